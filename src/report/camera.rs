//! A perspective camera that frames a mesh.

use rayon::prelude::*;

use crate::math::DVec3;
use crate::mesh::Mesh;

/// Half the field of view's tangent over the longer side: a lens of 25 degrees, which bends little.
const HALF_VIEW: f64 = 0.22;
/// What is closer to the eye than this share of the way to the mesh is not drawn.
const NEAR: f64 = 0.05;

/// Where the eye is, and its axes: right, up and backward.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    center: DVec3,
    axes: [DVec3; 3],
    /// From the center to the eye.
    distance: f64,
}

/// How an image stands before the camera, in samples.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Its width.
    pub width: usize,
    /// Its height.
    pub height: usize,
    /// What is left free at every side.
    pub margin: usize,
}

impl Camera {
    /// Looks at the middle of `mesh` from the side of `toward`, with `up` up, from as near as shows all of it in `frame`.
    ///
    /// The eye is outside then. What the frame shows is the faces: a vertex without a face does not count.
    pub fn new(mesh: &Mesh, toward: DVec3, up: DVec3, frame: &Frame) -> Self {
        let axes = axes(toward, up);
        let (low, high) = extent(mesh, axes);
        let middle = (low + high) / 2.0;
        let center = axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z;
        let unplaced = Self { center, axes, distance: 0.0 };
        let side = |samples: usize| samples.saturating_sub(2 * frame.margin).max(1) as f64 / 2.0 / frame.focal();
        let (half_width, half_height) = (side(frame.width), side(frame.height));
        // |x| / (distance − z) ≤ half the width, and the same for y.
        let needed = |p: DVec3| p.z + (p.x.abs() / half_width).max(p.y.abs() / half_height);
        let distance = corners(mesh).map(|p| needed(unplaced.turned(p))).reduce(|| 0.0, f64::max);
        Self { distance: if distance > 0.0 && distance.is_finite() { distance } else { 1.0 }, ..unplaced }
    }

    /// `p` from the center, along the axes.
    fn turned(&self, p: DVec3) -> DVec3 {
        along(self.axes, p - self.center)
    }

    /// A direction along the axes.
    pub fn direction(&self, n: DVec3) -> DVec3 {
        along(self.axes, n)
    }

    /// From `p` to the eye, along the axes.
    pub fn eye_from(&self, p: DVec3) -> DVec3 {
        DVec3::Z * self.distance - self.turned(p)
    }

    /// Column, row and nearness of `p` in `frame`, or `None` close to the eye and behind it.
    ///
    /// Nearness is the distance of the mesh's middle over that of `p`: its reciprocals are linear on the image.
    pub fn project(&self, p: DVec3, frame: &Frame) -> Option<(f64, f64, f64)> {
        let p = self.turned(p);
        let depth = self.distance - p.z;
        (depth > NEAR * self.distance).then(|| {
            let scale = frame.focal() / depth;
            (frame.width as f64 / 2.0 + scale * p.x, frame.height as f64 / 2.0 - scale * p.y, self.distance / depth)
        })
    }
}

impl Frame {
    /// The samples that a length of 1 takes at a distance of 1.
    fn focal(&self) -> f64 {
        self.width.max(self.height) as f64 / (2.0 * HALF_VIEW)
    }
}

/// Height over width of `mesh` as it is seen from `toward`; 1 for a point.
pub fn aspect(mesh: &Mesh, toward: DVec3, up: DVec3) -> f64 {
    let (low, high) = extent(mesh, axes(toward, up));
    let size = high - low;
    if size.x > 0.0 && size.is_finite() { size.y / size.x } else { 1.0 }
}

fn axes(toward: DVec3, up: DVec3) -> [DVec3; 3] {
    let back = toward.normalize_or(DVec3::Z);
    let right = up.cross(back).normalize_or(back.any_orthonormal_vector());
    [right, back.cross(right), back]
}

fn along(axes: [DVec3; 3], p: DVec3) -> DVec3 {
    DVec3::from(axes.map(|axis| axis.dot(p)))
}

/// The corners of the box around the faces, along the axes.
fn extent(mesh: &Mesh, axes: [DVec3; 3]) -> (DVec3, DVec3) {
    let nowhere = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = corners(mesh)
        .map(|p| along(axes, p))
        .fold(|| nowhere, |(low, high), p| (low.min(p), high.max(p)))
        .reduce(|| nowhere, |a, b| (a.0.min(b.0), a.1.max(b.1)));
    if low.is_finite() { (low, high) } else { (DVec3::ZERO, DVec3::ZERO) }
}

fn corners(mesh: &Mesh) -> impl ParallelIterator<Item = DVec3> {
    mesh.faces.par_iter().with_min_len(4096).flat_map_iter(|face| face.map(|v| mesh.positions[v as usize]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::icosphere;

    #[test]
    fn a_mesh_fills_the_frame_and_not_more() {
        let frame = Frame { width: 300, height: 200, margin: 10 };
        let mut ball = icosphere(3);
        for p in &mut ball.positions {
            *p = *p * 1e-3 + DVec3::splat(77.0);
        }
        let camera = Camera::new(&ball, DVec3::new(1.0, -2.0, 0.5), DVec3::Z, &frame);
        let rows: Vec<f64> =
            ball.positions.iter().filter_map(|&p| camera.project(p, &frame)).map(|(_, row, _)| row).collect();
        assert_eq!(rows.len(), ball.positions.len());
        let (top, bottom) = rows.iter().fold((f64::MAX, f64::MIN), |(a, b), &row| (a.min(row), b.max(row)));
        assert!((10.0 - 1e-6..11.0).contains(&top) && (189.0..190.0 + 1e-6).contains(&bottom), "{top} {bottom}");
    }

    #[test]
    fn right_is_right_and_up_is_up() {
        let frame = Frame { width: 100, height: 100, margin: 0 };
        let camera = Camera::new(&icosphere(1), DVec3::NEG_Y, DVec3::Z, &frame);
        let at = |p| camera.project(p, &frame).expect("in front of the eye");
        let (x, y, nearness) = at(DVec3::ZERO);
        assert!((x - 50.0).abs() < 1e-9 && (y - 50.0).abs() < 1e-9 && (nearness - 1.0).abs() < 1e-9);
        assert!(at(DVec3::X).0 > 60.0 && at(DVec3::Z).1 < 40.0 && at(DVec3::NEG_Y).2 > 1.0);
        assert!(camera.project(DVec3::NEG_Y * 100.0, &frame).is_none());
    }

    #[test]
    fn nothing_and_a_point_have_a_camera() {
        let frame = Frame { width: 10, height: 10, margin: 0 };
        let point = Mesh::new(vec![DVec3::ONE; 3], vec![[0, 1, 2]]);
        for mesh in [Mesh::default(), point] {
            assert_eq!(aspect(&mesh, DVec3::X, DVec3::X), 1.0);
            assert_eq!(Camera::new(&mesh, DVec3::X, DVec3::X, &frame).distance, 1.0);
        }
    }
}
