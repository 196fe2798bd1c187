// The points of a face that a fit measures. Twin: src/kernel/fit_points.rs

// The corner weights of point `k` of a face: its middle, or near a corner.
fn face_point(k: u32) -> vec3f {
    if k == 0u {
        return vec3f(0.33333334f, 0.33333334f, 0.33333334f);
    }
    return vec3f(select(0.1f, 0.8f, k == 1u), select(0.1f, 0.8f, k == 2u), select(0.1f, 0.8f, k == 3u));
}

// Adds a point of the face, given by its corner weights, that lies `away` from where it should.
fn with_point(fit: FaceFit, corner_weights: vec3f, away: vec3f, weight: f32) -> FaceFit {
    let v = flush3(corner_weights, LEAST_FACTOR);
    let wa = flush(mul(weight, v.x), LEAST_FACTOR);
    let wb = flush(mul(weight, v.y), LEAST_FACTOR);
    let wc = flush(mul(weight, v.z), LEAST_FACTOR);
    let r = flush3(away, LEAST_FACTOR);
    let height = flush(dot3(vec3f(fit.nx, fit.ny, fit.nz), r), LEAST_FACTOR);
    return FaceFit(
        fit.nx,
        fit.ny,
        fit.nz,
        add(fit.aa, mul(wa, v.x)),
        add(fit.ab, mul(wa, v.y)),
        add(fit.ac, mul(wa, v.z)),
        add(fit.bb, mul(wb, v.y)),
        add(fit.bc, mul(wb, v.z)),
        add(fit.cc, mul(wc, v.z)),
        add(fit.a, mul(wa, height)),
        add(fit.b, mul(wb, height)),
        add(fit.c, mul(wc, height)),
        add(fit.error, mul(weight, flush(dot3(r, r), LEAST_FACTOR))),
    );
}
