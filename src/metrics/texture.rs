//! How far a texture slides over the surface: the points of two meshes at the same place of the texture.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::Spread;
use super::atlas::{Atlas, Patch};
use super::sums::Sums;
use super::texels::{Extent, Grid};
use crate::error::{Error, Result};
use crate::mesh::Mesh;

/// A usual number of texels along the longer side.
pub const TEXELS: usize = 512;
/// The greatest: 2²⁸ texels of 8 bytes.
const MOST_TEXELS: usize = 1 << 14;
/// Faces a thread takes at a time. The sums are added in the order of the faces, so the result is repeatable.
const CHUNK_FACES: usize = 1 << 10;

/// How far a texture on one mesh has moved from where it is on another, in model units.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct TextureDeviation {
    /// Over the texels that both meshes use: between their points there, the nearest two where the texture is used twice.
    pub deviation: Spread,
    /// The greatest way from a point of the first mesh to the second mesh's nearest point of the same texture coordinates;
    /// over texels and the corners, edge midpoints and centers of faces. Where another part of the second mesh alone shows these, and
    /// a rim of its charts is nearer, to the rim, and as far as the texture goes on from there.
    pub mapping_distance: f64,
    /// The share of the first mesh's texels that the second uses too. All is 0 when they have nothing in common.
    pub covered: f64,
}

/// The same of the faces of one material.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MaterialTexture {
    /// Its name in the first mesh, or in the second where only that has it.
    pub name: String,
    /// Its faces in either mesh.
    pub faces: [usize; 2],
    /// Where both have some.
    pub texture: Option<TextureDeviation>,
}

/// Compares where `a` and `b` have the same texture coordinates, on a grid of `texels` along the longer side of the box of
/// `a`'s; see [`TEXELS`]. `None` unless both meshes have texture coordinates.
///
/// Every material has a texture of its own: where both meshes tell materials, the places of one are looked for in the same
/// one. See [`texture_by_material`].
///
/// Coordinates outside `[0, 1]` are taken as they are. Faces without an area in the texture take no part. Where no
/// texel's center lies in a face (tiny charts far apart), the corners, midpoints and centers count as texels. Texels
/// get larger when the texture is used so often that there would be more than 2²⁰ samples.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh, [`Error::Parameter`] for no texels or more than 16,384.
///
/// # Reference
/// \[COM98\] for the texture deviation, the greatest over the texture of the distance between the points of both surfaces.
/// Departs: sampled rather than exact on the overlay of both triangulations, and overlapping charts are allowed.
pub fn texture_deviation(a: &Mesh, b: &Mesh, texels: usize) -> Result<Option<TextureDeviation>> {
    Ok(texture_by_material(a, b, texels)?.map(|(all, _)| all))
}

/// [`texture_deviation`] over all, and of every material; the list is empty unless both meshes tell materials.
///
/// Materials of the same name are the same, and where no name is in both, those of the same number, if there are as many; where
/// nothing tells which are the same, places are looked for in all.
///
/// # Errors
/// Those of [`texture_deviation`].
pub fn texture_by_material(
    a: &Mesh,
    b: &Mesh,
    texels: usize,
) -> Result<Option<(TextureDeviation, Vec<MaterialTexture>)>> {
    a.check()?;
    b.check()?;
    if !(1..=MOST_TEXELS).contains(&texels) {
        return Err(Error::Parameter(format!("{texels} texels: give 1 to {MOST_TEXELS}")));
    }
    if a.texcoords.is_none() || b.texcoords.is_none() {
        return Ok(None);
    }
    let all: Vec<u32> = (0..a.faces.len() as u32).collect();
    let extent = Extent::of(patches(a, &all));
    let size = extent.texel(texels);
    let mut total = Measured::default();
    let mut measure = |of: &Group| {
        let grid = Grid::over(&Extent::of(patches(a, &of.faces[0])), size, texels)?;
        let atlas = Atlas::new(b, &of.faces[1]);
        let chunks: Vec<Samples> =
            of.faces[0].par_chunks(CHUNK_FACES).map(|chunk| Samples::of(patches(a, chunk), &grid, &atlas)).collect();
        let mut measured = Measured::default();
        chunks.iter().for_each(|chunk| measured.at_faces.merge(chunk));
        grid.distances().for_each(|distance| measured.at_texels.add(distance));
        measured.settle();
        total.at_faces.merge(&measured.at_faces);
        total.at_texels.merge(&measured.at_texels);
        Some(measured.finish())
    };
    let groups = groups(a, b);
    let mut list = Vec::with_capacity(groups.len());
    if groups.iter().any(Group::is_in_both) {
        for group in &groups {
            let texture = measure(group).filter(|_| group.is_in_both());
            list.push(MaterialTexture { texture, ..group.told() });
        }
    } else {
        measure(&Group::whole(a, b));
        list.extend(groups.iter().map(Group::told));
    }
    let has_materials = a.materials.is_some() && b.materials.is_some();
    Ok(Some((total.finish(), if has_materials { list } else { Vec::new() })))
}

/// The faces of one material in both meshes.
#[derive(Debug, Default)]
struct Group {
    name: String,
    faces: [Vec<u32>; 2],
}

impl Group {
    /// All of both.
    fn whole(a: &Mesh, b: &Mesh) -> Self {
        Self { name: String::new(), faces: [a, b].map(|mesh| (0..mesh.faces.len() as u32).collect()) }
    }

    fn is_in_both(&self) -> bool {
        self.faces.iter().all(|faces| !faces.is_empty())
    }

    fn told(&self) -> MaterialTexture {
        MaterialTexture { name: self.name.clone(), faces: [0, 1].map(|side| self.faces[side].len()), texture: None }
    }
}

/// The faces by material, in the order of the first mesh's materials, then those that only the second has.
fn groups(a: &Mesh, b: &Mesh) -> Vec<Group> {
    let (Some(own), Some(other)) = (&a.materials, &b.materials) else {
        return vec![Group::whole(a, b)];
    };
    let mut groups: Vec<Group> = Vec::new();
    let mut known: FxHashMap<&String, usize> = FxHashMap::default();
    let mut number = |groups: &mut Vec<Group>, name| {
        *known.entry(name).or_insert_with(|| {
            groups.push(Group { name: name.clone(), ..Group::default() });
            groups.len() - 1
        })
    };
    let names: FxHashSet<&String> = own.names.iter().collect();
    let in_common = other.names.iter().any(|name| names.contains(name));
    let by_number = !in_common && own.names.len() == other.names.len();
    for (side, materials) in [own, other].into_iter().enumerate() {
        let names = if by_number { &own.names } else { &materials.names };
        let numbers: Vec<usize> = names.iter().map(|name| number(&mut groups, name)).collect();
        for (face, &material) in (0..).zip(&materials.of_face) {
            groups[numbers[material as usize]].faces[side].push(face);
        }
    }
    groups.retain(|group| group.faces.iter().any(|faces| !faces.is_empty()));
    groups
}

/// These faces, `None` for those that cover nothing of the texture.
fn patches(mesh: &Mesh, faces: &[u32]) -> impl Iterator<Item = Option<Patch>> {
    faces.iter().map(|&face| Patch::of(mesh, face as usize))
}

/// Samples of a part of the texture.
#[derive(Default)]
struct Measured {
    at_faces: Samples,
    at_texels: Samples,
}

impl Measured {
    /// Where no texel's center lies in a face, places of faces stand for texels.
    fn settle(&mut self) {
        if self.at_texels.taken == 0 {
            self.at_texels.merge(&self.at_faces);
        }
    }

    fn finish(&self) -> TextureDeviation {
        let Self { at_faces, at_texels } = self;
        TextureDeviation {
            deviation: at_texels.sums.finish().unwrap_or_default(),
            mapping_distance: at_faces.greatest,
            covered: at_texels.found as f64 / at_texels.taken.max(1) as f64,
        }
    }
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
                    samples.add(atlas.distance(place, point, &patch));
                }
            }
            grid.for_each_texel(patch.uv, |texel, place| {
                let Some(point) = patch.at(place) else { return };
                let distance = atlas.distance(place, point, &patch);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Vec2};
    use crate::mesh::{Materials, shapes};

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

    /// Two sheets far apart show the same texels. One loses its last row: what was there is as far as the rim and back in the
    /// texture, not as the other sheet.
    #[test]
    fn what_a_part_has_lost_is_not_looked_for_on_its_twin() {
        let twins = |lost: usize| {
            let mut mesh = sheet();
            let twin = moved(sheet(), DVec3::Z * 100.0);
            let (vertices, kept) = (mesh.positions.len() as u32, mesh.faces.len() - lost);
            mesh.positions.extend(twin.positions);
            mesh.faces.truncate(kept);
            mesh.faces.extend(twin.faces.iter().map(|face| face.map(|v| v + vertices)));
            if let Some(rows) = &mut mesh.texcoords {
                rows.truncate(kept);
                rows.extend(twin.texcoords.iter().flatten());
            }
            mesh
        };
        let found = compare(&twins(0), &twins(16));
        assert!((found.mapping_distance - 2.0).abs() < 1e-9 && found.covered == 1.0, "{found:?}");
        // Both parts where they were: the other one shows the texels.
        assert!(found.deviation.max < 1e-9, "{found:?}");
        // A part that is gone has no rim.
        assert!((compare(&twins(0), &twins(128)).mapping_distance - 100.0).abs() < 1e-9);
        // Nor does a rim hide how far a texture is off that shows all of it.
        let off = moved(twins(0), DVec3::new(0.5, 0.0, 0.0));
        assert!((compare(&twins(0), &off).mapping_distance - 0.5).abs() < 1e-6);
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

    /// Two sheets one above the other, with the same square of two textures: the upper is moved by 1, the lower by 3.
    #[test]
    fn materials_have_textures_of_their_own() {
        let both = |lower: f64, upper: f64, names: [&str; 2]| {
            let mut mesh = moved(sheet(), DVec3::Z * lower);
            let other = moved(sheet(), DVec3::Z * (2.0 + upper));
            let (vertices, faces) = (mesh.positions.len() as u32, mesh.faces.len());
            mesh.positions.extend(other.positions);
            mesh.faces.extend(other.faces.iter().map(|face| face.map(|v| v + vertices)));
            mesh.texcoords.iter_mut().for_each(|rows| rows.extend(other.texcoords.iter().flatten()));
            let of_face = (0..2 * faces).map(|face| u32::from(face >= faces)).collect();
            mesh.materials = Some(Materials { of_face, names: names.map(String::from).to_vec() });
            mesh
        };
        let (a, b) = (both(0.0, 0.0, ["lower", "upper"]), both(3.0, 1.0, ["lower", "upper"]));
        let found = |a: &Mesh, b: &Mesh| texture_by_material(a, b, 64).expect("valid meshes").expect("textures");
        let (all, list) = found(&a, &b);
        assert!(
            (all.deviation.rms - 5.0_f64.sqrt()).abs() < 1e-6 && (all.mapping_distance - 3.0).abs() < 1e-9,
            "{all:?}"
        );
        let told = list.iter().map(|row| (row.name.as_str(), row.faces, row.texture.expect("both").deviation.rms));
        assert_eq!(told.collect::<Vec<_>>(), [("lower", [128; 2], 3.0), ("upper", [128; 2], 1.0)]);
        // Without materials on one side the nearer sheet counts: the lower one at 3 is 1 above the upper one.
        let bare = Mesh { materials: None, ..b.clone() };
        let (all, list) = found(&a, &bare);
        assert!((all.deviation.max - 1.0).abs() < 1e-6 && list.is_empty(), "{all:?}");
        // Other names: by number, and by nothing where they are not as many.
        assert_eq!(found(&a, &both(3.0, 1.0, ["first", "second"])).0, found(&a, &b).0);
        let mut more = both(3.0, 1.0, ["first", "second"]);
        more.materials.iter_mut().for_each(|materials| materials.names.push("third".into()));
        let (all, list) = found(&a, &more);
        assert!((all.deviation.max - 1.0).abs() < 1e-6 && list.len() == 4, "{all:?} {list:?}");
        assert!(list.iter().all(|row| row.texture.is_none() && row.faces.contains(&0)));
        // One of them is gone: its texels are not covered.
        let mut half = b.clone();
        half.faces.truncate(128);
        half.texcoords.iter_mut().for_each(|rows| rows.truncate(128));
        half.materials.iter_mut().for_each(|materials| materials.of_face.truncate(128));
        let (all, list) = found(&a, &half);
        assert!(all.covered == 0.5 && list[1].texture.is_none() && list[1].faces == [128, 0], "{all:?} {list:?}");
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
