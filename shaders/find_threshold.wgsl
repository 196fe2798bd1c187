// The key below which as many pairs pass as the gate wants, at the bound of a bucket of the histogram. Twin:
// src/kernel/find_threshold.rs, by contract.

var<workgroup> sums: array<u32, WORKGROUP>;
// The bounds, in buckets, below which as many pass as are wanted as usual, and of those that cost little more.
var<workgroup> bounds: array<u32, 2>;

// count · share · 2⁻³², rounded up, from halves of 16 bits.
fn share_of(count: u32, share: u32) -> u32 {
    let low = (count & 0xffffu) * (share & 0xffffu);
    let first = (count >> 16u) * (share & 0xffffu);
    let second = (count & 0xffffu) * (share >> 16u);
    let middle = (low >> 16u) + (first & 0xffffu) + (second & 0xffffu);
    let high = (count >> 16u) * (share >> 16u) + (first >> 16u) + (second >> 16u) + (middle >> 16u);
    return high + select(0u, 1u, ((low | middle) & 0xffffu) != 0u);
}

// Writes the bound below which `wanted` pairs have keys, if it lies in the buckets of this lane, which has `own` pairs behind
// `before` others.
fn find_bound(which: u32, lane: u32, before: u32, own: u32, wanted: u32) {
    let first = lane * BUCKETS_EACH;
    if wanted == 0u {
        if lane == 0u {
            bounds[which] = 0u;
        }
    } else if before < wanted && (before + own >= wanted || lane == WORKGROUP - 1u) {
        var passing = before;
        var bucket = first;
        while bucket < first + BUCKETS_EACH && passing < wanted {
            passing += load_buckets(bucket);
            bucket++;
        }
        bounds[which] = bucket;
    }
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
    find_bound(0u, lane, passing, own, min(share_of(pairs, params.share), params.most));
    find_bound(1u, lane, passing, own, min(share_of(pairs, params.wide_share), params.wide_most));
    workgroupBarrier();
    let bound = max(bounds[0], min(bounds[1], bounds[0] + REACH));
    let is_own = (bound > first && bound <= first + BUCKETS_EACH) || (bound == 0u && lane == 0u);
    if is_own {
        for (var bucket = first; bucket < bound; bucket++) {
            passing += load_buckets(bucket);
        }
        store_threshold(0u, Threshold(pairs, bound << BUCKET_SHIFT, passing));
    }
}
