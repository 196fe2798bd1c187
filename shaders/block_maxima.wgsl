// The greatest values of blocks. Twin: src/kernel/block_maxima.rs

fn block_maximum(block: u32) -> QuadricBound {
    var greatest = QuadricBound(0.0, 0.0);
    let end = min((block + 1u) * MAXIMUM_BLOCK, params.bound_count);
    for (var i = block * MAXIMUM_BLOCK; i < end; i++) {
        let bound = load_bounds(i);
        greatest = QuadricBound(max(greatest.weight, bound.weight), max(greatest.offset_sq, bound.offset_sq));
    }
    return greatest;
}

fn run(i: u32) {
    store_maxima(i, block_maximum(i));
}
