// Adds to every value the scanned sum of its block. Twin: src/kernel/scan_add.rs

fn run(i: u32) {
    store_values(i, load_values(i) + load_sums(i / SCAN_BLOCK));
}
