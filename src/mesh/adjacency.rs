//! Which faces touch a vertex, and the edges read off from that.

use std::ops::Range;

use rayon::prelude::*;

use super::PARALLEL_ROWS;
use super::topology::has_repeated_corner;

/// The faces around every vertex, in compressed rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rings {
    /// V + 1 offsets into `faces`: the ring of `v` is `faces[starts[v]..starts[v + 1]]`.
    pub starts: Vec<u32>,
    /// 3F face indices, ascending within a ring. A face with a repeated corner stands there once a corner.
    pub faces: Vec<u32>,
}

/// Which corner of a face a vertex is, without a branch; the first where it is none.
#[inline(always)]
pub fn corner_of([_, b, c]: [u32; 3], vertex: u32) -> usize {
    let (is_b, is_c) = (b == vertex, c == vertex);
    usize::from(is_b & !is_c) + 2 * usize::from(is_c)
}

/// The one other face on a manifold edge, and whether it runs along it in the same direction; read from the shorter ring of the
/// two, without a branch that depends on a face.
pub fn across(faces: &[[u32; 3]], rings: &Rings, face: u32, [a, b]: [u32; 2]) -> Option<(u32, bool)> {
    from_corner(faces[face as usize], a)?;
    let (near, far) = if rings.ring(a).len() <= rings.ring(b).len() { (a, b) } else { (b, a) };
    let (mut found, mut count) = ((0, false), 0);
    for &f in rings.ring(near) {
        let corners = faces[f as usize];
        let k = corner_of(corners, near);
        let (next, last) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let is_other = ((next == far) | (last == far)) & (f != face) & !has_repeated_corner(&corners);
        found = if is_other { (f, (next == far) == (near == a)) } else { found };
        count += u32::from(is_other);
    }
    (count == 1).then_some(found)
}

impl Rings {
    /// The rings of `vertex_count` vertices. Corners that are not below that have none; [`Mesh::check`](super::Mesh::check)
    /// rules them out.
    pub fn new(faces: &[[u32; 3]], vertex_count: usize) -> Self {
        let (starts, faces) = group_stretches(&Stretch::of_faces(faces), vertex_count, |f| faces[f]);
        Self { starts, faces }
    }

    /// The number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The faces around `vertex`, ascending.
    pub fn ring(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.faces[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// The edges at `vertex`, ascending by far end; each is the list of its uses, ascending by face.
    ///
    /// Faces with a repeated corner have no edges. `scratch` is overwritten.
    pub fn edges_at<'s>(
        &self,
        faces: &[[u32; 3]],
        vertex: u32,
        scratch: &'s mut Vec<EdgeUse>,
    ) -> impl Iterator<Item = &'s [EdgeUse]> + use<'s> {
        self.collect_uses(faces, vertex, 0, scratch)
    }

    /// Like [`Rings::edges_at`], but only the edges whose far end is the greater index: over all vertices, every edge once.
    pub fn edges_from<'s>(
        &self,
        faces: &[[u32; 3]],
        vertex: u32,
        scratch: &'s mut Vec<EdgeUse>,
    ) -> impl Iterator<Item = &'s [EdgeUse]> + use<'s> {
        self.collect_uses(faces, vertex, vertex + 1, scratch)
    }

    fn collect_uses<'s>(
        &self,
        faces: &[[u32; 3]],
        vertex: u32,
        least_far: u32,
        scratch: &'s mut Vec<EdgeUse>,
    ) -> impl Iterator<Item = &'s [EdgeUse]> + use<'s> {
        scratch.clear();
        for &face in self.ring(vertex) {
            let Some([_, next, last]) = from_corner(faces[face as usize], vertex) else { continue };
            if next >= least_far {
                scratch.push(EdgeUse::new(next, face, true));
            }
            if last >= least_far {
                scratch.push(EdgeUse::new(last, face, false));
            }
        }
        scratch.sort_unstable();
        scratch.chunk_by(|a, b| a.far() == b.far())
    }

    /// The faces that use the edge `a`–`b`, ascending, read from the shorter ring of the two.
    ///
    /// The sum of the shorter rings over all edges stays near-linear even with a vertex that half the faces share.
    pub fn faces_of_edge<'r>(&'r self, faces: &'r [[u32; 3]], a: u32, b: u32) -> impl Iterator<Item = u32> + 'r {
        let (near, far) = if self.ring(a).len() <= self.ring(b).len() { (a, b) } else { (b, a) };
        self.ring(near).iter().copied().filter(move |&f| {
            from_corner(faces[f as usize], near).is_some_and(|[_, next, last]| next == far || last == far)
        })
    }
}

/// A face's use of an edge, seen from one end.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeUse(u64);

impl EdgeUse {
    // One word, so that the small sorts compare integers: far end, then face, then direction. Faces are below 2^31.
    fn new(far: u32, face: u32, outward: bool) -> Self {
        Self(u64::from(far) << 32 | u64::from(face) << 1 | u64::from(outward))
    }

    /// The other end of the edge.
    pub fn far(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The face.
    pub fn face(self) -> u32 {
        self.0 as u32 >> 1
    }

    /// Whether the face runs along the edge from the near to the far end.
    pub fn outward(self) -> bool {
        self.0 & 1 == 1
    }
}

/// The face's corners rotated so that `vertex` comes first; nothing when a corner is repeated or `vertex` is none of them.
pub fn from_corner([a, b, c]: [u32; 3], vertex: u32) -> Option<[u32; 3]> {
    if a == b || b == c || c == a {
        None
    } else if a == vertex {
        Some([a, b, c])
    } else if b == vertex {
        Some([b, c, a])
    } else if c == vertex {
        Some([c, a, b])
    } else {
        None
    }
}

/// Below this many keys a second thread costs more than it brings.
const PARALLEL_KEYS: usize = 1 << 15;
/// Faces of a stretch: of longer ones more reach across a border between bands, which both read.
const STRETCH: usize = 1 << 9;
/// Where nothing is known of the items every thread reads all keys, so more bands than this only add reading.
const MOST_BANDS: usize = 8;

/// Items by key in compressed rows: offsets (one more than keys) and item indices, ascending within a key.
///
/// Every thread owns a band of keys and reads all items, so that the order needs neither atomics nor sorting.
pub(crate) fn group<const K: usize>(
    item_count: usize,
    key_count: usize,
    keys: impl Fn(usize) -> [u32; K] + Sync,
) -> (Vec<u32>, Vec<u32>) {
    group_stretches(&Stretch::any(item_count), key_count, keys)
}

/// [`group`] of the items of `stretches`, one after the other.
fn group_stretches<const K: usize>(
    stretches: &[Stretch],
    key_count: usize,
    keys: impl Fn(usize) -> [u32; K] + Sync,
) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0; key_count + 1];
    let mut items = Vec::new();
    group_into(stretches, keys, &mut starts, rayon::current_num_threads(), |total| {
        items = vec![0; total];
        &mut items
    });
    (starts, items)
}

/// Consecutive items whose keys are known to lie in a range.
#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    pub items: Range<usize>,
    pub keys: Range<usize>,
}

impl Stretch {
    /// Stretches of faces, with the ranges of their corners.
    fn of_faces(faces: &[[u32; 3]]) -> Vec<Self> {
        let stretch = |(chunk, rows): (usize, &[[u32; 3]])| {
            let ends =
                |(low, high): (u32, u32), &[a, b, c]: &[u32; 3]| (low.min(a).min(b).min(c), high.max(a).max(b).max(c));
            let (low, high) = rows.iter().fold((u32::MAX, 0), ends);
            let first = chunk * STRETCH;
            Self { items: first..first + rows.len(), keys: low as usize..high as usize + 1 }
        };
        faces.par_chunks(STRETCH).enumerate().with_min_len(PARALLEL_ROWS / STRETCH).map(stretch).collect()
    }

    /// So many items of which nothing is known.
    pub fn any(item_count: usize) -> [Self; 1] {
        [Self { items: 0..item_count, keys: 0..usize::MAX }]
    }
}

/// [`group_stretches`] by so many threads into `starts`, one more than keys, and what `room` has for as many as there are. A band
/// skips stretches that have none of its keys.
pub(crate) fn group_into<'r, const K: usize>(
    stretches: &[Stretch],
    keys: impl Fn(usize) -> [u32; K] + Sync,
    starts: &mut [u32],
    threads: usize,
    room: impl FnOnce(usize) -> &'r mut [u32],
) {
    let key_count = starts.len() - 1;
    let item_count: usize = stretches.iter().map(|stretch| stretch.items.len()).sum();
    let bands = if item_count * K < PARALLEL_KEYS { 1 } else { threads.clamp(1, MOST_BANDS) };
    let band_len = key_count.div_ceil(bands).max(1);
    starts.fill(0);
    starts[..key_count].par_chunks_mut(band_len).enumerate().for_each(|(band, counts)| {
        for_keys_in(band * band_len..band * band_len + counts.len(), stretches, &keys, |key, _| counts[key] += 1);
    });
    let mut total = 0;
    for start in starts.iter_mut() {
        total += std::mem::replace(start, total);
    }

    let mut rows = Vec::with_capacity(bands);
    let mut rest = room(total as usize);
    for first_key in (0..key_count).step_by(band_len) {
        let end_key = (first_key + band_len).min(key_count);
        let (row, after) = rest.split_at_mut((starts[end_key] - starts[first_key]) as usize);
        rows.push(row);
        rest = after;
    }
    // The starts serve as cursors: filled, each has become the start of its successor, and one shift puts them right.
    starts[..key_count].par_chunks_mut(band_len).zip(rows).enumerate().for_each(|(band, (cursors, row))| {
        let first = cursors[0];
        for_keys_in(band * band_len..band * band_len + cursors.len(), stretches, &keys, |key, item| {
            row[(cursors[key] - first) as usize] = item as u32;
            cursors[key] += 1;
        });
    });
    starts.copy_within(..key_count, 1);
    starts[0] = 0;
}

fn for_keys_in<const K: usize>(
    band: Range<usize>,
    stretches: &[Stretch],
    keys: &(impl Fn(usize) -> [u32; K] + Sync),
    mut visit: impl FnMut(usize, usize),
) {
    let meets = |stretch: &&Stretch| stretch.keys.start < band.end && band.start < stretch.keys.end;
    for Stretch { items, keys: within } in stretches.iter().filter(meets) {
        let is_inside = band.start <= within.start && within.end <= band.end;
        for item in items.clone() {
            for key in keys(item) {
                if is_inside || band.contains(&(key as usize)) {
                    visit(key as usize - band.start, item);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    // 2 - 3
    // | \ |
    // 0 - 1
    const SQUARE: [[u32; 3]; 2] = [[0, 1, 2], [1, 3, 2]];

    #[test]
    fn a_corner_is_found_wherever_it_stands() {
        assert_eq!([4, 7, 2, 9].map(|v| corner_of([4, 7, 2], v)), [0, 1, 2, 0]);
        // Of a repeated one the last.
        assert_eq!([4, 7].map(|v| corner_of([4, 7, 7], v)), [0, 2]);
    }

    #[test]
    fn square_rings() {
        let rings = Rings::new(&SQUARE, 5);
        assert_eq!(rings.starts, [0, 1, 3, 5, 6, 6]);
        assert_eq!(rings.faces, [0, 0, 1, 0, 1, 1]);
        assert_eq!(rings.ring(4), [] as [u32; 0]);
    }

    #[test]
    fn square_edges() {
        let rings = Rings::new(&SQUARE, 4);
        let mut scratch = Vec::new();
        let mut edges = Vec::new();
        for v in 0..4 {
            for uses in rings.edges_from(&SQUARE, v, &mut scratch) {
                edges.push((v, uses[0].far(), uses.iter().map(|u| (u.face(), u.outward())).collect::<Vec<_>>()));
            }
        }
        let expected = [
            (0, 1, vec![(0, true)]),
            (0, 2, vec![(0, false)]),
            (1, 2, vec![(0, true), (1, false)]),
            (1, 3, vec![(1, true)]),
            (2, 3, vec![(1, false)]),
        ];
        assert_eq!(edges, expected);
        assert_eq!(rings.faces_of_edge(&SQUARE, 2, 1).collect::<Vec<_>>(), [0, 1]);
        assert_eq!(rings.faces_of_edge(&SQUARE, 0, 3).count(), 0);
    }

    #[test]
    fn a_repeated_corner_has_ring_entries_but_no_edges() {
        let rings = Rings::new(&[[0, 0, 1]], 2);
        assert_eq!(rings.faces, [0, 0, 0]);
        assert_eq!(rings.edges_at(&[[0, 0, 1]], 0, &mut Vec::new()).count(), 0);
    }

    #[test]
    fn no_faces_and_no_vertices() {
        assert_eq!(Rings::new(&[], 0), Rings { starts: vec![0], faces: vec![] });
        assert_eq!(Rings::new(&[], 2).starts, [0, 0, 0]);
    }

    #[test]
    fn bands_do_not_show() {
        let vertex_count = 20_000;
        let faces: Vec<[u32; 3]> =
            (0..40_000u32).map(|i| [0, 1, 2].map(|k| (i * 7919 + k * 104_729) % vertex_count)).collect();
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let one = pool(1).install(|| Rings::new(&faces, vertex_count as usize));
        for threads in [2, 3, 11] {
            assert_eq!(pool(threads).install(|| Rings::new(&faces, vertex_count as usize)), one);
        }
    }

    /// With ends at those of bands, ranges wider than need be, and stretches of nothing.
    #[test]
    fn stretches_do_not_show() {
        let faces: Vec<[u32; 3]> = (0..40_000u32).map(|i| [i / 2, i / 2 + 1, i / 2 + 90]).collect();
        let (starts, rings) = group(faces.len(), 20_090, |f| faces[f]);
        let expected = Rings { starts, faces: rings };
        for (len, slack, threads) in [(1, 0, 3), (7, 0, 2), (300, 0, 1), (300, 5, 3)] {
            let stretch = |first: usize| {
                let items = first..(first + len).min(faces.len());
                let corners = || faces[items.clone()].iter().flatten();
                let low = corners().min().map_or(0, |&v| v as usize).saturating_sub(slack);
                let keys = low..corners().max().map_or(0, |&v| v as usize + 1 + slack);
                [Stretch { items, keys }, Stretch { items: first..first, keys: 0..0 }]
            };
            let stretches: Vec<Stretch> = (0..faces.len()).step_by(len).flat_map(stretch).collect();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            let (starts, rings) = pool.install(|| group_stretches(&stretches, 20_090, |f| faces[f]));
            assert_eq!(Rings { starts, faces: rings }, expected, "{len}, {slack}, {threads} threads");
            assert_eq!(pool.install(|| Rings::new(&faces, 20_090)), expected);
        }
    }

    proptest! {
        #[test]
        fn rings_are_the_plain_definition(faces in prop::collection::vec([0u32..9, 0u32..9, 0u32..9], 0..40)) {
            let rings = Rings::new(&faces, 9);
            for v in 0..9 {
                let plain: Vec<u32> = (0..faces.len() as u32)
                    .flat_map(|f| faces[f as usize].iter().filter(|&&c| c == v).map(|_| f).collect::<Vec<_>>())
                    .collect();
                prop_assert_eq!(rings.ring(v), plain);
            }
        }
    }
}
