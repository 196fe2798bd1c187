// Sums blocks of values in their order. Twin: src/kernel/block_sums.rs

fn block_sum(block: u32) -> f32 {
    var sum = 0.0;
    let end = min((block + 1u) * SUM_BLOCK, params.value_count);
    for (var i = block * SUM_BLOCK; i < end; i++) {
        sum = add(sum, load_values(i));
    }
    return sum;
}

fn run(i: u32) {
    store_sums(i, flush(block_sum(i), LEAST_SUM));
}
