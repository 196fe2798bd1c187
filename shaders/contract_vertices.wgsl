// Moves kept vertices and marks the roles of both ends of every accepted contraction. Twin:
// src/kernel/contract_vertices.rs

fn run(i: u32) {
    let c = load_contractions(i);
    store_positions(c.keep, Position(c.x, c.y, c.z, c.flags));
    store_roles(c.keep, KEEPS | c.gone);
    store_roles(c.gone, GONE | c.keep);
}
