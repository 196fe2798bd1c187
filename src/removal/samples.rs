//! How far the surface and what it was are from each other: the vertices that were removed, by the face that each is nearest to,
//! and how far out every face is.

use crate::kernel::rows::Position;
use crate::math::DVec3;
use crate::spatial::triangle::closest_point;

/// Squared distances, in the frame, below which a point lies on a face: what rounding leaves.
const NOISE_SQ: f64 = 1e-24;
/// No sample follows.
const END: u32 = u32::MAX;

/// Lists of samples, one a face. A sample is a vertex of the start.
#[derive(Debug)]
pub struct Samples {
    points: Vec<[f32; 3]>,
    /// The first sample of every face.
    first: Vec<u32>,
    /// The sample after each in its list.
    next: Vec<u32>,
    /// How far the edges of every face are taken to be from the surface of the start: a vertex at a rim that bends inward lies inside
    /// of what fills its hole, and edges there alone tell of the deviation.
    outward: Vec<f32>,
}

/// A sample and the new face that it is nearest to.
#[derive(Debug, Clone, Copy)]
pub struct Moved {
    pub sample: u32,
    /// Which of the fill's faces.
    pub face: u32,
    /// Squared distance to it.
    pub distance_sq: f32,
}

/// The greatest distance of those moved to each of `count` faces.
pub fn deviations(moved: &[Moved], count: usize) -> Vec<f32> {
    let mut greatest = vec![0.0_f32; count];
    for moved in moved {
        if let Some(row) = greatest.get_mut(moved.face as usize) {
            *row = row.max(moved.distance_sq.sqrt());
        }
    }
    greatest
}

impl Samples {
    /// Without any sample yet, of the vertices of the start.
    pub fn new(positions: &[Position], face_count: usize) -> Self {
        Self {
            points: positions.iter().map(|p| [p.x, p.y, p.z]).collect(),
            first: vec![END; face_count],
            next: vec![END; positions.len()],
            outward: vec![0.0; face_count],
        }
    }

    /// How far edges with these middles are taken to be from the surface of the start, where they replace the triangles `before`, the
    /// faces `old`: what their middles are off these, and what these were before. All are about one origin.
    pub fn outward(&self, middles: impl Iterator<Item = DVec3>, before: &[[DVec3; 3]], old: &[u32]) -> f64 {
        let least =
            |middle| before.iter().map(|&face| closest_point(middle, face).distance_sq).fold(f64::INFINITY, f64::min);
        let step_sq = middles.map(least).fold(0.0, f64::max);
        let step = if step_sq <= NOISE_SQ { 0.0 } else { step_sq.sqrt() };
        step + f64::from(old.iter().map(|&face| self.outward[face as usize]).fold(0.0, f32::max))
    }

    /// Tells the samples of a face.
    fn for_each(&self, face: u32, mut tell: impl FnMut(u32)) {
        let mut sample = self.first[face as usize];
        while sample != END {
            tell(sample);
            sample = self.next[sample as usize];
        }
    }

    /// Finds the nearest of `triangles`, whose corners are about `origin`, for the sample `own` and those of `faces`;
    /// returns the greatest squared distance, and leaves the faces in `moved`.
    pub fn nearest(
        &self,
        own: u32,
        faces: &[u32],
        origin: DVec3,
        triangles: &[[DVec3; 3]],
        moved: &mut Vec<Moved>,
    ) -> f64 {
        moved.clear();
        let mut greatest = 0.0_f64;
        let mut find = |sample: u32| {
            let point = DVec3::from(self.points[sample as usize].map(f64::from)) - origin;
            let mut least = (f64::INFINITY, 0);
            for (face, &triangle) in (0..).zip(triangles) {
                let distance_sq = closest_point(point, triangle).distance_sq;
                if distance_sq < least.0 {
                    least = (distance_sq, face);
                }
            }
            if least.0 <= NOISE_SQ {
                least.0 = 0.0;
            }
            greatest = greatest.max(least.0);
            moved.push(Moved { sample, face: least.1, distance_sq: least.0 as f32 });
        };
        find(own);
        faces.iter().for_each(|&face| self.for_each(face, &mut find));
        greatest
    }

    /// Empties the lists of `old` faces and adds the samples to those of `new` ones, which are `outward` as far out at most.
    pub fn follow(&mut self, old: &[u32], new: &[u32], moved: &[Moved], outward: f32) {
        old.iter().for_each(|&face| self.first[face as usize] = END);
        for &face in new {
            let own = &mut self.outward[face as usize];
            *own = if old.contains(&face) { outward } else { own.max(outward) };
        }
        for &Moved { sample, face, .. } in moved {
            if let Some(&face) = new.get(face as usize) {
                self.next[sample as usize] = std::mem::replace(&mut self.first[face as usize], sample);
            }
        }
    }

    /// Keeps the lists of the faces `live`.
    pub fn compact(&mut self, live: &[u32]) {
        self.first = live.iter().map(|&face| self.first[face as usize]).collect();
        self.outward = live.iter().map(|&face| self.outward[face as usize]).collect();
    }
}
