// The cell of every vertex, as a key. Twin: src/kernel/cell_keys.rs

fn cell_key(site: Site, vertex: u32, steps: u32) -> vec2u {
    if site.x == UNUSED {
        return vec2u(vertex, UNUSED);
    }
    let x = site.x / steps;
    let y = site.y / steps;
    let z = site.z / steps;
    return vec2u(x | (y << 21u), (y >> 11u) | (z << 10u));
}

fn run(i: u32) {
    store_keys(i, cell_key(load_sites(i), i, params.steps));
}
