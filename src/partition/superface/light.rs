//! The light and the area of every face.

use rayon::prelude::*;

use super::super::surface::Surface;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::orient::TURNED;
use crate::mesh::weld::joined_attributes;

/// What is darker than this share of the brightest light counts as that.
const FLOOR: f32 = 1.0 / 1024.0;
/// The brightest light there is: a thousand times what a screen shows.
const BRIGHTEST: f32 = 1e3;
/// Areas are at most this, so that sums of them are numbers of single precision.
const LARGEST: f64 = 1e30;
/// Faces that a thread takes at a time.
const ROWS: usize = 1 << 12;

/// The light of faces, as kernels have it.
#[derive(Debug)]
pub struct Lights {
    /// F rows of red, green, blue, and the area in units of area; in the frame's where none was given.
    pub rows: Vec<[f32; 4]>,
    /// Below this light counts as this.
    pub floor: f32,
    /// Faces with light below zero, past the brightest, or no number at all.
    pub flawed: usize,
}

impl Lights {
    /// Of the faces of `surface`, which was made of `mesh`; areas in units of `area_unit` squared model units.
    ///
    /// # Errors
    /// [`Error::Mesh`] when there are no colors.
    pub fn new(surface: &Surface, mesh: &Mesh, area_unit: Option<f64>) -> Result<Self> {
        if mesh.face_colors.is_none() && mesh.colors.is_none() {
            let message = "it has no light: superfaces need colors at its faces or vertices, such as PLY has, \
                or take regions by their shape";
            return Err(Error::Mesh(message.into()));
        }
        let length = surface.frame.length_to_model(1.0);
        let unit = area_unit.map_or(1.0, |unit| length * length / unit);
        let row = |(face, &source): (&[u32; 3], &u32)| {
            let [a, b, c] = face.map(|v| surface.points[v as usize]);
            let area = (b - a).cross(c - a).length() / 2.0 * unit;
            let [red, green, blue] = light(mesh, source & !TURNED).map(cut);
            [red, green, blue, area.min(LARGEST) as f32]
        };
        let is_flawed = |&source: &u32| light(mesh, source & !TURNED).into_iter().any(|x| x != cut(x));
        let flawed = surface.face_source.par_iter().with_min_len(ROWS).filter(|&source| is_flawed(source)).count();
        let faces = surface.faces.par_iter().zip(&surface.face_source).with_min_len(ROWS);
        let rows: Vec<[f32; 4]> = faces.map(row).collect();
        let greatest = rows.iter().flat_map(|row| &row[..3]).fold(0.0, |greatest, &light| f32::max(greatest, light));
        Ok(Self { rows, floor: greatest * FLOOR, flawed })
    }
}

/// The light at every vertex of `surface`: its color, or without any the mean light of the faces around it by area,
/// B_v = Σ A_f B_f / Σ A_f \[Liu99\].
pub fn vertex_lights(surface: &Surface, mesh: &Mesh) -> Vec<[f32; 4]> {
    if let (_, Some(colors)) = joined_attributes(mesh, surface.lowest.as_ref(), &surface.vertex_source) {
        return colors.into_iter().map(|[red, green, blue, alpha]| [cut(red), cut(green), cut(blue), alpha]).collect();
    }
    let mean = |vertex: u32| {
        let mut sum = [0.0; 4];
        for &face in surface.rings.ring(vertex) {
            let [a, b, c] = surface.faces[face as usize].map(|v| surface.points[v as usize]);
            let area = (b - a).cross(c - a).length();
            let [red, green, blue] = light(mesh, surface.input_face(face)).map(|x| f64::from(cut(x)) * area);
            sum = [sum[0] + red, sum[1] + green, sum[2] + blue, sum[3] + area];
        }
        let [red, green, blue] = [0, 1, 2].map(|k| if sum[3] > 0.0 { (sum[k] / sum[3]) as f32 } else { 0.0 });
        [red, green, blue, 1.0]
    };
    (0..surface.points.len() as u32).into_par_iter().with_min_len(ROWS).map(mean).collect()
}

/// A channel from nothing to the brightest there is; what is no number is nothing.
fn cut(light: f32) -> f32 {
    if light > 0.0 { light.min(BRIGHTEST) } else { 0.0 }
}

/// The light of a face of the input: its own, or the mean of its corners'.
fn light(mesh: &Mesh, face: u32) -> [f32; 3] {
    if let Some(colors) = &mesh.face_colors {
        let [red, green, blue, _] = colors[face as usize];
        return [red, green, blue];
    }
    let Some(colors) = &mesh.colors else { return [0.0; 3] };
    let corners = mesh.faces[face as usize].map(|v| colors[v as usize]);
    [0, 1, 2].map(|k| corners.iter().map(|corner| corner[k]).sum::<f32>() / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn faces_have_their_own_light_or_that_of_their_corners() {
        let mut mesh = shapes::plane(1, 1);
        let surface = Surface::new(&mesh, Some(0.0)).expect("a valid mesh");
        assert!(matches!(Lights::new(&surface, &mesh, None), Err(Error::Mesh(_))));
        mesh.colors = Some((0..4u8).map(|v| [f32::from(v), f32::NAN, -1.0, 1.0]).collect());
        let of = |mesh: &Mesh| Lights::new(&surface, mesh, None).expect("colors");
        let lights = of(&mesh);
        assert_eq!(lights.flawed, 2);
        for (face, row) in surface.face_source.iter().zip(&lights.rows) {
            let sum: u32 = mesh.faces[*face as usize].iter().sum();
            assert_eq!(row[..3], [sum as f32 / 3.0, 0.0, 0.0]);
        }
        mesh.face_colors = Some(vec![[0.5, 2.0, f32::INFINITY, 1.0]; 2]);
        assert_eq!(of(&mesh).rows[0][..3], [0.5, 2.0, BRIGHTEST]);
        assert_eq!(of(&mesh).floor, BRIGHTEST / 1024.0);
    }

    #[test]
    fn areas_are_in_their_unit() {
        let mut mesh = shapes::plane(2, 2);
        mesh.positions.iter_mut().for_each(|p| *p *= 10.0);
        mesh.colors = Some(vec![[1.0; 4]; 9]);
        let surface = Surface::new(&mesh, Some(0.0)).expect("a valid mesh");
        let areas = |unit| {
            let lights = Lights::new(&surface, &mesh, Some(unit)).expect("colors");
            lights.rows.iter().map(|row| row[3]).sum::<f32>()
        };
        let whole = mesh.area() as f32;
        assert_eq!([areas(1.0), areas(50.0)], [whole, whole / 50.0]);
    }
}
