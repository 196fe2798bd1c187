// What the kernels of vertex clustering share. Twin: src/kernel/cells.rs

// A site about another, in units: exact, for it has 24 digits and the unit is a power of two.
fn about(site: Site, origin: Site, unit: f32) -> vec3f {
    return vec3f(
        mul(f32(bitcast<i32>(site.x - origin.x)), unit),
        mul(f32(bitcast<i32>(site.y - origin.y)), unit),
        mul(f32(bitcast<i32>(site.z - origin.z)), unit),
    );
}
