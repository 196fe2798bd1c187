//! A welded mesh in the order of a space-filling curve, with its rings: what [`weld`](super::weld()) makes of a mesh, but
//! for the order, and in fewer passes.
//!
//! Sorting the vertices along the curve finds those that repeat; sorting the faces by their lowest vertex puts
//! duplicates side by side. Both sorts go in two steps, a coarse one over pieces of the input and a fine one over pieces
//! of the output, so that tasks share nothing and stay in their cache.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use rayon::prelude::*;

use super::adjacency::Rings;
use super::curve::Curve;
use super::layers::Layers;
use super::limits::check_weld;
use super::near::within;
use super::repeated::{Repeated, Sorted};
use super::topology::has_repeated_corner;
use super::{Mesh, PARALLEL_ROWS, task_len};
use crate::error::{Error, Result};
use crate::math::DVec3;

/// What is wrong with a mesh that has faces, none of which is left.
pub(crate) const NO_FACE_LEFT: &str = "all its faces are degenerate: two corners of each lie at one point";

/// The same of a mesh whose vertices were joined within a distance, in model units, which may be what left none.
pub(crate) fn no_face_left(mesh: &Mesh, weld: Option<f64>) -> String {
    let has_sides = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
        a != b && b != c && c != a
    };
    match weld {
        Some(distance) if mesh.faces.iter().any(has_sides) => {
            format!("welding within {distance} joins two corners of every face: give a smaller distance")
        }
        _ => NO_FACE_LEFT.into(),
    }
}

/// A welded mesh without its positions, in the order of the curve.
#[derive(Debug)]
pub(crate) struct Arranged {
    /// The lowest input vertex joined into each vertex.
    pub vertex_source: Vec<u32>,
    /// Sorted by lowest corner, those of one by input face; each begins with the corner that its input face does.
    pub faces: Vec<[u32; 3]>,
    /// The input face of each face.
    pub face_source: Vec<u32>,
    pub rings: Rings,
    /// The lowest input vertex joined with each; `None` where each is on its own.
    pub lowest: Option<Vec<u32>>,
    /// The corners of the bounding box of all vertices that faces use.
    pub bounds: (DVec3, DVec3),
    /// As in [`Welded`](super::Welded), and so the next two.
    pub unreferenced_vertices: usize,
    pub degenerate_faces: usize,
    pub duplicate_faces: usize,
    /// Faces that lie on one of another layer, and stay.
    pub covering_faces: usize,
}

/// What any run asks of a mesh and of the distance within which it joins vertices.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh or one without faces, [`Error::Parameter`] for a tolerance that is no length.
pub(crate) fn check(mesh: &Mesh, tolerance: Option<f64>) -> Result<()> {
    mesh.check()?;
    if mesh.faces.is_empty() {
        return Err(Error::Mesh("it has no faces".into()));
    }
    check_weld(tolerance)
}

impl Arranged {
    /// [`new`](Self::new) of any mesh.
    ///
    /// # Errors
    /// [`Error::Mesh`] for an invalid mesh or one that has no face left, [`Error::Parameter`] for a tolerance that is no length.
    pub fn checked(mesh: &Mesh, tolerance: Option<f64>) -> Result<Self> {
        check(mesh, tolerance)?;
        let arranged = Self::new(mesh, tolerance, Layers::ONE);
        if arranged.faces.is_empty() {
            return Err(Error::Mesh(no_face_left(mesh, tolerance)));
        }
        Ok(arranged)
    }

    /// Arranges `mesh`, which passed its check.
    ///
    /// Joins vertices like [`weld`](super::weld()) with this tolerance; faces of different `layers` are no duplicates. `None`
    /// joins nothing, keeps duplicate faces and unreferenced vertices.
    pub fn new(mesh: &Mesh, tolerance: Option<f64>, layers: Layers<'_>) -> Self {
        let Curve { order: mut vertex_source, repeats, bounds } = Curve::new(&mesh.positions);
        let lowest = match tolerance {
            Some(tolerance) if tolerance > 0.0 => Some(within(&mesh.positions, tolerance)),
            Some(_) if !repeats.is_empty() => {
                let mut lowest: Vec<u32> = (0..mesh.positions.len() as u32).collect();
                repeats.iter().for_each(|&[index, first]| lowest[index as usize] = first);
                Some(lowest)
            }
            _ => None,
        };
        if let Some(lowest) = &lowest {
            vertex_source.retain(|&v| lowest[v as usize] == v);
        }
        let renamed = names(&vertex_source, lowest.as_deref(), mesh.positions.len());

        let SortedFaces { mut faces, sources: mut face_source, duplicates, covering: covering_faces } =
            sort_faces(&mesh.faces, &renamed, vertex_source.len(), layers);
        drop(renamed);
        let degenerate_faces = mesh.faces.len() - faces.len();
        let drops_duplicates = tolerance.is_some() && !duplicates.is_empty();
        if drops_duplicates {
            remove(&mut faces, &duplicates);
            remove(&mut face_source, &duplicates);
        }
        let mut arranged = Self {
            rings: Rings::new(&faces, vertex_source.len()),
            vertex_source,
            faces,
            face_source,
            lowest,
            bounds,
            unreferenced_vertices: 0,
            degenerate_faces,
            duplicate_faces: if drops_duplicates { duplicates.len() } else { 0 },
            covering_faces,
        };
        arranged.settle(mesh, tolerance);
        arranged
    }

    /// What was dropped, as warnings.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let dropped = [
            (self.degenerate_faces, "degenerate faces dropped"),
            (self.duplicate_faces, "duplicate faces dropped"),
            (self.unreferenced_vertices, "unreferenced vertices dropped"),
        ];
        dropped.into_iter().filter(|&(count, _)| count > 0).map(|(count, what)| format!("{what}: {count}"))
    }

    /// Finds unreferenced vertices, and drops them where vertices are joined.
    fn settle(&mut self, mesh: &Mesh, tolerance: Option<f64>) {
        let starts = &self.rings.starts;
        let all_used = starts.par_windows(2).with_min_len(PARALLEL_ROWS).all(|ends| ends[0] != ends[1]);
        if all_used && tolerance.is_none_or(|tolerance| tolerance <= 0.0) {
            return;
        }
        let used: Vec<bool> = starts.windows(2).map(|ends| ends[0] != ends[1]).collect();
        let corners = || self.vertex_source.iter().zip(&used).filter(|&(_, &used)| used).map(|(&v, _)| v);
        self.bounds = match corners().next() {
            Some(first) => {
                let first = mesh.positions[first as usize];
                corners()
                    .map(|v| mesh.positions[v as usize])
                    .fold((first, first), |(low, high), p| (low.min(p), high.max(p)))
            }
            None => (DVec3::ZERO, DVec3::ZERO),
        };
        if all_used || tolerance.is_none() {
            return;
        }
        let mut renamed = vec![0; used.len()];
        let mut count = 0;
        for (new, &used) in renamed.iter_mut().zip(&used) {
            *new = count;
            count += u32::from(used);
        }
        self.unreferenced_vertices = used.len() - count as usize;
        let mut row = used.iter().copied();
        self.vertex_source.retain(|_| row.next().unwrap_or(false));
        let mut row = used.iter().copied().chain([true]);
        self.rings.starts.retain(|_| row.next().unwrap_or(true));
        self.faces.par_iter_mut().with_min_len(PARALLEL_ROWS).for_each(|face| {
            *face = face.map(|v| renamed[v as usize]);
        });
    }
}

/// What each of so many vertices is called, where the one called `n` is `sources[n]`, and each like the lowest joined with it.
fn names(sources: &[u32], lowest: Option<&[u32]>, count: usize) -> Vec<u32> {
    let names: Vec<AtomicU32> = (0..count).map(|_| AtomicU32::default()).collect();
    let name = |vertex: u32| &names[vertex as usize];
    sources.par_iter().zip(0..sources.len() as u32).with_min_len(PARALLEL_ROWS).for_each(|(&source, new)| {
        name(source).store(new, Relaxed);
    });
    if let Some(lowest) = lowest {
        // The lowest has its name already, and keeps it.
        names.par_iter().zip(lowest).with_min_len(PARALLEL_ROWS).for_each(|(own, &lowest)| {
            own.store(name(lowest).load(Relaxed), Relaxed);
        });
    }
    names.into_iter().map(AtomicU32::into_inner).collect()
}

/// Drops the rows of these ascending indices.
fn remove<T: Copy>(rows: &mut Vec<T>, indices: &[u32]) {
    let mut next = indices.iter().peekable();
    let mut index = 0;
    rows.retain(|_| {
        let dropped = next.next_if_eq(&&index).is_some();
        index += 1;
        !dropped
    });
}

/// Faces sorted by lowest corner, and then as they came.
struct SortedFaces {
    faces: Vec<[u32; 3]>,
    sources: Vec<u32>,
    /// Indices of those with the corners, the turning sense and the layer of an earlier one, ascending.
    duplicates: Vec<u32>,
    /// How many have the corners and the turning sense of an earlier one, but a layer that none of these has.
    covering: usize,
}

/// Vertices whose faces a task sorts, at least, and in large meshes.
const BAND: (usize, usize) = (1 << 11, 1 << 13);
/// Bands at most: every chunk counts each.
const MOST_BANDS: usize = 1 << 12;
/// Faces that a task hands to bands, at least, and in large meshes.
const CHUNK: (usize, usize) = (1 << 13, 1 << 15);
/// Chunks at most: every band reads each.
const MOST_CHUNKS: usize = 1 << 9;

/// The faces as they came, under new names.
#[derive(Clone, Copy)]
struct Renamed<'a> {
    faces: &'a [[u32; 3]],
    names: &'a [u32],
    /// Lowest corners a band, a power of two.
    band_len: usize,
}

impl Renamed<'_> {
    fn face(self, source: u32) -> [u32; 3] {
        self.faces[source as usize].map(|v| self.names[v as usize])
    }
}

/// A piece of the faces, sorted by the band of the lowest corner; without those that repeat a corner.
struct Chunk {
    sources: Vec<u32>,
    /// Where the faces of each band start, and the end.
    starts: Vec<u32>,
}

impl Chunk {
    /// `unsorted` is room, for sources and bands.
    fn new(sources: Range<u32>, renamed: Renamed<'_>, band_count: usize, unsorted: &mut Vec<[u32; 2]>) -> Self {
        let mut starts = vec![0; band_count + 1];
        unsorted.clear();
        for source in sources {
            let face = renamed.face(source);
            if !has_repeated_corner(&face) {
                let band = lowest_of(&face) as usize / renamed.band_len;
                unsorted.push([source, band as u32]);
                starts[band] += 1;
            }
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += std::mem::replace(start, sum);
        }
        let mut sources = vec![0; unsorted.len()];
        for &[source, band] in &*unsorted {
            let cursor = &mut starts[band as usize];
            sources[*cursor as usize] = source;
            *cursor += 1;
        }
        // Each cursor has become the start of its successor.
        starts.copy_within(..band_count, 1);
        starts[0] = 0;
        Self { sources, starts }
    }

    fn band(&self, band: usize) -> &[u32] {
        &self.sources[self.starts[band] as usize..self.starts[band + 1] as usize]
    }
}

fn lowest_of(&[a, b, c]: &[u32; 3]) -> u32 {
    a.min(b).min(c)
}

/// Renames the corners of `faces`, drops those with a repeated one, and sorts the rest.
fn sort_faces(faces: &[[u32; 3]], names: &[u32], vertex_count: usize, layers: Layers<'_>) -> SortedFaces {
    let band_len = task_len(vertex_count, BAND).max(vertex_count.div_ceil(MOST_BANDS)).next_power_of_two();
    let band_count = vertex_count.div_ceil(band_len).max(1);
    let chunk_len = task_len(faces.len(), CHUNK).max(faces.len().div_ceil(MOST_CHUNKS));
    let renamed = Renamed { faces, names, band_len };
    let chunks: Vec<Chunk> = (0..faces.len().div_ceil(chunk_len))
        .into_par_iter()
        .map_init(Vec::new, |unsorted, chunk| {
            let first = chunk * chunk_len;
            let end = faces.len().min(first + chunk_len);
            Chunk::new(first as u32..end as u32, renamed, band_count, unsorted)
        })
        .collect();

    let count = chunks.iter().map(|chunk| chunk.sources.len()).sum();
    let (mut sorted, mut sources) = (vec![[0; 3]; count], vec![0; count]);
    let mut outputs = Vec::with_capacity(band_count);
    let (mut faces_left, mut sources_left) = (sorted.as_mut_slice(), sources.as_mut_slice());
    let mut first = 0;
    for band in 0..band_count {
        let len = chunks.iter().map(|chunk| chunk.band(band).len()).sum();
        let (band_faces, band_sources);
        (band_faces, faces_left) = faces_left.split_at_mut(len);
        (band_sources, sources_left) = sources_left.split_at_mut(len);
        outputs.push((band, first, band_faces, band_sources));
        first += len as u32;
    }
    let (duplicates, covering): (Vec<Vec<u32>>, Vec<usize>) = outputs
        .into_par_iter()
        .map_init(BandRoom::default, |room, (band, first, faces, sources)| {
            room.sort(chunks.iter().flat_map(|chunk| chunk.band(band)), renamed, faces, sources);
            let Repeated { faces, covering } = Sorted { faces, sources, layers }.repeated(&room.ends);
            (faces.into_iter().map(|face| first + face).collect(), covering)
        })
        .unzip();
    SortedFaces { faces: sorted, sources, duplicates: duplicates.concat(), covering: covering.into_iter().sum() }
}

/// Room to sort a band.
#[derive(Default)]
struct BandRoom {
    unsorted: Vec<([u32; 3], u32)>,
    /// Where the faces of each lowest corner end.
    ends: Vec<u32>,
}

impl BandRoom {
    /// Writes the faces of these sources, sorted by lowest corner.
    fn sort<'c>(
        &mut self,
        from: impl Iterator<Item = &'c u32>,
        renamed: Renamed<'_>,
        faces: &mut [[u32; 3]],
        sources: &mut [u32],
    ) {
        let Self { unsorted, ends } = self;
        unsorted.clear();
        ends.clear();
        ends.resize(renamed.band_len, 0);
        let within = |face: &[u32; 3]| lowest_of(face) as usize & (renamed.band_len - 1);
        for &source in from {
            let face = renamed.face(source);
            ends[within(&face)] += 1;
            unsorted.push((face, source));
        }
        let mut sum = 0;
        for end in ends.iter_mut() {
            sum += std::mem::replace(end, sum);
        }
        for &(face, source) in &*unsorted {
            let cursor = &mut ends[within(&face)];
            faces[*cursor as usize] = face;
            sources[*cursor as usize] = source;
            *cursor += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::Materials;
    use super::super::weld::weld;
    use super::*;

    /// Faces by input face, with the input vertices of their corners.
    fn in_input_order(arranged: &Arranged) -> Vec<(u32, [u32; 3])> {
        let corners = arranged.faces.iter().map(|face| face.map(|v| arranged.vertex_source[v as usize]));
        let mut faces: Vec<_> = arranged.face_source.iter().copied().zip(corners).collect();
        faces.sort_unstable();
        faces
    }

    fn check(mesh: &Mesh, tolerance: f64) {
        let (arranged, welded) =
            (Arranged::new(mesh, Some(tolerance), Layers::new(mesh.materials.as_ref())), weld(mesh, tolerance));
        let corners = welded.mesh.faces.iter().map(|face| face.map(|v| welded.vertex_source[v as usize]));
        let expected: Vec<_> = welded.face_source.iter().copied().zip(corners).collect();
        assert_eq!(in_input_order(&arranged), expected);
        assert_eq!(
            (arranged.unreferenced_vertices, arranged.degenerate_faces, arranged.duplicate_faces),
            (welded.unreferenced_vertices, welded.degenerate_faces, welded.duplicate_faces)
        );
        assert_eq!(arranged.bounds, welded.mesh.bounds());
        assert_eq!(arranged.rings, Rings::new(&arranged.faces, arranged.vertex_source.len()));
        assert!(arranged.faces.is_sorted_by_key(lowest_of));
    }

    #[test]
    fn who_left_no_face_is_told() {
        let row = |step: f64| (0..6).map(|i| DVec3::new(step * f64::from(i), f64::from(i % 2) * step, 0.0)).collect();
        let told = |step: f64, weld: Option<f64>| {
            let mesh = Mesh::new(row(step), vec![[0, 1, 2], [2, 1, 3], [3, 4, 5]]);
            Arranged::checked(&mesh, weld).expect_err("no face is left").to_string()
        };
        assert!(
            told(0.1, Some(2.0)).ends_with("welding within 2 joins two corners of every face: give a smaller distance")
        );
        // Where there was none before, no smaller distance helps.
        assert!([0.0, 2.0].iter().all(|&within| told(0.0, Some(within)).ends_with(NO_FACE_LEFT)));
    }

    #[test]
    fn many_faces_of_one_corner_are_compared_too() {
        let positions = (0..40).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
        let mut faces: Vec<[u32; 3]> = (1..39).map(|i| [0, i, i + 1]).collect();
        faces.extend([[4, 5, 0], [6, 5, 0], [0, 20, 21], [4, 5, 0]]);
        let mesh = Mesh::new(positions, faces);
        assert_eq!(Arranged::new(&mesh, Some(0.0), Layers::ONE).duplicate_faces, 3);
        check(&mesh, 0.0);
    }

    #[test]
    fn without_welding_everything_stays_but_broken_faces() {
        let positions = [9.0, 0.0, 1.0, 0.0, 2.0].map(DVec3::splat).to_vec();
        let mesh = Mesh::new(positions, vec![[1, 2, 3], [2, 3, 1], [1, 1, 2]]);
        let arranged = Arranged::new(&mesh, None, Layers::ONE);
        assert_eq!(in_input_order(&arranged), [(0, [1, 2, 3]), (1, [2, 3, 1])]);
        assert_eq!(arranged.vertex_source, [1, 3, 2, 4, 0]);
        assert_eq!(arranged.bounds, (DVec3::ZERO, DVec3::ONE));
        assert_eq!((arranged.degenerate_faces, arranged.duplicate_faces, arranged.unreferenced_vertices), (1, 0, 0));
    }

    #[test]
    fn threads_do_not_show() {
        let positions = (0..60_000u32).map(|i| DVec3::splat(f64::from(i.wrapping_mul(2_654_435_761) % 9000))).collect();
        let faces = (0..90_000u32).map(|i| [i % 60_000, i * 7 % 60_000, (i * 13 + 1) % 60_000]).collect();
        let mesh = Mesh::new(positions, faces);
        check(&mesh, 0.0);
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let [one, seven] = [1, 7].map(|threads| pool(threads).install(|| Arranged::new(&mesh, Some(0.0), Layers::ONE)));
        assert_eq!((one.faces, one.face_source, one.rings), (seven.faces, seven.face_source, seven.rings));
    }

    fn any_mesh() -> impl Strategy<Value = Mesh> {
        let position = [0i8..3, 0i8..3, 0i8..2].prop_map(|p| DVec3::from(p.map(f64::from)));
        let faces = prop::collection::vec([0u32..12, 0u32..12, 0u32..12], 0..40);
        (prop::collection::vec(position, 12), faces).prop_map(|(positions, faces)| Mesh::new(positions, faces))
    }

    proptest! {
        #[test]
        fn it_is_what_welding_makes(
            mut mesh in any_mesh(),
            tolerance in prop::sample::select(vec![0.0, 0.5, 1.0]),
            of_face in prop::collection::vec(0u32..2, 40),
        ) {
            check(&mesh, tolerance);
            let of_face = of_face[..mesh.faces.len()].to_vec();
            mesh.materials = Some(Materials { of_face, names: vec!["a".into(), "b".into()] });
            check(&mesh, tolerance);
        }
    }
}
