//! One candidate on the current state: is it legal, and where does its vertex go.

use crate::kernel::contract_quadrics::contracted;
use crate::kernel::rows::{BORDER, JOINED, LOCKED, Position, SEAM};
use crate::kernel::weigh_quadrics::weighed;
use crate::math::DVec3;

use super::Metric;
use super::advance::{Advance, advance, away_from_faces, is_bent};
use super::blend::Blend;
use super::destination::{Attributed, Choice, Costs, Destination};
use super::filter::{Rejection, closed_link_condition, link_condition};
use super::patch::{Accumulated, Patch, Placed};
use super::placement::Quadric;
use super::retreat::{BELIEVED, RETREAT, believed_sq, retreat_sq};
use super::rules::Rules;
use super::seam_filter::seams_let;
use super::sides::Sides;
use super::star::Star;
use super::wedges::WedgeRows;

/// A pair that came to cost more than this many times what it did waits for the next round.
const OUTDATED: f64 = 2.0;
/// What distances to seams that yield count, as those to a border do. With 4, the factor of borders, images of a truck with
/// a tenth of its faces are 15 % farther off; with none the panes of its windows go first.
const SEAM_WEIGHT: f64 = 1.2;
/// The same of seams that hold, for where the vertex goes on them and not for what it costs, which nobody knew as the round
/// began. Without it seams wander over smooth surfaces, and textures retreat from their rims; with a quarter a map is up to 1.7
/// times as far off, and feline and pizza are 1 to 2 % nearer.
const HELD_SEAM_WEIGHT: f64 = 1.0;
/// What single precision leaves of the cost of a pair on a flat, of its weight times the squared half of its length: a slope of
/// 1e-4, below what a kernel's sums tell from none. A pair that costs less is neither dear, nor is its place better than an end
/// that is on the flat as well, which rounds nothing: new places off their flats made others dear, round after round.
const FLAT: f64 = 1e-8;

/// As [`BELIEVED`], for how far the new vertex is from what was there; the middles of new edges keep that one. With 1.5 boxes of an office
/// with a twentieth of their faces are 2.8 times as far off (RMS), with 3 an airplane at 1 % has a tip twice as far out.
const BELIEVED_OUT: f64 = 2.0;

/// What became of a candidate.
#[derive(Debug, Clone)]
pub enum Verdict {
    Accepted(Accepted),
    Rejected(Rejection),
    /// It costs as much, of which its quadric did not tell, in a round where none may wait: cheaper ones come first.
    Dearer(f32),
    /// Its faces reach out of the patch.
    Outside,
}

impl From<Rejection> for Verdict {
    fn from(rejection: Rejection) -> Self {
        Self::Rejected(rejection)
    }
}

/// A legal contraction.
#[derive(Debug, Clone)]
pub struct Accepted {
    pub placed: Placed,
    pub deviation: f32,
    pub faces_removed: usize,
    /// Sides opposite to the new vertex of faces that cancel each other out: see [`Star::cancel`]. Only where parts join.
    pub cancelled: Vec<[u32; 2]>,
    /// The end that the new vertex stands at.
    pub end: Option<usize>,
}

/// Examines candidates, with scratch that outlives each.
#[derive(Debug)]
pub struct Examiner {
    pub rules: Rules,
    pub star: Star,
    pub sides: Sides,
    pub blend: Blend,
    /// Whether a pair that became dear may wait for another round.
    pub may_wait: bool,
    /// The cost of the dearest candidate of the round.
    pub dearest: f32,
}

impl Examiner {
    /// Of a round in which a pair that became dear waits for another or, if it may not, is contracted.
    pub fn new(rules: Rules, may_wait: bool, dearest: f32) -> Self {
        Self { rules, star: Star::default(), sides: Sides::default(), blend: Blend::default(), may_wait, dearest }
    }

    /// What a pair may cost now of which `known` could be known as the round began. Seams that yield cost what nobody knew then:
    /// such a pair may cost what others of the round do.
    fn most_waiting(&self, known: f64) -> f64 {
        let most = known + self.sides.rounding();
        if self.sides.yields { most.max(f64::from(self.dearest)) } else { most }
    }

    /// The contraction of `u` and `w`, both free and in the patch, which cost `cost` as the round began.
    pub fn examine(&mut self, patch: &Patch<'_>, pair: [u32; 2], cost: f32) -> Verdict {
        let [pu, pw] = pair.map(|v| patch.position(v).xyz().as_dvec3());
        let h = (pw - pu) * 0.5;
        let middle = pu + h;
        if self.star.gather(pair, h, patch).is_err() {
            return Verdict::Outside;
        }
        self.judge(patch, pair, middle, cost).map_or_else(|verdict| verdict, Verdict::Accepted)
    }

    #[inline(always)]
    fn judge(&mut self, patch: &Patch<'_>, pair: [u32; 2], middle: DVec3, cost: f32) -> Result<Accepted, Verdict> {
        let (pu, pw) = (patch.position(pair[0]), patch.position(pair[1]));
        let stays_border = self.rules.locks_border && (pu.flags | pw.flags) & BORDER != 0;
        let may_join = (pu.flags | pw.flags) & JOINED != 0 && !stays_border;
        let joins = self.rules.joins && (may_join || self.star.shared().is_empty());
        if !self.rules.joins && (pu.flags | pw.flags) & (BORDER | LOCKED) == 0 {
            closed_link_condition(&self.star, pair[1])?;
        } else if !joins {
            link_condition(&self.star, pair[1], [pu.flags, pw.flags])?;
        } else if pu.flags & pw.flags & LOCKED != 0 {
            return Err(Rejection::Link.into());
        }
        seams_let(patch, pair, &self.star)?;
        self.sides.gather_pair(patch, pair, &self.star, middle);
        self.sides.find(patch, pair)?;
        self.star.locate(middle, patch);

        let weights = patch.weights(pair);
        let costs = self.costs(patch, pair, weights);
        let flat = FLAT * costs.geometry.weight() * self.star.h.length_squared();
        let was_flat = f64::from(cost) <= flat;
        let choice = self.choice(&costs, pair, middle, [pu, pw]);
        let by_planes = choice.by_planes(flat, was_flat);
        let total = choice.value(&by_planes).max(0.0);
        // Accumulated quadrics are the ends' own: no neighbor changes their cost.
        let weight = weights.map_or(1.0, |[first, second]| f64::from(first.max(second)));
        let (dear, known) = (weight * total, OUTDATED * f64::from(cost) + weight * flat);
        if self.may_wait && self.rules.metric == Metric::Volume && dear > known && dear > self.most_waiting(known) {
            return Err(Rejection::Outdated.into());
        }
        let cancelled = if joins { self.star.cancel(middle, patch) } else { Vec::new() };
        // Where no face is left nothing tells how far off that is. What may go is a matter of `small_parts`.
        if self.rules.keeps_walls && self.star.survivors() == 0 {
            return Err(Rejection::Link.into());
        }
        let is_on_border = |v: u32| patch.position(v).flags & BORDER != 0;
        if self.rules.locks_border && cancelled.iter().any(|side| side.iter().all(|&v| is_on_border(v))) {
            return Err(Rejection::Border.into());
        }
        // At borders lines hold what planes do not. Of a star without the faces that cancel each other out nobody knows what was there.
        let may_advance = (pu.flags | pw.flags) & BORDER == 0 && cancelled.is_empty() && self.asks_faces();
        let is_bent = may_advance && is_bent(&self.star, costs.geometry.normal());
        let off_sq = costs.off_planes_sq(by_planes.x);
        let limit_sq = believed_sq(&self.star, off_sq, BELIEVED);
        let away = if is_bent && by_planes.end.is_none() {
            away_from_faces(&self.star, by_planes.x, believed_sq(&self.star, off_sq, BELIEVED_OUT))
        } else {
            None
        };
        // Again: the star may have lost faces.
        let choice = self.choice(&costs, pair, middle, [pu, pw]);
        let goes = choice.that_holds(by_planes, away)?;
        let mut at = choice.at(&goes);
        let of_moved = if goes.x == by_planes.x { 0.0 } else { choice.value(&goes) };
        let Destination { mut x, mut end, out } = goes;
        let moved_to = at.as_dvec3() - middle;
        let mut retreat = self.retreat(moved_to, limit_sq);
        if self.rules.keeps_walls && !cancelled.is_empty() {
            retreat = retreat.max(height_of_walls(&cancelled, patch, at.as_dvec3()));
        }
        let out = if is_bent { out.max(advance(&self.star, pair, moved_to, limit_sq)) } else { Advance::default() };
        let mut unforeseen = (RETREAT * retreat * retreat * costs.geometry.weight()).max(out.cost).max(of_moved);
        if weight * unforeseen > known
            && (pu.flags | pw.flags) & BORDER != 0
            && cancelled.is_empty()
            && let Some(kept) = choice.end_that_is_kept(&goes, unforeseen)
        {
            (x, end, at) = (kept.place.x, kept.place.end, choice.at(&kept.place));
            (retreat, unforeseen) = (kept.retreat, kept.cost);
        }
        // In single precision, as costs are: what comes back with it costs that, and no more.
        let unforeseen_cost = (weight * unforeseen) as f32;
        if f64::from(unforeseen_cost) > known {
            match self.may_wait {
                true if unforeseen_cost > self.dearest => return Err(Rejection::Outdated.into()),
                false => return Err(Verdict::Dearer(unforeseen_cost)),
                true => {}
            }
        }

        let accumulated = match self.rules.metric {
            Metric::Plane => {
                let [first, second] = pair.map(|v| *patch.quadric(v));
                Accumulated::Planes(contracted(first, second, pu.xyz(), pw.xyz(), at))
            }
            Metric::Volume => {
                // The mean of a star for what retreats; for what goes out all of it: with as little thin plates were up to three times
                // as far off as estimated.
                let unforeseen_step = (RETREAT.sqrt() * retreat).max(out.distance);
                let step = off_planes(&costs.geometry, x).max(unforeseen_step as f32);
                Accumulated::Drift(patch.drift(pair[0], pair[1]) + step)
            }
        };
        let deviation = accumulated.deviation();
        if f64::from(deviation) > self.rules.max_deviation {
            return Err(Rejection::Error.into());
        }
        self.blend.place(patch, &self.sides, at.as_dvec3() - middle, end)?;
        let h = self.star.h;
        let t = match at {
            _ if at == pu.xyz() => 0.0,
            _ if at == pw.xyz() => 1.0,
            // Strictly inside: only a placement exactly at an end takes that end's own rows.
            _ => (((x + h).dot(h) / (2.0 * h.length_squared())) as f32).clamp(f32::EPSILON, 1.0 - f32::EPSILON),
        };
        let flags =
            if self.star.shared().is_empty() { JOINED } else { 0 } | if self.sides.tears { SEAM | LOCKED } else { 0 };
        let placed = Placed { x: at, t, accumulated, flags };
        let faces_removed = self.star.shared().len() + cancelled.len();
        Ok(Accepted { placed, deviation, faces_removed, cancelled, end })
    }

    /// Whether faces are asked for what planes do not tell.
    fn asks_faces(&self) -> bool {
        self.rules.metric == Metric::Volume && !self.star.shared().is_empty()
    }

    /// How far an end comes to lie from the new faces with the vertex at `x`, where the quadric does not tell; 0 elsewhere.
    fn retreat(&self, x: DVec3, limit_sq: f64) -> f64 {
        if self.asks_faces() { retreat_sq(&self.star, x, limit_sq).map_or(0.0, f64::sqrt) } else { 0.0 }
    }

    /// What a pair costs, whose sides are found.
    fn costs(&mut self, patch: &Patch<'_>, pair: [u32; 2], weights: Option<[f32; 2]>) -> Costs {
        let flags = pair.map(|v| patch.position(v).flags);
        let on_border = (flags[0] | flags[1]) & BORDER != 0;
        let geometry = self.quadric(patch, pair, on_border, weights);
        if patch.wedges().is_none() {
            return Costs { geometry, attributed: None };
        }
        let mut with_least = geometry;
        self.sides.add_to(patch, &self.star, &mut with_least);
        if self.sides.yields && (flags[0] | flags[1]) & SEAM != 0 {
            self.sides.add_seams(patch, pair, &mut with_least, SEAM_WEIGHT);
        }
        let mut placing = with_least;
        let decides = |rows: &WedgeRows<'_>| rows.layout.costed > 0;
        if flags[0] & flags[1] & SEAM != 0 && !self.sides.yields && patch.wedges().is_some_and(decides) {
            self.sides.add_seams(patch, pair, &mut placing, HELD_SEAM_WEIGHT);
        }
        Costs { geometry, attributed: Some(Attributed { with_least, placing }) }
    }

    /// What decides where the vertex of a pair goes.
    fn choice<'a>(&'a self, costs: &'a Costs, pair: [u32; 2], middle: DVec3, ends: [Position; 2]) -> Choice<'a> {
        let Self { rules, star, sides, .. } = self;
        let are_locked = ends.map(|end| end.flags & LOCKED != 0);
        let is_last = !self.may_wait && rules.metric == Metric::Volume;
        Choice { rules, star, sides, costs, pair, middle, ends: ends.map(|end| end.xyz()), are_locked, is_last }
    }

    /// The pair's quadric about its midpoint, on the current state. Weights of the round change where the least of
    /// accumulated quadrics is, and nothing of the star's.
    fn quadric(&self, patch: &Patch<'_>, pair: [u32; 2], on_border: bool, weights: Option<[f32; 2]>) -> Quadric {
        match self.rules.metric {
            Metric::Plane => {
                let mut quadric = Quadric::default();
                let [first, second] = pair.map(|v| *patch.quadric(v));
                let [first, second] = match weights {
                    Some([by_first, by_second]) => [weighed(first, by_first), weighed(second, by_second)],
                    None => [first, second],
                };
                quadric.add_plane_quadric(&first, -self.star.h);
                quadric.add_plane_quadric(&second, self.star.h);
                quadric
            }
            Metric::Volume => {
                let mut quadric = Quadric::of_star(&self.star);
                if on_border {
                    quadric.free_volume();
                    let weight = self.rules.border_weight;
                    self.star.for_each_border_edge(pair, |from, to| quadric.add_border(to - from, from, weight));
                }
                quadric
            }
        }
    }
}

/// The greatest of the least heights of faces that cancel each other out with one that runs the other way: so far what is in them
/// comes to lie from what is left, if only at their sides.
fn height_of_walls(cancelled: &[[u32; 2]], patch: &Patch<'_>, at: DVec3) -> f64 {
    let walls = cancelled.iter().filter(|&&[v1, v2]| v1 < v2 && cancelled.contains(&[v2, v1]));
    let height = |&[v1, v2]: &[u32; 2]| {
        let [to_v1, to_v2] = [v1, v2].map(|v| patch.position(v).xyz().as_dvec3() - at);
        let longest_sq = [to_v1, to_v2, to_v2 - to_v1].map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
        if longest_sq > 0.0 { to_v1.cross(to_v2).length() / longest_sq.sqrt() } else { 0.0 }
    };
    walls.map(height).fold(0.0, f64::max)
}

/// The root of the weighted mean squared distance of `x` to what a pair's quadric stands for: planes, and border edges.
fn off_planes(quadric: &Quadric, x: DVec3) -> f32 {
    (quadric.value(x).max(0.0) / quadric.weight()).sqrt() as f32
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::prepare::prepare;
    use super::super::surface::Surface;
    use super::*;
    use crate::backend::Device;
    use crate::mesh::shapes;

    #[test]
    fn the_step_of_a_pair_is_added_to_the_greater_drift_of_its_ends() {
        let options = Options::default();
        let mut prepared = prepare(&shapes::icosphere(2), &options).expect("a valid mesh");
        let (start, device) = (prepared.take_start(), Device::cpu(1).expect("a device"));
        let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
        let [u, w, _] = surface.faces.host()[0].corners();
        let mut deviation_after = |drifts: [f32; 2]| {
            prepared.carried.drift[u as usize] = drifts[0];
            prepared.carried.drift[w as usize] = drifts[1];
            let patch = Patch::whole(&mut surface, &mut prepared.carried);
            let mut examiner = Examiner::new(Rules::new(&options, false, f64::INFINITY), false, 0.0);
            match examiner.examine(&patch, [u, w], 0.0) {
                Verdict::Accepted(Accepted { placed, deviation, .. }) => {
                    assert_eq!(placed.accumulated.deviation(), deviation);
                    deviation
                }
                refused => panic!("{refused:?}"),
            }
        };
        let step = deviation_after([0.0, 0.0]);
        // Edges are about 1 long in the frame, and this sphere bends by a seventh of that over two.
        assert!((1e-3..0.2).contains(&step), "{step}");
        assert_eq!([[1.0, 0.0], [0.5, 2.0]].map(&mut deviation_after), [1.0 + step, 2.0 + step]);
    }
}
