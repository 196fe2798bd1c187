//! Which face is seen at each sample of an image.
//!
//! A cell holds depth and face in one integer, and a face that covers a sample puts its own there if it is smaller. The
//! least does not depend on the order, so faces are drawn by all threads at once and the result is the same. Corners are
//! rounded to 1/256 of a sample; coverage is then exact integer arithmetic and neighboring faces leave no gap.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use rayon::prelude::*;

use super::camera::{Camera, Frame};
use crate::mesh::Mesh;

/// The steps of a sample's side.
pub const STEPS: i64 = 256;
/// A corner farther off in steps makes its face invisible; products of two still fit 64 bits.
const FARTHEST: f64 = (1 << 28) as f64;
/// The fewest rows worth handing to another thread.
const PARALLEL_ROWS: usize = 1024;

/// A vertex on the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Steps from the left and from the top.
    pub at: [i32; 2],
    /// As [`Camera::project`] has it; 0 for a vertex that cannot be drawn.
    pub nearness: f32,
}

/// Whether a face is there at a sample.
pub type IsThere<'a> = dyn Fn(u32, &Outline, [usize; 2], [i64; 3]) -> bool + Sync + 'a;

/// A mesh as a camera sees it.
#[derive(Debug)]
pub struct Sight {
    frame: Frame,
    cells: Vec<AtomicU64>,
    corners: Vec<Corner>,
}

/// A face on the image, its corners clockwise on the screen.
#[derive(Debug, Clone, Copy)]
pub struct Outline {
    pub corners: [Corner; 3],
    /// Twice its area in squared steps.
    pub area: i64,
    /// Whether the corners had to be turned around.
    pub turned: bool,
}

impl Outline {
    /// The outline of a face, unless it has no area or cannot be drawn.
    pub fn new([a, b, c]: [Corner; 3]) -> Option<Self> {
        if [a, b, c].iter().any(|corner| corner.nearness <= 0.0) {
            return None;
        }
        match edge(a, b, c.at) {
            0 => None,
            area if area < 0 => Some(Self { corners: [a, c, b], area: -area, turned: true }),
            area => Some(Self { corners: [a, b, c], area, turned: false }),
        }
    }

    /// Twice the areas between `at` and the edges opposite to each corner: none is negative inside.
    pub fn areas(&self, at: [i32; 2]) -> [i64; 3] {
        let [a, b, c] = self.corners;
        [edge(b, c, at), edge(c, a, at), edge(a, b, at)]
    }

    /// What the areas gain with a step of a sample to the right, and of one down.
    pub fn gains(&self) -> [[i64; 3]; 2] {
        let [a, b, c] = self.corners.map(|corner| corner.at.map(i64::from));
        let legs = [(b, c), (c, a), (a, b)];
        [legs.map(|(from, to)| (from[1] - to[1]) * STEPS), legs.map(|(from, to)| (to[0] - from[0]) * STEPS)]
    }

    /// What each corner counts for where these are the areas: their sum is 1. Outside too, unless that is behind the eye.
    pub fn shares(&self, areas: [i64; 3]) -> Option<[f64; 3]> {
        // Perspective: what is near counts more.
        let shares: [f64; 3] = std::array::from_fn(|i| areas[i] as f64 * f64::from(self.corners[i].nearness));
        let sum = shares.iter().sum::<f64>();
        (sum > 0.0).then(|| shares.map(|share| share / sum))
    }

    /// The number that each corner has in its face.
    pub fn order(&self) -> [usize; 3] {
        if self.turned { [0, 2, 1] } else { [0, 1, 2] }
    }
}

/// Twice the area of the triangle `a`, `b`, `p`.
fn edge(a: Corner, b: Corner, p: [i32; 2]) -> i64 {
    let [ax, ay, bx, by] = [a.at[0], a.at[1], b.at[0], b.at[1]].map(i64::from);
    let [px, py] = p.map(i64::from);
    (bx - ax) * (py - ay) - (by - ay) * (px - ax)
}

/// The middle of a sample, in steps.
pub fn middle(column: usize, row: usize) -> [i32; 2] {
    [column, row].map(|i| (i as i64 * STEPS + STEPS / 2) as i32)
}

/// Draws `mesh` as `camera` sees it. The mesh must be valid.
///
/// A face is left out where `is_there` denies it: that is asked with its number, its outline, the sample's place and areas.
pub fn draw(mesh: &Mesh, camera: &Camera, frame: &Frame, is_there: &IsThere<'_>) -> Sight {
    let place = |steps: f64| steps.round() as i32;
    let corner = |p| match camera.project(p, frame) {
        Some((x, y, nearness)) if (x * STEPS as f64).abs().max((y * STEPS as f64).abs()) < FARTHEST => {
            Corner { at: [x, y].map(|x| place(x * STEPS as f64)), nearness: nearness as f32 }
        }
        _ => Corner { at: [0, 0], nearness: 0.0 },
    };
    let corners = mesh.positions.par_iter().with_min_len(PARALLEL_ROWS).map(|&p| corner(p)).collect();
    let cells = (0..frame.width * frame.height).map(|_| AtomicU64::new(u64::MAX)).collect();
    let sight = Sight { frame: *frame, cells, corners };
    mesh.faces.par_iter().enumerate().with_min_len(PARALLEL_ROWS).for_each(|(id, &face)| {
        if let Some(outline) = sight.outline(face) {
            sight.fill(id as u32, &outline, is_there);
        }
    });
    sight
}

impl Sight {
    /// The face seen at a sample.
    pub fn face(&self, column: usize, row: usize) -> Option<u32> {
        let cell = self.cells[row * self.frame.width + column].load(Relaxed);
        (cell != u64::MAX).then_some(cell as u32)
    }

    /// The outline of a face.
    pub fn outline(&self, face: [u32; 3]) -> Option<Outline> {
        Outline::new(face.map(|v| self.corners[v as usize]))
    }

    /// Puts a face wherever it is the nearest so far.
    fn fill(&self, id: u32, outline: &Outline, is_there: &IsThere<'_>) {
        let [columns, rows] = [(0, self.frame.width), (1, self.frame.height)].map(|(axis, samples)| {
            let places = outline.corners.map(|corner| i64::from(corner.at[axis]));
            let least = places.iter().copied().min().unwrap_or(0);
            let most = places.iter().copied().max().unwrap_or(0);
            // Samples whose middle lies between the two.
            let first = (least + STEPS / 2 - 1).div_euclid(STEPS).max(0);
            let end = ((most + STEPS / 2).div_euclid(STEPS)).min(samples as i64);
            first as usize..end.max(first) as usize
        });
        let nearness = outline.corners.map(|corner| f64::from(corner.nearness));
        let share = 1.0 / outline.area as f64;
        let [gains, _] = outline.gains();
        for row in rows {
            let mut areas = outline.areas(middle(columns.start, row));
            for column in columns.clone() {
                if areas.iter().all(|&area| area >= 0) && is_there(id, outline, [column, row], areas) {
                    let [u, v, w] = areas.map(|area| area as f64 * share);
                    let near = (u * nearness[0] + v * nearness[1] + w * nearness[2]) as f32;
                    // The bits of positive floats are in the order of the floats.
                    let cell = u64::from(!near.to_bits()) << 32 | u64::from(id);
                    self.cells[row * self.frame.width + column].fetch_min(cell, Relaxed);
                }
                areas = std::array::from_fn(|i| areas[i] + gains[i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::mesh::shapes::{icosphere, torus};

    const FRAME: Frame = Frame { width: 8, height: 8, margin: 0 };

    fn everywhere(_: u32, _: &Outline, _: [usize; 2], _: [i64; 3]) -> bool {
        true
    }

    /// A sight with these corners, in samples.
    fn sight(corners: &[([f64; 2], f32)], faces: &[[u32; 3]]) -> Sight {
        let corners = corners
            .iter()
            .map(|&(at, nearness)| Corner { at: at.map(|x| (x * STEPS as f64) as i32), nearness })
            .collect();
        let sight = Sight { frame: FRAME, cells: (0..64).map(|_| AtomicU64::new(u64::MAX)).collect(), corners };
        for (id, &face) in faces.iter().enumerate() {
            if let Some(outline) = sight.outline(face) {
                sight.fill(id as u32, &outline, &everywhere);
            }
        }
        sight
    }

    fn rows(sight: &Sight) -> Vec<String> {
        let letter = |face: Option<u32>| face.map_or('.', |face| (b'a' + face as u8) as char);
        (0..8).map(|row| (0..8).map(|column| letter(sight.face(column, row))).collect()).collect()
    }

    #[test]
    fn a_triangle_covers_the_samples_whose_middle_is_inside() {
        let corners = [([1.0, 1.0], 1.0), ([6.0, 1.0], 1.0), ([1.0, 6.0], 1.0)];
        for face in [[0, 1, 2], [0, 2, 1]] {
            let expected =
                ["........", ".aaaaa..", ".aaaa...", ".aaa....", ".aa.....", ".a......", "........", "........"];
            assert_eq!(rows(&sight(&corners, &[face])), expected);
        }
    }

    #[test]
    fn the_nearest_wins_whatever_the_order() {
        // Two that cross: one is nearer at the left, the other at the right.
        let corners = [
            ([0.0, 0.0], 1.0),
            ([8.0, 0.0], 3.0),
            ([4.0, 16.0], 2.0),
            ([0.0, 0.0], 3.0),
            ([8.0, 0.0], 1.0),
            ([4.0, 16.0], 2.0),
        ];
        let [one, other] = [[[0, 1, 2], [3, 4, 5]], [[3, 4, 5], [0, 1, 2]]].map(|faces| rows(&sight(&corners, &faces)));
        assert_eq!((one[0].as_str(), other[0].as_str()), ("bbbbaaaa", "aaaabbbb"));
        // Of equals the first wins.
        assert!(rows(&sight(&corners, &[[0, 1, 2], [0, 1, 2]])).iter().all(|row| !row.contains('b')));
    }

    #[test]
    fn neighbors_leave_no_gap_and_far_corners_do_no_harm() {
        // A fan about a point that lies on no sample.
        let mut corners = vec![([3.3, 4.1], 1.0)];
        corners.extend([[-90.0, -3.0], [50.0, -70.5], [91.7, 33.3], [-2.0, 1000.0]].map(|at| (at, 1.0)));
        let sight = sight(&corners, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]);
        assert!(rows(&sight).iter().all(|row| !row.contains('.')), "{:#?}", rows(&sight));
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        let flat = [([1.0, 1.0], 1.0), ([6.0, 6.0], 1.0), ([3.0, 3.0], 1.0)];
        let behind = [([1.0, 1.0], 1.0), ([6.0, 1.0], 0.0), ([1.0, 6.0], 1.0)];
        for corners in [flat, behind] {
            assert!(rows(&sight(&corners, &[[0, 1, 2], [0, 0, 1]])).iter().all(|row| row == "........"));
        }
    }

    #[test]
    fn the_threads_do_not_show() {
        let frame = Frame { width: 200, height: 150, margin: 0 };
        let mesh = torus(200, 150);
        let faces = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let camera = Camera::new(&mesh, DVec3::new(1.0, -1.0, 1.0), DVec3::Z, &frame);
            let sight = pool.install(|| draw(&mesh, &camera, &frame, &everywhere));
            sight.cells.into_iter().map(AtomicU64::into_inner).collect::<Vec<_>>()
        };
        let one = faces(1);
        assert!(one.iter().filter(|&&cell| cell != u64::MAX).count() > 10_000);
        assert_eq!(one, faces(5));
    }

    #[test]
    fn a_ball_is_round_and_shows_its_front() {
        let frame = Frame { width: 100, height: 100, margin: 0 };
        let ball = icosphere(4);
        let sight = draw(&ball, &Camera::new(&ball, DVec3::NEG_Y, DVec3::Z, &frame), &frame, &everywhere);
        let mut covered = 0;
        for (row, column) in (0..100).flat_map(|row| (0..100).map(move |column| (row, column))) {
            if let Some(face) = sight.face(column, row) {
                covered += 1;
                let [a, b, c] = ball.faces[face as usize].map(|v| ball.positions[v as usize]);
                assert!((a + b + c).y < 0.0, "face {face} lies at the back");
            }
        }
        assert!((7600..7900).contains(&covered), "{covered} samples instead of about 7,854");
    }
}
