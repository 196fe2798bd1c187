//! One region into two.

use crate::math::DVec3;
use crate::mesh::adjacency::group;

use super::flood::Frontier;
use super::labeling::{FREE, Labeling, Sum};
use super::scene::Scene;

/// Times that both halves grow anew from their best faces.
const TRIALS: usize = 2;

/// The faces of every region, and where each stands.
#[derive(Debug)]
pub struct Members {
    starts: Vec<u32>,
    faces: Vec<u32>,
    /// The place of every face in `faces`.
    places: Vec<u32>,
}

impl Members {
    pub fn new(regions: &Labeling) -> Self {
        let (starts, faces) = group(regions.labels.len(), regions.count(), |face| [regions.labels[face]]);
        let mut places = vec![0; faces.len()];
        (0..).zip(&faces).for_each(|(place, &face)| places[face as usize] = place);
        Self { starts, faces, places }
    }

    /// The faces of a region, ascending.
    pub fn of(&self, region: u32) -> &[u32] {
        &self.faces[self.starts[region as usize] as usize..self.starts[region as usize + 1] as usize]
    }

    /// The place of a face within its region.
    fn place(&self, region: u32, face: u32) -> usize {
        (self.places[face as usize] - self.starts[region as usize]) as usize
    }
}

/// What a region falls into.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    pub region: u32,
    /// The faces of the second half; the others stay.
    pub second: Vec<u32>,
    /// How much the energy falls.
    pub gain: f64,
}

/// Splits a region of two faces or more where its normals differ most; both halves are connected.
pub fn split(scene: &Scene<'_>, regions: &Labeling, members: &Members, region: u32) -> Option<Split> {
    let faces = members.of(region);
    if faces.len() < 2 {
        return None;
    }
    let mut halves = Halves { scene, regions, members, region, labels: vec![FREE; faces.len()] };
    let whole = regions.sums[region as usize];
    let mut seeds = halves.far_apart(whole.direction());
    let mut directions = seeds.map(|face| scene.shapes[face as usize].normal);
    let mut best = Split { region, second: Vec::new(), gain: f64::NEG_INFINITY };
    for _ in 0..TRIALS {
        halves.grow(seeds, directions);
        let of_half =
            |half| faces.iter().zip(&halves.labels).filter(move |&(_, &label)| label == half).map(|(&face, _)| face);
        let sums = [0, 1].map(|half| Sum::of(scene, of_half(half)));
        let gain = 2.0 * (sums[0].length + sums[1].length - whole.length);
        if gain > best.gain {
            best = Split { region, second: of_half(1).collect(), gain };
        }
        directions = sums.map(|sum| sum.direction());
        let next = [0, 1].map(|half| nearest(scene, of_half(half as u32), directions[half]));
        if next == seeds.map(Some) {
            break;
        }
        seeds = [next[0].unwrap_or(seeds[0]), next[1].unwrap_or(seeds[1])];
    }
    Some(best)
}

/// The face with the nearest normal, the lowest of such.
pub fn nearest(scene: &Scene<'_>, faces: impl Iterator<Item = u32>, direction: DVec3) -> Option<u32> {
    let distance = |face: u32| (scene.shapes[face as usize].distance_sq(direction), face);
    faces.map(distance).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, face)| face)
}

struct Halves<'a> {
    scene: &'a Scene<'a>,
    regions: &'a Labeling,
    members: &'a Members,
    region: u32,
    /// The half of every face, by its place.
    labels: Vec<u32>,
}

impl Halves<'_> {
    /// Two different faces: the one farthest from `direction`, and the one farthest from that; where all are alike, those at
    /// either end.
    fn far_apart(&mut self, direction: DVec3) -> [u32; 2] {
        let faces = self.members.of(self.region);
        let farthest = |direction: DVec3| {
            let apart = |face: u32| {
                let shape = &self.scene.shapes[face as usize];
                (shape.area * shape.distance_sq(direction), face)
            };
            faces.iter().map(|&face| apart(face)).max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
        };
        let Some((apart, second)) = farthest(direction) else { return [faces[0]; 2] };
        let first = farthest(self.scene.shapes[second as usize].normal).map_or(second, |(_, face)| face);
        if apart > 0.0 && first != second { [first, second] } else { [faces[0], self.last_from(faces[0])] }
    }

    /// The face most steps away.
    fn last_from(&mut self, first: u32) -> u32 {
        self.labels.fill(FREE);
        let mut queue = vec![first];
        self.labels[self.members.place(self.region, first)] = 0;
        let mut at = 0;
        while at < queue.len() {
            let (scene, regions) = (self.scene, self.regions);
            let inside = |other: &u32| regions.labels[*other as usize] == self.region;
            for other in scene.around(queue[at]).filter(inside) {
                let label = &mut self.labels[self.members.place(self.region, other)];
                if *label == FREE {
                    *label = 0;
                    queue.push(other);
                }
            }
            at += 1;
        }
        queue[at - 1]
    }

    /// The neighbors of a face in the region.
    fn inside(&self, face: u32) -> impl Iterator<Item = u32> + use<'_> {
        self.scene.around(face).filter(|&other| self.regions.labels[other as usize] == self.region)
    }

    /// Grows both halves from their seeds over the region.
    fn grow(&mut self, seeds: [u32; 2], directions: [DVec3; 2]) {
        self.labels.fill(FREE);
        let mut frontier = Frontier::default();
        // A seed is its half's whatever the other would give.
        for (half, seed) in (0..).zip(seeds) {
            self.labels[self.members.place(self.region, seed)] = half;
        }
        for (half, seed) in (0..).zip(seeds) {
            self.spread(seed, half, directions, &mut frontier);
        }
        while let Some((face, half)) = frontier.pop() {
            let place = self.members.place(self.region, face);
            if self.labels[place] == FREE {
                self.labels[place] = half;
                self.spread(face, half, directions, &mut frontier);
            }
        }
    }

    fn spread(&self, face: u32, half: u32, directions: [DVec3; 2], frontier: &mut Frontier) {
        for other in self.inside(face) {
            if self.labels[self.members.place(self.region, other)] == FREE {
                frontier.push(self.scene.shapes[other as usize].distance_sq(directions[half as usize]), other, half);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::partition::Partition;
    use crate::partition::vsa::scene::tests::{scene, surface};

    fn halves(scene: &Scene<'_>, regions: &Labeling, split: &Split) -> Labeling {
        let mut labels = regions.labels.clone();
        split.second.iter().for_each(|&face| labels[face as usize] = regions.count() as u32);
        Labeling::new(scene, labels, regions.count() + 1)
    }

    /// Two sides of a cube: along their edge, and all of the energy is gained.
    #[test]
    fn a_bent_region_falls_apart_at_the_bend() {
        let mut mesh = shapes::cube(5);
        let keeps = |face: &[u32; 3]| {
            [0, 2].iter().any(|&axis| face.iter().all(|&v| mesh.positions[v as usize][axis] == mesh.bounds().1[axis]))
        };
        mesh.faces = mesh.faces.iter().copied().filter(keeps).collect();
        let surface = surface(&mesh);
        let scene = scene(&surface);
        assert_eq!(scene.face_count(), 100);
        let regions = Labeling::new(&scene, vec![0; 100], 1);
        let members = Members::new(&regions);
        let split = split(&scene, &regions, &members, 0).expect("two faces or more");
        assert!((split.gain - regions.energy()).abs() < 1e-12);
        assert_eq!(halves(&scene, &regions, &split).energy(), 0.0);
        assert_eq!(split.second.len(), 50);
    }

    /// Where all normals agree there are still two pieces, and one face has none.
    #[test]
    fn a_flat_region_falls_apart_too() {
        let surface = surface(&shapes::plane(5, 4));
        let scene = scene(&surface);
        let regions = Labeling::new(&scene, vec![0; 40], 1);
        let split_of = |regions: &Labeling, region| split(&scene, regions, &Members::new(regions), region);
        let found = split_of(&regions, 0).expect("two faces or more");
        let two = halves(&scene, &regions, &found);
        let partition = Partition { labels: two.labels.clone(), region_count: 2 };
        assert_eq!(partition.validate(&surface.neighbors), []);
        let each = Labeling::each_face(&scene);
        assert_eq!(split_of(&each, 7), None);
    }

    #[test]
    fn members_are_listed() {
        let surface = surface(&shapes::tetrahedron());
        let scene = scene(&surface);
        let members = Members::new(&Labeling::new(&scene, vec![1, 0, 1, 1], 2));
        assert_eq!((members.of(0), members.of(1)), (&[1][..], &[0, 2, 3][..]));
        assert_eq!([0, 2, 3].map(|face| members.place(1, face)), [0, 1, 2]);
    }
}
