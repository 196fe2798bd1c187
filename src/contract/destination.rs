//! Where the vertex of a pair goes: where it costs least, unless planes do not tell how far out that is, or faces fold there.

use crate::math::{DVec3, Vec3};

use super::Placement;
use super::advance::{Advance, Away, drawn_back, leaving_crease};
use super::filter::{Rejection, shapes_hold};
use super::placement::Quadric;
use super::retreat::{BELIEVED, RETREAT, believed_sq, retreat_sq};
use super::rules::Rules;
use super::sides::Sides;
use super::star::Star;

/// How much less a vertex is drawn back than it should be, in turn, until faces hold. All or nothing left an airplane with a tip that
/// was 1.2 times as far out.
const LESS: [f64; 4] = [0.0, 0.25, 0.5, 0.75];

/// Up to which share of what a pair costs whose rim retreats one costs that keeps an end of it where it is: half as far off. With half
/// of the cost four meshes of few faces are up to 1.08 times as far off (RMS); away from borders, with a tenth to half, a tray and an
/// engine with hardly more faces than their parts need are up to 2.4 times.
const KEPT: f64 = 0.25;

/// What a pair costs about its middle, on the current state.
#[derive(Debug)]
pub struct Costs {
    /// Without attributes.
    pub geometry: Quadric,
    /// Where there are any.
    pub attributed: Option<Attributed>,
}

/// The same with attributes.
#[derive(Debug)]
pub struct Attributed {
    /// With the numbers of the new wedges that are best at every place.
    pub with_least: Quadric,
    /// What the new vertex is placed by.
    pub placing: Quadric,
}

impl Costs {
    fn with_least(&self) -> &Quadric {
        self.attributed.as_ref().map_or(&self.geometry, |costs| &costs.with_least)
    }

    fn placing(&self) -> &Quadric {
        self.attributed.as_ref().map_or(&self.geometry, |costs| &costs.placing)
    }

    /// The mean squared distance of `x` from the planes of the pair's star, as its quadric tells.
    pub fn off_planes_sq(&self, x: DVec3) -> f64 {
        self.geometry.value(x).max(0.0) / self.geometry.weight()
    }
}

/// Where the vertex of a pair goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Destination {
    /// About the pair's middle.
    pub x: DVec3,
    /// The end that it stands at, whose attributes it keeps.
    pub end: Option<usize>,
    /// How far it goes from the old faces, where that is known already.
    pub out: Advance,
}

/// The end that a pair keeps.
#[derive(Debug, Clone, Copy)]
pub struct Kept {
    pub place: Destination,
    /// How far the other end comes to lie from the faces that are left.
    pub retreat: f64,
    /// What all of that costs, in the units of a quadric.
    pub cost: f64,
}

/// A pair whose vertex is to be placed.
#[derive(Debug)]
pub struct Choice<'a> {
    pub rules: &'a Rules,
    pub star: &'a Star,
    pub sides: &'a Sides,
    pub costs: &'a Costs,
    pub pair: [u32; 2],
    /// Of the pair, in the normalized frame.
    pub middle: DVec3,
    /// Where the ends stand, to the bit.
    pub ends: [Vec3; 2],
    /// Whether either end has to stay.
    pub are_locked: [bool; 2],
    /// Whether no pair may wait for a better one.
    pub is_last: bool,
}

impl Choice<'_> {
    /// The place of an end.
    fn end(&self, end: usize) -> Destination {
        let h = self.star.h;
        Destination { x: if end == 0 { -h } else { h }, end: Some(end), out: Advance::default() }
    }

    /// A place, which may be that of an end.
    fn place(&self, x: DVec3) -> Destination {
        let h = self.star.h;
        let end = if x == h { Some(1) } else { (x == -h).then_some(0) };
        Destination { x, end, out: Advance::default() }
    }

    /// What a place rounds to; an end to the bit, whose difference may have been rounded.
    pub fn at(&self, place: &Destination) -> Vec3 {
        place.end.map_or_else(|| (self.middle + place.x).as_vec3(), |end| self.ends[end])
    }

    /// What the pair costs with the vertex at a place; at an end, with the numbers of that.
    pub fn value(&self, place: &Destination) -> f64 {
        let value = self.costs.with_least().value(place.x);
        place.end.map_or(value, |end| value + self.sides.at_end(end, self.star.h))
    }

    /// Whether the vertex may go anywhere.
    fn is_free(&self) -> bool {
        !self.are_locked[0] && !self.are_locked[1] && self.sides.fixed.is_none()
    }

    /// The end that costs less, then the other.
    fn ends_by_cost(&self) -> [Destination; 2] {
        let [first, second] = [0, 1].map(|end| self.end(end));
        if self.value(&second) < self.value(&first) { [second, first] } else { [first, second] }
    }

    /// The end that is on the same flat as everything around the pair.
    fn flat_end(&self, flat: f64) -> Option<Destination> {
        let [end, _] = self.ends_by_cost();
        (self.value(&end) <= flat).then_some(end)
    }

    /// Where the vertex goes by planes. Costs below `flat` are none; where the pair `was_flat` as the round began, an end is likely to
    /// do, and is asked first.
    #[inline]
    pub fn by_planes(&self, flat: f64, was_flat: bool) -> Destination {
        let h = self.star.h;
        if was_flat
            && self.is_free()
            && let Some(end) = self.flat_end(flat)
        {
            return end;
        }
        let placement = if self.sides.at_an_end { Placement::Endpoint } else { self.rules.placement };
        let placing = self.costs.placing();
        let place = match (self.are_locked, self.sides.fixed, placement) {
            ([false, false], None, Placement::Optimal) => self.place(placing.least(h, self.rules.regularization)),
            ([false, false], None, Placement::Segment) => self.place(placing.least_between(h)),
            ([false, false], None, Placement::EndpointOrMiddle) => self.place(placing.least_of(&[-h, h, DVec3::ZERO])),
            ([false, false], None, Placement::Endpoint) => self.ends_by_cost()[0],
            ([false, _], None, _) | (_, Some(1), _) => self.end(1),
            _ => self.end(0),
        };
        if place.end.is_none() && self.costs.with_least().value(place.x) <= flat {
            return self.flat_end(flat).unwrap_or(place);
        }
        place
    }

    /// Where the vertex goes that is at `place` by planes, so far `away` from the old faces, if faces keep their shapes there.
    ///
    /// It is drawn back, as planes do not tell how far out it is, or less so where faces fold there: what has few faces left would keep
    /// them, and others go for it. So it would where they fold wherever it goes; where no pair may wait for a better one an end does
    /// then, too.
    #[inline]
    pub fn that_holds(&self, place: Destination, away: Option<Away>) -> Result<Destination, Rejection> {
        let place = match away.map(|away| self.drawn_back(place, away)) {
            Some(Ok(drawn)) => return Ok(drawn),
            Some(Err(place)) => place,
            None => place,
        };
        match self.holds(&place) {
            Err(refused) if self.is_last && self.is_free() => self.end_that_holds(place.end).ok_or(refused),
            held => held.map(|()| place),
        }
    }

    /// The place as far back as faces hold; where they fold all of the way, itself, as far out as it is.
    #[cold]
    fn drawn_back(&self, place: Destination, away: Away) -> Result<Destination, Destination> {
        let length = 2.0 * self.star.h.length();
        let (x, distance) = drawn_back(self.costs.placing(), length, place.x, away);
        let at = |less: f64| {
            let out = Advance::of(length, distance + (away.distance - distance) * less);
            Destination { out, ..self.place(x.lerp(place.x, less)) }
        };
        let drawn = LESS.into_iter().map(at).find(|drawn| self.holds(drawn).is_ok());
        drawn.ok_or(Destination { out: Advance::of(length, away.distance), ..place })
    }

    /// The cheapest end at which faces hold, but for one at which they do not.
    #[cold]
    fn end_that_holds(&self, folds: Option<usize>) -> Option<Destination> {
        let mut ends = self.ends_by_cost().into_iter().filter(|end| end.end != folds);
        let end = ends.find(|end| self.holds(end).is_ok())?;
        let left = usize::from(end.end == Some(0));
        Some(Destination { out: leaving_crease(self.star, self.pair, left), ..end })
    }

    /// The cheaper end to keep, for a pair that costs as much with its vertex at `place`, for its rim would retreat: the tip of a strip
    /// that tapers, along which planes and lines of the border hold nothing.
    #[cold]
    pub fn end_that_is_kept(&self, place: &Destination, cost: f64) -> Option<Kept> {
        if place.end.is_some() || !self.is_free() {
            return None;
        }
        let ends = self.ends_by_cost().into_iter().filter(|end| self.holds(end).is_ok()).map(|place| {
            let x = self.at(&place).as_dvec3() - self.middle;
            let limit_sq = believed_sq(self.star, self.costs.off_planes_sq(place.x), BELIEVED);
            let retreat = retreat_sq(self.star, x, limit_sq).map_or(0.0, f64::sqrt);
            let cost = (RETREAT * retreat * retreat * self.costs.geometry.weight()).max(self.value(&place));
            Kept { place, retreat, cost }
        });
        ends.filter(|kept| kept.cost < KEPT * cost).min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Whether faces keep their shapes with the vertex at a place.
    #[inline]
    fn holds(&self, place: &Destination) -> Result<(), Rejection> {
        shapes_hold(self.star, self.at(place).as_dvec3() - self.middle, self.rules.limits)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::advance::away_from_faces;
    use super::super::retreat::tests::for_each_pair;
    use super::*;
    use crate::mesh::{Mesh, shapes};

    /// A plane with vertices pushed about, so that faces around many a pair fold at one of its ends.
    fn rough() -> Mesh {
        let mut mesh = shapes::plane(9, 9);
        for (v, p) in mesh.positions.iter_mut().enumerate() {
            let v = v as f64;
            *p += DVec3::new((7.0 * v).sin(), (11.0 * v).sin(), 2.0 * (5.0 * v).sin()) * 0.45;
        }
        mesh
    }

    /// Tells the choice of every pair of a mesh, about its middle, and up to which squared distance planes are believed.
    fn for_each_choice(mesh: &Mesh, are_locked: [bool; 2], is_last: bool, mut tell: impl FnMut(&Choice<'_>, f64)) {
        let rules = Rules::new(&Options::default(), false, f64::INFINITY);
        let sides = Sides::default();
        for_each_pair(mesh, |star, _, pair, limit_sq| {
            let costs = Costs { geometry: Quadric::of_star(star), attributed: None };
            let ends = [-star.h, star.h].map(|end| end.as_vec3());
            let (rules, sides, costs) = (&rules, &sides, &costs);
            tell(&Choice { rules, star, sides, costs, pair, middle: DVec3::ZERO, ends, are_locked, is_last }, limit_sq);
        });
    }

    /// A place beside a pair where faces fold, if they do, and why it is refused.
    fn folded(choice: &Choice<'_>) -> Option<(Destination, Rejection)> {
        let place = choice.place(DVec3::X * 20.0 * choice.star.h.length());
        choice.holds(&place).err().map(|rejection| (place, rejection))
    }

    /// How far an end is from the crease that it leaves, where the vertex goes to the other.
    fn left(choice: &Choice<'_>, taken: &Destination) -> Advance {
        leaving_crease(choice.star, choice.pair, 1 - taken.end.expect("an end"))
    }

    #[test]
    fn where_faces_fold_the_cheaper_end_that_holds_is_taken_in_a_last_round_alone() {
        let (mut first, mut second, mut refused, mut left_crease) = (0, 0, 0, 0);
        for_each_choice(&rough(), [false; 2], true, |choice, _| {
            let Some((place, why)) = folded(choice) else { return };
            let ends = choice.ends_by_cost();
            assert!(choice.value(&ends[0]) <= choice.value(&ends[1]));
            match choice.that_holds(place, None) {
                Ok(taken) => {
                    assert!(choice.holds(&taken).is_ok());
                    assert_eq!(taken.out, left(choice, &taken));
                    left_crease += u32::from(taken.out.distance > 0.0);
                    if taken.end == ends[0].end {
                        first += 1;
                    } else {
                        assert!(taken.end == ends[1].end && choice.holds(&ends[0]).is_err());
                        second += 1;
                    }
                }
                Err(rejection) => {
                    assert_eq!(rejection, why);
                    assert!(ends.iter().all(|end| choice.holds(end).is_err()));
                    refused += 1;
                }
            }
        });
        let counts = [first, second, refused, left_crease];
        assert!(counts.iter().all(|&count| count > 0), "{counts:?}");
        for (are_locked, is_last) in [([true, false], true), ([false, true], true), ([false; 2], false)] {
            for_each_choice(&rough(), are_locked, is_last, |choice, _| {
                let Some((place, why)) = folded(choice) else { return };
                assert_eq!(choice.that_holds(place, None), Err(why));
            });
        }
    }

    /// A strip of so many steps that bends and comes to a point.
    fn blade(steps: u32) -> Mesh {
        let along = |step: u32| f64::from(step) / f64::from(steps);
        let side =
            |step: u32, side: f64| DVec3::new(side * (1.0 - along(step)), 20.0 * along(step), along(step).powi(2));
        let mut mesh = Mesh::default();
        mesh.positions.extend((0..steps).flat_map(|step| [side(step, -1.0), side(step, 1.0)]));
        mesh.positions.push(side(steps, 0.0));
        for [a, b, c, d] in (0..steps - 1).map(|step| [0, 1, 2, 3].map(|v| 2 * step + v)) {
            mesh.faces.extend([[a, b, c], [c, b, d]]);
        }
        mesh.faces.push([2 * steps - 2, 2 * steps - 1, 2 * steps]);
        mesh
    }

    #[test]
    fn where_a_rim_retreats_the_end_that_costs_least_is_kept() {
        let (mesh, mut kept_ends) = (blade(12), [0; 2]);
        for are_locked in [[false; 2], [true, false]] {
            for_each_choice(&mesh, are_locked, false, |choice, _| {
                let place = choice.place(DVec3::ZERO);
                let cost = |end: usize| {
                    let end = choice.end(end);
                    let limit_sq = believed_sq(choice.star, choice.costs.off_planes_sq(end.x), BELIEVED);
                    let retreat_sq = retreat_sq(choice.star, end.x, limit_sq).unwrap_or(0.0);
                    let cost = choice.value(&end).max(RETREAT * retreat_sq * choice.costs.geometry.weight());
                    if choice.holds(&end).is_ok() { cost } else { f64::INFINITY }
                };
                let costs = [0, 1].map(cost);
                let least = costs[0].min(costs[1]);
                if least.is_infinite() {
                    return;
                }
                let kept = |times: f64| choice.end_that_is_kept(&place, times * least + f64::MIN_POSITIVE);
                match kept(4.1) {
                    Some(Kept { place, cost, .. }) => {
                        assert_eq!(are_locked, [false; 2]);
                        let end = place.end.expect("an end");
                        assert!(cost < 1.001 * least && costs[end] < 1.001 * least, "{cost} of {costs:?}");
                        kept_ends[end] += 1;
                    }
                    None => assert!(are_locked[0], "{costs:?}"),
                }
                assert!(kept(3.9).is_none());
                let at_end = choice.end_that_is_kept(&choice.end(0), f64::INFINITY);
                assert!(at_end.is_none());
            });
        }
        assert!(kept_ends.iter().all(|&count| count > 0), "{kept_ends:?}");
    }

    #[test]
    fn an_end_at_which_faces_fold_gives_way_to_the_other() {
        let mut taken = 0;
        for is_last in [false, true] {
            for_each_choice(&rough(), [false; 2], is_last, |choice, _| {
                let ends = choice.ends_by_cost();
                if choice.holds(&ends[0]).is_err() && choice.holds(&ends[1]).is_ok() {
                    let found = choice.that_holds(ends[0], None);
                    assert_eq!(found.ok().map(|found| found.end), is_last.then_some(ends[1].end));
                    taken += u32::from(is_last);
                }
            });
        }
        assert!(taken > 0);
    }

    #[test]
    fn a_vertex_is_drawn_back_unless_faces_fold_there_and_counts_how_far_out_it_is() {
        let (mut drawn, mut less, mut stayed, mut at_end) = (0, 0, 0, 0);
        let mut look = |choice: &Choice<'_>, limit_sq: f64| {
            let length = 2.0 * choice.star.h.length();
            for axis in DVec3::AXES.into_iter().chain([-DVec3::X, -DVec3::Y, -DVec3::Z]) {
                let place = choice.place(choice.star.h + axis * length);
                let Some(away) = away_from_faces(choice.star, place.x, limit_sq) else { continue };
                let (x, distance) = drawn_back(choice.costs.placing(), length, place.x, away);
                match choice.that_holds(place, Some(away)) {
                    Ok(found) if found.x == x => {
                        assert_eq!(found.out, Advance::of(length, distance));
                        assert_eq!(found, Destination { out: found.out, ..choice.place(x) });
                        drawn += u32::from(x != place.x);
                        at_end += u32::from(found.end.is_some());
                    }
                    Ok(found) => {
                        assert!(choice.holds(&choice.place(x)).is_err() && choice.holds(&found).is_ok());
                        let share = (found.x - x).length() / (place.x - x).length();
                        let out = Advance::of(length, distance + (away.distance - distance) * share);
                        assert!((found.out.distance / out.distance - 1.0).abs() < 1e-9, "{found:?}, {out:?}");
                        for step in LESS.into_iter().filter(|step| *step < share - 1e-9) {
                            assert!(choice.holds(&choice.place(x.lerp(place.x, step))).is_err(), "{step} {share}");
                        }
                        less += u32::from(share < 0.99);
                        stayed += u32::from(found.x == place.x);
                    }
                    Err(_) => assert!(choice.holds(&place).is_err() && choice.holds(&choice.place(x)).is_err()),
                }
            }
        };
        for mesh in [shapes::cube(4), rough()] {
            for_each_choice(&mesh, [false; 2], false, &mut look);
        }
        assert!(drawn > 0 && at_end > 0 && less > 0 && stayed > 0, "{drawn}, {at_end}, {less}, {stayed}");
    }
}
