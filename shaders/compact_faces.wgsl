// Moves live faces to their new numbers, their corners to the new numbers of their vertices. Twin:
// src/kernel/compact_faces.rs

fn run(i: u32) {
    let now = load_new_face(i);
    if load_new_face(i + 1u) != now {
        let face = load_faces(i);
        store_faces_out(now, Face(load_new_vertex(face.a), load_new_vertex(face.b), load_new_vertex(face.c)));
    }
}
