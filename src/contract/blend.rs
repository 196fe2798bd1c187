//! The rows of new wedges: the best numbers at their place, or those of the nearest point of the surface before, and no
//! face that turns over in the texture.
//!
//! In the texture the new wedge takes its best place, or the nearest from which no face turns over (`chart`). Faces without
//! an area there demand nothing but to get none of the other sign.

use crate::math::{DVec3, Vec3};
use crate::spatial::triangle::closest_point;

use super::chart::{Chart, all_keep, is_in_repeat_of, place, rounded};
use super::filter::Rejection;
use super::hold::Past;
use super::layout::{Kind, Layer, Layout, Origin};
use super::patch::Patch;
use super::sides::{CornerFace, ENDS, Side, Sides};
use super::wedges::WedgeRows;

/// How far past the numbers of a side's corners those of a new vertex off its faces may be, of their range. With none the
/// texture of a truck with half of its faces moves by three times as much; without a bound it is lost where faces are thin.
const PAST: f32 = 2.0;
/// The same of a side with a wedge of either end, by its range: vertices are off the surface by rounding.
const NEAR: f32 = 1.0 / 1024.0;

/// Rows of new wedges, with scratch that outlives each.
#[derive(Debug, Default)]
pub struct Blend {
    /// One for each side.
    rows: Vec<f32>,
    /// That of the nearest point, where the best place folds; and what several share.
    nearest: Vec<f32>,
    groups: Groups,
    chart: Chart,
}

/// Sides that have the same of a layer.
#[derive(Debug, Default)]
struct Groups {
    /// For each side the first of its own.
    leaders: Vec<u32>,
    /// The sides, those of a group together and ascending, and where those of each leader begin.
    members: Vec<u32>,
    starts: Vec<u32>,
}

impl Groups {
    /// Groups so many sides by the first that each agrees with.
    fn find(&mut self, count: usize, mut first: impl FnMut(usize) -> Option<usize>) {
        if count == 1 {
            self.find_one();
            return;
        }
        self.leaders.clear();
        self.starts.clear();
        self.starts.resize(count + 1, 0);
        for number in 0..count {
            let leader = first(number).map_or(number as u32, |first| self.leaders[first]);
            self.leaders.push(leader);
            self.starts[leader as usize + 1] += 1;
        }
        for leader in 0..count {
            self.starts[leader + 1] += self.starts[leader];
        }
        self.members.clear();
        self.members.extend(0..count as u32);
        // Nearly in order as they are.
        self.members.sort_by_key(|&member| self.leaders[member as usize]);
    }

    /// [`Groups::find`] of one side.
    fn find_one(&mut self) {
        self.leaders.resize(1, 0);
        self.members.resize(1, 0);
        self.starts.resize(2, 0);
        (self.leaders[0], self.members[0]) = (0, 0);
        self.starts.copy_from_slice(&[0, 1]);
    }

    /// Those that a side leads, itself first; none where another leads it.
    fn of(&self, leader: usize) -> &[u32] {
        &self.members[self.starts[leader] as usize..self.starts[leader + 1] as usize]
    }
}

impl Blend {
    /// The row of a side, of `width` numbers.
    pub fn row(&self, side: usize, width: usize) -> &[f32] {
        &self.rows[side * width..][..width]
    }

    /// Finds the rows for a vertex at `x` about the middle; those of the end `at_end`, where it stands at one.
    ///
    /// # Errors
    /// [`Rejection::Texture`] where a face would turn over in the texture.
    pub fn place(
        &mut self,
        patch: &Patch<'_>,
        sides: &Sides,
        x: DVec3,
        at_end: Option<usize>,
    ) -> Result<(), Rejection> {
        let Some(wedges) = patch.wedges() else { return Ok(()) };
        let layout = wedges.layout;
        self.rows.resize(sides.sides.len() * layout.width, 0.0);
        self.nearest.resize(layout.width, 0.0);
        for (number, side) in sides.sides.iter().enumerate() {
            let row = &mut self.rows[number * layout.width..][..layout.width];
            if let Some(wedge) = at_end.and_then(|end| side.wedge(end)) {
                row.copy_from_slice(wedges.row(wedge));
                continue;
            }
            side.own(ENDS).take(1).for_each(|wedge| row.copy_from_slice(wedges.row(wedge)));
            if sides.apart || layout.has_others {
                nearest_row(patch, wedges, sides, sides.faces_of(number), x, row);
            }
            if !sides.apart {
                sides.write_least(number, x, past(layout, sides, side), row);
            }
            layout.layers.iter().for_each(|layer| restrict(layer, layer.of_mut(row)));
        }
        if sides.sides.len() > 1 && (at_end.is_none() || sides.yields) {
            self.mend(wedges, sides, at_end);
        }
        for layer in layout.of_kind(Kind::Texcoords) {
            self.group(wedges, sides, layer);
            for side in 0..sides.sides.len() {
                if !self.groups.of(side).is_empty() {
                    self.unfold(patch, wedges, sides, side, layer, (x, at_end))?;
                }
            }
        }
        Ok(())
    }

    /// Has the wedges of the ends become one on each side, with the rows that were found.
    pub fn write(&self, patch: &mut Patch<'_>, sides: &Sides, ends: &[u32], at_end: Option<usize>) {
        let Some(wedges) = patch.wedges_mut() else { return };
        let width = wedges.layout.width;
        let kept = (0..ends.len()).min_by_key(|&end| ends[end]).unwrap_or(0);
        for (number, side) in sides.sides.iter().enumerate() {
            let (row, from) = (self.row(number, width), at_end.and_then(|end| side.wedge(end)));
            // Where a seam ends both sides have one wedge there, and with it become one.
            let meets = |other: &&Side| {
                (0..ends.len()).any(|end| side.wedge(end).is_some_and(|own| other.wedge(end) == Some(own)))
            };
            // Sides of one end's wedge alone share none.
            let before = if number < sides.told { number } else { 0 };
            let met = sides.sides[..before].iter().find(meets).unwrap_or(side);
            let Some(onto) = met.wedge(kept).or_else(|| met.own(ends.len()).next()) else { continue };
            side.own(ends.len()).for_each(|wedge| wedges.write(wedge, row, from));
            side.own(ends.len()).filter(|&wedge| wedge != onto).for_each(|wedge| wedges.join(wedge, onto));
        }
    }

    /// Finds for each side the first with which it has been one as to a layer: they agree at the ends that both have. Sides
    /// of a seam that does not yield each have a place in the texture of their own.
    fn group(&mut self, wedges: &WedgeRows<'_>, sides: &Sides, layer: &Layer) {
        let may_agree = sides.yields || layer.origin != Origin::Texcoords;
        let agrees = |side: &Side, other: &Side| {
            let mut both = (0..ENDS).filter_map(|end| Some((side.wedge(end)?, other.wedge(end)?))).peekable();
            both.peek().is_some() && both.all(|(a, b)| layer.of(wedges.row(a)) == layer.of(wedges.row(b)))
        };
        self.groups.find(sides.sides.len(), |number| {
            let others = if may_agree { 0..number } else { 0..0 };
            others.into_iter().find(|&other| agrees(&sides.sides[number], &sides.sides[other]))
        });
    }

    /// What was the same on several sides of a seam stays the same: that of an end, where the vertex stands there.
    fn mend(&mut self, wedges: &WedgeRows<'_>, sides: &Sides, at_end: Option<usize>) {
        let layout = wedges.layout;
        for layer in &layout.layers {
            self.group(wedges, sides, layer);
            for leader in 0..sides.sides.len() {
                let Self { rows, nearest: shared, groups, .. } = self;
                let members = groups.of(leader);
                if members.len() < 2 {
                    continue;
                }
                let row = |side: u32| side as usize * layout.width..(side as usize + 1) * layout.width;
                let has_end = |side: u32, end: usize| sides.sides[side as usize].wedge(end).is_some();
                let first = at_end.and_then(|end| members.iter().copied().find(|&side| has_end(side, end)));
                shared.copy_from_slice(&rows[row(first.unwrap_or(leader as u32))]);
                let own = layer.of_mut(shared);
                if first.is_none() {
                    let mut weight = sides.weight(leader);
                    for &side in &members[1..] {
                        let other = sides.weight(side as usize);
                        let share = if weight + other > 0.0 { (other / (weight + other)) as f32 } else { 0.5 };
                        if !layer.kind.has_names() {
                            let numbers = layer.of(&rows[row(side)]);
                            own.iter_mut().zip(numbers).for_each(|(a, b)| *a = toward(*a, *b, share));
                        }
                        weight += other;
                    }
                    restrict(layer, own);
                }
                for &side in members {
                    layer.of_mut(&mut rows[row(side)]).copy_from_slice(own);
                }
            }
        }
    }

    /// Moves the place in a texture of a side, and of those that it leads, to where no surviving face turns over, and into the
    /// picture; an end's stays.
    fn unfold(
        &mut self,
        patch: &Patch<'_>,
        wedges: &WedgeRows<'_>,
        sides: &Sides,
        side: usize,
        layer: &Layer,
        (x, at_end): (DVec3, Option<usize>),
    ) -> Result<(), Rejection> {
        let Self { rows, nearest, groups, chart, .. } = self;
        let (width, members) = (wedges.layout.width, groups.of(side));
        let own_faces = || {
            members.iter().enumerate().flat_map(|(earlier, &member)| {
                sides.faces_first_of(member as usize, &members[..earlier]).map(move |face| (member as usize, face))
            })
        };
        let has_end = |side: u32, end: usize| sides.sides[side as usize].wedge(end).is_some();
        let stays = at_end.is_some_and(|end| members.iter().any(|&member| has_end(member, end)));
        let best = place(layer, &rows[side * width..]);
        // Where seams yield, vertices go far off their facets, and past the picture.
        let is_free = stays || sides.yields || sides.apart || layer.first >= wedges.layout.costed;
        // On the inside of a chart a place from which no face turns over lies among them.
        let is_near = || {
            let mut own = sides.sides[side].own(ENDS);
            own.any(|wedge| is_in_repeat_of(place(layer, wedges.row(wedge)), best, f64::from(layer.scale)))
        };
        if members.len() == 1
            && (is_free || sides.is_inside() || is_near())
            && all_keep(wedges, layer, sides.faces_of(side), best)
        {
            return Ok(());
        }
        chart.gather(wedges, layer, sides.sides.len(), own_faces());
        if chart.is_flat() {
            return Ok(());
        }
        let held = if is_free { best } else { rounded(chart.within_repeats(best, f64::from(layer.scale))) };
        let found = match Some(held).filter(|&at| chart.keeps(at)) {
            Some(at) => at,
            None if stays => return Err(Rejection::Texture),
            None => {
                nearest_row(patch, wedges, sides, own_faces().map(|(_, face)| face), x, nearest);
                Some(place(layer, nearest))
                    .filter(|&at| chart.keeps(at))
                    .or_else(|| chart.nearest(held))
                    .ok_or(Rejection::Texture)?
            }
        };
        if found != best {
            for &member in members {
                layer
                    .of_mut(&mut rows[member as usize * width..][..width])
                    .copy_from_slice(&found.as_vec2().to_array());
            }
        }
        Ok(())
    }
}

/// How far past those of a side's corners its numbers may be that are summed: past a thin face a linear function may be anything.
/// Those of one end alone have to reach out to the new vertex.
fn past<'a>(layout: &'a Layout, sides: &Sides, side: &Side) -> Past<'a> {
    let of = &layout.are_texcoords;
    match (side.is_alone(), sides.yields) {
        (true, _) => Past { of, times: 0.0, plus: PAST },
        (false, true) => Past { of, times: 0.0, plus: 0.0 },
        (false, false) => Past { of, times: NEAR, plus: 0.0 },
    }
}

/// The row at the point of faces that is nearest to `x`, the first of equals.
fn nearest_row<'a>(
    patch: &Patch<'_>,
    wedges: &WedgeRows<'_>,
    sides: &Sides,
    faces: impl Iterator<Item = &'a CornerFace>,
    x: DVec3,
    row: &mut [f32],
) {
    let found = faces.map(|face| (closest_point(x, sides.points(patch, face)), face));
    let Some((nearest, face)) = found.min_by(|(a, _), (b, _)| a.distance_sq.total_cmp(&b.distance_sq)) else { return };
    let weights = nearest.weights.map(|weight| weight as f32);
    let rows = face.wedges.map(|wedge| wedges.row(wedge));
    for layer in &wedges.layout.layers {
        between(layer, rows.map(|row| layer.of(row)), weights, layer.of_mut(row));
    }
}

/// The numbers of a layer between three corners.
fn between(layer: &Layer, rows: [&[f32]; 3], weights: [f32; 3], out: &mut [f32]) {
    let nearest = (0..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
    match layer.kind {
        Kind::Joints => return joints_between(rows, weights, out),
        Kind::Label => return out.copy_from_slice(rows[nearest]),
        _ => {}
    }
    for (i, out) in out.iter_mut().enumerate() {
        let sum = rows[0][i] * weights[0] + rows[1][i] * weights[1] + rows[2][i] * weights[2];
        // Weights may be past 1 by rounding.
        *out = sum.clamp(f32::MIN, f32::MAX);
    }
    if layer.kind == Kind::Tangent {
        out[3] = rows[nearest][3];
    }
    restrict(layer, out);
}

/// `share` of the way from a number to another, whose difference may be infinite.
fn toward(a: f32, b: f32, share: f32) -> f32 {
    let way = b - a;
    if way.is_finite() { a + way * share } else { a * (1.0 - share) + b * share }
}

/// Joints with their weights added up, the greatest of them, whose sum is 1.
fn joints_between(rows: [&[f32]; 3], weights: [f32; 3], out: &mut [f32]) {
    let count = out.len() / 2;
    let mut joints: Vec<(f32, f32)> = Vec::with_capacity(3 * count);
    for (row, weight) in rows.into_iter().zip(weights) {
        for (&joint, &share) in row[..count].iter().zip(&row[count..]) {
            match joints.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, sum)) => *sum += share * weight,
                None => joints.push((joint, share * weight)),
            }
        }
    }
    // By joint where they count the same, so that no order of faces shows.
    joints.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
    joints.resize(count, (0.0, 0.0));
    let sum: f32 = joints.iter().map(|(_, weight)| weight).sum();
    for (i, (joint, weight)) in joints.into_iter().enumerate() {
        let share = if sum > 0.0 { weight / sum } else { 0.0 };
        (out[i], out[count + i]) = (if share > 0.0 { joint } else { 0.0 }, share);
    }
}

/// Brings numbers back to what their kind allows.
fn restrict(layer: &Layer, numbers: &mut [f32]) {
    match layer.kind {
        Kind::Normal | Kind::Tangent => {
            let sign = numbers.get(3).map(|sign| if *sign < 0.0 { -layer.scale } else { layer.scale });
            let unit = Vec3::from_slice(numbers).normalize_or_zero() * layer.scale;
            numbers[..3].copy_from_slice(&unit.to_array());
            if let Some(sign) = sign {
                numbers[3] = sign;
            }
        }
        Kind::Color => numbers.iter_mut().for_each(|x| *x = x.clamp(0.0, layer.scale)),
        Kind::Luv => numbers[3] = numbers[3].clamp(0.0, layer.scale),
        Kind::Texcoords | Kind::Linear | Kind::Label | Kind::Joints => {}
    }
}
