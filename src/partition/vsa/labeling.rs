//! The state of a partition: labels, and what the energy needs to know of each region.

use crate::math::DVec3;

use super::scene::Scene;

/// The label of a face that has none yet.
pub const FREE: u32 = u32::MAX;

/// A region as energies see it: N = Σ ρ n over its faces, S = Σ ρ.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sum {
    /// N.
    pub normal: DVec3,
    /// |N|.
    pub length: f64,
    /// S.
    pub area: f64,
    /// How many faces.
    pub faces: u32,
    /// The component they lie in.
    pub component: u32,
}

impl Sum {
    /// The direction of its proxy; zero where normals cancel.
    pub fn direction(&self) -> DVec3 {
        self.normal.normalize_or_zero()
    }

    /// Σ ρ |n − N/|N||² = 2 (S − |N|).
    pub fn energy(&self) -> f64 {
        (2.0 * (self.area - self.length)).max(0.0)
    }

    /// With one more face.
    pub fn add(&mut self, scene: &Scene<'_>, face: u32) {
        let shape = &scene.shapes[face as usize];
        self.normal += shape.weighted();
        self.length = self.normal.length();
        self.area += shape.area;
        self.faces += 1;
        self.component = scene.components[face as usize];
    }

    /// Of these faces.
    pub fn of(scene: &Scene<'_>, faces: impl IntoIterator<Item = u32>) -> Self {
        let mut sum = Self::default();
        for face in faces {
            let shape = &scene.shapes[face as usize];
            sum.normal += shape.weighted();
            sum.area += shape.area;
            sum.faces += 1;
            sum.component = scene.components[face as usize];
        }
        sum.length = sum.normal.length();
        sum
    }

    /// Of both.
    pub fn joined(&self, other: &Self) -> Self {
        let normal = self.normal + other.normal;
        Self {
            normal,
            length: normal.length(),
            area: self.area + other.area,
            faces: self.faces + other.faces,
            component: self.component,
        }
    }

    /// How much more energy the two have as one: 2 (|N| + |M| − |N + M|), never below zero.
    pub fn merging_cost(&self, other: &Self) -> f64 {
        (2.0 * (self.length + other.length - (self.normal + other.normal).length())).max(0.0)
    }
}

/// Faces by region, and the sum of each region. Every region has a face once all faces have a label.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Labeling {
    /// The region of every face, or [`FREE`].
    pub labels: Vec<u32>,
    pub sums: Vec<Sum>,
}

impl Labeling {
    /// No face in any.
    pub fn none(scene: &Scene<'_>) -> Self {
        Self { labels: vec![FREE; scene.face_count()], sums: Vec::new() }
    }

    /// The regions of these labels, which are below `count`; [`FREE`] faces count nowhere.
    pub fn new(scene: &Scene<'_>, labels: Vec<u32>, count: usize) -> Self {
        let mut regions = Self { labels, sums: vec![Sum::default(); count] };
        regions.sum_anew(scene);
        regions
    }

    /// Every face a region.
    pub fn each_face(scene: &Scene<'_>) -> Self {
        let count = scene.face_count() as u32;
        Self::new(scene, (0..count).collect(), count as usize)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.sums.len()
    }

    /// ε, with half the bounding box's diagonal as the unit of length.
    pub fn energy(&self) -> f64 {
        self.sums.iter().map(Sum::energy).sum()
    }

    /// Forgets what rounding has left in running sums.
    pub fn sum_anew(&mut self, scene: &Scene<'_>) {
        self.sums.fill(Sum::default());
        for ((face, &label), shape) in (0..).zip(&self.labels).zip(&scene.shapes) {
            if label != FREE {
                let sum = &mut self.sums[label as usize];
                sum.normal += shape.weighted();
                sum.area += shape.area;
                sum.faces += 1;
                sum.component = scene.components[face as usize];
            }
        }
        self.sums.iter_mut().for_each(|sum| sum.length = sum.normal.length());
    }

    /// Moves a face to another region.
    pub fn shift(&mut self, scene: &Scene<'_>, face: u32, label: u32) {
        let shape = &scene.shapes[face as usize];
        let from = &mut self.sums[self.labels[face as usize] as usize];
        from.normal -= shape.weighted();
        from.length = from.normal.length();
        from.area -= shape.area;
        from.faces -= 1;
        let to = &mut self.sums[label as usize];
        to.normal += shape.weighted();
        to.length = to.normal.length();
        to.area += shape.area;
        to.faces += 1;
        self.labels[face as usize] = label;
    }

    /// How many regions lie in every component.
    pub fn by_component(&self, scene: &Scene<'_>) -> Vec<u32> {
        let mut counts = vec![0; scene.is_closed.len()];
        self.sums.iter().for_each(|sum| counts[sum.component as usize] += 1);
        counts
    }

    /// Pairs of regions with an edge between them, ascending.
    pub fn adjacent(&self, scene: &Scene<'_>) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        for (face, &label) in (0..).zip(&self.labels) {
            let others = scene.around(face).map(|other| self.labels[other as usize]);
            pairs.extend(others.filter(|&other| label < other).map(|other| [label, other]));
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::partition::vsa::scene::tests::{scene, surface};

    /// Σ ρ |n − u|² = 2 (S − |N|), between 0 and twice the area.
    #[test]
    fn the_energy_is_what_it_stands_for() {
        let surface = surface(&shapes::torus(30, 20));
        let scene = scene(&surface);
        let labels: Vec<u32> = (0..scene.face_count() as u32).map(|face| face / 100).collect();
        let regions = Labeling::new(&scene, labels, scene.face_count() / 100);
        let apart: f64 = (regions.labels.iter().zip(&scene.shapes))
            .map(|(&label, shape)| shape.area * shape.distance_sq(regions.sums[label as usize].direction()))
            .sum();
        assert!((regions.energy() - apart).abs() < 1e-10, "{} {apart}", regions.energy());
        assert!(regions.energy() > 0.1 && regions.energy() <= 2.0 * scene.area);
        let all = Labeling::new(&scene, vec![0; scene.face_count()], 1);
        assert!((all.energy() - 2.0 * scene.area).abs() < 1e-6, "normals of a torus cancel");
    }

    #[test]
    fn merging_costs_what_it_says() {
        let surface = surface(&shapes::icosphere(3));
        let scene = scene(&surface);
        let count = scene.face_count() as u32 / 64;
        let regions =
            Labeling::new(&scene, (0..scene.face_count() as u32).map(|face| face / 64).collect(), count as usize);
        for [k, l] in regions.adjacent(&scene) {
            let labels = regions.labels.iter().map(|&label| if label == l { k } else { label }).collect();
            let merged = Labeling::new(&scene, labels, count as usize);
            let cost = regions.sums[k as usize].merging_cost(&regions.sums[l as usize]);
            assert!(cost >= 0.0 && (merged.energy() - regions.energy() - cost).abs() < 1e-12);
            let joined = regions.sums[k as usize].joined(&regions.sums[l as usize]);
            assert!((joined.normal - merged.sums[k as usize].normal).length() < 1e-12);
        }
    }

    #[test]
    fn running_sums_are_those_summed_anew() {
        let surface = surface(&shapes::cube(6));
        let scene = scene(&surface);
        let mut regions = Labeling::new(&scene, (0..432).map(|face| face % 7).collect(), 7);
        for step in 0..5000_u32 {
            let face = step.wrapping_mul(2_654_435_761) % 432;
            if regions.sums[regions.labels[face as usize] as usize].faces > 1 {
                regions.shift(&scene, face, step % 7);
            }
        }
        let mut anew = regions.clone();
        anew.sum_anew(&scene);
        for (running, sum) in regions.sums.iter().zip(&anew.sums) {
            assert!((running.normal - sum.normal).length() < 1e-12 && (running.area - sum.area).abs() < 1e-12);
            assert_eq!(running.faces, sum.faces);
        }
    }
}
