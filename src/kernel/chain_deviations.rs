//! How far the vertices of chains are from the segments that may take their place, in space and in color. Twin:
//! `shaders/chain_deviations.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::Position;
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, add, add3, divide, dot3, flush, flush3, mul, root, scale3, sub, sub3};

/// One invocation a vertex of a chain. The color beside a vertex is compared with that of the segment's nearest point, as
/// \[Liu99\] compares it with that of its corresponding point.
pub struct ChainDeviations<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// V colors, in any unit; one row of zeros where there are none.
    pub colors: &'a Buffer<[f32; 4]>,
    /// N rows: the vertex, the segment's ends, and 0.
    pub spans: &'a Buffer<[u32; 4]>,
    /// N.
    pub span_count: u32,
    /// Whether `colors` has a row a vertex.
    pub has_colors: bool,
    /// Writes N rows: the distance in lengths of the frame, and the greatest difference of a color's channels.
    pub deviations: &'a mut Buffer<[f32; 2]>,
}

/// Where between its ends, 0 … 1, a segment is nearest to the origin; the ends are given about it.
#[inline(always)]
fn nearest_on(a: Vec3, b: Vec3) -> f32 {
    let ab = flush3(sub3(b, a), LEAST_FACTOR);
    let along = flush(-dot3(ab, a), LEAST_FACTOR);
    let length_sq = dot3(ab, ab);
    if along <= 0.0 {
        return 0.0;
    }
    if along >= length_sq {
        return 1.0;
    }
    divide(along, length_sq)
}

#[inline(always)]
fn between(a: f32, b: f32, t: f32) -> f32 {
    add(a, mul(sub(b, a), t))
}

#[inline(always)]
fn color_deviation(own: [f32; 4], first: [f32; 4], last: [f32; 4], t: f32) -> f32 {
    let red = sub(between(first[0], last[0], t), own[0]).abs();
    let green = sub(between(first[1], last[1], t), own[1]).abs();
    let blue = sub(between(first[2], last[2], t), own[2]).abs();
    red.max(green).max(blue)
}

#[inline(always)]
fn chain_deviation(span: [u32; 4], positions: &[Position], colors: &[[f32; 4]], has_colors: bool) -> [f32; 2] {
    let own = positions[span[0] as usize].xyz();
    let a = flush3(sub3(positions[span[1] as usize].xyz(), own), LEAST_FACTOR);
    let b = flush3(sub3(positions[span[2] as usize].xyz(), own), LEAST_FACTOR);
    let t = nearest_on(a, b);
    let away = flush3(add3(a, scale3(sub3(b, a), t)), LEAST_FACTOR);
    let mut color = 0.0;
    if has_colors {
        color = color_deviation(colors[span[0] as usize], colors[span[1] as usize], colors[span[2] as usize], t);
    }
    [root(dot3(away, away)), color]
}

params! {
    /// Scalars of a run.
    pub struct Params {
        /// 1 where `colors` has a row a vertex, else 0.
        pub has_colors: u32,
    }
}

impl Kernel for ChainDeviations<'_> {
    const NAME: &'static str = "chain_deviations";
    const SOURCE: &'static str = include_str!("../../shaders/chain_deviations.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;

    fn params(&self) -> Params {
        Params { has_colors: self.has_colors.into() }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("colors", Access::Read, self.colors),
            Binding::new("spans", Access::Read, self.spans),
            Binding::new("deviations", Access::Write, self.deviations),
        ]
    }

    fn invocations(&self) -> u32 {
        self.span_count
    }

    fn run_cpu(&mut self) {
        let (positions, colors, has_colors) = (self.positions.host(), self.colors.host(), self.has_colors);
        let spans = &self.spans.host()[..self.span_count as usize];
        let rows = self.deviations.host_mut().par_iter_mut().zip(spans).with_min_len(CHUNK);
        rows.for_each(|(row, &span)| *row = chain_deviation(span, positions, colors, has_colors));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_and_color_by_hand() {
        let at = |x: f32, y: f32| Position::new(Vec3::new(x, y, 0.0), 0);
        let positions = [at(0.0, 0.0), at(4.0, 0.0), at(1.0, 3.0), at(7.0, 4.0), at(-3.0, -4.0)];
        let gray = |x: f32| [x, x, x, 1.0];
        let colors = [gray(10.0), gray(30.0), [15.0, 17.0, 10.0, 0.0], gray(30.0), gray(9.0)];
        let deviation = |span: [u32; 4]| chain_deviation(span, &positions, &colors, true);
        assert_eq!(deviation([2, 0, 1, 0]), [3.0, 5.0]);
        assert_eq!(deviation([3, 0, 1, 0]), [5.0, 0.0]);
        assert_eq!(deviation([4, 0, 1, 0]), [5.0, 1.0]);
        // A segment without length.
        assert_eq!(deviation([3, 1, 1, 0]), [5.0, 0.0]);
        assert_eq!(chain_deviation([2, 0, 1, 0], &positions, &colors, false), [3.0, 0.0]);
    }
}
