// Renames the corners of every face after a round's contractions and tells which faces still live. Twin:
// src/kernel/contract_faces.rs

fn renamed(vertex: u32) -> u32 {
    let role = load_roles(vertex);
    return select(vertex, role & VERTEX, (role & GONE) != 0u);
}

fn run(i: u32) {
    if i == params.count {
        store_live(i, 0u);
        return;
    }
    let face = load_faces(i);
    let now = Face(renamed(face.a), renamed(face.b), renamed(face.c));
    store_faces(i, now);
    store_live(i, select(0u, 1u, is_live(now)));
}
