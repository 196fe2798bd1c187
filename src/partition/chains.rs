//! Chains simplified by recursive subdivision: a segment takes the place of the vertices between its ends where all of them
//! are near it, or else is split at the one farthest off.
//!
//! # Reference
//! \[Liu99\] by distance and color, \[Jin09\] by the distance over the segment's length.

use std::ops::Range;

use rayon::prelude::*;

use super::boundary::Boundary;
use super::fit::area_around;
use super::surface::Surface;
use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::chain_deviations::ChainDeviations;
use crate::kernel::rows::Position;
use crate::math::DVec3;

/// Rows that a thread takes at a time.
const ROWS: usize = 1 << 10;

/// What vertices may be off the segment that takes their place; infinite tolerances allow anything.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Distance, in lengths of the frame.
    pub distance: f64,
    /// Distance over the segment's length.
    pub chord_ratio: f64,
    /// Difference of a color's channel, in the unit of the colors.
    pub color: f64,
    /// Difference of color times area that a segment's vertices may lose together, in the frame.
    pub worth: f64,
}

impl Tolerances {
    /// No limit.
    pub const ANY: Self =
        Self { distance: f64::INFINITY, chord_ratio: f64::INFINITY, color: f64::INFINITY, worth: f64::INFINITY };

    /// How far over them a vertex is; 1 and more is too far.
    fn excess(self, distance: f64, color: f64, chord: f64) -> f64 {
        let share = |off: f64, allowed: f64| if off < allowed || allowed > 0.0 { off / allowed } else { f64::INFINITY };
        // A chord without length, times infinity, is no number.
        let bulge = if self.chord_ratio.is_finite() { self.chord_ratio * chord } else { f64::INFINITY };
        share(distance, self.distance).max(share(distance, bulge)).max(share(color, self.color))
    }
}

/// The vertices of a surface on a device, for all chains that are drawn along them.
#[derive(Debug)]
pub struct Vertices {
    positions: Buffer<Position>,
    colors: Buffer<[f32; 4]>,
    has_colors: bool,
}

impl Vertices {
    /// Copies them to the device of `queue`, with the color of each where it counts.
    ///
    /// # Errors
    /// Those of the device.
    pub fn new(surface: &Surface, colors: Option<&[[f32; 4]]>, queue: &mut Queue) -> Result<Self> {
        Ok(Self {
            positions: queue.buffer_from(surface.positions.clone())?,
            colors: queue.buffer_from(colors.map_or_else(|| vec![[0.0; 4]], <[_]>::to_vec))?,
            has_colors: colors.is_some(),
        })
    }
}

/// Which vertices of chains stay.
#[derive(Debug)]
pub struct Chains<'a> {
    surface: &'a Surface,
    boundary: &'a Boundary,
    /// One a place in [`Boundary::chain_vertices`].
    kept: Vec<bool>,
    /// How many vertices each chain leaves out.
    missing: Vec<u32>,
}

/// A segment: the places of its ends.
pub type Segment = [usize; 2];

impl<'a> Chains<'a> {
    /// Chains with nothing but their ends.
    pub fn new(surface: &'a Surface, boundary: &'a Boundary) -> Self {
        let mut kept = vec![false; boundary.chain_vertices.len()];
        let mut missing = Vec::with_capacity(boundary.chain_count());
        for chain in 0..boundary.chain_count() {
            let Range { start, end } = boundary.places(chain);
            (kept[start], kept[end - 1]) = (true, true);
            missing.push((end - start - 2) as u32);
        }
        Self { surface, boundary, kept, missing }
    }

    /// Splits segments until all are within `tolerances`.
    ///
    /// In rounds: the deviations of all vertices of segments not settled on the device, the splits on the host.
    ///
    /// # Errors
    /// Those of the queue's device; the chains are then as they were.
    pub fn simplify(&mut self, tolerances: Tolerances, vertices: &Vertices, queue: &mut Queue) -> Result<()> {
        let all = |chain| self.boundary.places(chain);
        let mut open: Vec<Segment> = (0..self.boundary.chain_count()).map(|c| [all(c).start, all(c).end - 1]).collect();
        open.retain(|[first, last]| last - first > 1);
        let mut kept = self.kept.clone();
        let mut rows = Vec::new();
        while !open.is_empty() {
            self.measure(&open, vertices, queue, &mut rows)?;
            let mut begins = Vec::with_capacity(open.len());
            let mut begin = 0;
            for [first, last] in &open {
                begins.push(begin);
                begin += last - first - 1;
            }
            let split = |(&segment, &begin): (&Segment, &usize)| self.worst(segment, tolerances, &rows[begin..]);
            let splits: Vec<Option<usize>> = open.par_iter().zip(&begins).with_min_len(ROWS).map(split).collect();
            let mut next = Vec::new();
            for ([first, last], split) in open.into_iter().zip(splits) {
                let Some(middle) = split else { continue };
                kept[middle] = true;
                next.extend([[first, middle], [middle, last]].into_iter().filter(|[first, last]| last - first > 1));
            }
            open = next;
        }
        self.kept = kept;
        for (chain, missing) in self.missing.iter_mut().enumerate() {
            *missing = self.kept[self.boundary.places(chain)].iter().filter(|&&kept| !kept).count() as u32;
        }
        Ok(())
    }

    /// How far every vertex between the ends of these segments is off, in place and in color.
    fn measure(
        &self,
        open: &[Segment],
        vertices: &Vertices,
        queue: &mut Queue,
        rows: &mut Vec<[f32; 2]>,
    ) -> Result<()> {
        let vertex = |place: usize| self.boundary.chain_vertices[place];
        let spans: Vec<[u32; 4]> = (open.par_iter().with_min_len(ROWS))
            .flat_map_iter(|&[first, last]| {
                (first + 1..last).map(move |place| [vertex(place), vertex(first), vertex(last), 0])
            })
            .collect();
        let span_count = spans.len() as u32;
        let mut deviations = queue.buffer(spans.len())?;
        let spans = queue.buffer_from(spans)?;
        queue.run(ChainDeviations {
            positions: &vertices.positions,
            colors: &vertices.colors,
            spans: &spans,
            span_count,
            has_colors: vertices.has_colors,
            deviations: &mut deviations,
        })?;
        rows.clear();
        queue.read(&deviations, 0..span_count as usize, rows)
    }

    /// Where to split a segment, by the deviations of the vertices between its ends: at the one that is farthest off, or where
    /// most light is lost.
    fn worst(&self, [first, last]: Segment, tolerances: Tolerances, rows: &[[f32; 2]]) -> Option<usize> {
        let chord = (self.point(last) - self.point(first)).length();
        let mut worst = (1.0, -1.0);
        let mut at = None;
        for (place, &[distance, color]) in (first + 1..last).zip(rows) {
            let (distance, color) = (f64::from(distance), f64::from(color));
            let excess = (tolerances.excess(distance, color, chord), distance);
            if excess.0 >= 1.0 && excess > worst {
                (worst, at) = (excess, Some(place));
            }
        }
        at.or_else(|| self.darkest([first, last], tolerances.worth, rows))
    }

    /// Where most light is lost between the ends of a segment, if all of it together is worth more than `worth`.
    fn darkest(&self, [first, last]: Segment, worth: f64, rows: &[[f32; 2]]) -> Option<usize> {
        if worth.is_infinite() {
            return None;
        }
        let (mut sum, mut most, mut at) = (0.0, 0.0, None);
        for (place, &[_, color]) in (first + 1..last).zip(rows) {
            let lost = f64::from(color) * area_around(self.surface, self.boundary.chain_vertices[place]);
            sum += lost;
            if lost > most {
                (most, at) = (lost, Some(place));
            }
        }
        at.filter(|_| sum > worth)
    }

    fn point(&self, place: usize) -> DVec3 {
        self.surface.points[self.boundary.chain_vertices[place] as usize]
    }

    /// The places of a chain's vertices that stay.
    pub fn kept(&self, chain: usize) -> impl DoubleEndedIterator<Item = usize> {
        self.boundary.places(chain).filter(|&place| self.kept[place])
    }

    /// The segments of a chain.
    pub fn segments(&self, chain: usize) -> impl Iterator<Item = Segment> {
        self.kept(chain).zip(self.kept(chain).skip(1)).map(|(first, last)| [first, last])
    }

    /// The vertex between the ends of a segment that is farthest from it, and how far; nothing of an edge.
    pub fn farthest(&self, [first, last]: Segment) -> Option<(usize, f64)> {
        let (a, b) = (self.point(first), self.point(last));
        let mut worst = None;
        for place in first + 1..last {
            let off = distance_to_segment(self.point(place), a, b);
            if worst.is_none_or(|(_, most)| off > most) {
                worst = Some((place, off));
            }
        }
        worst
    }

    /// Keeps the vertex at a place.
    pub fn keep(&mut self, place: usize) {
        if !std::mem::replace(&mut self.kept[place], true) {
            self.missing[self.boundary.chain_at(place)] -= 1;
        }
    }

    /// Whether a chain has all of its vertices.
    pub fn is_whole(&self, chain: usize) -> bool {
        self.missing[chain] == 0
    }

    /// Keeps every vertex of a chain; whether that changes it.
    pub fn keep_all(&mut self, chain: usize) -> bool {
        self.kept[self.boundary.places(chain)].fill(true);
        std::mem::take(&mut self.missing[chain]) > 0
    }
}

/// The distance of a point to a segment.
fn distance_to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (along, length_sq) = ((p - a).dot(b - a), (b - a).length_squared());
    let t = if length_sq > 0.0 { (along / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + (b - a) * t)).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Device;
    use crate::mesh::{Mesh, shapes};
    use crate::partition::Partition;

    fn kept(mesh: &Mesh, tolerances: Tolerances, color: Option<fn(DVec3) -> f32>) -> Vec<usize> {
        let surface = Surface::new(mesh, Some(0.0)).expect("a valid mesh");
        let partition = Partition { labels: vec![0; surface.faces.len()], region_count: 1 };
        let boundary = Boundary::new(&surface, &partition);
        let mut chains = Chains::new(&surface, &boundary);
        let device = Device::cpu(1).expect("a thread");
        let at = |v: u32| mesh.positions[v as usize];
        let colors: Option<Vec<[f32; 4]>> =
            color.map(|color| surface.vertex_source.iter().map(|&v| [color(at(v)), 0.0, 0.0, 1.0]).collect());
        let mut queue = device.cpu_queue();
        let vertices = Vertices::new(&surface, colors.as_deref(), &mut queue).expect("memory");
        chains.simplify(tolerances, &vertices, &mut queue).expect("chains");
        (0..boundary.chain_count()).map(|chain| chains.kept(chain).count()).collect()
    }

    #[test]
    fn straight_sides_keep_their_corners() {
        let plane = shapes::plane(8, 5);
        assert_eq!(kept(&plane, Tolerances { distance: 1e-3, ..Tolerances::ANY }, None), [5]);
        assert_eq!(kept(&plane, Tolerances { chord_ratio: 1e-3, ..Tolerances::ANY }, None), [5]);
        assert_eq!(kept(&plane, Tolerances::ANY, None), [2]);
        assert_eq!(kept(&plane, Tolerances { distance: 0.0, ..Tolerances::ANY }, None), [27]);
    }

    #[test]
    fn colors_split_what_is_straight() {
        let plane = shapes::plane(8, 8);
        let sides = kept(&plane, Tolerances { distance: 1e-3, ..Tolerances::ANY }, None)[0];
        let step = |p: DVec3| if p.x > 3.5 { 100.0 } else { 0.0 };
        let both = kept(&plane, Tolerances { distance: 1e-3, color: 2.0, ..Tolerances::ANY }, Some(step))[0];
        assert_eq!((sides, both), (5, 9), "two vertices on either of the two sides that the step crosses");
    }

    /// Light that is a little off at every vertex of a side is worth as much as a step.
    #[test]
    fn light_lost_on_the_whole_splits_too() {
        let plane = shapes::plane(8, 8);
        let arch = |p: DVec3| (p.x - 4.0).powi(2) as f32;
        let kept =
            |worth| kept(&plane, Tolerances { distance: 1e-3, color: 20.0, worth, ..Tolerances::ANY }, Some(arch));
        assert_eq!([kept(f64::INFINITY), kept(1e6)], [[5], [5]], "16 at the most");
        let [some, all] = [kept(1e-3)[0], kept(0.0)[0]];
        assert!(some > 5 && all == 4 + 2 * 7 + 1, "{some} and {all}: both sides that it runs along, whole");
    }
}
