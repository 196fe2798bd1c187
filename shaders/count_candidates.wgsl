// How many keys of every block pass the gate. Twin: src/kernel/count_candidates.rs, by contract.

var<workgroup> passing: atomic<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = group.y * groups.x + group.x;
    let i = block * GATE_BLOCK + lane;
    if i < params.count {
        if load_keys(i) < params.threshold {
            atomicAdd(&passing, 1u);
        }
    }
    workgroupBarrier();
    // One block past the last ends the counts with 0.
    if lane == 0u && block <= (params.count + GATE_BLOCK - 1u) / GATE_BLOCK {
        store_counts(block, atomicLoad(&passing));
    }
}
