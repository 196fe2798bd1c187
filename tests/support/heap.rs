//! Serial edge collapse with a priority queue, in f64: the reference that contraction in rounds is measured against.
//!
//! ```text
//!         k              an interior pair (u, v) loses two faces, a border pair (no l) one;
//!       / | \            every other face of both stars survives with u and v replaced by the new vertex
//!      u--+--v
//!       \ | /
//!         l
//! ```
//!
//! After a contraction every pair with an end in the closed one-ring of the new vertex is costed and queued again; an
//! older entry is known by its ends' versions. A refused pair therefore comes back exactly when its surroundings change.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use coarsen::Mesh;
use coarsen::contract::Metric;
use coarsen::math::{DMat3, DVec3};

use super::quadric::Quadric;

/// The numbers of both metrics that the papers leave open.
#[derive(Debug, Clone, Copy)]
pub struct Tuning {
    /// `Volume`: factor of the border terms.
    pub volume_border: f64,
    /// `Volume`: pull to the midpoint, as a fraction of the matrix's trace.
    pub volume_ridge: f64,
    /// `Volume`: a face weighs its doubled area to this power (2: its volume, squared, as in the paper).
    pub volume_area_power: f64,
    /// `Plane`: factor of the planes through border edges, times the edge's squared length.
    pub plane_border: f64,
    /// `Plane`: a face's plane weighs its area to this power (0: all alike, as in the paper's first form).
    pub plane_area_power: f64,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            volume_border: 4.0,
            volume_ridge: 1e-5,
            volume_area_power: 1.0,
            plane_border: 1.0,
            plane_area_power: 1.0,
        }
    }
}

/// Collapses the cheapest legal edge until `faces` faces are left or none is legal.
///
/// A closed surface cannot lose a single face, so an odd count ends one below.
pub fn simplify(mesh: &Mesh, metric: Metric, faces: usize) -> Mesh {
    simplify_tuned(mesh, metric, faces, Tuning::default())
}

/// [`simplify`] with other numbers.
pub fn simplify_tuned(mesh: &Mesh, metric: Metric, faces: usize, tuning: Tuning) -> Mesh {
    let (centre, scale) = normalization(mesh);
    let mut surface = Surface::new(mesh, centre, scale, metric, tuning);
    surface.run(faces);
    surface.into_mesh(centre, scale)
}

/// Whether the edge `u v` of `mesh` may be contracted as far as topology goes.
pub fn link_allows(mesh: &Mesh, u: u32, v: u32) -> bool {
    Surface::new(mesh, DVec3::ZERO, 1.0, Metric::Plane, Tuning::default()).link_holds(u, v)
}

/// The box's centre and the factor that makes the mean edge length 1.
fn normalization(mesh: &Mesh) -> (DVec3, f64) {
    let edges: BTreeSet<(u32, u32)> = mesh.faces.iter().flat_map(face_edges).map(ascending).collect();
    let total: f64 = edges.iter().map(|&(a, b)| mesh.positions[a as usize].distance(mesh.positions[b as usize])).sum();
    let (low, high) = mesh.bounds();
    (0.5 * (low + high), if total > 0.0 { edges.len() as f64 / total } else { 1.0 })
}

fn face_edges(face: &[u32; 3]) -> [(u32, u32); 3] {
    [(face[0], face[1]), (face[1], face[2]), (face[2], face[0])]
}

fn ascending((a, b): (u32, u32)) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// Cost bits (costs are not negative, so their bits sort as they do), tie breaker, ends, the ends' versions.
type Entry = Reverse<(u64, u64, u32, u32, u32, u32)>;

struct Surface {
    metric: Metric,
    tuning: Tuning,
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    alive: Vec<bool>,
    live_faces: usize,
    /// Live faces around every vertex, unordered.
    stars: Vec<Vec<u32>>,
    /// Vertices that must stay: on an edge of three or more faces, or joining several fans.
    locked: Vec<bool>,
    /// `Plane` only: the quadric of every vertex about the common origin.
    quadrics: Vec<Quadric>,
    versions: Vec<u32>,
    queue: BinaryHeap<Entry>,
}

impl Surface {
    fn new(mesh: &Mesh, centre: DVec3, scale: f64, metric: Metric, tuning: Tuning) -> Self {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|&p| (p - centre) * scale).collect();
        let faces: Vec<[u32; 3]> =
            mesh.faces.iter().copied().filter(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0]).collect();
        let mut stars = vec![Vec::new(); positions.len()];
        for (f, face) in faces.iter().enumerate() {
            face.iter().for_each(|&v| stars[v as usize].push(f as u32));
        }
        let vertex_count = positions.len();
        let mut surface = Self {
            metric,
            tuning,
            alive: vec![true; faces.len()],
            live_faces: faces.len(),
            positions,
            faces,
            stars,
            locked: vec![false; vertex_count],
            quadrics: vec![Quadric::ZERO; vertex_count],
            versions: vec![0; vertex_count],
            queue: BinaryHeap::new(),
        };
        for v in 0..vertex_count as u32 {
            surface.locked[v as usize] = surface.is_singular(v);
        }
        if metric == Metric::Plane {
            surface.init_quadrics();
        }
        let pairs: BTreeSet<(u32, u32)> = surface.faces.iter().flat_map(face_edges).map(ascending).collect();
        for (u, v) in pairs {
            surface.enqueue(u, v);
        }
        surface
    }

    fn into_mesh(self, centre: DVec3, scale: f64) -> Mesh {
        let mut renamed = BTreeMap::new();
        let mut mesh = Mesh::default();
        for (face, _) in self.faces.iter().zip(&self.alive).filter(|(_, alive)| **alive) {
            mesh.faces.push(face.map(|v| {
                *renamed.entry(v).or_insert_with(|| {
                    mesh.positions.push(self.positions[v as usize] / scale + centre);
                    mesh.positions.len() as u32 - 1
                })
            }));
        }
        mesh
    }

    fn run(&mut self, target: usize) {
        // Pairs of two faces met when only one is left to remove: taken if no border pair turns up.
        let mut too_many = Vec::new();
        while self.live_faces > target {
            let Some(Reverse((_, _, u, v, version_u, version_v))) = self.queue.pop() else { break };
            if (version_u, version_v) != (self.versions[u as usize], self.versions[v as usize]) {
                continue;
            }
            if self.faces_on(u, v).len() > self.live_faces - target {
                too_many.push((u, v));
                continue;
            }
            self.contract_if_legal(u, v);
        }
        for (u, v) in too_many {
            if self.live_faces > target {
                self.contract_if_legal(u, v);
            }
        }
    }

    fn contract_if_legal(&mut self, u: u32, v: u32) {
        let (x, _) = self.placement(u, v);
        if self.link_holds(u, v) && self.no_face_flips(u, v, x) {
            self.contract(u, v, x);
        }
    }

    fn position(&self, v: u32) -> DVec3 {
        self.positions[v as usize]
    }

    fn corners(&self, f: u32) -> [DVec3; 3] {
        self.faces[f as usize].map(|v| self.position(v))
    }

    fn faces_on(&self, u: u32, v: u32) -> Vec<u32> {
        self.stars[u as usize].iter().copied().filter(|&f| self.faces[f as usize].contains(&v)).collect()
    }

    /// Faces of both stars, each once.
    fn faces_around(&self, u: u32, v: u32) -> Vec<u32> {
        let of_v_only = self.stars[v as usize].iter().filter(|&&f| !self.faces[f as usize].contains(&u));
        self.stars[u as usize].iter().chain(of_v_only).copied().collect()
    }

    /// Every neighbor of `v` with the number of faces on the edge to it.
    fn neighbors(&self, v: u32) -> Vec<(u32, usize)> {
        let mut others: Vec<u32> =
            self.stars[v as usize].iter().flat_map(|&f| self.faces[f as usize]).filter(|&w| w != v).collect();
        others.sort_unstable();
        others.chunk_by(|a, b| a == b).map(|run| (run[0], run.len())).collect()
    }

    fn on_border(&self, v: u32) -> bool {
        self.neighbors(v).iter().any(|&(_, faces)| faces == 1)
    }

    /// Whether `v` lies on an edge of three or more faces, or its faces form more than one fan.
    fn is_singular(&self, v: u32) -> bool {
        let star = &self.stars[v as usize];
        if star.is_empty() {
            return false;
        }
        if self.neighbors(v).iter().any(|&(_, faces)| faces > 2) {
            return true;
        }
        let mut reached = BTreeSet::from([star[0]]);
        let mut open = vec![star[0]];
        while let Some(f) = open.pop() {
            for w in self.faces[f as usize].into_iter().filter(|&w| w != v) {
                open.extend(self.faces_on(v, w).into_iter().filter(|&g| reached.insert(g)));
            }
        }
        reached.len() < star.len()
    }

    fn init_quadrics(&mut self) {
        for f in 0..self.faces.len() as u32 {
            let [p0, p1, p2] = self.corners(f);
            let cross = (p1 - p0).cross(p2 - p0);
            let Some(n) = cross.try_normalize() else { continue };
            let area = 0.5 * cross.length();
            let quadric = Quadric::plane(n, n.dot(p0), area.powf(self.tuning.plane_area_power));
            for v in self.faces[f as usize] {
                self.quadrics[v as usize].add(&quadric);
            }
            for (a, b) in face_edges(&self.faces[f as usize]) {
                let e = self.position(b) - self.position(a);
                let Some(side) = n.cross(e).try_normalize() else { continue };
                if self.faces_on(a, b).len() == 1 {
                    let weight = self.tuning.plane_border * e.length_squared();
                    let fence = Quadric::plane(side, side.dot(self.position(a)), weight);
                    self.quadrics[a as usize].add(&fence);
                    self.quadrics[b as usize].add(&fence);
                }
            }
        }
    }

    fn enqueue(&mut self, u: u32, v: u32) {
        let (u, v) = ascending((u, v));
        if (self.locked[u as usize] && self.locked[v as usize]) || self.faces_on(u, v).len() > 2 {
            return;
        }
        let (_, cost) = self.placement(u, v);
        let versions = (self.versions[u as usize], self.versions[v as usize]);
        self.queue.push(Reverse((cost.to_bits(), tie_breaker(u, v), u, v, versions.0, versions.1)));
    }

    /// Where the vertex of the contraction goes, and the metric there.
    fn placement(&self, u: u32, v: u32) -> (DVec3, f64) {
        let midpoint = 0.5 * (self.position(u) + self.position(v));
        // From here on everything is relative to the midpoint: the ends are −half and +half.
        let half = self.position(v) - midpoint;
        let (quadric, optimum) = match self.metric {
            Metric::Volume => self.volume_optimum(u, v, midpoint),
            Metric::Plane => self.plane_optimum(u, v, midpoint),
        };
        let within_reach = |x: &DVec3| x.is_finite() && x.length() <= 4.0 * half.length();
        let least = |points: &[DVec3]| {
            points.iter().copied().min_by(|&p, &q| quadric.at(p).total_cmp(&quadric.at(q))).unwrap_or_default()
        };
        let x = if self.locked[u as usize] {
            -half
        } else if self.locked[v as usize] {
            half
        } else if let Some(x) = optimum.filter(within_reach) {
            x
        } else if self.metric == Metric::Plane {
            // On the segment x = t·half: half·A·half t² − 2 b·half t + c, least at b·half / half·A·half.
            let t = quadric.b.dot(half) / half.dot(quadric.a * half);
            least(&[half * if t.is_finite() { t.clamp(-1.0, 1.0) } else { 0.0 }, DVec3::ZERO, -half, half])
        } else {
            least(&[DVec3::ZERO, -half, half])
        };
        (midpoint + x, quadric.at(x))
    }

    /// Squared distances to the faces' planes by area, on the surface as it is \[LT98\]; about the midpoint.
    ///
    /// Minimizes Σ (n·x − d)²/|n| subject to (Σ n)·x = Σ d, which keeps the volume; where the stars have a border, its
    /// edges join the sum and the constraint is left out.
    fn volume_optimum(&self, u: u32, v: u32, midpoint: DVec3) -> (Quadric, Option<DVec3>) {
        let mut quadric = Quadric::ZERO;
        let (mut normals, mut volumes) = (DVec3::ZERO, 0.0);
        for f in self.faces_around(u, v) {
            let [p0, p1, p2] = self.corners(f).map(|p| p - midpoint);
            let n = (p1 - p0).cross(p2 - p0);
            if n != DVec3::ZERO {
                let weight = n.length().powf(self.tuning.volume_area_power - 2.0);
                quadric.add(&Quadric::plane(n, n.dot(p0), weight));
            }
            normals += n;
            volumes += n.dot(p0);
        }
        let weight = self.tuning.volume_border;
        let mut border = false;
        for (end, other) in [(u, v), (v, u)] {
            for (w, _) in self.neighbors(end).into_iter().filter(|&(_, faces)| faces == 1) {
                border = true;
                // The pair's own edge is found from both ends and counts once.
                if w != other || end < other {
                    let p = self.position(end) - midpoint;
                    quadric.add(&Quadric::line(self.position(w) - self.position(end), p, weight));
                }
            }
        }
        let ridge = DMat3::from_diagonal(DVec3::splat(self.tuning.volume_ridge * quadric.trace()));
        let Some(inverse) = (quadric.a + ridge).try_inverse() else { return (quadric, None) };
        let free = inverse * quadric.b;
        // Faces that cancel out (a closed sliver) give no direction along which to keep the volume.
        if border || normals.length_squared() <= 1e-10 * quadric.trace().powi(2) {
            return (quadric, Some(free));
        }
        let across = inverse * normals;
        let multiplier = (normals.dot(free) - volumes) / normals.dot(across);
        (quadric, Some(free - across * multiplier))
    }

    /// Squared distances to the planes gathered by both ends \[GH97\]; about the midpoint.
    fn plane_optimum(&self, u: u32, v: u32, midpoint: DVec3) -> (Quadric, Option<DVec3>) {
        let mut quadric = self.quadrics[u as usize];
        quadric.add(&self.quadrics[v as usize]);
        let quadric = quadric.about(midpoint);
        let conditioned = quadric.a.determinant().abs() > 1e-9 * quadric.trace().powi(3);
        let optimum = conditioned.then(|| quadric.a.inverse() * quadric.b);
        (quadric, optimum)
    }

    /// The link condition \[DE99\] for a triangle mesh with borders: contracting keeps the topology.
    fn link_holds(&self, u: u32, v: u32) -> bool {
        let opposite: BTreeSet<u32> =
            self.faces_on(u, v).iter().flat_map(|&f| self.faces[f as usize]).filter(|&w| w != u && w != v).collect();
        let around_v: BTreeSet<u32> = self.neighbors(v).iter().map(|&(w, _)| w).collect();
        let common: BTreeSet<u32> =
            self.neighbors(u).iter().map(|&(w, _)| w).filter(|w| around_v.contains(w)).collect();
        if common != opposite || opposite.len() != self.faces_on(u, v).len() {
            return false;
        }
        let has_face =
            |a: u32, b: u32, c: u32| self.faces_on(a, b).iter().any(|&f| self.faces[f as usize].contains(&c));
        let is_rim = |w: u32| self.locked[w as usize] || self.on_border(w);
        match opposite.into_iter().collect::<Vec<_>>()[..] {
            // The last face of its surface has borders all around.
            [k] => self.faces_on(u, k).len() > 1 || self.faces_on(v, k).len() > 1,
            // Not across the surface from rim to rim, and not the last four faces of a closed one.
            [k, l] => !((is_rim(u) && is_rim(v)) || (has_face(u, k, l) && has_face(v, k, l))),
            _ => false,
        }
    }

    /// Whether every surviving face keeps an area and turns by less than about 78°.
    fn no_face_flips(&self, u: u32, v: u32, x: DVec3) -> bool {
        const LEAST_COSINE: f64 = 0.2;
        self.faces_around(u, v).into_iter().filter(|&f| !self.has_both(f, u, v)).all(|f| {
            let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
            let before = normal(self.corners(f));
            let after = normal(self.faces[f as usize].map(|w| if w == u || w == v { x } else { self.position(w) }));
            after.length() > 0.0 && before.dot(after) > LEAST_COSINE * before.length() * after.length()
        })
    }

    fn has_both(&self, f: u32, u: u32, v: u32) -> bool {
        self.faces[f as usize].contains(&u) && self.faces[f as usize].contains(&v)
    }

    /// Replaces `v` by `u`, which moves to `x`; a locked `v` stays and `u` goes.
    fn contract(&mut self, u: u32, v: u32, x: DVec3) {
        let (u, v) = if self.locked[v as usize] { (v, u) } else { (u, v) };
        for f in self.faces_on(u, v) {
            self.alive[f as usize] = false;
            self.live_faces -= 1;
            for w in self.faces[f as usize] {
                self.stars[w as usize].retain(|&g| g != f);
            }
        }
        for f in std::mem::take(&mut self.stars[v as usize]) {
            self.faces[f as usize] = self.faces[f as usize].map(|w| if w == v { u } else { w });
            self.stars[u as usize].push(f);
        }
        self.positions[u as usize] = x;
        let gone = self.quadrics[v as usize];
        self.quadrics[u as usize].add(&gone);

        let ring: Vec<u32> = self.neighbors(u).iter().map(|&(w, _)| w).chain([u]).collect();
        for &w in ring.iter().chain([&v]) {
            self.versions[w as usize] += 1;
        }
        let pairs: BTreeSet<(u32, u32)> =
            ring.iter().flat_map(|&a| self.neighbors(a).into_iter().map(move |(b, _)| ascending((a, b)))).collect();
        for (a, b) in pairs {
            self.enqueue(a, b);
        }
    }
}

/// Spreads pairs of equal cost (flat areas have many) over the surface; by index they would follow one another.
fn tie_breaker(u: u32, v: u32) -> u64 {
    let mut h = ((u64::from(u) << 32) | u64::from(v)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h ^ (h >> 31)
}
