//! A superface as it grows: its light, its plane, and what may join it.

use super::super::plane::Plane;
use super::super::surface::Surface;
use super::{Criterion, Options};
use crate::math::DVec3;
use crate::mesh::limits::least_cos;

/// The least cosine between the normal of a face and that of its superface: past it, faces would lie over each other in the plane.
const LEAST_TO_PLANE: f64 = 0.2;
/// Faces that a superface has when its plane is first put through all of them.
const FIRST_FIT: usize = 4;
/// Twice the area of a face over its longest side squared: below this its normal is noise.
const SLIVER: f64 = 1e-9;

/// A face as superfaces see it.
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    pub light: [f64; 3],
    /// How much the light changes around it, by channel.
    pub change: [f64; 3],
    pub area: f64,
    /// Unit length; zero where a face has no direction.
    pub normal: DVec3,
    pub corners: [DVec3; 3],
}

impl Patch {
    pub fn new(surface: &Surface, face: usize, light: [f32; 4], change: [f32; 4]) -> Self {
        let corners = surface.faces[face].map(|v| surface.points[v as usize]);
        let first = |row: [f32; 4]| [row[0], row[1], row[2]].map(f64::from);
        let normal = normal(corners);
        Self { light: first(light), change: first(change), area: f64::from(light[3]), normal, corners }
    }
}

/// The unit normal of a face; zero where it has none.
pub fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let cross = (b - a).cross(c - a);
    let longest_sq = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    if cross.length() > SLIVER * longest_sq { cross.normalize_or_zero() } else { DVec3::ZERO }
}

/// A superface.
#[derive(Debug)]
pub struct Region {
    pub faces: Vec<u32>,
    /// Of the seed, until it is put through more.
    pub plane: Option<Plane>,
    /// Means by area.
    pub light: [f64; 3],
    change: [f64; 3],
    area: f64,
    /// The range of light.
    least: [f64; 3],
    greatest: [f64; 3],
    seed_normal: DVec3,
    next_fit: usize,
}

/// What a face must pass to join.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    epsilon: f64,
    by_area: bool,
    range_cap: f64,
    floor: f64,
    least_cos: f64,
    /// From the plane, in the frame.
    distance: f64,
}

impl Rules {
    pub fn new(options: Options, floor: f32, diagonal: f64) -> Self {
        let range_cap = match options.criterion {
            Criterion::Contrast { range_cap, .. } => range_cap,
            Criterion::Paper { .. } => f64::INFINITY,
        };
        Self {
            epsilon: options.criterion.epsilon(),
            by_area: options.criterion.area_unit().is_some(),
            range_cap,
            floor: f64::from(floor),
            least_cos: least_cos(options.guard.angle_rad),
            distance: options.guard.distance * diagonal,
        }
    }
}

impl Region {
    /// A superface of one face.
    pub fn new(seed: u32, patch: &Patch) -> Self {
        let has_normal = patch.normal != DVec3::ZERO;
        Self {
            faces: vec![seed],
            plane: has_normal.then(|| Plane::new(patch.corners[0], patch.normal)),
            light: patch.light,
            change: patch.change,
            area: patch.area,
            least: patch.light,
            greatest: patch.light,
            seed_normal: patch.normal,
            next_fit: FIRST_FIT,
        }
    }

    /// Whether a face beside it may join.
    pub fn takes(&self, patch: &Patch, rules: &Rules) -> bool {
        self.is_lit_like(patch, rules) && self.range_holds(patch, rules) && self.lies_along(patch, rules)
    }

    /// merged(S, P, ε) \[Liu99\].
    fn is_lit_like(&self, patch: &Patch, rules: &Rules) -> bool {
        let below = |change: f64| change < rules.epsilon;
        if patch.change.into_iter().all(below) {
            return self.means(self.change, patch.change, patch.area).into_iter().all(below);
        }
        let area = if rules.by_area { self.area + patch.area } else { 1.0 };
        (0..3).all(|k| {
            let (own, other) = (self.light[k], patch.light[k]);
            let darker = own.min(other).max(rules.floor);
            own == other && rules.epsilon > 0.0 || (own - other).abs() < rules.epsilon * darker * area
        })
    }

    fn range_holds(&self, patch: &Patch, rules: &Rules) -> bool {
        (0..3).all(|k| {
            let (least, greatest) = (self.least[k].min(patch.light[k]), self.greatest[k].max(patch.light[k]));
            greatest - least <= rules.range_cap * greatest.max(rules.floor)
        })
    }

    fn lies_along(&self, patch: &Patch, rules: &Rules) -> bool {
        let Some(plane) = &self.plane else { return false };
        let has_normal = patch.normal != DVec3::ZERO;
        let along =
            patch.normal.dot(self.seed_normal) >= rules.least_cos && patch.normal.dot(plane.normal) > LEAST_TO_PLANE;
        (along || !has_normal) && patch.corners.iter().all(|&p| plane.height(p).abs() <= rules.distance)
    }

    /// Means of two rows by the areas of this and of a patch.
    fn means(&self, own: [f64; 3], other: [f64; 3], area: f64) -> [f64; 3] {
        let sum = self.area + area;
        [0, 1, 2].map(|k| if sum > 0.0 { (own[k] * self.area + other[k] * area) / sum } else { own[k].max(other[k]) })
    }

    /// Takes a face in.
    pub fn join(&mut self, face: u32, patch: &Patch) {
        self.faces.push(face);
        self.change = self.means(self.change, patch.change, patch.area);
        self.light = self.means(self.light, patch.light, patch.area);
        self.area += patch.area;
        for k in 0..3 {
            self.least[k] = self.least[k].min(patch.light[k]);
            self.greatest[k] = self.greatest[k].max(patch.light[k]);
        }
    }

    /// Puts the plane through all faces whenever they have grown by half, so that all of it takes as long as growing does. A
    /// plane that a vertex lies too far from, or a face looks away from, is not taken.
    pub fn fit_when_due(&mut self, surface: &Surface, rules: &Rules) {
        if self.faces.len() >= self.next_fit {
            self.next_fit = self.faces.len() + self.faces.len() / 2;
            self.fit(surface, rules);
        }
    }

    /// Puts the plane through all faces, if it can be.
    pub fn fit(&mut self, surface: &Surface, rules: &Rules) {
        let Some(plane) = Plane::of(surface, &self.faces) else { return };
        let holds = |&f: &u32| {
            let corners = surface.faces[f as usize].map(|v| surface.points[v as usize]);
            let normal = normal(corners);
            (normal == DVec3::ZERO || normal.dot(plane.normal) > LEAST_TO_PLANE)
                && corners.iter().all(|&p| plane.height(p).abs() <= rules.distance)
        };
        if self.faces.iter().all(holds) {
            self.plane = Some(plane);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::Flatness;

    const FLOOR: f32 = 1.0 / 1024.0;

    /// A patch of this light and area in the plane z = 0.
    fn patch(light: f64, change: f64, area: f64) -> Patch {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        Patch { light: [light; 3], change: [change; 3], area, normal: DVec3::Z, corners }
    }

    fn rules(criterion: Criterion) -> Rules {
        Rules::new(Options { criterion, guard: Flatness { distance: 0.01, ..Options::FLAT } }, FLOOR, 1.0)
    }

    fn contrast(epsilon: f64) -> Rules {
        rules(Criterion::Contrast { epsilon, range_cap: 0.25 })
    }

    #[test]
    fn even_faces_join_by_their_mean_change_and_others_by_their_step() {
        // The mean of 0.05 and 0.16, by areas 3 and 1, is 0.0775.
        let region = Region::new(0, &patch(0.5, 0.16, 1.0));
        assert!(region.takes(&patch(0.5, 0.05, 3.0), &contrast(0.08)));
        assert!(!region.takes(&patch(0.5, 0.05, 3.0), &contrast(0.0775)));
        // A change of 0.5 is past any; the step from 0.5 to 0.55 is a tenth.
        assert!(region.takes(&patch(0.55, 0.5, 3.0), &contrast(0.1001)));
        assert!(!region.takes(&patch(0.55, 0.5, 3.0), &contrast(0.0999)));
    }

    #[test]
    fn in_the_papers_criterion_areas_divide() {
        let paper = |area_unit| rules(Criterion::Paper { epsilon: 0.1, area_unit });
        let region = Region::new(0, &patch(0.5, 0.0, 1.0));
        // 0.2 over the areas 1 + 3 is 0.05; over 0.1 + 0.3 it is 0.5.
        assert!(region.takes(&patch(0.6, 0.5, 3.0), &paper(1.0)));
        assert!(!Region::new(0, &patch(0.5, 0.0, 0.1)).takes(&patch(0.6, 0.5, 0.3), &paper(1.0)));
    }

    #[test]
    fn the_range_of_light_is_capped() {
        let mut region = Region::new(0, &patch(0.4, 0.0, 1.0));
        region.join(1, &patch(0.45, 0.0, 1.0));
        assert!(region.takes(&patch(0.53, 0.0, 1.0), &contrast(0.5)));
        assert!(!region.takes(&patch(0.54, 0.0, 1.0), &contrast(0.5)), "0.14 of 0.54 is past a quarter");
    }

    #[test]
    fn one_channel_is_enough_to_stay_out() {
        let region = Region::new(0, &patch(0.5, 0.0, 1.0));
        let blue = Patch { light: [0.5, 0.5, 0.6], change: [0.0, 0.0, 0.2], ..patch(0.5, 0.0, 1.0) };
        assert!(!region.takes(&blue, &contrast(0.1)));
        assert!(region.takes(&blue, &contrast(0.21)));
    }

    #[test]
    fn what_leaves_the_plane_stays_out() {
        let region = Region::new(0, &patch(0.5, 0.0, 1.0));
        let moved = |p: DVec3| {
            let corners = [DVec3::Y, DVec3::X, p];
            Patch { corners, normal: normal(corners), ..patch(0.5, 0.0, 1.0) }
        };
        assert!(region.takes(&moved(DVec3::new(1.0, 1.0, 0.005)), &contrast(0.1)));
        assert!(!region.takes(&moved(DVec3::new(1.0, 1.0, 0.011)), &contrast(0.1)), "too far");
        assert!(!region.takes(&moved(DVec3::new(0.51, 0.51, 0.009)), &contrast(0.1)), "too steep");
        assert!(!region.takes(&moved(DVec3::new(0.1, 0.1, 0.0)), &contrast(0.1)), "folded over");
        // On the edge itself, without an area.
        assert!(region.takes(&moved(DVec3::new(0.5, 0.5, 0.0)), &contrast(0.1)));
    }

    #[test]
    fn nothing_joins_at_zero() {
        let region = Region::new(0, &patch(0.5, 0.0, 1.0));
        assert!(!region.takes(&patch(0.5, 0.0, 1.0), &contrast(0.0)));
        assert!(!region.takes(&patch(0.5, 0.1, 1.0), &contrast(0.0)));
    }
}
