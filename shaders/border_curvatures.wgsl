// The curvature of every vertex on a border: the mean of its neighbors off the border. Twin:
// src/kernel/border_curvatures.rs

fn mean_around(vertex: u32) -> f32 {
    var sum = 0.0;
    var count = 0.0;
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        // A neighbor off the border is a corner of two faces here.
        let seen = spoke(load_faces(load_ring_faces(i)), vertex);
        let ends = array<u32, 2>(seen.next, seen.last);
        for (var k = 0u; k < 2u; k++) {
            if (load_positions(ends[k]).flags & BORDER) == 0u {
                sum = add(sum, load_curvatures(ends[k]));
                count = add(count, 1.0);
            }
        }
    }
    return divide(sum, count);
}

fn run(i: u32) {
    if (load_positions(i).flags & BORDER) != 0u {
        store_curvatures(i, mean_around(i));
    }
}
