//! How far a texture slides over the surface: the points of two meshes at the same place of the texture.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::Spread;
use super::atlas::{Atlas, Patch};
use super::sums::Sums;
use crate::error::{Error, Result};
use crate::math::DVec2;
use crate::mesh::Mesh;

/// A usual number of texels along the longer side.
pub const TEXELS: usize = 512;
/// The greatest: 2²⁸ texels of 8 bytes.
const MOST_TEXELS: usize = 1 << 14;
/// Samples at texels after which the texels get larger: a texture that repeats on many faces is sampled on each of them.
const MOST_SAMPLES: f64 = (1 << 24) as f64;
/// Faces a thread takes at a time. The sums are added in the order of the faces, so the result is repeatable.
const CHUNK_FACES: usize = 1 << 10;

/// How far a texture on one mesh has moved from where it is on another, in model units.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct TextureDeviation {
    /// Over the texels that both meshes use: between their points there, the nearest two where the texture is used twice.
    pub deviation: Spread,
    /// The greatest way from a point of the first mesh to the second mesh's nearest point of the same texture coordinates;
    /// over texels and the corners, edge midpoints and centers of faces.
    pub mapping_distance: f64,
    /// The share of the first mesh's texels that the second uses too. All is 0 when they have nothing in common.
    pub covered: f64,
}

/// Compares where `a` and `b` have the same texture coordinates, on a grid of `texels` along the longer side of the box of
/// `a`'s; see [`TEXELS`]. `None` unless both meshes have texture coordinates.
///
/// Coordinates outside `[0, 1]` are taken as they are. Faces without an area in the texture take no part. Where no
/// texel's center lies in a face (tiny charts far apart), the corners, midpoints and centers count as texels. Texels
/// get larger when the texture is used so often that there would be more than 2²⁴ samples.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh, [`Error::Parameter`] for no texels or more than 16,384.
///
/// # Reference
/// \[COM98\] for the texture deviation, the greatest over the texture of the distance between the points of both surfaces.
/// Departs: sampled rather than exact on the overlay of both triangulations, and overlapping charts are allowed.
pub fn texture_deviation(a: &Mesh, b: &Mesh, texels: usize) -> Result<Option<TextureDeviation>> {
    a.check()?;
    b.check()?;
    if !(1..=MOST_TEXELS).contains(&texels) {
        return Err(Error::Parameter(format!("{texels} texels: give 1 to {MOST_TEXELS}")));
    }
    if a.texcoords.is_none() || b.texcoords.is_none() {
        return Ok(None);
    }
    let Some(grid) = Grid::over(patches(a, 0), texels) else { return Ok(Some(TextureDeviation::default())) };
    let atlas = Atlas::new(b);
    let chunks: Vec<Samples> = (0..a.faces.len().div_ceil(CHUNK_FACES))
        .into_par_iter()
        .map(|chunk| Samples::of(patches(a, chunk * CHUNK_FACES).take(CHUNK_FACES), &grid, &atlas))
        .collect();
    let mut at_faces = Samples::default();
    chunks.iter().for_each(|chunk| at_faces.merge(chunk));
    let mut at_texels = Samples::default();
    for distance in grid.distances() {
        at_texels.add(distance);
    }
    let samples = if at_texels.taken > 0 { &at_texels } else { &at_faces };
    Ok(Some(TextureDeviation {
        deviation: samples.sums.finish().unwrap_or_default(),
        mapping_distance: at_faces.greatest,
        covered: samples.found as f64 / samples.taken.max(1) as f64,
    }))
}

/// The faces from `first` on, `None` for those that cover nothing of the texture.
fn patches(mesh: &Mesh, first: usize) -> impl Iterator<Item = Option<Patch>> {
    (first..mesh.faces.len()).map(|face| Patch::of(mesh, face))
}

/// Distances at places of the texture, where both meshes use it.
#[derive(Default)]
struct Samples {
    taken: u64,
    found: u64,
    sums: Sums,
    greatest: f64,
}

impl Samples {
    /// The samples of faces. Those at texels go to the grid and count for the greatest only.
    fn of(patches: impl Iterator<Item = Option<Patch>>, grid: &Grid, atlas: &Atlas<'_>) -> Self {
        let mut samples = Self::default();
        for patch in patches.flatten() {
            let [a, b, c] = patch.uv;
            for place in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
                if let Some(point) = patch.at(place) {
                    samples.add(atlas.distance(place, point));
                }
            }
            grid.for_each_texel(patch.uv, |texel, place| {
                let Some(point) = patch.at(place) else { return };
                let distance = atlas.distance(place, point);
                samples.greatest = samples.greatest.max(distance.unwrap_or(0.0));
                grid.note(texel, distance);
            });
        }
        samples
    }

    fn add(&mut self, distance: Option<f64>) {
        self.taken += 1;
        if let Some(distance) = distance {
            self.found += 1;
            self.sums.add(distance);
            self.greatest = self.greatest.max(distance);
        }
    }

    fn merge(&mut self, other: &Self) {
        self.taken += other.taken;
        self.found += other.found;
        self.sums.merge(&other.sums);
        self.greatest = self.greatest.max(other.greatest);
    }
}

/// Texels over a part of the texture, each with the least distance noted there.
struct Grid {
    low: DVec2,
    /// The side of a texel.
    size: f64,
    columns: usize,
    rows: usize,
    /// Bits of a distance, whose order is that of the numbers; infinity where only the first mesh is.
    nearest: Vec<AtomicU64>,
}

/// Marks a texel where nothing was noted: above every distance.
const UNUSED: u64 = u64::MAX;

impl Grid {
    /// A grid over the box of `patches`; `None` without any.
    fn over(patches: impl Iterator<Item = Option<Patch>>, texels: usize) -> Option<Self> {
        let (mut low, mut high, mut area) = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0.0);
        for patch in patches.flatten() {
            (low, high) = patch.uv.iter().fold((low, high), |(low, high), &uv| (low.min(uv), high.max(uv)));
            area += patch.area();
        }
        if area <= 0.0 {
            return None;
        }
        let extent = high - low;
        let size = (extent.max_element() / texels as f64).max((area / MOST_SAMPLES).sqrt());
        let count = |length: f64| ((length / size).ceil() as usize).clamp(1, texels);
        let (columns, rows) = (count(extent.x), count(extent.y));
        let nearest = (0..columns * rows).map(|_| AtomicU64::new(UNUSED)).collect();
        Some(Self { low, size, columns, rows, nearest })
    }

    /// The texels from `from` to `to` whose centers lie between, of `count`.
    fn between(&self, from: f64, to: f64, low: f64, count: usize) -> std::ops::Range<usize> {
        // The casts saturate.
        let first = ((from - low) / self.size - 0.5).ceil().max(0.0) as usize;
        let last = ((to - low) / self.size - 0.5).floor();
        if last >= 0.0 { first..count.min(last as usize + 1) } else { 0..0 }
    }

    /// Calls `each` with the texels whose centers lie in a triangle of the texture, and those centers.
    fn for_each_texel(&self, uv: [DVec2; 3], mut each: impl FnMut(usize, DVec2)) {
        let low = uv.iter().fold(f64::INFINITY, |low, corner| low.min(corner.y));
        let high = uv.iter().fold(f64::NEG_INFINITY, |high, corner| high.max(corner.y));
        for row in self.between(low, high, self.low.y, self.rows) {
            let y = self.low.y + (row as f64 + 0.5) * self.size;
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            for [p, q] in [[uv[0], uv[1]], [uv[1], uv[2]], [uv[2], uv[0]]] {
                if p.y != q.y && y >= p.y.min(q.y) && y <= p.y.max(q.y) {
                    let x = p.x + (y - p.y) * (q.x - p.x) / (q.y - p.y);
                    (from, to) = (from.min(x), to.max(x));
                }
            }
            for column in self.between(from, to, self.low.x, self.columns) {
                each(row * self.columns + column, DVec2::new(self.low.x + (column as f64 + 0.5) * self.size, y));
            }
        }
    }

    /// Notes the distance of a point at a texel, `None` where the second mesh has none. The least stays, whatever the order.
    fn note(&self, texel: usize, distance: Option<f64>) {
        // Plus zero: a negative zero would be above all.
        let bits = (distance.unwrap_or(f64::INFINITY) + 0.0).to_bits();
        self.nearest[texel].fetch_min(bits, Ordering::Relaxed);
    }

    /// What was noted at the texels of the first mesh, in their order.
    fn distances(&self) -> impl Iterator<Item = Option<f64>> {
        let noted = self.nearest.iter().map(|bits| bits.load(Ordering::Relaxed)).filter(|&bits| bits != UNUSED);
        noted.map(|bits| Some(f64::from_bits(bits)).filter(|distance| distance.is_finite()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Vec2};
    use crate::mesh::shapes;

    /// Texture coordinates of every corner by the position of its vertex.
    fn textured(mut mesh: Mesh, uv: impl Fn(DVec3) -> (f64, f64)) -> Mesh {
        let of = |v: u32| {
            let (u, v) = uv(mesh.positions[v as usize]);
            Vec2::new(u as f32, v as f32)
        };
        mesh.texcoords = Some(mesh.faces.iter().map(|face| face.map(of)).collect());
        mesh
    }

    /// 8 × 8 units on the unit square, all of it exact.
    fn sheet() -> Mesh {
        textured(shapes::plane(8, 8), |p| (p.x / 8.0, p.y / 8.0))
    }

    fn moved(mut mesh: Mesh, by: DVec3) -> Mesh {
        mesh.positions.iter_mut().for_each(|p| *p += by);
        mesh
    }

    fn compare(a: &Mesh, b: &Mesh) -> TextureDeviation {
        texture_deviation(a, b, 64).expect("valid meshes").expect("texture coordinates")
    }

    fn assert_all(found: &TextureDeviation, length: f64, covered: f64) {
        let Spread { max, mean, rms } = found.deviation;
        let near = [max, mean, rms, found.mapping_distance].iter().all(|x| (x - length).abs() < 1e-6);
        assert!(near && (found.covered - covered).abs() < 1e-9, "{found:?}, expected {length} on {covered}");
    }

    #[test]
    fn a_mesh_is_nowhere_from_itself() {
        let exact = TextureDeviation { covered: 1.0, ..TextureDeviation::default() };
        assert_eq!(compare(&sheet(), &sheet()), exact);
        // Charts that overlap: the torus shows each place of the texture about twice.
        let torus = textured(shapes::torus(40, 30), |p| (p.x / 3.0, p.y / 7.0));
        assert_eq!(compare(&torus, &torus), exact);
    }

    #[test]
    fn a_moved_sheet_is_as_far_as_it_was_moved() {
        assert_all(&compare(&sheet(), &moved(sheet(), DVec3::new(2.0, 3.0, 6.0))), 7.0, 1.0);
        // Another triangulation and another orientation of the same surface make no difference.
        let coarse = textured(shapes::plane(1, 1), |p| (p.x, p.y));
        let mut coarse = Mesh { positions: coarse.positions.iter().map(|&p| p * 8.0).collect(), ..coarse };
        coarse.faces.iter_mut().for_each(|face| face.reverse());
        coarse.texcoords.iter_mut().flatten().for_each(|row| row.reverse());
        assert_all(&compare(&sheet(), &moved(coarse, DVec3::Z)), 1.0, 1.0);
    }

    // The texture is pushed by a quarter of its width, 2 units: three quarters of the texels are still used.
    #[test]
    fn a_pushed_texture_is_as_far_as_it_was_pushed() {
        let pushed = textured(shapes::plane(8, 8), |p| (p.x / 8.0 + 0.25, p.y / 8.0));
        assert_all(&compare(&sheet(), &pushed), 2.0, 0.75);
        assert_all(&compare(&pushed, &sheet()), 2.0, 0.75);
    }

    #[test]
    fn a_pulled_vertex_is_the_greatest_but_not_the_mean() {
        let mut pulled = sheet();
        pulled.positions[40].z = 3.0;
        let found = compare(&sheet(), &pulled);
        assert_eq!(found.mapping_distance, 3.0);
        assert!(found.deviation.max < 3.0 && found.deviation.max > 2.5, "{found:?}");
        // The pulled pyramid over six halves of squares: volume 1/3 · 3 units² · 3 units, over 64 units².
        assert!((found.deviation.mean - 3.0 / 64.0).abs() < 2e-3, "{found:?}");
    }

    #[test]
    fn of_overlapping_charts_the_nearest_counts() {
        // Every square shows the whole texture, mirrored in every second column.
        let tiled = |mut mesh: Mesh| {
            let uv = |square: usize, x: f32, y: f32| Vec2::new(if square.is_multiple_of(2) { x } else { 1.0 - x }, y);
            let row = |face: usize| match (face / 2, face % 2) {
                (square, 0) => [uv(square, 0.0, 0.0), uv(square, 1.0, 0.0), uv(square, 1.0, 1.0)],
                (square, _) => [uv(square, 0.0, 0.0), uv(square, 1.0, 1.0), uv(square, 0.0, 1.0)],
            };
            mesh.texcoords = Some((0..mesh.faces.len()).map(row).collect());
            mesh
        };
        let sheet = tiled(shapes::plane(12, 12));
        assert_eq!(compare(&sheet, &sheet).mapping_distance, 0.0);
        assert_all(&compare(&sheet, &moved(sheet.clone(), DVec3::Z * 0.25)), 0.25, 1.0);
        // The upper six rows are gone: the last of them finds its part of the texture six rows below.
        let mut half = sheet.clone();
        half.faces.truncate(144);
        half.texcoords.iter_mut().for_each(|rows| rows.truncate(144));
        let found = compare(&sheet, &half);
        assert!(found.covered == 1.0 && found.deviation.max < 1e-9, "{found:?}");
        assert!((found.mapping_distance - 6.0).abs() < 1e-9, "{found:?}");
        assert_eq!(compare(&half, &sheet).mapping_distance, 0.0);
    }

    #[test]
    fn what_has_nothing_in_common_has_no_deviation() {
        let elsewhere = textured(shapes::plane(8, 8), |p| (p.x / 8.0 + 2.0, p.y / 8.0));
        assert_eq!(compare(&sheet(), &elsewhere), TextureDeviation::default());
        let nowhere = textured(shapes::plane(8, 8), |_| (0.5, 0.5));
        assert_eq!(compare(&sheet(), &nowhere), TextureDeviation::default());
        assert_eq!(compare(&nowhere, &sheet()), TextureDeviation::default());
        let line = textured(shapes::plane(8, 8), |p| (p.x, p.x));
        assert_eq!(compare(&line, &sheet()), TextureDeviation::default());
    }

    #[test]
    fn huge_and_tiny_charts_are_found() {
        for scale in [1e-30, 1e-10, 1e6, 1e30] {
            let scaled = textured(shapes::plane(8, 8), |p| (p.x * scale, -p.y * scale));
            assert_all(&compare(&scaled, &moved(scaled.clone(), DVec3::Y)), 1.0, 1.0);
        }
        // Two charts so far apart that no texel's center lies in either.
        let apart = |p: DVec3| if p.x > 4.5 { (p.x + 1e6, p.y) } else { (p.x, p.y) };
        let mut two = textured(shapes::plane(8, 8), apart);
        let (faces, rows) = (&two.faces, two.texcoords.iter().flatten());
        let kept: Vec<_> =
            faces.iter().copied().zip(rows.copied()).filter(|(_, r)| r[0].distance(r[1]) < 9.0).collect();
        let kept: Vec<_> = kept.into_iter().filter(|(_, r)| r[1].distance(r[2]) < 9.0).collect();
        (two.faces, two.texcoords) = (kept.iter().map(|k| k.0).collect(), Some(kept.iter().map(|k| k.1).collect()));
        assert_all(&compare(&two, &moved(two.clone(), DVec3::Z)), 1.0, 1.0);
    }

    #[test]
    fn meshes_without_texture_coordinates_have_none() {
        assert_eq!(texture_deviation(&sheet(), &shapes::plane(8, 8), 64).ok(), Some(None));
        assert_eq!(texture_deviation(&Mesh::default(), &sheet(), 64).ok(), Some(None));
        let empty = Mesh { texcoords: Some(Vec::new()), ..Mesh::default() };
        assert_eq!(compare(&empty, &sheet()), TextureDeviation::default());
        assert_eq!(compare(&sheet(), &empty), TextureDeviation::default());
        for texels in [0, MOST_TEXELS + 1] {
            assert!(matches!(texture_deviation(&sheet(), &sheet(), texels), Err(Error::Parameter(_))));
        }
        let bad = Mesh { texcoords: Some(Vec::new()), ..sheet() };
        assert!(matches!(texture_deviation(&bad, &sheet(), 64), Err(Error::Mesh(_))));
    }

    #[test]
    fn threads_do_not_show() {
        let map = |p: DVec3| (p.x / 3.0 + p.z, p.y / 5.0);
        let (fine, coarse) = (textured(shapes::torus(120, 70), map), textured(shapes::torus(40, 25), map));
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let one = pool(1).install(|| compare(&fine, &coarse));
        assert!(one.deviation.mean > 0.0 && one.covered > 0.9, "{one:?}");
        assert_eq!(pool(3).install(|| compare(&fine, &coarse)), one);
    }
}
