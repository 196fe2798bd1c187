//! The shape of triangles: what a solver or a shader thinks of a mesh.

use rayon::prelude::*;

use crate::math::DVec3;
use crate::mesh::Mesh;

/// Faces a thread takes at a time. The sums are added in the order of the faces, so the result is repeatable.
const CHUNK_FACES: usize = 1 << 12;

/// How well shaped the faces of a mesh are. All is 0 without faces.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Quality {
    /// The share of faces with an angle below 10°.
    pub below_10_degrees: f64,
    /// Faces by twice the inscribed circle's radius over the circumscribed one's, in tenths: 1 is equilateral, 0 has no area.
    pub ratio_histogram: [u64; 10],
    /// The mean of that ratio.
    pub mean_ratio: f64,
    /// The smallest angle of any face.
    pub min_angle_rad: f64,
}

/// Measures the faces of a mesh that passes [`Mesh::check`]. A face without an area has the ratio 0 and an angle of 0.
pub fn quality(mesh: &Mesh) -> Quality {
    let chunks: Vec<Sums> = mesh.faces.par_chunks(CHUNK_FACES).map(|faces| Sums::of(mesh, faces)).collect();
    if chunks.is_empty() {
        return Quality::default();
    }
    let mut all = Sums::default();
    chunks.iter().for_each(|chunk| all.merge(chunk));
    let count = mesh.faces.len() as f64;
    Quality {
        below_10_degrees: all.below as f64 / count,
        ratio_histogram: all.histogram,
        mean_ratio: all.ratio / count,
        min_angle_rad: all.min_angle_rad,
    }
}

struct Sums {
    below: u64,
    histogram: [u64; 10],
    ratio: f64,
    min_angle_rad: f64,
}

impl Default for Sums {
    fn default() -> Self {
        Self { below: 0, histogram: [0; 10], ratio: 0.0, min_angle_rad: f64::INFINITY }
    }
}

impl Sums {
    fn of(mesh: &Mesh, faces: &[[u32; 3]]) -> Self {
        let mut sums = Self::default();
        for face in faces {
            let (ratio, angle_rad) = shape(face.map(|v| mesh.positions[v as usize]));
            sums.below += u64::from(angle_rad < 10.0_f64.to_radians());
            sums.histogram[((ratio * 10.0) as usize).min(9)] += 1;
            sums.ratio += ratio;
            sums.min_angle_rad = sums.min_angle_rad.min(angle_rad);
        }
        sums
    }

    fn merge(&mut self, other: &Self) {
        self.below += other.below;
        self.histogram.iter_mut().zip(other.histogram).for_each(|(own, other)| *own += other);
        self.ratio += other.ratio;
        self.min_angle_rad = self.min_angle_rad.min(other.min_angle_rad);
    }
}

/// Twice the inradius over the circumradius, and the smallest angle.
///
/// r = 2·A / (a + b + c) and R = a·b·c / (4·A), so 2·r / R = 4·(2·A)² / ((a + b + c)·a·b·c), where 2·A is the length of the
/// cross product.
fn shape([a, b, c]: [DVec3; 3]) -> (f64, f64) {
    let edges = [b - a, c - b, a - c];
    // In units of the longest side neither tiny nor huge models leave the range of the products.
    let longest = edges.iter().fold(0.0_f64, |longest, edge| longest.max(edge.abs().max_element()));
    if !(longest > 0.0 && longest.is_finite()) {
        return (0.0, 0.0);
    }
    let edges = edges.map(|edge| edge / longest);
    let lengths = edges.map(DVec3::length);
    let twice_area = edges[0].cross(-edges[2]).length();
    let product = lengths.iter().sum::<f64>() * lengths.iter().product::<f64>();
    if !(twice_area > 0.0 && product > 0.0) {
        return (0.0, 0.0);
    }
    let angles = [0, 1, 2].map(|i| twice_area.atan2(-edges[i].dot(edges[(i + 2) % 3])));
    let ratio = 4.0 * twice_area * twice_area / product;
    (ratio.min(1.0), angles.into_iter().fold(f64::INFINITY, f64::min))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn triangle(corners: [[f64; 3]; 3]) -> Quality {
        quality(&Mesh::new(corners.map(DVec3::from).to_vec(), vec![[0, 1, 2]]))
    }

    #[test]
    fn equilateral_faces_are_perfect() {
        let quality = quality(&shapes::icosahedron());
        assert_eq!((quality.below_10_degrees, quality.ratio_histogram), (0.0, [0, 0, 0, 0, 0, 0, 0, 0, 0, 20]));
        assert!((quality.mean_ratio - 1.0).abs() < 1e-12);
        assert!((quality.min_angle_rad - 60.0_f64.to_radians()).abs() < 1e-9);
    }

    // Legs 3 and 4: r = 1, R = 5/2, so the ratio is 4/5; a hair less falls in the tenth below, so legs 1 and 1 as well:
    // r = 1/(2 + √2), R = √2/2, ratio 4/(2√2 + 2) = 0.828….
    #[test]
    fn right_triangles_by_hand() {
        let quality = triangle([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        assert!((quality.mean_ratio - 0.8).abs() < 1e-12);
        assert!((quality.min_angle_rad - 0.75_f64.atan()).abs() < 1e-12);
        let plane = super::quality(&shapes::plane(3, 3));
        assert_eq!(plane.ratio_histogram, [0, 0, 0, 0, 0, 0, 0, 0, 18, 0]);
        assert!((plane.mean_ratio - 4.0 / (2.0 + 8.0_f64.sqrt())).abs() < 1e-12);
        assert!((plane.min_angle_rad - 45.0_f64.to_radians()).abs() < 1e-12);
    }

    #[test]
    fn ten_degrees_is_the_limit_at_any_size() {
        for scale in [1e-300, 1e-30, 1.0, 1e30, 1e300] {
            let with_angle = |degrees: f64| {
                let (y, x) = degrees.to_radians().sin_cos();
                triangle([[0.0; 3], [scale, 0.0, 0.0], [x * scale, y * scale, 0.0]])
            };
            assert_eq!(with_angle(9.99).below_10_degrees, 1.0, "{scale}");
            assert_eq!(with_angle(10.01).below_10_degrees, 0.0, "{scale}");
            assert!((with_angle(10.01).min_angle_rad - 10.01_f64.to_radians()).abs() < 1e-12, "{scale}");
        }
    }

    #[test]
    fn faces_without_area_count_as_the_worst() {
        let worst =
            Quality { below_10_degrees: 1.0, ratio_histogram: [1, 0, 0, 0, 0, 0, 0, 0, 0, 0], ..Quality::default() };
        assert_eq!(triangle([[1.0; 3]; 3]), worst);
        assert_eq!(triangle([[0.0; 3], [1.0; 3], [3.0; 3]]), worst);
        assert_eq!(triangle([[0.0; 3], [1.0; 3], [1.0; 3]]), worst);
        assert_eq!(triangle([[-f64::MAX; 3], [f64::MAX; 3], [0.0, f64::MAX, 0.0]]), worst);
        assert_eq!(quality(&Mesh::default()), Quality::default());
    }

    #[test]
    fn threads_do_not_show() {
        let mesh = shapes::torus(150, 90);
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let one = pool(1).install(|| quality(&mesh));
        assert!(mesh.faces.len() > 4 * CHUNK_FACES && one.ratio_histogram.iter().sum::<u64>() == 27_000);
        assert_eq!(pool(3).install(|| quality(&mesh)), one);
    }
}
