//! What is partitioned, as energies see it: the normal and area of every face, how much it bends, and which faces hang
//! together at all.

use rayon::prelude::*;

use crate::backend::Queue;
use crate::error::Result;
use crate::kernel::angle_defects::AngleDefects;
use crate::kernel::face_corners::FaceCorners;
use crate::kernel::face_normals::FaceNormals;
use crate::kernel::rows::{Corners, Normal};
use crate::math::DVec3;
use crate::mesh::dual::{self, NONE};

use super::super::surface::Surface;

/// Faces or vertices that a thread takes at a time.
const ROWS: usize = 1 << 12;
/// An angle defect in radians that rounding may make of a flat: six angles, each off by some 10⁻⁶.
const FLAT: f32 = 1e-5;
/// Share of the bent vertices whose curvature counts in full; the others have next to no area.
const UNCAPPED: f64 = 0.999;

/// A face as energies see it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shape {
    /// The unit normal n; zero for a face without area.
    pub normal: DVec3,
    /// The area ρ, with half the bounding box's diagonal as the unit of length.
    pub area: f64,
}

impl Shape {
    /// ρ n.
    pub fn weighted(&self) -> DVec3 {
        self.normal * self.area
    }

    /// |n − u|²; 0 for a face without area, which goes with any neighbor.
    pub fn distance_sq(&self, direction: DVec3) -> f64 {
        if self.area > 0.0 { (self.normal - direction).length_squared() } else { 0.0 }
    }
}

/// A surface with what a partition of it needs; shared by all that try one.
#[derive(Debug)]
pub struct Scene<'a> {
    pub surface: &'a Surface,
    pub shapes: Vec<Shape>,
    /// The area of every face times the mean of its corners' |Gaussian curvature|.
    pub bends: Vec<f64>,
    /// The sum of all areas.
    pub area: f64,
    /// The component of every face.
    pub components: Vec<u32>,
    /// Whether a component has no wall.
    pub is_closed: Vec<bool>,
}

impl<'a> Scene<'a> {
    /// Measures the faces of `surface` on the device of `queue`.
    ///
    /// # Errors
    /// As [`Queue::run`].
    pub fn new(queue: &mut Queue, surface: &'a Surface) -> Result<Self> {
        let uploaded = surface.upload(queue)?;
        let (positions, faces) = (&uploaded.positions, &uploaded.faces);
        let (ring_starts, ring_faces) = (&uploaded.ring_starts, &uploaded.ring_faces);
        let (vertex_count, face_count) = (surface.points.len() as u32, surface.faces.len() as u32);
        let mut normals = queue.buffer(surface.faces.len())?;
        let mut corners = queue.buffer(surface.faces.len())?;
        let mut defects = queue.buffer(surface.points.len())?;
        queue.run(FaceNormals { positions, faces, face_count, normals: &mut normals })?;
        queue.run(FaceCorners { positions, faces, face_count, corners: &mut corners })?;
        queue.run(AngleDefects {
            positions,
            faces,
            ring_starts,
            ring_faces,
            corners: &corners,
            vertex_count,
            defects: &mut defects,
        })?;
        let unit = (2.0 / surface.diagonal).powi(2);
        let shape = |row: &Normal| {
            let root = f64::from(row.root);
            let normal = row.weighted().as_dvec3().normalize_or_zero();
            Shape { normal, area: if normal == DVec3::ZERO { 0.0 } else { 0.5 * root * root * unit } }
        };
        let shapes: Vec<Shape> = queue.rows(&normals)?.par_iter().with_min_len(ROWS).map(shape).collect();
        let bends = bends(surface, &shapes, &queue.rows(&corners)?, &queue.rows(&defects)?);
        let (components, is_closed) = components(&surface.neighbors);
        let area = shapes.iter().map(|shape| shape.area).sum();
        Ok(Self { surface, shapes, bends, area, components, is_closed })
    }

    /// How many faces there are.
    pub fn face_count(&self) -> usize {
        self.shapes.len()
    }

    /// The fewest regions that it may have: one a component, two where it is closed.
    pub fn fewest_regions(&self) -> usize {
        self.is_closed.iter().map(|&is_closed| 1 + usize::from(is_closed)).sum()
    }

    /// How many regions there are where fewer were asked for than there must be: parts too small for a region of their own have
    /// theirs beside those that were asked for, so that crumbs do not use them up.
    pub fn regions_beside(&self, asked: usize) -> usize {
        let mut areas = vec![0.0; self.is_closed.len()];
        for (shape, &component) in self.shapes.iter().zip(&self.components) {
            areas[component as usize] += shape.area;
        }
        let share = self.area / asked as f64;
        let regions = |is_large: bool| -> usize {
            let parts = self.is_closed.iter().zip(&areas).filter(|(_, area)| (**area >= share) == is_large);
            parts.map(|(&is_closed, _)| 1 + usize::from(is_closed)).sum()
        };
        match regions(true) {
            0 => self.fewest_regions(),
            large => regions(false) + large.max(asked),
        }
    }

    /// The faces across the edges of one.
    pub fn around(&self, face: u32) -> impl Iterator<Item = u32> + use<> {
        self.surface.neighbors[face as usize].into_iter().filter(|&other| other != NONE)
    }
}

/// The area of every face times the mean |κ| of its corners, κ = (2π − Σθ)/A with Meyer's mixed area A: lengths cancel.
fn bends(surface: &Surface, shapes: &[Shape], corners: &[Corners], defects: &[f32]) -> Vec<f64> {
    let curvature = |v: usize| {
        if defects[v].abs() < FLAT {
            return 0.0;
        }
        let area_in = |&face: &u32| {
            let row = corners[face as usize];
            let corner = surface.faces[face as usize].iter().position(|&c| c as usize == v).unwrap_or(0);
            f64::from([row.area_a, row.area_b, row.area_c][corner])
        };
        let area: f64 = surface.rings.ring(v as u32).iter().map(area_in).sum();
        if area > 0.0 { f64::from(defects[v]).abs() / area } else { 0.0 }
    };
    let curvatures: Vec<f64> = (0..surface.points.len()).into_par_iter().with_min_len(ROWS).map(curvature).collect();
    let most = cap(&curvatures);
    let to_frame = (surface.diagonal / 2.0).powi(2);
    let bend = |(face, shape): (&[u32; 3], &Shape)| {
        shape.area * to_frame * face.map(|v| curvatures[v as usize].min(most)).iter().sum::<f64>() / 3.0
    };
    surface.faces.par_iter().zip(shapes).with_min_len(ROWS).map(bend).collect()
}

/// The curvature that [`UNCAPPED`] of the bent vertices do not exceed.
fn cap(curvatures: &[f64]) -> f64 {
    let mut bent: Vec<f64> = curvatures.iter().copied().filter(|&curvature| curvature > 0.0).collect();
    if bent.is_empty() {
        return 0.0;
    }
    let rank = ((bent.len() - 1) as f64 * UNCAPPED).ceil() as usize;
    *bent.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// The component of every face, and whether each is closed.
fn components(neighbors: &[[u32; 3]]) -> (Vec<u32>, Vec<bool>) {
    let (components, firsts) = dual::components(neighbors, |_, _| true);
    let mut is_closed = vec![true; firsts.len()];
    for (row, &component) in neighbors.iter().zip(&components) {
        is_closed[component as usize] &= !row.contains(&NONE);
    }
    (components, is_closed)
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::backend::Device;
    use crate::mesh::{Mesh, shapes};

    pub fn surface(mesh: &Mesh) -> Surface {
        Surface::new(mesh, Some(0.0)).expect("a valid mesh")
    }

    /// A torus with waves of two lengths on it: normals of all directions, no symmetry.
    pub fn bumpy_torus(around: u32, across: u32) -> Mesh {
        let mut mesh = shapes::torus(around, across);
        for p in &mut mesh.positions {
            let wave = |k: f64| DVec3::new((k * p.y).sin(), (k * p.z + 1.0).sin(), (k * p.x + 2.0).sin());
            *p += 0.05 * wave(3.1) + 0.02 * wave(9.7);
        }
        mesh
    }

    pub fn scene(surface: &Surface) -> Scene<'_> {
        let device = Device::cpu(1).expect("a thread");
        Scene::new(&mut device.cpu_queue(), surface).expect("the CPU does not fail")
    }

    #[test]
    fn areas_are_in_half_diagonals() {
        // A unit square: its half diagonal is √½.
        let surface = surface(&shapes::plane(4, 4));
        let scene = scene(&surface);
        assert!((scene.area - 2.0).abs() < 1e-12, "{}", scene.area);
        assert!(scene.shapes.iter().all(|shape| shape.normal.z.abs() == 1.0));
        let unlike = scene.shapes[0].distance_sq(-scene.shapes[0].normal);
        assert_eq!((unlike, Shape::default().distance_sq(DVec3::X)), (4.0, 0.0));
    }

    /// Σ κ A = 2π χ; of a cube all at its corners, and the bends hold the same in sum where faces are alike.
    #[test]
    fn curvature_adds_up_to_the_characteristic() {
        for (mesh, chi) in [(shapes::icosphere(3), 2.0), (shapes::torus(30, 20), 0.0), (shapes::cube(5), 2.0)] {
            let surface = surface(&mesh);
            let device = Device::cpu(1).expect("a thread");
            let mut queue = device.cpu_queue();
            let on = surface.upload(&mut queue).expect("memory");
            let mut corners = queue.buffer(surface.faces.len()).expect("memory");
            let mut defects = queue.buffer(surface.points.len()).expect("memory");
            let (positions, faces, face_count) = (&on.positions, &on.faces, surface.faces.len() as u32);
            queue.run(FaceCorners { positions, faces, face_count, corners: &mut corners }).expect("the CPU");
            let (ring_starts, ring_faces) = (&on.ring_starts, &on.ring_faces);
            let vertex_count = surface.points.len() as u32;
            let (corners, defects_out) = (&corners, &mut defects);
            let kernel =
                AngleDefects { positions, faces, ring_starts, ring_faces, corners, vertex_count, defects: defects_out };
            queue.run(kernel).expect("the CPU");
            let sum: f64 = defects.host().iter().map(|&defect| f64::from(defect)).sum();
            assert!((sum - std::f64::consts::TAU * chi).abs() < 1e-2, "{sum}");
        }
        let sphere = surface(&shapes::icosphere(4));
        let bent: f64 = scene(&sphere).bends.iter().sum();
        assert!((bent / (2.0 * std::f64::consts::TAU) - 1.0).abs() < 0.02, "{bent}");
    }

    #[test]
    fn flats_do_not_bend() {
        let cube = surface(&shapes::cube(40));
        let scene = scene(&cube);
        // Six or so faces at each of the eight corners.
        assert!((24..=48).contains(&scene.bends.iter().filter(|&&bend| bend > 0.0).count()));
        assert_eq!(cap(&[0.0, 0.0]), 0.0);
        assert_eq!(cap(&(0..2001).map(f64::from).collect::<Vec<_>>()), 1999.0);
    }

    #[test]
    fn components_know_whether_they_are_closed() {
        let (mut two, plane) = (shapes::tetrahedron(), shapes::plane(1, 1));
        let shift = two.positions.len() as u32;
        two.positions.extend(plane.positions);
        two.faces.extend(plane.faces.iter().map(|face| face.map(|v| v + shift)));
        let neighbors = dual::neighbors(&two.faces, &crate::mesh::Rings::new(&two.faces, two.positions.len()));
        assert_eq!(components(&neighbors), (vec![0, 0, 0, 0, 1, 1], vec![true, false]));
    }
}
