//! The light in a room whose surfaces reflect alike in all directions: radiosity by progressive refinement.
//!
//! Coarse patches exchange light until little is left to send; what reaches a point straight from a lamp is found for each
//! point by itself, so that shadows are as sharp as the lamps are small. Only operations that round correctly, in a fixed order:
//! the same bits everywhere.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::scene::{Cuboid, Panel, middles};
use crate::math::DVec3;

/// Light that was not sent on yet when the exchange ends, as a share of what the lamps light up.
const LEFT: f64 = 1e-3;
/// Patches that send at most, as a multiple of their number: more than any scene here takes.
const MOST_SENT: usize = 50;
/// The length of a lamp that one sample stands for, and the most samples along a side.
const LAMP_STEP: f64 = 0.16;
const MOST_LAMP_SAMPLES: usize = 8;
/// Receiving points stand off their surface by this, in model units.
const OFF: f64 = 1e-6;

/// A piece of a panel that light falls on or comes from.
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    pub point: DVec3,
    pub normal: DVec3,
    pub area: f64,
}

/// The share of the light leaving `a` that a unit of the area of `b` gets: cos θ cos θ' / (π r² + A).
///
/// The form factor from a point to a disc, F_ij = cos θ cos θ' A_j / (π r² + A_j) \[Liu99\], but with the mean of both areas
/// below: the same for equal patches, and A_i F_ij = A_j F_ji for all.
pub fn exchange(a: &Patch, b: &Patch) -> f64 {
    let way = b.point - a.point;
    let (out, into) = (a.normal.dot(way), -b.normal.dot(way));
    if out > 0.0 && into > 0.0 {
        let r_sq = way.length_squared();
        out * into / (r_sq * (PI * r_sq + 0.5 * (a.area + b.area)))
    } else {
        0.0
    }
}

/// The share of a ray that may lie in a box: its ends may be on the surface.
const TOUCH: f64 = 1e-9;
/// Boxes listed one after the other that a ray misses together: a desk and what is on it.
const GROUP: usize = 6;

/// The corners of a box.
type Bounds = (DVec3, DVec3);

/// What stands in the way of light: boxes, and those that hold each [`GROUP`] of them.
#[derive(Debug)]
pub struct Obstacles(Vec<(Bounds, Vec<Bounds>)>);

impl Obstacles {
    pub fn new(boxes: &[Cuboid]) -> Self {
        let boxes: Vec<Bounds> =
            boxes.iter().filter(|cuboid| !cuboid.is_room).map(|cuboid| (cuboid.low, cuboid.high)).collect();
        let around = |group: &[Bounds]| {
            let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let hull = group.iter().fold(nothing, |hull, bounds| (hull.0.min(bounds.0), hull.1.max(bounds.1)));
            (hull, group.to_vec())
        };
        Self(boxes.chunks(GROUP).map(around).collect())
    }

    /// Whether nothing is between two points, either way. Touching a box does not count.
    pub fn is_clear(&self, a: DVec3, b: DVec3) -> bool {
        // Rounding would tell what grazes a box apart by direction.
        let (from, to) = if a.to_array() < b.to_array() { (a, b) } else { (b, a) };
        let inverse = (to - from).recip();
        let meets = |&(low, high): &Bounds| {
            // On a plane of the box that it runs along, 0·∞ is no number: `max` and `min` pass over those.
            let (near, far) = ((low - from) * inverse, (high - from) * inverse);
            let enter = near.x.min(far.x).max(near.y.min(far.y)).max(near.z.min(far.z)).max(0.0);
            let leave = near.x.max(far.x).min(near.y.max(far.y)).min(near.z.max(far.z)).min(1.0);
            enter + TOUCH < leave
        };
        !self.0.iter().any(|(hull, group)| meets(hull) && group.iter().any(meets))
    }
}

/// A scene with the light in it.
#[derive(Debug)]
pub struct Solution {
    obstacles: Obstacles,
    lamps: Vec<(Patch, DVec3)>,
    /// The patches of every panel, in the order of the boxes.
    grids: Vec<[usize; 2]>,
    starts: Vec<usize>,
    /// What every patch gives back of the light that other surfaces reflect to it.
    indirect: Vec<DVec3>,
}

impl Solution {
    /// Solves for the light with patches of about `step`.
    pub fn new(boxes: &[Cuboid], step: f64) -> Self {
        let panels: Vec<Panel> = boxes.iter().flat_map(Cuboid::panels).collect();
        let grids: Vec<[usize; 2]> = panels.iter().map(|panel| panel.counts(step)).collect();
        let mut starts = vec![0];
        starts.extend(grids.iter().scan(0, |end, [columns, rows]| {
            *end += columns * rows;
            Some(*end)
        }));
        let shining = panels.iter().filter(|panel| panel.light != DVec3::ZERO);
        let lamps = shining.flat_map(|panel| {
            let counts = panel.size().map(|length| ((length / LAMP_STEP).ceil() as usize).clamp(1, MOST_LAMP_SAMPLES));
            cut(panel, counts).map(|patch| (patch, panel.light))
        });
        let mut solution =
            Self { obstacles: Obstacles::new(boxes), lamps: lamps.collect(), grids, starts, indirect: Vec::new() };
        let of_panels = || panels.iter().zip(&solution.grids);
        let patches: Vec<Patch> = of_panels().flat_map(|(panel, &counts)| cut(panel, counts)).collect();
        let reflectances: Vec<DVec3> =
            of_panels().flat_map(|(panel, &[columns, rows])| vec![panel.reflectance; columns * rows]).collect();
        let lit = |(patch, &reflectance): (&Patch, &DVec3)| reflectance * solution.direct(patch.point, patch.normal);
        let lit = patches.par_iter().zip(&reflectances).map(lit).collect();
        solution.indirect = spread(&patches, &reflectances, &solution.obstacles, lit);
        solution
    }

    /// The light of a cell of a panel: of its own, straight from the lamps, and by way of other surfaces. `panel` is the
    /// place of the panel among those of all boxes.
    pub fn light(&self, index: usize, panel: &Panel, at: [f64; 2]) -> DVec3 {
        panel.light + panel.reflectance * self.direct(panel.at(at), panel.normal) + self.interpolated(index, at)
    }

    /// What reaches a point straight from the lamps.
    fn direct(&self, point: DVec3, normal: DVec3) -> DVec3 {
        let point = point + normal * OFF;
        let mut sum = DVec3::ZERO;
        for (lamp, light) in &self.lamps {
            // The receiver has no area of its own: the point-to-disc form as it stands.
            let here = Patch { point, normal, area: lamp.area };
            let share = exchange(&here, lamp);
            if share > 0.0 && self.obstacles.is_clear(point, lamp.point) {
                sum += *light * (share * lamp.area);
            }
        }
        sum
    }

    /// Between the middles of the four patches around a place of a panel.
    fn interpolated(&self, panel: usize, [s, t]: [f64; 2]) -> DVec3 {
        let [columns, rows] = self.grids[panel];
        let along = |s: f64, count: usize| {
            let place = (s * count as f64 - 0.5).clamp(0.0, (count - 1) as f64);
            let first = (place as usize).min(count.saturating_sub(2));
            (first, (first + 1).min(count - 1), place - first as f64)
        };
        let ((left, right, x), (low, high, y)) = (along(s, columns), along(t, rows));
        let patch = |column: usize, row: usize| self.indirect[self.starts[panel] + row * columns + column];
        let row = |row: usize| patch(left, row) + (patch(right, row) - patch(left, row)) * x;
        row(low) + (row(high) - row(low)) * y
    }
}

/// The cells of a panel.
fn cut(panel: &Panel, [columns, rows]: [usize; 2]) -> impl Iterator<Item = Patch> {
    let area = panel.area() / (columns * rows) as f64;
    middles([columns, rows]).map(move |at| Patch { point: panel.at(at), normal: panel.normal, area })
}

/// What all patches give back once `lit`, the light they give back first, has been sent on and on, without `lit` itself.
///
/// The patch with the most light to send goes first \[Liu99\].
fn spread(patches: &[Patch], reflectances: &[DVec3], obstacles: &Obstacles, lit: Vec<DVec3>) -> Vec<DVec3> {
    let flux = |(patch, light): (&Patch, &DVec3)| patch.area * light.element_sum();
    let mut unsent = lit;
    let enough = LEFT * patches.iter().zip(&unsent).map(flux).sum::<f64>();
    let mut gathered = vec![DVec3::ZERO; patches.len()];
    let mut rows: Vec<Option<Vec<f64>>> = vec![None; patches.len()];
    for _ in 0..MOST_SENT * patches.len() {
        let fluxes = || patches.iter().zip(&unsent).map(flux);
        let Some((sender, _)) = fluxes().enumerate().reduce(|best, next| if next.1 > best.1 { next } else { best })
        else {
            break;
        };
        if fluxes().sum::<f64>() <= enough {
            break;
        }
        let light = std::mem::take(&mut unsent[sender]);
        let row = rows[sender].get_or_insert_with(|| factors(sender, patches, obstacles));
        for (j, &factor) in row.iter().enumerate() {
            let given = reflectances[j] * light * factor;
            gathered[j] += given;
            unsent[j] += given;
        }
    }
    gathered
}

/// The form factor from every patch to this one.
pub fn factors(to: usize, patches: &[Patch], obstacles: &Obstacles) -> Vec<f64> {
    let to = &patches[to];
    let factor = |from: &Patch| {
        let share = exchange(from, to);
        let seen = || obstacles.is_clear(from.point + from.normal * OFF, to.point + to.normal * OFF);
        if share > 0.0 && seen() { share * to.area } else { 0.0 }
    };
    patches.par_iter().with_min_len(64).map(factor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room() -> Cuboid {
        Cuboid { is_room: true, ..Cuboid::new([0.0; 3], [4.0, 3.0, 2.5], [0.5; 3]) }
    }

    fn patches(cuboid: &Cuboid, step: f64) -> Vec<Patch> {
        cuboid.panels().iter().flat_map(|panel| cut(panel, panel.counts(step)).collect::<Vec<_>>()).collect()
    }

    /// All light that leaves a patch of a closed room falls on another.
    #[test]
    fn form_factors_of_a_closed_room_sum_to_one() {
        let patches = patches(&room(), 0.25);
        let obstacles = Obstacles::new(&[room()]);
        // Columns are those that send: F_ij by j, summed over j for every i.
        let mut sums = vec![0.0; patches.len()];
        for to in 0..patches.len() {
            factors(to, &patches, &obstacles).iter().zip(&mut sums).for_each(|(factor, sum)| *sum += factor);
        }
        let mean = sums.iter().sum::<f64>() / sums.len() as f64;
        assert!((mean - 1.0).abs() < 0.03, "mean {mean}");
        let near_corner = |patch: &Patch| {
            let [a, b, c] = patch.point.min(DVec3::new(4.0, 3.0, 2.5) - patch.point).to_array();
            a.max(b).min(b.max(c)).min(a.max(c)) < 0.25
        };
        for (patch, sum) in patches.iter().zip(&sums).filter(|(patch, _)| !near_corner(patch)) {
            assert!((sum - 1.0).abs() < 0.15, "{sum} at {}", patch.point);
        }
    }

    #[test]
    fn light_goes_both_ways_alike() {
        let boxes = [room(), Cuboid::new([1.0, 1.0, 0.1], [2.0, 1.5, 1.5], [0.5; 3])];
        let patches: Vec<Patch> =
            boxes.iter().zip([0.5, 0.3]).flat_map(|(cuboid, step)| patches(cuboid, step)).collect();
        let obstacles = Obstacles::new(&boxes);
        let rows: Vec<Vec<f64>> = (0..patches.len()).map(|to| factors(to, &patches, &obstacles)).collect();
        let mut seen = 0;
        for i in 0..patches.len() {
            for j in 0..i {
                // F_ij stands in the row of j.
                let [there, back] = [patches[i].area * rows[j][i], patches[j].area * rows[i][j]];
                assert!((there - back).abs() <= 1e-15, "{i} {j}: {there} {back}");
                seen += usize::from(there > 0.0);
            }
        }
        assert!(seen > patches.len() * 10, "{seen} pairs");
    }

    /// Two unit squares face each other at a distance of 10: cos θ cos θ' A / (π r² + A) by hand.
    #[test]
    fn the_form_factor_is_that_of_a_point_to_a_disc() {
        let patch = |z: f64, up: f64| Patch { point: DVec3::Z * z, normal: DVec3::Z * up, area: 1.0 };
        let factor = exchange(&patch(0.0, 1.0), &patch(10.0, -1.0));
        assert!((factor - 1.0 / (100.0 * PI + 1.0)).abs() < 1e-15);
        assert_eq!(exchange(&patch(0.0, -1.0), &patch(10.0, -1.0)), 0.0);
    }

    #[test]
    fn boxes_stand_in_the_way_and_their_surfaces_do_not() {
        let obstacles = Obstacles::new(&[Cuboid::new([1.0; 3], [2.0; 3], [0.5; 3])]);
        let is_clear = |from: [f64; 3], to: [f64; 3]| obstacles.is_clear(from.into(), to.into());
        assert!(!is_clear([0.0, 1.5, 1.5], [3.0, 1.5, 1.5]));
        assert!(!is_clear([0.0, 0.0, 0.0], [3.0, 3.0, 3.0]));
        assert!(is_clear([0.0, 1.5, 1.5], [0.9, 1.5, 1.5]), "ends before it");
        assert!(is_clear([0.0, 2.5, 1.5], [3.0, 2.5, 1.5]), "passes beside it");
        assert!(is_clear([0.0, 0.0, 2.0], [3.0, 3.0, 2.0]), "along its lid");
        assert!(is_clear([1.5, 1.5, 2.0], [1.5, 1.5, 3.0]), "from its lid");
    }

    /// In a closed room of one reflectance ρ the light of all bounces is that of the first times ρ / (1 - ρ), on the mean.
    #[test]
    fn light_is_spread_until_little_is_left() {
        let patches = patches(&room(), 0.4);
        let reflectances = vec![DVec3::splat(0.5); patches.len()];
        let lit = vec![DVec3::splat(1.0); patches.len()];
        let gathered = spread(&patches, &reflectances, &Obstacles(Vec::new()), lit);
        let area: f64 = patches.iter().map(|patch| patch.area).sum();
        let mean = patches.iter().zip(&gathered).map(|(patch, light)| patch.area * light.x).sum::<f64>() / area;
        assert!((mean - 1.0).abs() < 0.08, "{mean}");
    }
}
