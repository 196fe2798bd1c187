//! What every vertex counts by its feature degree. Twin: `shaders/feature_weights.wgsl`, line for line.
//!
//! # Reference
//! \[Yang13\]: the entropy of the curvatures about a vertex, over that of equal shares, is low where the curvature
//! changes strongly. Departs: a floor below which curvatures drown, since the shares alone know no scale and would take
//! the noise on a flat for features.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::rows::{BORDER, FLAGS, Face, HUB, LOCKED, Position};
use super::split::CHUNK;
use super::stars::{Stars, spoke};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{LEAST, add, divide, log2, mul, sub};
use crate::math::lanes::{self, Columns, LANES, Lane, QUAD, Quad};

/// One invocation a vertex.
pub struct FeatureWeights<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// V mean curvatures.
    pub curvatures: &'a Buffer<f32>,
    /// Their sum.
    pub curvature_sum: &'a Buffer<f32>,
    /// V.
    pub vertex_count: u32,
    /// From the degree to the weight.
    pub params: Params,
    /// Writes V weights.
    pub weights: &'a mut Buffer<f32>,
}

params! {
    /// The uniform block: the weight is max(`base` + `slope` · degree, `least`).
    pub struct Params {
        /// The floor of the curvatures as a share of their sum.
        pub floor_share: f32,
        /// Taken for the sum where that is less.
        pub least_sum: f32,
        /// Whether a degree counts by how far its own curvature is above the floor.
        pub gated: u32,
        /// At degree 0.
        pub base: f32,
        /// From degree 0 to degree 1.
        pub slope: f32,
        /// The least weight.
        pub least: f32,
        /// Of vertices that stay: locked ones and hubs.
        pub of_fixed: f32,
    }
}

/// What is added to every curvature.
#[inline(always)]
fn floor_of(curvature_sum: f32, params: Params) -> f32 {
    mul(params.floor_share, curvature_sum.max(params.least_sum))
}

/// With rᵢ = kᵢ/max k: Σr and Σ r log r. The entropy of the shares is log Σr − Σ r log r / Σr, for equal shares without
/// any error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Shares {
    sum: f32,
    logs: f32,
}

#[inline(always)]
fn with_share(before: Shares, value: f32, greatest: f32) -> Shares {
    let r = divide(value, greatest);
    Shares { sum: add(before.sum, r), logs: add(before.logs, mul(r, log2(r))) }
}

/// One less the entropy over that of as many equal shares.
#[inline(always)]
fn degree_of(shares: Shares, neighbors: u32) -> f32 {
    let entropy = sub(log2(shares.sum), divide(shares.logs, shares.sum));
    sub(1.0, divide(entropy, log2((neighbors + 1) as f32))).max(0.0)
}

/// The live mesh and the curvatures of its vertices.
#[derive(Debug, Clone, Copy)]
struct Curved<'a> {
    stars: Stars<'a>,
    curvatures: &'a [f32],
}

fn lifted(vertex: u32, floor: f32, curved: &Curved<'_>) -> f32 {
    add(curved.curvatures[vertex as usize], floor)
}

/// The neighbor before the first face of an open fan, which comes after this vertex in no face; else the vertex itself.
fn last_neighbor(vertex: u32, stars: &Stars<'_>) -> u32 {
    let ring = stars.ring(vertex);
    for &f in ring {
        let last = spoke(stars.faces[f as usize], vertex).last;
        let mut is_next = false;
        for &g in ring {
            is_next = is_next || spoke(stars.faces[g as usize], vertex).next == last;
        }
        if !is_next {
            return last;
        }
    }
    vertex
}

fn feature_degree(vertex: u32, floor: f32, curved: &Curved<'_>) -> f32 {
    let stars = &curved.stars;
    let own = lifted(vertex, floor, curved);
    let mut greatest = own;
    let ring = stars.ring(vertex);
    for &f in ring {
        greatest = greatest.max(lifted(spoke(stars.faces[f as usize], vertex).next, floor, curved));
    }
    let mut last = vertex;
    if stars.positions[vertex as usize].flags & BORDER != 0 {
        last = last_neighbor(vertex, stars);
        greatest = greatest.max(lifted(last, floor, curved));
    }
    if greatest < LEAST {
        return 0.0;
    }
    let mut shares = with_share(Shares::default(), own, greatest);
    for &f in ring {
        shares = with_share(shares, lifted(spoke(stars.faces[f as usize], vertex).next, floor, curved), greatest);
    }
    if last == vertex {
        return degree_of(shares, ring.len() as u32);
    }
    degree_of(with_share(shares, lifted(last, floor, curved), greatest), ring.len() as u32 + 1)
}

/// The weight of a free vertex, by its degree and its own curvature.
#[inline(always)]
fn weight_of(degree: f32, own: f32, floor: f32, params: Params) -> f32 {
    let mut gate = 1.0;
    if params.gated != 0 {
        gate = divide(own, add(own, floor));
    }
    add(params.base, mul(params.slope, mul(degree, gate))).max(params.least)
}

fn feature_weight(vertex: u32, floor: f32, curved: &Curved<'_>, params: Params) -> f32 {
    if curved.stars.positions[vertex as usize].flags & (LOCKED | HUB) != 0 {
        return params.of_fixed;
    }
    weight_of(feature_degree(vertex, floor, curved), curved.curvatures[vertex as usize], floor, params)
}

/// Neighbors of a vertex that has a lane; few vertices have more.
const WINDOW: usize = 7;

/// The curvatures about a vertex off the border, of at most [`WINDOW`] neighbors.
///
/// The shader walks every ring. In lanes that takes a third of the time (75 to 26 ns a vertex); other vertices are walked.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
struct Ring {
    own: f32,
    /// In the order of the faces.
    around: [f32; WINDOW],
    neighbors: u32,
    flags: u32,
}

const RING_WORDS: usize = size_of::<Ring>() / 4;

impl Ring {
    /// About a vertex.
    #[inline(always)]
    fn at(vertex: usize, Curved { stars, curvatures }: Curved<'_>) -> Self {
        let ring = stars.ring(vertex as u32);
        let mut around = [0.0; WINDOW];
        for (curvature, &f) in around.iter_mut().zip(ring) {
            *curvature = curvatures[spoke(stars.faces[f as usize], vertex as u32).next as usize];
        }
        let flags = stars.positions[vertex].flags;
        Self { own: curvatures[vertex], around, neighbors: ring.len() as u32, flags }
    }

    fn has_lane(&self) -> bool {
        self.neighbors as usize <= WINDOW && self.flags & BORDER == 0
    }
}

impl Lane for Ring {
    type Source<'a> = Curved<'a>;
    type Params = (f32, Params);
    type Output = f32;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], curved: Curved<'_>, lanes: &mut Quad<'_>) {
        lanes.put::<_, RING_WORDS>(indices.map(|index| Self::at(index, curved)).each_ref());
    }

    /// What [`feature_weight`] returns, with zeros added for neighbors that are not there.
    #[inline(always)]
    fn compute(self, (floor, params): (f32, Params)) -> f32 {
        let own = add(self.own, floor);
        let mut around = self.around;
        let mut greatest = own;
        for (i, value) in (0..).zip(&mut around) {
            *value = if i < self.neighbors { add(*value, floor) } else { 0.0 };
            greatest = greatest.max(*value);
        }
        // No loop: with one inside, the loop over the lanes is not made vectors.
        let mut shares = with_share(Shares::default(), own, greatest);
        shares = with_share(shares, around[0], greatest);
        shares = with_share(shares, around[1], greatest);
        shares = with_share(shares, around[2], greatest);
        shares = with_share(shares, around[3], greatest);
        shares = with_share(shares, around[4], greatest);
        shares = with_share(shares, around[5], greatest);
        shares = with_share(shares, around[6], greatest);
        let degree = if greatest < LEAST { 0.0 } else { degree_of(shares, self.neighbors) };
        let weight = weight_of(degree, self.own, floor, params);
        if self.flags & (LOCKED | HUB) != 0 { params.of_fixed } else { weight }
    }
}

impl Kernel for FeatureWeights<'_> {
    const NAME: &'static str = "feature_weights";
    const SOURCE: &'static str = include_str!("../../shaders/feature_weights.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/stars.wgsl")];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = FLAGS;

    fn params(&self) -> Params {
        self.params
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("curvatures", Access::Read, self.curvatures),
            Binding::new("curvature_sum", Access::Read, self.curvature_sum),
            Binding::new("weights", Access::Write, self.weights),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let curved = Curved { stars, curvatures: self.curvatures.host() };
        let sum = self.curvature_sum.host().first().copied().unwrap_or(0.0);
        let params = self.params;
        let floor = floor_of(sum, params);
        let blocks = self.weights.host_mut()[..self.vertex_count as usize].par_chunks_mut(LANES).enumerate();
        blocks.with_min_len(CHUNK / LANES).for_each_init(Columns::<Ring, RING_WORDS>::new, |block, (i, weights)| {
            let first = i * LANES;
            lanes::compute(first, curved, (floor, params), block, weights);
            for (lane, weight) in weights.iter_mut().enumerate() {
                if !block.get(lane).has_lane() {
                    *weight = feature_weight((first + lane) as u32, floor, &curved, params);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AFFINE: Params =
        Params { floor_share: 1.0, least_sum: 0.0, gated: 0, base: 1.0, slope: 4.0, least: 0.0, of_fixed: 5.0 };

    /// A fan of `n` faces around vertex 0, closed or with a border.
    fn fan(n: u32, is_closed: bool) -> (Vec<Position>, Vec<Face>, Vec<u32>, Vec<u32>) {
        let rim = if is_closed { n } else { n + 1 };
        let faces: Vec<Face> = (0..n).map(|i| Face { a: 1 + i, b: 1 + (i + 1) % rim, c: 0 }).collect();
        let flags = if is_closed { 0 } else { BORDER };
        let positions = vec![Position { flags, ..Position::default() }; rim as usize + 1];
        (positions, faces, vec![0, n], (0..n).collect())
    }

    fn weight(n: u32, is_closed: bool, curvatures: &[f32], floor: f32, params: Params) -> f32 {
        let (positions, faces, ring_starts, ring_faces) = fan(n, is_closed);
        let stars = Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
        let curved = Curved { stars, curvatures };
        let walked = feature_weight(0, floor, &curved, params);
        let row = Ring::at(0, curved);
        if row.has_lane() {
            assert_eq!(row.compute((floor, params)).to_bits(), walked.to_bits(), "{curvatures:?}");
        }
        walked
    }

    #[test]
    fn lanes_have_the_bits_of_walks() {
        for n in 3..9 {
            for seed in 0..50_u32 {
                let curvature =
                    |i: u32| ((seed * 31 + i * 7) % 17) as f32 * [0.0, 1e-20, 0.1, 3.0, 1e6][seed as usize % 5];
                let curvatures: Vec<f32> = (0..=n).map(curvature).collect();
                for floor in [0.0, 0.01] {
                    weight(n, true, &curvatures, floor, AFFINE);
                    weight(n, true, &curvatures, floor, Params { gated: 1, ..AFFINE });
                }
            }
        }
    }

    #[test]
    fn even_curvature_is_no_feature_and_a_spike_is_all_of_one() {
        let degree = Params { base: 0.0, slope: 1.0, ..AFFINE };
        for n in 3..20 {
            let mut curvatures = vec![0.3; n as usize + 1];
            assert_eq!(weight(n, true, &curvatures, 0.1, degree), 0.0, "{n} neighbors");
            assert_eq!(weight(n - 1, false, &curvatures, 0.1, degree), 0.0, "{n} neighbors on a border");
            curvatures.fill(0.0);
            assert_eq!(weight(n, true, &curvatures, 0.0, degree), 0.0, "a flat of {n} neighbors");
            curvatures[2] = 1e-6;
            assert_eq!(weight(n, true, &curvatures, 0.0, degree), 1.0, "a spike by {n} neighbors");
        }
    }

    #[test]
    fn the_degree_is_one_less_the_normalized_entropy() {
        // Shares ½, ¼, ¼, 0: 1.5 bits of log₂ 4 = 2.
        let degree = Params { base: 0.0, slope: 1.0, ..AFFINE };
        assert_eq!(weight(3, true, &[0.5, 0.25, 0.0, 0.25], 0.0, degree), 0.25);
        assert_eq!(weight(2, false, &[0.5, 0.25, 0.0, 0.25], 0.0, degree), 0.25);
        assert_eq!(weight(3, true, &[0.5, 0.25, 0.0, 0.25], 0.0, AFFINE), 2.0);
        // A gate of ½/(½ + ½).
        let gated = Params { gated: 1, ..AFFINE };
        let own_is_floor = weight(3, true, &[0.5, 0.0, 0.0, 0.0], 0.5, AFFINE) - 1.0;
        assert_eq!(weight(3, true, &[0.5, 0.0, 0.0, 0.0], 0.5, gated) - 1.0, own_is_floor / 2.0);
    }

    #[test]
    fn vertices_that_stay_have_their_own_weight() {
        let (mut positions, faces, ring_starts, ring_faces) = fan(6, true);
        positions[0].flags = LOCKED;
        let stars = Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
        let curved = Curved { stars, curvatures: &[0.0; 7] };
        assert_eq!(feature_weight(0, 0.0, &curved, AFFINE), 5.0);
        assert_eq!(Ring::at(0, curved).compute((0.0, AFFINE)), 5.0);
    }
}
