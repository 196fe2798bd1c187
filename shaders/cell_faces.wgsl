// Every face with its corners renamed to their cells. Twin: src/kernel/cell_faces.rs

fn run(i: u32) {
    let face = load_faces(i);
    store_cell_faces(i, Face(load_vertex_cells(face.a), load_vertex_cells(face.b), load_vertex_cells(face.c)));
}
