// Twin: src/kernel/volume_sums.rs

// |e|²·I − e eᵀ: the squared distance to a line along e, times |e|².
fn border_term(edge: vec3f) -> Sym3 {
    let e = flush3(edge, LEAST_FACTOR);
    let length_sq = dot3(e, e);
    let diagonal = Sym3(length_sq, 0.0, 0.0, length_sq, 0.0, length_sq);
    return sym_sub(diagonal, outer(e));
}
