// Every function of shared/exact.wgsl on hostile operands. Twin: src/kernel/exact_probe.rs

// A finite number with the sign and digits of `bits` and an exponent within `span` of 0; zeros stay.
fn ranged(bits: u32, span: u32) -> f32 {
    let exponent = (bits >> 23u) & 0xffu;
    if exponent == 0u {
        return 0.0;
    }
    let near = 127u - span + exponent % (2u * span + 1u);
    return bitcast<f32>((bits & 0x807fffffu) | (near << 23u));
}

fn finite(bits: u32) -> f32 {
    return bitcast<f32>(select(bits, bits & 0xbfffffffu, ((bits >> 23u) & 0xffu) == 0xffu));
}

fn put_raw(i: u32, result: u32, x: f32) {
    store_results(i * params.results + result, bitcast<u32>(x));
}

fn put(i: u32, result: u32, x: f32) {
    put_raw(i, result, flush(x, LEAST));
}

fn put3(i: u32, first: u32, v: vec3f) {
    put(i, first, v.x);
    put(i, first + 1u, v.y);
    put(i, first + 2u, v.z);
}

fn put_sym(i: u32, first: u32, m: Sym3) {
    put3(i, first, vec3f(m.xx, m.xy, m.xz));
    put3(i, first + 3u, vec3f(m.yy, m.yz, m.zz));
}

// A guess up to 3 units in the last place off, as `/` and `sqrt` of a device may be.
fn misguess(guess: f32, bits: u32) -> f32 {
    return bitcast<f32>(bitcast<u32>(guess) + bits % 7u - 3u);
}

fn run(i: u32) {
    let bits = load_operands(i);
    put_raw(i, 0u, divide(finite(bits.x), finite(bits.y)));
    put_raw(i, 1u, root(finite(bits.x)));

    // Products of two stay within the range.
    let a = ranged(bits.x, 60u);
    let b = ranged(bits.y, 60u);
    let c = ranged(bits.z, 60u);
    let d = ranged(bits.w, 60u);
    put(i, 2u, add(a, b));
    put(i, 3u, sub(a, b));
    put(i, 4u, mul(a, b));
    put(i, 5u, add(mul(a, b), c));
    put(i, 6u, sub(mul(a, b), mul(c, d)));
    put(i, 7u, sub(mul(a, b), mul(b, a)));
    put(i, 8u, sub(add(a, b), a));
    put(i, 9u, add(add(add(a, b), c), d));
    put(i, 10u, divide(mul(a, b), b));
    put(i, 11u, root(mul(a, a)));

    // Products of three as well.
    let v = vec3f(ranged(bits.x, 20u), ranged(bits.y, 20u), ranged(bits.z, 20u));
    let w = vec3f(ranged(bits.w, 20u), ranged(bits.x, 20u), ranged(bits.y, 20u));
    put(i, 12u, dot3(v, w));
    put3(i, 13u, cross3(v, w));
    put3(i, 16u, add3(v, w));
    put3(i, 19u, sub3(v, w));
    put3(i, 22u, scale3(mul3(v, w), v.x));
    let m = sym_sub(sym_add(Sym3(v.x, v.y, v.z, w.x, w.y, w.z), sym_scale(outer(v), 0.5)), outer(w));
    put_sym(i, 25u, m);
    put3(i, 31u, sym_mul(m, v));
    put(i, 34u, trace(m));
    let k = Sym3(v.x, w.y, v.z, w.x, v.y, w.z);
    let cofactors_of_k = cofactors(k);
    put_sym(i, 35u, cofactors_of_k);
    put(i, 41u, sym_det(k, cofactors_of_k));
    put(i, 42u, flush(a, 1.0));
    put3(i, 43u, flush3(v, 0x1p-10f));
    put(i, 46u, divide(1.0, root(dot3(v, v))));
    put(i, 47u, keep(b));

    let x = significand(a);
    let y = significand(b);
    let n = x << select(0u, 1u, x < y);
    put(i, 48u, f32(quotient_digits(n, y, misguess(f32(n) / f32(y), bits.z))));
    put(i, 49u, f32(root_digits(n, misguess(sqrt(f32(n) * 8388608.0), bits.w))));
    put_raw(i, 50u, log2(finite(bits.z)));
    put_raw(i, 51u, arccot(finite(bits.z)));
}
