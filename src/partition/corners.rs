//! What corners of faces carry, as numbers that are linear over a flat region or part it.

use super::Flatness;
use super::plane::Plane;
use super::surface::Surface;
use crate::math::DVec2;
use crate::mesh::orient::input_corner;
use crate::mesh::{ChannelKind, Mesh};

/// Texture coordinates may be off by this at least: a tenth of a texel of a usual texture, and what four digits round away.
const TEXTURE: f64 = 1e-4;
/// And by this share of the greatest, which single precision rounds away.
const ROUNDED: f64 = 1e-6;
/// Colors and weights of joints may be off by a step of 8 bits at least.
const STEP: f64 = 1.0 / 255.0;
/// And scalars by this share of their range; all of them by the share of the diagonal that the surface may be off.
const SCALAR: f64 = 1e-3;
/// Normals may be off by this at least.
const NORMAL: f64 = 1e-6;
/// Of the squared extent of corners: along a direction in which they have none, what they carry does not change.
const RIDGE: f64 = 1e-12;

/// Where numbers come from.
#[derive(Debug, Clone, Copy)]
enum Source {
    Normals,
    Colors,
    Texcoords,
    Channel(usize),
}

/// Some numbers of a row.
#[derive(Debug, Clone, Copy)]
struct Layer {
    source: Source,
    width: usize,
    /// So many at the start of it are names, which no number lies between.
    names: usize,
    /// How far the others may be off.
    tolerance: f64,
}

/// Rows of numbers at the corners of a mesh, in units of what each may be off.
#[derive(Debug)]
pub struct Corners<'a> {
    mesh: &'a Mesh,
    layers: Vec<Layer>,
}

/// Rows as an affine function of places in a plane.
#[derive(Debug, Clone)]
pub struct Affine {
    center: DVec2,
    /// At the center, each with its slope.
    columns: Vec<(f64, DVec2)>,
}

impl Affine {
    /// How far the row of a place is off, in units of what it may be.
    fn off(&self, place: DVec2, row: &[f64]) -> f64 {
        let away = place - self.center;
        let off = |(&x, &(mean, slope)): (&f64, &(f64, DVec2))| (x - (mean + slope.dot(away))).abs();
        row.iter().zip(&self.columns).map(off).fold(0.0, f64::max)
    }
}

impl<'a> Corners<'a> {
    /// The numbers of `mesh`, as far as flat regions may be off; `None` where it carries nothing. `distance` is in model units.
    pub fn new(mesh: &'a Mesh, flatness: Flatness, distance: f64) -> Option<Self> {
        let mut layers = Vec::new();
        let diagonal = mesh.diagonal();
        let share = if diagonal > 0.0 { distance / diagonal } else { 0.0 };
        let step = share.max(STEP);
        let direction = flatness.angle_rad.max(NORMAL);
        if mesh.normals.is_some() {
            layers.push(Layer { source: Source::Normals, width: 3, names: 0, tolerance: direction });
        }
        if mesh.colors.is_some() {
            layers.push(Layer { source: Source::Colors, width: 4, names: 0, tolerance: step });
        }
        let texture = |source: Source, corners: &dyn Fn(usize) -> [[f32; 2]; 3], most: f64| {
            let length = mesh.length_of_texture(corners);
            let slip = if length > 0.0 { distance / length } else { 0.0 };
            Layer { source, width: 2, names: 0, tolerance: slip.max(TEXTURE).max(ROUNDED * most) }
        };
        let greatest = |values: &mut dyn Iterator<Item = f32>| {
            values.filter(|x| x.is_finite()).fold(0.0, |most: f64, x| most.max(f64::from(x).abs()))
        };
        if let Some(rows) = &mesh.texcoords {
            let most = greatest(&mut rows.iter().flatten().flat_map(|uv| uv.to_array()));
            layers.push(texture(Source::Texcoords, &|f| rows[f].map(|uv| uv.to_array()), most));
        }
        for (number, channel) in mesh.channels.iter().enumerate() {
            let (source, width) = (Source::Channel(number), channel.width);
            let finite = || channel.values.iter().copied().filter(|x| x.is_finite()).map(f64::from);
            layers.push(match channel.kind {
                ChannelKind::Texcoords => {
                    let corners = |f: usize| mesh.faces[f].map(|v| [0, 1].map(|i| channel.row(v as usize)[i]));
                    texture(source, &corners, greatest(&mut channel.values.iter().copied()))
                }
                ChannelKind::Tangent => Layer { source, width, names: 0, tolerance: direction },
                ChannelKind::Label => Layer { source, width, names: width, tolerance: step },
                ChannelKind::Joints => Layer { source, width, names: width / 2, tolerance: step },
                ChannelKind::Linear | ChannelKind::Displacement => {
                    let (low, high) = finite().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
                    let tolerance = if high > low { share.max(SCALAR) * (high - low) } else { 1.0 };
                    Layer { source, width, names: 0, tolerance }
                }
            });
        }
        (!layers.is_empty()).then_some(Self { mesh, layers })
    }

    /// Reads the row of a face's corner; what is not finite is zero.
    fn read(&self, surface: &Surface, face: u32, k: usize, row: &mut Vec<f64>) {
        let (face, k) = input_corner(surface.face_source[face as usize], k);
        let (mesh, vertex) = (self.mesh, self.mesh.faces[face][k] as usize);
        row.clear();
        for &Layer { source, names, tolerance, .. } in &self.layers {
            let mut add = |values: &[f32]| {
                let finite = |&x: &f32| if x.is_finite() { f64::from(x) } else { 0.0 };
                // Names are whole numbers: half a step apart, no two are taken for one.
                let scaled = values.iter().enumerate();
                row.extend(scaled.map(|(i, x)| if i < names { finite(x) * 4.0 } else { finite(x) / tolerance }));
            };
            match source {
                Source::Normals => mesh.normals.iter().for_each(|rows| add(&rows[vertex].to_array())),
                Source::Colors => mesh.colors.iter().for_each(|rows| add(&rows[vertex])),
                Source::Texcoords => mesh.texcoords.iter().for_each(|rows| add(&rows[face][k].to_array())),
                Source::Channel(number) => add(mesh.channels[number].row(vertex)),
            }
        }
    }

    /// Calls `each` with the place in `plane` and the row of every corner of these faces; `row` is overwritten.
    fn for_each(
        &self,
        surface: &Surface,
        plane: &Plane,
        (faces, row): (&[u32], &mut Vec<f64>),
        mut each: impl FnMut(DVec2, &[f64]),
    ) {
        for &face in faces {
            for (k, &v) in surface.faces[face as usize].iter().enumerate() {
                self.read(surface, face, k, row);
                each(plane.project(surface.points[v as usize]), row);
            }
        }
    }

    /// The affine function that is nearest to what the corners of these faces carry, by least squares.
    pub fn fit(&self, surface: &Surface, plane: &Plane, faces: &[u32], row: &mut Vec<f64>) -> Affine {
        // About the first corner, so that one pass loses no digits.
        let Some(&first) = faces.first() else {
            return Affine { center: DVec2::ZERO, columns: Vec::new() };
        };
        self.read(surface, first, 0, row);
        let (origin, base) = (plane.project(surface.points[surface.faces[first as usize][0] as usize]), row.clone());
        let mut sum = DVec2::ZERO;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let mut columns = vec![(0.0, DVec2::ZERO); base.len()];
        self.for_each(surface, plane, (faces, row), |place, row| {
            let away = place - origin;
            sum += away;
            (xx, xy, yy) = (xx + away.x * away.x, xy + away.x * away.y, yy + away.y * away.y);
            for (((total, moment), &x), &base) in columns.iter_mut().zip(row).zip(&base) {
                *total += x - base;
                *moment += away * (x - base);
            }
        });
        let count = 3.0 * faces.len() as f64;
        let mean = sum / count;
        let ridge = RIDGE * (xx + yy);
        xx += ridge - sum.x * mean.x;
        yy += ridge - sum.y * mean.y;
        xy -= sum.x * mean.y;
        let determinant = xx * yy - xy * xy;
        for ((total, moment), base) in columns.iter_mut().zip(base) {
            let about_mean = *moment - mean * *total;
            *total = base + *total / count;
            let slope = DVec2::new(yy * about_mean.x - xy * about_mean.y, xx * about_mean.y - xy * about_mean.x);
            *moment = if determinant > 0.0 { slope / determinant } else { DVec2::ZERO };
        }
        let mut first = 0;
        for layer in &self.layers {
            columns[first..first + layer.names].iter_mut().for_each(|(_, slope)| *slope = DVec2::ZERO);
            first += layer.width;
        }
        Affine { center: origin + mean, columns }
    }

    /// How far what the corners of these faces carry is off `map`, in units of what it may be; `row` is overwritten.
    pub fn off(&self, surface: &Surface, plane: &Plane, map: &Affine, (faces, row): (&[u32], &mut Vec<f64>)) -> f64 {
        let mut most = 0.0_f64;
        self.for_each(surface, plane, (faces, row), |place, row| most = most.max(map.off(place, row)));
        most
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;
    use crate::mesh::shapes;

    /// Coordinates that are linear over a sheet far from the origin are fitted to the last digits; where one is off, it tells.
    #[test]
    fn what_is_linear_is_found() {
        let mut sheet = shapes::plane(9, 7);
        sheet.positions.iter_mut().for_each(|p| p.x += 1e3);
        let at = |v: u32| {
            let p = sheet.positions[v as usize];
            Vec2::new((0.5 * (p.x - 1e3) - 0.25 * p.y + 2.0) as f32, (0.125 * p.y) as f32)
        };
        sheet.texcoords = Some(sheet.faces.iter().map(|face| face.map(at)).collect());
        let surface = Surface::new(&sheet, Some(0.0)).expect("a valid mesh");
        let corners = Corners::new(&sheet, Flatness::default(), 0.0).expect("a texture");
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let plane = Plane::of(&surface, &faces).expect("a plane");
        let mut row = Vec::new();
        let all = corners.fit(&surface, &plane, &faces, &mut row);
        assert!(corners.off(&surface, &plane, &all, (&faces, &mut row)) < 1e-6);
        // That of one face is that of all.
        let one = corners.fit(&surface, &plane, &faces[5..6], &mut row);
        assert!(corners.off(&surface, &plane, &one, (&faces, &mut row)) < 1e-6);
        let mut bent = sheet.clone();
        bent.texcoords.iter_mut().for_each(|rows| rows[40][1].y += 3e-4);
        let corners = Corners::new(&bent, Flatness::default(), 0.0).expect("a texture");
        let off = corners.off(&surface, &plane, &all, (&faces, &mut row));
        assert!((2.9..3.1).contains(&off), "{off} times what it may be");
        assert!(Corners::new(&shapes::plane(2, 2), Flatness::default(), 0.0).is_none());
    }
}
