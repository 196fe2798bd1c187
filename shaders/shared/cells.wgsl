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

fn cell_box(origin: Site, steps: u32, unit: f32) -> CellBox {
    let lowest = Site(origin.x / steps * steps, origin.y / steps * steps, origin.z / steps * steps);
    let low = about(lowest, origin, unit);
    let side = mul(f32(steps), unit);
    return CellBox(low, add3(low, vec3f(side, side, side)));
}

fn is_in(p: vec3f, cell: CellBox) -> bool {
    return all(p >= cell.low) && all(p < cell.high);
}
