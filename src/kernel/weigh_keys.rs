//! Multiplies the cost of every pair by the greater weight of its ends. Twin: `shaders/weigh_keys.wgsl`, line for line.

use rayon::prelude::*;

use super::pair_quadric::NO_KEY;
use super::pairs::half_edge_ends;
use super::rows::{Edge, Face};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::exact::{LEAST, flush, mul};

/// Costs above this are taken for it, so that no weight makes them infinite.
pub const GREATEST_COST: f32 = 1e30;

/// One invocation a pair.
pub struct WeighKeys<'a> {
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// P pairs.
    pub pairs: &'a Buffer<Edge>,
    /// V weights, at most 10⁸.
    pub weights: &'a Buffer<f32>,
    /// P.
    pub pair_count: u32,
    /// P keys, changed in place.
    pub keys: &'a mut Buffer<u32>,
}

/// The key of a pair whose ends have these weights; what has none gets none.
#[inline(always)]
pub fn weighed_key(key: u32, first: f32, second: f32) -> u32 {
    if key == NO_KEY {
        return key;
    }
    let cost = flush(f32::from_bits(key).min(GREATEST_COST), LEAST);
    flush(mul(cost, flush(first.max(second), LEAST)), LEAST).to_bits()
}

/// Multiplies the keys of these pairs.
pub fn weigh_keys(pairs: &[Edge], faces: &[Face], weights: &[f32], keys: &mut [u32]) {
    for (key, pair) in keys.iter_mut().zip(pairs) {
        let [u, w] = half_edge_ends(pair.half_edge, faces).map(|end| weights[end as usize]);
        *key = weighed_key(*key, u, w);
    }
}

impl Kernel for WeighKeys<'_> {
    const NAME: &'static str = "weigh_keys";
    const SOURCE: &'static str = include_str!("../../shaders/weigh_keys.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/half_edges.wgsl")];
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] =
        &[("GREATEST_COST", Constant::F32(GREATEST_COST)), ("NO_KEY", Constant::U32(NO_KEY))];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("pairs", Access::Read, self.pairs),
            Binding::new("weights", Access::Read, self.weights),
            Binding::new("keys", Access::Write, self.keys),
        ]
    }

    fn invocations(&self) -> u32 {
        self.pair_count
    }

    fn run_cpu(&mut self) {
        let (faces, weights) = (self.faces.host(), self.weights.host());
        let pairs = self.pairs.host()[..self.pair_count as usize].par_chunks(CHUNK);
        let keys = self.keys.host_mut().par_chunks_mut(CHUNK);
        keys.zip(pairs).for_each(|(keys, pairs)| weigh_keys(pairs, faces, weights, keys));
    }
}
