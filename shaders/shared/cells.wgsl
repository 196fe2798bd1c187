// What the kernels of vertex clustering share. Twin: src/kernel/cells.rs

// A site about another, in units: exact, for it has 24 digits and the unit is a power of two.
fn about(site: Site, origin: Site, unit: f32) -> vec3f {
    return vec3f(
        mul(f32(bitcast<i32>(site.x - origin.x)), unit),
        mul(f32(bitcast<i32>(site.y - origin.y)), unit),
        mul(f32(bitcast<i32>(site.z - origin.z)), unit),
    );
}

// A cell about its origin; its lowest corner belongs to it, its highest to others.
struct CellBox { low: vec3f, high: vec3f }

fn lowest_site(site: Site, steps: u32) -> Site {
    return Site(site.x / steps * steps, site.y / steps * steps, site.z / steps * steps);
}

fn box_from(low: vec3f, steps: u32, unit: f32) -> CellBox {
    let side = mul(f32(steps), unit);
    return CellBox(low, add3(low, vec3f(side, side, side)));
}

fn cell_box(origin: Site, steps: u32, unit: f32) -> CellBox {
    return box_from(about(lowest_site(origin, steps), origin, unit), steps, unit);
}

fn is_in(p: vec3f, cell: CellBox) -> bool {
    return all(p >= cell.low) && all(p < cell.high);
}

fn matrix(sum: CellSum) -> Sym3 {
    return Sym3(sum.xx, sum.xy, sum.xz, sum.yy, sum.yz, sum.zz);
}

fn linear(sum: CellSum) -> vec3f {
    return vec3f(sum.bx, sum.by, sum.bz);
}

fn position(sum: CellSum) -> vec3f {
    return vec3f(sum.x, sum.y, sum.z);
}

// The sum of two, about the same origin.
fn sum_add(a: CellSum, b: CellSum) -> CellSum {
    let m = sym_add(matrix(a), matrix(b));
    let l = add3(linear(a), linear(b));
    let p = add3(position(a), position(b));
    return CellSum(
        m.xx, m.xy, m.xz, m.yy, m.yz, m.zz,
        l.x, l.y, l.z,
        add(a.c, b.c),
        add(a.weight, b.weight),
        p.x, p.y, p.z,
        add(a.corners, b.corners),
    );
}
