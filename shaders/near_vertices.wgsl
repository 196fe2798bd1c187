// For every vertex the nearest others that it may join: closer than a distance, across components or from border to
// border. Twin: src/kernel/near_vertices.rs

const NOTHING: vec2u = vec2u(NONE, NONE);

fn cell_of(p: Position, per_unit: f32) -> Site {
    return Site(coordinate(p.x, per_unit), coordinate(p.y, per_unit), coordinate(p.z, per_unit));
}

fn coordinate(x: f32, per_unit: f32) -> u32 {
    let cell = floor(flush(mul(x, per_unit), LEAST));
    // From 1 on: cells before the first and after the last are numbers too.
    return bitcast<u32>(i32(clamp(cell, -CELLS, CELLS))) + 0x40000001u;
}

// Whether a cell stands before another.
fn is_before(a: Site, b: Site) -> bool {
    return a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.z < b.z)));
}

// The vertices found so far, by the bits of the squared distance, which order as it does, and their number.
struct Found { near: array<vec2u, NEAREST>, compared: u32 }

// Where the members of a cell start, or would.
fn start_of(cell: Site) -> u32 {
    var low = 0u;
    var high = params.cell_count;
    while low < high {
        let middle = (low + high) >> 1u;
        if is_before(load_cells(middle), cell) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return load_cell_starts(low);
}

// Compares a vertex with a run of members.
fn compare(found: ptr<function, Found>, vertex: u32, start: u32, end: u32) {
    let p = load_positions(vertex);
    let component = load_components(vertex);
    var i = start;
    while i < end && (*found).compared < MOST_COMPARED {
        let other = load_members(i);
        let q = load_positions(other);
        (*found).compared += 1u;
        i += 1u;
        let both_on_border = (p.flags & q.flags & BORDER) != 0u;
        if other == vertex || (load_components(other) == component && !both_on_border) {
            continue;
        }
        let away = flush3(sub3(vec3f(p.x, p.y, p.z), vec3f(q.x, q.y, q.z)), LEAST_FACTOR);
        let distance_sq = dot3(away, away);
        if distance_sq < params.reach_sq {
            insert(found, vec2u(bitcast<u32>(distance_sq), other));
        }
    }
}

// Puts a vertex in its place among those found, of which the last drops out.
fn insert(found: ptr<function, Found>, entry: vec2u) {
    var carried = entry;
    for (var slot = 0u; slot < NEAREST; slot++) {
        let before = (*found).near[slot];
        if carried.x < before.x || (carried.x == before.x && carried.y < before.y) {
            (*found).near[slot] = carried;
            carried = before;
        }
    }
}

fn run(vertex: u32) {
    var found: Found;
    found.compared = 0u;
    for (var slot = 0u; slot < NEAREST; slot++) {
        found.near[slot] = NOTHING;
    }
    let own = cell_of(load_positions(vertex), params.per_unit);
    let own_start = start_of(own);
    let own_end = start_of(Site(own.x, own.y, own.z + 1u));
    compare(&found, vertex, own_start, own_end);
    for (var column = 0u; column < 9u; column++) {
        let x = own.x + column / 3u - 1u;
        let y = own.y + column % 3u - 1u;
        let start = start_of(Site(x, y, own.z - 1u));
        let end = start_of(Site(x, y, own.z + 2u));
        if column == 4u {
            compare(&found, vertex, start, own_start);
            compare(&found, vertex, own_end, end);
        } else {
            compare(&found, vertex, start, end);
        }
    }
    for (var slot = 0u; slot < NEAREST; slot++) {
        store_near(NEAREST * vertex + slot, found.near[slot].y);
    }
}
