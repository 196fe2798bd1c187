// Writes the pairs that pass the gate, in the order of their half-edges. Twin: src/kernel/gather_candidates.rs, by
// contract.

var<workgroup> ranks: array<u32, GATE_BLOCK>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = group.y * groups.x + group.x;
    let i = block * GATE_BLOCK + lane;
    var key = 0u;
    var passes = 0u;
    if i < params.count {
        key = load_keys(i);
        passes = select(0u, 1u, key < params.threshold);
    }
    // Doubling: after each step a lane holds the count of twice as many lanes up to itself.
    ranks[lane] = passes;
    workgroupBarrier();
    for (var reach = 1u; reach < GATE_BLOCK; reach *= 2u) {
        var other = 0u;
        if lane >= reach {
            other = ranks[lane - reach];
        }
        workgroupBarrier();
        ranks[lane] += other;
        workgroupBarrier();
    }
    if passes == 1u {
        store_candidates(load_starts(block) + ranks[lane] - 1u, Candidate(key, i));
    }
}
