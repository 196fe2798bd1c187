//! Joins vertices that lie together, and drops the faces and vertices this leaves without a purpose.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use rayon::prelude::*;

use super::adjacency::group;
use super::key_table::KeyTable;
use super::layers::Layers;
use super::near::within;
use super::{Mesh, PARALLEL_ROWS};
use crate::math::{DVec3, Vec3};

/// A welded mesh, and where each of its parts comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Welded {
    /// No repeated positions (within the tolerance), no unreferenced vertices, no repeated corners, no duplicate faces of one
    /// material.
    pub mesh: Mesh,
    /// The lowest input vertex joined into each vertex; strictly ascending.
    pub vertex_source: Vec<u32>,
    /// The input face of each face; strictly ascending.
    pub face_source: Vec<u32>,
    /// The lowest input vertex that each input vertex was joined with: itself, where it was with none.
    pub lowest: Vec<u32>,
    /// Input vertices joined into a lower one.
    pub joined_vertices: usize,
    /// Positions that no kept face uses: `joined_vertices + unreferenced_vertices` is what the mesh lost.
    pub unreferenced_vertices: usize,
    /// Dropped: two corners became one vertex, or were from the start.
    pub degenerate_faces: usize,
    /// Dropped: the same corners in the same turning sense as a lower face, and its material.
    pub duplicate_faces: usize,
    /// Kept: pairs of faces with the same corners in opposite senses, as on a thin sheet modeled with both sides.
    pub opposite_faces: usize,
}

/// Joins the vertices of `mesh` that lie within `tolerance` of each other, in model units.
///
/// Zero (and anything below, or not a number) joins equal positions, where `-0.0` equals `0.0`. Above zero, joining is
/// transitive: a row of vertices each within the tolerance of the next becomes one vertex. The lowest input vertex gives the
/// position; vertices and faces keep their order. Normals and colors of joined vertices are averaged; normals that cancel
/// out fall back to that of the lowest vertex. Texture coordinates stay with their corners, so that seams are kept, and colors
/// and materials of faces with their faces. Channels are those of the lowest vertex. Of faces with the same corners in the same
/// sense the lowest of each material stays.
pub fn weld(mesh: &Mesh, tolerance: f64) -> Welded {
    weld_layers(mesh, tolerance, Layers::new(mesh.materials.as_ref()))
}

/// [`weld`], where faces of different `layers` are no duplicates.
pub(crate) fn weld_layers(mesh: &Mesh, tolerance: f64, layers: Layers<'_>) -> Welded {
    let lowest = lowest_within(&mesh.positions, tolerance);
    let joined_vertices = count(lowest.len(), |v| lowest[v] as usize != v);

    let joined = |f: usize| mesh.faces[f].map(|v| lowest[v as usize]);
    let degenerate = collect_faces(mesh.faces.len(), |f, out| {
        let [a, b, c] = joined(f);
        if a == b || b == c || c == a {
            out.push(f as u32);
        }
    });
    let twins = Twins::new(mesh.faces.len(), mesh.positions.len(), joined, layers);
    let face_source = all_but(mesh.faces.len(), &degenerate, &twins.duplicates);

    let mut faces: Vec<[u32; 3]> =
        face_source.par_iter().with_min_len(PARALLEL_ROWS).map(|&f| joined(f as usize)).collect();
    let vertex_source = referenced(&faces, mesh.positions.len());
    if vertex_source.len() < mesh.positions.len() {
        let mut renamed = lowest.clone();
        for (new, &old) in (0..).zip(&vertex_source) {
            renamed[old as usize] = new;
        }
        faces.par_iter_mut().with_min_len(PARALLEL_ROWS).for_each(|face| *face = face.map(|v| renamed[v as usize]));
    }

    let positions = take(&mesh.positions, &vertex_source);
    let (normals, colors) = joined_attributes(mesh, (joined_vertices > 0).then_some(&lowest), &vertex_source);
    // Faces keep the order of their corners.
    let texcoords = mesh.texcoords.as_ref().map(|rows| take(rows, &face_source));
    let face_colors = mesh.face_colors.as_ref().map(|rows| take(rows, &face_source));
    let channels = mesh.channels.iter().map(|channel| channel.take(&vertex_source)).collect();
    let materials = mesh.materials.as_ref().map(|materials| materials.take(&face_source));

    Welded {
        unreferenced_vertices: mesh.positions.len() - joined_vertices - positions.len(),
        mesh: Mesh { positions, faces, normals, colors, texcoords, face_colors, channels, materials },
        vertex_source,
        face_source,
        lowest,
        joined_vertices,
        degenerate_faces: degenerate.len(),
        duplicate_faces: twins.duplicates.len(),
        opposite_faces: twins.opposites.len(),
    }
}

/// The lowest vertex that each is joined with, within a tolerance or at its position.
pub(crate) fn lowest_within(positions: &[DVec3], tolerance: f64) -> Vec<u32> {
    if tolerance > 0.0 { within(positions, tolerance) } else { lowest_at_position(positions) }
}

/// The lowest vertex at the position of each; `-0.0` equals `0.0`.
pub(crate) fn lowest_at_position(positions: &[DVec3]) -> Vec<u32> {
    KeyTable::new(positions).1
}

/// Normals and colors of the vertices `kept`, averaged over those of which each is the `lowest`.
pub(crate) fn joined_attributes(
    mesh: &Mesh,
    lowest: Option<&Vec<u32>>,
    kept: &[u32],
) -> (Option<Vec<Vec3>>, Option<Vec<[f32; 4]>>) {
    let (mut normals, mut colors) =
        (mesh.normals.as_ref().map(|rows| take(rows, kept)), mesh.colors.as_ref().map(|rows| take(rows, kept)));
    if let Some(lowest) = lowest.filter(|_| normals.is_some() || colors.is_some()) {
        let members = Members::new(lowest, kept);
        if let (Some(averaged), Some(rows)) = (&mut normals, &mesh.normals) {
            members.average(
                averaged,
                |v| rows[v].to_array().map(f64::from),
                |sum, _| {
                    let normal = Vec3::from_array(sum.map(|x| x as f32));
                    normal.try_normalize()
                },
            );
        }
        if let (Some(averaged), Some(rows)) = (&mut colors, &mesh.colors) {
            members.average(averaged, |v| rows[v].map(f64::from), |sum, n| Some(sum.map(|x| (x / n) as f32)));
        }
    }
    (normals, colors)
}

/// Faces on the same three corners. Faces with a repeated corner take no part.
pub(crate) struct Twins {
    /// Faces with the corners, the turning sense and the layer of a lower one, ascending.
    pub duplicates: Vec<u32>,
    /// The lowest face of either sense, of corner sets that have both; ascending by lowest corner.
    pub opposites: Vec<[u32; 2]>,
}

/// A face under its lowest corner; in the order of its fields.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct UnderLowest {
    /// The other two, in order.
    corners: [u32; 2],
    /// Whether they were swapped for that.
    is_swapped: bool,
    layer: u32,
    face: u32,
}

impl Twins {
    /// Compares every face with the others of the same lowest corner: on average two.
    pub fn new(
        face_count: usize,
        vertex_count: usize,
        face: impl Fn(usize) -> [u32; 3] + Sync,
        layers: Layers<'_>,
    ) -> Self {
        let (starts, items) = group(face_count, vertex_count, |f| [face(f).into_iter().min().unwrap_or(0)]);
        let chunks: Vec<Self> = (0..vertex_count)
            .into_par_iter()
            .with_min_len(PARALLEL_ROWS)
            .fold(
                || (Self { duplicates: Vec::new(), opposites: Vec::new() }, Vec::new()),
                |(mut twins, mut under), v| {
                    let row = &items[starts[v] as usize..starts[v + 1] as usize];
                    if row.len() > 1 {
                        twins.compare((row, v as u32), &face, layers, &mut under);
                    }
                    (twins, under)
                },
            )
            .map(|(twins, _)| twins)
            .collect();
        let mut all = Self { duplicates: Vec::new(), opposites: Vec::new() };
        for twins in chunks {
            all.duplicates.extend(twins.duplicates);
            all.opposites.extend(twins.opposites);
        }
        all.duplicates.sort_unstable();
        all
    }

    /// Compares the faces of a row, all with this lowest corner.
    fn compare(
        &mut self,
        (row, lowest): (&[u32], u32),
        face: &impl Fn(usize) -> [u32; 3],
        layers: Layers<'_>,
        under: &mut Vec<UnderLowest>,
    ) {
        under.clear();
        under.extend(row.iter().filter_map(|&f| {
            let [_, next, last] = super::adjacency::from_corner(face(f as usize), lowest)?;
            let corners = [next.min(last), next.max(last)];
            Some(UnderLowest { corners, is_swapped: last < next, layer: layers.of(f), face: f })
        }));
        under.sort_unstable();
        for same in under.chunk_by(|a, b| a.corners == b.corners).filter(|same| same.len() > 1) {
            // Those of one sense come first.
            let turn = same.partition_point(|under| under.is_swapped == same[0].is_swapped);
            let (one, other) = same.split_at(turn);
            let repeated = |two: &&[UnderLowest]| two[0].layer == two[1].layer;
            let of_senses = [one, other].into_iter().flat_map(|sense| sense.windows(2).filter(repeated));
            self.duplicates.extend(of_senses.map(|two| two[1].face));
            let lowest = |sense: &[UnderLowest]| sense.iter().map(|under| under.face).min();
            if let (Some(one), Some(other)) = (lowest(one), lowest(other)) {
                self.opposites.push([one, other]);
            }
        }
    }
}

/// The members of every kept vertex, in compressed rows.
struct Members {
    starts: Vec<u32>,
    vertices: Vec<u32>,
}

impl Members {
    fn new(lowest: &[u32], kept: &[u32]) -> Self {
        let (starts, vertices) = group(lowest.len(), lowest.len(), |v| [lowest[v]]);
        let mut members = Self { starts: vec![0], vertices: Vec::with_capacity(lowest.len()) };
        for &v in kept {
            let row = starts[v as usize] as usize..starts[v as usize + 1] as usize;
            members.vertices.extend_from_slice(&vertices[row]);
            members.starts.push(members.vertices.len() as u32);
        }
        members
    }

    /// Replaces each row that has several members by the `mean` of their sum and number, where there is one.
    fn average<const N: usize, Row: Send>(
        &self,
        rows: &mut [Row],
        value: impl Fn(usize) -> [f64; N] + Sync,
        mean: impl Fn([f64; N], f64) -> Option<Row> + Sync,
    ) {
        rows.par_iter_mut().with_min_len(PARALLEL_ROWS).zip(self.starts.par_windows(2)).for_each(|(row, ends)| {
            let members = &self.vertices[ends[0] as usize..ends[1] as usize];
            if members.len() > 1 {
                let mut sum = [0.0; N];
                for &v in members {
                    for (total, x) in sum.iter_mut().zip(value(v as usize)) {
                        *total += x;
                    }
                }
                if let Some(averaged) = mean(sum, members.len() as f64) {
                    *row = averaged;
                }
            }
        });
    }
}

fn count(len: usize, keep: impl Fn(usize) -> bool + Sync) -> usize {
    (0..len).into_par_iter().with_min_len(PARALLEL_ROWS).filter(|&i| keep(i)).count()
}

/// What `visit` pushes over all faces, in face order.
fn collect_faces(face_count: usize, visit: impl Fn(usize, &mut Vec<u32>) + Sync) -> Vec<u32> {
    (0..face_count)
        .into_par_iter()
        .with_min_len(PARALLEL_ROWS)
        .fold(Vec::new, |mut out, f| {
            visit(f, &mut out);
            out
        })
        .collect::<Vec<_>>()
        .concat()
}

/// `0..len` without the members of two ascending lists.
fn all_but(len: usize, first: &[u32], second: &[u32]) -> Vec<u32> {
    let mut dropped = [first, second].concat();
    dropped.sort_unstable();
    let mut kept = Vec::with_capacity(len - dropped.len());
    let mut next = 0;
    for &gap in &dropped {
        kept.extend(next..gap);
        next = gap + 1;
    }
    kept.extend(next..len as u32);
    kept
}

/// Whether a face uses each vertex.
pub(crate) fn used_vertices(faces: &[[u32; 3]], vertex_count: usize) -> Vec<bool> {
    let used: Vec<AtomicBool> = (0..vertex_count).map(|_| AtomicBool::new(false)).collect();
    faces.par_iter().with_min_len(PARALLEL_ROWS).flatten_iter().for_each(|&v| {
        // Looking first leaves the cache line to all threads that have it.
        if !used[v as usize].load(Relaxed) {
            used[v as usize].store(true, Relaxed);
        }
    });
    used.into_iter().map(AtomicBool::into_inner).collect()
}

/// The vertices that a face uses, ascending.
fn referenced(faces: &[[u32; 3]], vertex_count: usize) -> Vec<u32> {
    let used = used_vertices(faces, vertex_count);
    (0..vertex_count as u32).filter(|&v| used[v as usize]).collect()
}

fn take<T: Copy + Send + Sync>(rows: &[T], indices: &[u32]) -> Vec<T> {
    indices.par_iter().with_min_len(PARALLEL_ROWS).map(|&i| rows[i as usize]).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math::{DVec3, Vec2};

    fn points<const N: usize>(coordinates: [[f64; 3]; N]) -> Vec<DVec3> {
        coordinates.map(DVec3::from).to_vec()
    }

    // Two triangles of a soup on the diagonal of a square, an unused vertex in front.
    fn soup() -> Mesh {
        let corners = points([
            [9.0, 9.0, 9.0],
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, -0.0, 0.0],
            [1.0, 1.0, 0.0],
            [-0.0, 1.0, 0.0],
        ]);
        Mesh::new(corners, vec![[1, 2, 3], [4, 5, 6]])
    }

    #[test]
    fn a_soup_becomes_a_square() {
        let welded = weld(&soup(), 0.0);
        assert_eq!(welded.mesh.faces, [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(welded.mesh.positions, [1, 2, 3, 5].map(|v| soup().positions[v]));
        assert_eq!(welded.vertex_source, [1, 2, 3, 5]);
        assert_eq!(welded.face_source, [0, 1]);
        assert_eq!(welded.lowest, [0, 1, 2, 3, 2, 5, 3]);
        assert_eq!((welded.joined_vertices, welded.unreferenced_vertices), (2, 1));
    }

    #[test]
    fn bad_faces_are_dropped_and_counted() {
        let mut mesh = soup();
        mesh.faces.extend([[1, 1, 2], [2, 3, 1], [4, 6, 1], [2, 1, 3], [3, 2, 1], [2, 4, 5]]);
        let welded = weld(&mesh, 0.0);
        assert_eq!(welded.mesh.faces, [[0, 1, 2], [1, 3, 2], [1, 0, 2]]);
        assert_eq!(welded.face_source, [0, 1, 5]);
        assert_eq!((welded.degenerate_faces, welded.duplicate_faces, welded.opposite_faces), (2, 3, 1));
    }

    #[test]
    fn vertices_that_only_a_dropped_face_used_go() {
        let welded = weld(&Mesh::new(points([[0.0; 3], [1.0; 3], [0.0; 3]]), vec![[0, 1, 2]]), 0.0);
        assert_eq!((welded.mesh.positions.len(), welded.mesh.faces.len()), (0, 0));
        assert_eq!((welded.joined_vertices, welded.unreferenced_vertices, welded.degenerate_faces), (1, 2, 1));
    }

    #[test]
    fn the_tolerance_joins_what_is_close() {
        let mut mesh = soup();
        mesh.positions[4].x += 1e-3;
        assert_eq!(weld(&mesh, 0.0).mesh.positions.len(), 5);
        assert_eq!(weld(&mesh, 0.9e-3).mesh.positions.len(), 5);
        let welded = weld(&mesh, 1.1e-3);
        assert_eq!(welded.mesh.faces, [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(welded.mesh.positions[1], DVec3::X);
    }

    #[test]
    fn attributes_are_averaged() {
        let mut mesh = soup();
        let mut normals = vec![Vec3::Z; 7];
        normals[4] = Vec3::X;
        normals[3] = Vec3::Y;
        normals[6] = Vec3::NEG_Y;
        let mut colors = vec![[0.0, 0.0, 0.0, 1.0]; 7];
        colors[4] = [1.0, 0.5, 0.0, 0.0];
        (mesh.normals, mesh.colors) = (Some(normals), Some(colors));
        let welded = weld(&mesh, 0.0).mesh;
        let half = 0.5f32.sqrt();
        let normals = welded.normals.expect("normals were given");
        assert!(normals[1].abs_diff_eq(Vec3::new(half, 0.0, half), 1e-6));
        assert_eq!(normals[2], Vec3::Y, "opposite normals cancel out: the lowest vertex's stays");
        assert_eq!(welded.colors.expect("colors were given")[1], [0.5, 0.25, 0.0, 0.5]);
    }

    #[test]
    fn what_faces_have_stays_with_them() {
        let mut mesh = soup();
        mesh.faces = vec![[4, 6, 1], [1, 1, 2], [1, 2, 3], [3, 1, 2], [4, 5, 6]];
        let row = |f: usize| [0, 1, 2].map(|corner| Vec2::new(f as f32, corner as f32));
        mesh.texcoords = Some((0..5).map(row).collect());
        mesh.face_colors = Some((0..5).map(|f| [f as f32; 4]).collect());
        let welded = weld(&mesh, 0.0);
        // The degenerate face 1 goes, and faces 2 and 3, which repeat face 0 from another corner.
        assert_eq!(welded.face_source, [0, 4]);
        assert_eq!(welded.mesh.texcoords, Some(vec![row(0), row(4)]));
        assert_eq!(welded.mesh.face_colors, Some(vec![[0.0; 4], [4.0; 4]]));
        assert!(welded.mesh.check().is_ok());
    }

    #[test]
    fn faces_of_two_materials_are_no_duplicates() {
        let mut mesh = soup();
        mesh.faces = vec![[1, 2, 3], [3, 1, 2], [2, 3, 1], [2, 1, 3], [1, 2, 3]];
        let names = ["wall", "decal"].map(String::from).to_vec();
        mesh.materials = Some(crate::mesh::Materials { of_face: vec![0, 1, 0, 0, 1], names });
        let welded = weld(&mesh, 0.0);
        assert_eq!((welded.face_source, welded.duplicate_faces, welded.opposite_faces), (vec![0, 1, 3], 2, 1));
    }

    #[test]
    fn nothing_comes_of_nothing() {
        assert_eq!(weld(&Mesh::default(), 0.0).mesh, Mesh::default());
        assert_eq!(weld(&Mesh::default(), 1.0).mesh, Mesh::default());
    }

    #[test]
    fn threads_do_not_show() {
        let positions = (0..60_000u32).map(|i| DVec3::splat(f64::from(i.wrapping_mul(2_654_435_761) % 9000))).collect();
        let faces = (0..30_000u32).map(|i| [i, i * 7 % 60_000, (i * 13 + 1) % 60_000]).collect();
        let mesh = Mesh::new(positions, faces);
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let one = pool(1).install(|| weld(&mesh, 0.0));
        assert_eq!(pool(2).install(|| weld(&mesh, 0.0)), one);
        assert_eq!(pool(7).install(|| weld(&mesh, 0.0)), one);
    }

    fn any_mesh() -> impl Strategy<Value = Mesh> {
        // Three values a coordinate, so that positions, corners and whole faces repeat.
        let position = [0i8..3, 0i8..3, 0i8..2].prop_map(|p| DVec3::from(p.map(f64::from)));
        let faces = prop::collection::vec([0u32..12, 0u32..12, 0u32..12], 0..40);
        (prop::collection::vec(position, 12), faces).prop_map(|(positions, faces)| Mesh::new(positions, faces))
    }

    proptest! {
        #[test]
        fn welding_twice_changes_nothing(mesh in any_mesh(), tolerance in prop::sample::select(vec![0.0, 0.5, 1.0, 1.5])) {
            let once = weld(&mesh, tolerance);
            prop_assert!(once.mesh.check().is_ok());
            let twice = weld(&once.mesh, tolerance);
            prop_assert_eq!(&once.mesh, &twice.mesh);
            prop_assert_eq!(twice.joined_vertices + twice.unreferenced_vertices + twice.duplicate_faces, 0);
        }

        #[test]
        fn every_corner_keeps_its_position(mesh in any_mesh()) {
            let welded = weld(&mesh, 0.0);
            for (face, &source) in welded.mesh.faces.iter().zip(&welded.face_source) {
                let before = mesh.faces[source as usize].map(|v| mesh.positions[v as usize]);
                prop_assert_eq!(face.map(|v| welded.mesh.positions[v as usize]), before);
            }
            let lost = welded.degenerate_faces + welded.duplicate_faces;
            prop_assert_eq!(welded.mesh.faces.len() + lost, mesh.faces.len());
            let left = mesh.positions.len() - welded.joined_vertices - welded.unreferenced_vertices;
            prop_assert_eq!(welded.mesh.positions.len(), left);
        }

        #[test]
        fn the_order_of_faces_does_not_matter_for_the_counts(mesh in any_mesh()) {
            let mut reversed = mesh.clone();
            reversed.faces.reverse();
            let (a, b) = (weld(&mesh, 0.0), weld(&reversed, 0.0));
            prop_assert_eq!(a.mesh.positions, b.mesh.positions);
            prop_assert_eq!(a.mesh.faces.len(), b.mesh.faces.len());
            prop_assert_eq!((a.duplicate_faces, a.opposite_faces), (b.duplicate_faces, b.opposite_faces));
        }
    }
}
