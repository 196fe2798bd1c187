// How many pairs cost how much: a histogram over the leading bits of the keys. Twin: src/kernel/cost_histogram.rs, by
// contract. Counts in shared memory first: additions of integers, whose order cannot be seen.

var<workgroup> counts: array<atomic<u32>, BUCKETS>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let first = (group.y * groups.x + group.x) * WORKGROUP * KEYS_EACH + lane;
    for (var bucket = lane; bucket < BUCKETS; bucket += WORKGROUP) {
        atomicStore(&counts[bucket], 0u);
    }
    workgroupBarrier();
    let pairs = load_pair_starts(params.block_count);
    for (var i = 0u; i < KEYS_EACH; i++) {
        let index = first + i * WORKGROUP;
        if index < pairs {
            atomicAdd(&counts[load_keys(index) >> BUCKET_SHIFT], 1u);
        }
    }
    workgroupBarrier();
    for (var bucket = lane; bucket < BUCKETS; bucket += WORKGROUP) {
        let count = atomicLoad(&counts[bucket]);
        if count != 0u {
            add_buckets(bucket, count);
        }
    }
}
