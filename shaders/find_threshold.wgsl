// The key below which as many pairs pass as the gate wants, at the bound of a bucket of the histogram. Twin:
// src/kernel/find_threshold.rs, by contract.

var<workgroup> sums: array<u32, WORKGROUP>;

// count · share · 2⁻³², rounded up, from halves of 16 bits.
fn share_of(count: u32, share: u32) -> u32 {
    let low = (count & 0xffffu) * (share & 0xffffu);
    let first = (count >> 16u) * (share & 0xffffu);
    let second = (count & 0xffffu) * (share >> 16u);
    let middle = (low >> 16u) + (first & 0xffffu) + (second & 0xffffu);
    let high = (count >> 16u) * (share >> 16u) + (first >> 16u) + (second >> 16u) + (middle >> 16u);
    return high + select(0u, 1u, ((low | middle) & 0xffffu) != 0u);
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(local_invocation_index) lane: u32) {
    let first = lane * BUCKETS_EACH;
    var own = 0u;
    for (var i = 0u; i < BUCKETS_EACH; i++) {
        own += load_buckets(first + i);
    }
    sums[lane] = own;
    workgroupBarrier();
    var passing = 0u;
    for (var i = 0u; i < lane; i++) {
        passing += sums[i];
    }
    let pairs = load_pair_starts(params.block_count);
    let wanted = min(share_of(pairs, params.share), params.most);
    if wanted == 0u {
        if lane == 0u {
            store_threshold(0u, Threshold(pairs, 0u, 0u));
        }
    } else if passing < wanted && (passing + own >= wanted || lane == WORKGROUP - 1u) {
        var bucket = first;
        while bucket < first + BUCKETS_EACH && passing < wanted {
            passing += load_buckets(bucket);
            bucket++;
        }
        store_threshold(0u, Threshold(pairs, bucket << BUCKET_SHIFT, passing));
    }
}
