//! The attributes around a pair: which wedges become one on either side of it, and what that costs.
//!
//! Off the seams a pair has one side, with all of its faces; along a seam it has two, and on each the wedges of both ends
//! become one. In a face an attribute is a linear function of the place, of gradient g; the cost of a side is the integral
//! over its faces of the squared difference between these functions and the new wedge's number s \[HO99\]:
//! Σ |n| (g·x + e − s)², least where s is the weighted mean of g·x + e.

use std::ops::Range;

use rustc_hash::FxHashMap;

use crate::kernel::rows::{BORDER, JOINED, LOCKED, SEAM};
use crate::math::DVec3;
use crate::mesh::adjacency::corner_of;

use super::cost_lanes::CostSums;
use super::face_terms::FaceTerms;
use super::filter::Rejection;
use super::hold::Past;
use super::layout::{Kind, Layout};
use super::patch::Patch;
use super::placement::Quadric;
use super::side_edges::SideEdges;
use super::side_sums::{OwnFaces, SideSums};
use super::star::{Star, StarFace};
use super::wedges::{NO_WEDGE, WedgeRows};
use super::yielding::Yields;

/// Most ends of a contraction.
pub const ENDS: usize = 3;

/// A live face at one of the ends, each told by the first of its ends.
#[derive(Debug, Clone, Copy)]
pub struct CornerFace {
    /// That end and the corners after it, as they are now.
    pub corners: [u32; 3],
    /// The wedges of these as the round began, whose rows are current.
    pub wedges: [u32; 3],
    /// Which of the ends told it.
    pub end: u8,
    /// Whether it has another end.
    pub dies: bool,
}

impl CornerFace {
    /// The wedge that the face had at one of its corners as the round began.
    fn wedge_at(&self, vertex: u32) -> Option<u32> {
        self.corners.iter().position(|&v| v == vertex).map(|k| self.wedges[k])
    }
}

/// The wedges of the ends that become one.
#[derive(Debug, Clone)]
pub struct Side {
    /// Of every end, [`NO_WEDGE`] where it has none. In the last place that of a triangle; for a pair the first's again, or none where
    /// it has one end's alone.
    pub wedges: [u32; ENDS],
}

impl Side {
    /// Whether a face is one of its own.
    pub fn has(&self, face: &CornerFace) -> bool {
        self.wedges[usize::from(face.end)] == face.wedges[0]
    }

    /// Whether it has a wedge of one end alone.
    pub fn is_alone(&self) -> bool {
        self.wedges[..2].contains(&NO_WEDGE)
    }

    /// The wedge of an end, if it has one.
    pub fn wedge(&self, end: usize) -> Option<u32> {
        Some(self.wedges[end]).filter(|&wedge| wedge != NO_WEDGE)
    }

    /// The wedges of the first so many ends.
    pub fn own(&self, ends: usize) -> impl Iterator<Item = u32> + Clone + use<> {
        self.wedges.into_iter().take(ends).filter(|&wedge| wedge != NO_WEDGE)
    }
}

/// The sides of a pair.
#[derive(Debug, Default)]
pub struct Sides {
    /// Of a pair in the order of its star.
    pub faces: Vec<CornerFace>,
    /// Between the ends.
    middle: DVec3,
    /// Of a pair, which of them have both ends.
    dying: Range<usize>,
    pub sides: Vec<Side>,
    /// The sums over the faces of each side; longer than `sides` where more were needed before.
    sums: Vec<SideSums>,
    /// The end whose wedges stay as they are, and whose place is that of the new vertex.
    pub fixed: Option<usize>,
    /// Whether the new vertex has the wedges of both ends side by side: they share no face that could tell which are one.
    pub tears: bool,
    /// Whether the ends share no face: they cost what the geometry does.
    pub apart: bool,
    /// Whether the new vertex has to stand where one of the ends does.
    pub at_an_end: bool,
    /// Whether no seam and no border is known at the ends; where parts meet, or a vertex is locked, there may be one.
    is_inside: bool,
    /// Whether seams give way: some sides may have a wedge of one end alone.
    pub yields: bool,
    costed: usize,
    summed: usize,
    /// What the faces add to sums.
    terms: FaceTerms,
    /// Which of the faces are each side's, one side after the other, and where those of each begin.
    pub(super) own: Vec<u32>,
    pub(super) own_starts: Vec<usize>,
    /// How many sides come first that may share wedges; each after them has one wedge, of one end, that no other side has.
    pub(super) told: usize,
    /// The number of the side of a wedge alone, by its end, where there are more than a few.
    pub(super) alone: FxHashMap<(u8, u32), u32>,
    costs: CostSums,
    /// The edges that may be seams.
    pub(super) edges: SideEdges,
}

impl Sides {
    /// Forgets what was gathered before.
    fn clear(&mut self, layout: &Layout, middle: DVec3) {
        self.middle = middle;
        self.faces.clear();
        self.sides.clear();
        (self.fixed, self.tears, self.apart) = (None, false, false);
        (self.at_an_end, self.is_inside, self.yields) = (false, false, false);
        self.own_starts.clear();
        self.dying = 0..0;
        (self.costed, self.summed) = (layout.costed, layout.summed);
    }

    /// Adds a side of these wedges, the first two of which are a pair's.
    fn push(&mut self, wedges: [u32; ENDS], rows: &WedgeRows<'_>) {
        let number = self.sides.len();
        self.sides.push(Side { wedges });
        self.sums.resize_with(self.sums.len().max(number + 1), SideSums::default);
        let [first, second] = match wedges {
            [first, NO_WEDGE, _] => [first, first],
            [NO_WEDGE, second, _] => [second, second],
            [first, second, _] => [first, second],
        };
        self.sums[number].begin(rows.numbers(), [first, second], self.summed);
    }

    /// Adds a side of a wedge of one end, that none of the other's becomes one with.
    pub fn push_alone(&mut self, end: usize, wedge: u32, rows: &WedgeRows<'_>) {
        let mut wedges = [NO_WEDGE; ENDS];
        wedges[end] = wedge;
        self.push(wedges, rows);
    }

    /// Gathers the faces of the star of a pair about `middle`.
    pub fn gather_pair(&mut self, patch: &Patch<'_>, pair: [u32; 2], star: &Star, middle: DVec3) {
        let Some(rows) = patch.wedges() else { return };
        self.clear(rows.layout, middle);
        self.dying = star.numbers_of_shared();
        let (of_second, survivors) = (star.numbers_of_second(), star.survivors());
        let faces = star.faces().iter().enumerate();
        self.faces.extend(faces.map(|(number, &StarFace { face, others: [v1, v2] })| {
            let end = u8::from(of_second.contains(&number));
            let vertex = pair[usize::from(end)];
            let corner = corner_of(patch.connectivity.faces[face as usize].corners(), vertex);
            let wedges = rows.wedges_from(face, corner);
            CornerFace { corners: [vertex, v1, v2], wedges, end, dies: number >= survivors }
        }));
    }

    /// Gathers the live faces of the corners of a triangle, which are free: all of them lie in the patch.
    pub fn gather(&mut self, patch: &Patch<'_>, ends: [u32; ENDS], middle: DVec3) {
        let Some(rows) = patch.wedges() else { return };
        self.clear(rows.layout, middle);
        for (end, &vertex) in ends.iter().enumerate() {
            for &f in patch.connectivity.ring(vertex) {
                let corners = patch.connectivity.faces[f as usize].corners();
                let first = corner_of(corners, vertex);
                let around = [first, (first + 1) % 3, (first + 2) % 3];
                let now = around.map(|k| patch.current(corners[k]).unwrap_or(vertex));
                if now[1] == now[2] || now[1..].iter().any(|v| ends[..end].contains(v)) {
                    continue;
                }
                let wedges = around.map(|k| rows.wedge(f, k));
                let dies = now[1..].iter().any(|v| ends.contains(v));
                self.faces.push(CornerFace { corners: now, wedges, end: end as u8, dies });
            }
        }
    }

    /// Finds the sides of a pair that [no seam holds](super::seam_filter::seams_let).
    ///
    /// # Errors
    /// [`Rejection::Seam`] where both ends have to stay where they are, or vanishing faces disagree in more than two sides.
    pub fn find(&mut self, patch: &Patch<'_>, pair: [u32; 2]) -> Result<(), Rejection> {
        let Some(rows) = patch.wedges() else { return Ok(()) };
        self.find_sides(patch, rows, pair)?;
        self.deal();
        Ok(())
    }

    fn find_sides(&mut self, patch: &Patch<'_>, rows: &WedgeRows<'_>, pair: [u32; 2]) -> Result<(), Rejection> {
        let flags = pair.map(|v| patch.position(v).flags);
        let on_seam = flags.map(|flags| flags & SEAM != 0);
        for f in self.dying.clone() {
            // Seen from the first end.
            let CornerFace { corners, wedges, .. } = &self.faces[f];
            let (first, second) = (wedges[0], wedges[1 + usize::from(corners[2] == pair[1])]);
            if self.sides.iter().all(|side| side.wedges[..2] != [first, second]) {
                self.push([first, second, first], rows);
            }
        }
        self.told = self.sides.len();
        match self.told {
            0 => {
                self.find_apart(rows, pair, on_seam == [false, false]);
                self.told = self.sides.len();
                return Ok(());
            }
            1 | 2 => {}
            _ => return Err(Rejection::Seam),
        }
        self.is_inside = (flags[0] | flags[1]) & (SEAM | BORDER | LOCKED | JOINED) == 0;
        if rows.layout.yields != Yields::Nothing {
            return self.find_yielding(rows, flags);
        }
        // Along a seam the wedges of either end are two, but where it ends.
        let meets = |end: usize| self.sides.len() == 2 && self.sides[0].wedges[end] == self.sides[1].wedges[end];
        let stays = |end: usize| flags[end] & LOCKED != 0 || meets(end) || (on_seam[end] && !on_seam[1 - end]);
        self.fixed = match [stays(0), stays(1)] {
            [true, true] => return Err(Rejection::Seam),
            [true, false] => Some(0),
            [false, true] => Some(1),
            [false, false] => None,
        };
        Ok(())
    }

    /// Whether faces stand all around both ends of a pair, and all of their corners there become one wedge.
    pub fn is_inside(&self) -> bool {
        self.is_inside && self.sides.len() == 1
    }

    /// The one side of a pair without an edge, where nothing but a texture or a material could tear.
    fn find_apart(&mut self, rows: &WedgeRows<'_>, pair: [u32; 2], is_whole: bool) {
        self.apart = true;
        let with_face = |end: usize| self.faces.iter().find(|face| face.corners[0] == pair[end]);
        // An end may have lost all of its faces.
        let wedge = |end: usize| with_face(end).map(|face| face.wedges[0]).or_else(|| rows.only(pair[end]));
        let holds = rows.layout.has_materials || rows.layout.of_kind(Kind::Texcoords).next().is_some();
        match (wedge(0), wedge(1)) {
            (Some(first), Some(second)) if is_whole && !holds => {
                self.push([first, second, first], rows);
            }
            _ => self.tears = true,
        }
    }

    /// The one side of a triangle, of whose corners one at most is on a seam.
    ///
    /// # Errors
    /// [`Rejection::Seam`] where its faces disagree, or two of its corners have to stay.
    pub fn find_whole(&mut self, patch: &Patch<'_>, ends: [u32; ENDS]) -> Result<(), Rejection> {
        let Some(rows) = patch.wedges() else { return Ok(()) };
        let mut wedges = [None; ENDS];
        for face in self.faces.iter().filter(|face| face.dies) {
            for (own, end) in wedges.iter_mut().zip(ends) {
                if let Some(wedge) = face.wedge_at(end)
                    && *own.get_or_insert(wedge) != wedge
                {
                    return Err(Rejection::Seam);
                }
            }
        }
        let [Some(a), Some(b), Some(c)] = wedges else { return Err(Rejection::Seam) };
        let mut held = (0..ENDS).filter(|&end| patch.position(ends[end]).flags & (SEAM | LOCKED) != 0);
        self.fixed = held.next();
        if held.next().is_some() {
            return Err(Rejection::Seam);
        }
        let wedges = [a, b, c];
        let side = Side { wedges };
        if rows.layout.yields != Yields::Nothing && !self.faces.iter().all(|face| side.has(face)) {
            return Err(Rejection::Seam);
        }
        self.push(wedges, rows);
        self.told = 1;
        self.deal();
        Ok(())
    }

    /// Adds what the attributes cost to the quadric of a pair about its middle, with the numbers of the new wedges that are best
    /// at every place.
    pub fn add_to(&mut self, patch: &Patch<'_>, star: &Star, quadric: &mut Quadric) {
        let (Some(rows), costed, summed) = (patch.wedges(), self.costed, self.summed) else { return };
        if costed == 0 || self.apart {
            return;
        }
        let Self { faces, sums, terms, own, own_starts, costs, .. } = self;
        terms.find(&star.quads, star.h, star.survivors());
        costs.begin(costed);
        for (ends, sums) in own_starts.windows(2).zip(sums) {
            let own = OwnFaces { faces, terms, own: &own[ends[0]..ends[1]], numbers: rows.numbers() };
            sums.add_faces(own, [costed, summed], costs);
        }
        costs.add_to(costed, quadric);
    }

    /// Where the corners of a face stand about the middle.
    pub fn points(&self, patch: &Patch<'_>, face: &CornerFace) -> [DVec3; 3] {
        face.corners.map(|v| patch.position(v).xyz().as_dvec3() - self.middle)
    }

    /// What the numbers of an end cost at its place more than the best; `h` is half the pair.
    pub fn at_end(&self, end: usize, h: DVec3) -> f64 {
        let (x, sign) = if end == 0 { (-h, -1.0) } else { (h, 1.0) };
        let value = |(side, sums): (&Side, &SideSums)| match side.wedge(end) {
            Some(_) => sums.at_end(self.costed, x, sign),
            // A side without a wedge there has the best numbers.
            None => 0.0,
        };
        self.sides.iter().zip(&self.sums).map(value).sum()
    }

    /// What the rounding of numbers may cost.
    pub fn rounding(&self) -> f64 {
        self.sums[..self.sides.len()].iter().map(|sums| sums.rounding(self.costed)).sum()
    }

    /// Writes the best numbers of a side at a place into its row, held near those of its corners.
    pub fn write_least(&self, side: usize, x: DVec3, past: Past<'_>, row: &mut [f32]) {
        self.sums[side].write_least(x, past, &mut row[..self.summed]);
    }

    /// The share of a side in the area around a pair.
    pub fn weight(&self, side: usize) -> f64 {
        self.sums[side].weight
    }
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::prepare::prepare;
    use super::super::surface::Surface;
    use super::*;
    use crate::backend::Device;
    use crate::math::Vec2;
    use crate::mesh::shapes;

    /// A plane whose texture is cut along its middle column: pairs are inside where no end is on the cut or the border.
    #[test]
    fn pairs_at_a_border_or_a_seam_are_not_inside() {
        let (width, middle) = (8, 4);
        let mut mesh = shapes::plane(width, width);
        let place = |v: u32| [v % (width + 1), v / (width + 1)];
        let texcoords = |face: &[u32; 3]| {
            let places = face.map(place);
            let shift = if places.iter().any(|&[x, _]| x > middle) { 20.0 } else { 0.0 };
            places.map(|[x, y]| Vec2::new(x as f32 + shift, y as f32))
        };
        mesh.texcoords = Some(mesh.faces.iter().map(texcoords).collect());
        let mut prepared = prepare(&mesh, &Options::default()).expect("a valid mesh");
        let device = Device::cpu(1).expect("a device");
        let start = prepared.take_start();
        let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
        let origin = prepared.carried.origin.clone();
        let patch = Patch::whole(&mut surface, &mut prepared.carried);
        let is_off = |v: u32| place(origin[v as usize]).iter().all(|&x| x > 0 && x < width);
        let is_inside = |v: u32| is_off(v) && place(origin[v as usize])[0] != middle;
        let (mut star, mut sides, mut inside, mut outside) = (Star::default(), Sides::default(), 0, 0);
        for face in patch.connectivity.faces {
            let pair = [face.a, face.b];
            let [u, w] = pair.map(|v| patch.position(v).xyz().as_dvec3());
            let middle = (u + w) * 0.5;
            star.gather(pair, (w - u) * 0.5, &patch).expect("the patch is the whole surface");
            sides.gather_pair(&patch, pair, &star, middle);
            if sides.find(&patch, pair).is_ok() {
                assert_eq!(sides.is_inside(), pair.iter().all(|&v| is_inside(v)), "{pair:?}");
                if sides.is_inside() { inside += 1 } else { outside += 1 }
            }
        }
        assert!(inside > 20 && outside > 20, "{inside}, {outside}");
    }
}
