// What both ends of a pair and the faces that they share sum to, by the volume metric. Twin: src/kernel/volume_costs.rs

struct Ends {
    first: Sym3,
    second: Sym3,
    mutual: Sym3,
    first_normal: vec3f,
    second_normal: vec3f,
    mutual_normal: vec3f,
}

fn border_matrix(sum: BorderSum) -> Sym3 {
    return Sym3(sum.xx, sum.xy, sum.xz, sum.yy, sum.yz, sum.zz);
}

// What two ends and the faces that they share sum to.
fn volume_ends(first: VolumeSum, second: VolumeSum, left: Normal, right: Normal) -> Ends {
    return Ends(
        volume_matrix(first),
        volume_matrix(second),
        sym_add(outer(weighted(left)), outer(weighted(right))),
        vec3f(first.nx, first.ny, first.nz),
        vec3f(second.nx, second.ny, second.nz),
        add3(doubled_area(left), doubled_area(right)),
    );
}

// Adds the border terms and drops the volume constraint.
fn with_border(ends: Ends, first: BorderSum, second: BorderSum, mutual: Sym3, weight: f32) -> Ends {
    let none = vec3f(0.0, 0.0, 0.0);
    return Ends(
        sym_add(ends.first, sym_scale(border_matrix(first), weight)),
        sym_add(ends.second, sym_scale(border_matrix(second), weight)),
        sym_add(ends.mutual, sym_scale(mutual, weight)),
        none,
        none,
        none,
    );
}

// The quadric of a pair from −h to h, times `scale`.
fn ends_quadric(ends: Ends, scale: f32, h: vec3f) -> PairQuadric {
    let first = sym_scale(ends.first, scale);
    let second = sym_scale(ends.second, scale);
    let mutual = sym_scale(ends.mutual, scale);
    var q = end_matrices(first, second, mutual, h);
    q.n = scale3(sub3(add3(ends.first_normal, ends.second_normal), ends.mutual_normal), scale);
    q.d = dot3(scale3(sub3(ends.second_normal, ends.first_normal), scale), h);
    return q;
}
