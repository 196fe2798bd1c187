// Exclusive prefix sums within blocks, and the sum of every block. Twin: src/kernel/scan_blocks.rs, by contract.

const VALUES_EACH: u32 = SCAN_BLOCK / SCAN_THREADS;

var<workgroup> lane_sums: array<u32, SCAN_THREADS>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = group.y * groups.x + group.x;
    let first = block * SCAN_BLOCK + lane * VALUES_EACH;
    var before: array<u32, VALUES_EACH>;
    var sum = 0u;
    for (var i = 0u; i < VALUES_EACH; i++) {
        before[i] = sum;
        if first + i < params.count {
            sum += load_values(first + i);
        }
    }
    // Doubling: after each step a lane holds the sum of twice as many lanes up to itself.
    lane_sums[lane] = sum;
    workgroupBarrier();
    for (var reach = 1u; reach < SCAN_THREADS; reach *= 2u) {
        var other = 0u;
        if lane >= reach {
            other = lane_sums[lane - reach];
        }
        workgroupBarrier();
        lane_sums[lane] += other;
        workgroupBarrier();
    }
    let start = lane_sums[lane] - sum;
    for (var i = 0u; i < VALUES_EACH; i++) {
        if first + i < params.count {
            store_values(first + i, start + before[i]);
        }
    }
    if lane == SCAN_THREADS - 1u && block * SCAN_BLOCK < params.count {
        store_sums(block, lane_sums[lane]);
    }
}
