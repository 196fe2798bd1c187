// Exclusive prefix sums within blocks, and the sum of every block. Twin: src/kernel/scan_blocks.rs

fn run(block: u32) {
    var sum = 0u;
    for (var i = block * SCAN_BLOCK; i < min((block + 1u) * SCAN_BLOCK, params.count); i++) {
        let value = load_values(i);
        store_values(i, sum);
        sum += value;
    }
    store_sums(block, sum);
}
