// Multiplies the cost of every pair by the greater weight of its ends. Twin: src/kernel/weigh_keys.rs

fn weighed_key(key: u32, first: f32, second: f32) -> u32 {
    if key == NO_KEY {
        return key;
    }
    let cost = flush(min(bitcast<f32>(key), GREATEST_COST), LEAST);
    return bitcast<u32>(flush(mul(cost, flush(max(first, second), LEAST)), LEAST));
}

fn run(i: u32) {
    let corners = half_edge_corners(load_pairs(i).half_edge);
    store_keys(i, weighed_key(load_keys(i), load_weights(corners.x), load_weights(corners.y)));
}
