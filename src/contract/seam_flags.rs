//! Which vertices lie on a seam, and which of these may move along it.

use rayon::prelude::*;

use crate::kernel::rows::{CORNER, Face, LOCKED, SEAM};
use crate::kernel::split::CHUNK;
use crate::mesh::adjacency::corner_of;
use crate::mesh::fan::Fan;
use crate::mesh::{Mesh, Rings};

use super::wedges::Wedges;
use super::yielding::Yields;

/// An edge as a face at one of its vertices has it: the far end, and the wedges at both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
struct EdgeWedges {
    end: u32,
    wedges: [u32; 2],
}

/// So many uses of edges are compared each with each, without a branch: to sort a few is misjudged at every step.
const FEW: usize = 64;

/// How many pairs of faces disagree in the wedges of an edge that they share: as many as there are seams where none has more
/// than two. Many `uses` are put in order.
fn count_seams(uses: &mut [EdgeWedges]) -> usize {
    if uses.len() > FEW {
        return count_seams_sorted(uses);
    }
    let disagree = |a: &EdgeWedges, b: &EdgeWedges| {
        let ([near, far], [other_near, other_far]) = (a.wedges, b.wedges);
        usize::from((a.end == b.end) & ((near != other_near) | (far != other_far)))
    };
    (1..uses.len()).map(|i| uses[..i].iter().map(|other| disagree(other, &uses[i])).sum::<usize>()).sum()
}

/// [`count_seams`] of any number.
fn count_seams_sorted(uses: &mut [EdgeWedges]) -> usize {
    uses.sort_unstable();
    let pairs = |count: usize| count * (count - 1) / 2;
    let all: usize = uses.chunk_by(|a, b| a.end == b.end).map(|uses| pairs(uses.len())).sum();
    let alike: usize = uses.chunk_by(|a, b| a == b).map(|uses| pairs(uses.len())).sum();
    all - alike
}

/// What is around the vertices of a surface.
#[derive(Debug, Clone, Copy)]
pub struct Around<'a> {
    pub faces: &'a [Face],
    pub rings: &'a Rings,
    pub fans: &'a [Fan],
}

/// What tells the seams of a surface as a run begins.
struct SeamFinder<'a> {
    faces: &'a [Face],
    rings: &'a Rings,
    /// The wedges of the corners of all faces, and the first of each vertex.
    corners: &'a [Face],
    starts: &'a [u32],
    /// The wedge that stands for those that count as one with another; none where each stands for itself.
    standing: Vec<u32>,
    /// Of which faces all vertices have one wedge.
    is_whole: Vec<bool>,
    yields: Yields,
}

impl<'a> SeamFinder<'a> {
    fn new(wedges: &'a Wedges, mesh: &Mesh, yields: Yields, Around { faces, rings, .. }: Around<'a>) -> Self {
        let (corners, starts) = wedges.connectivity();
        let is_one = |v: u32| starts[v as usize + 1] - starts[v as usize] == 1;
        let is_whole =
            faces.par_iter().with_min_len(CHUNK).map(|face| face.corners().into_iter().all(is_one)).collect();
        let standing = match yields {
            Yields::Nothing => Vec::new(),
            _ => {
                let agree = |a: &[f32], b: &[f32]| wedges.layout.agree_but_in_shading(a, b);
                standing(wedges, &wedges.materials_for(mesh, yields), starts, agree)
            }
        };
        Self { faces, rings, corners, starts, standing, is_whole, yields }
    }

    fn standing(&self, wedge: u32) -> u32 {
        self.standing.get(wedge as usize).copied().unwrap_or(wedge)
    }

    fn wedges_of(&self, vertex: u32) -> std::ops::Range<u32> {
        self.starts[vertex as usize]..self.starts[vertex as usize + 1]
    }

    /// The flags of a vertex that lies on a seam: [`SEAM`], and [`LOCKED`] or [`CORNER`] where it may not move along it.
    /// `uses` is overwritten.
    fn flags(&self, vertex: u32, fan: Fan, uses: &mut Vec<EdgeWedges>) -> u32 {
        let ring = self.rings.ring(vertex);
        if ring.iter().fold(true, |all, &f| all & self.is_whole[f as usize]) {
            return 0;
        }
        let corner = if self.yields >= Yields::Corners { SEAM | CORNER } else { SEAM | LOCKED };
        let own = self.wedges_of(vertex);
        let is_parted = own.len() > 1;
        let count = own.filter(|&wedge| self.standing(wedge) == wedge).count();
        if count > 2 {
            return corner;
        }
        uses.resize(uses.len().max(2 * ring.len()), EdgeWedges::default());
        let mut use_count = 0;
        for &f in ring {
            let (face, wedges) = (self.faces[f as usize].corners(), self.corners[f as usize].corners());
            let k = corner_of(face, vertex);
            let near = self.standing(wedges[k]);
            for far in [(k + 1) % 3, (k + 2) % 3] {
                // An edge whose ends have one wedge each is no seam. Written whether it may be one or not: a branch would be
                // misjudged along every seam.
                uses[use_count] = EdgeWedges { end: face[far], wedges: [near, self.standing(wedges[far])] };
                use_count += usize::from(is_parted | (self.wedges_of(face[far]).len() > 1));
            }
        }
        match (count_seams(&mut uses[..use_count]), count) {
            (0, 0 | 1) => 0,
            (2, 2) if fan == Fan::Closed => SEAM,
            _ => corner,
        }
    }
}

/// The wedge that stands for each: the first of its vertex that has its material, of these if there are any, and a row that `agree`s.
pub fn standing(
    wedges: &Wedges,
    materials: &[u32],
    starts: &[u32],
    agree: impl Fn(&[f32], &[f32]) -> bool + Sync + Send,
) -> Vec<u32> {
    let agree = &agree;
    let first_of = |begin: u32, wedge: u32| {
        let agrees = |&other: &u32| {
            let same_material = materials.get(other as usize) == materials.get(wedge as usize);
            same_material && agree(wedges.row(other), wedges.row(wedge))
        };
        (begin..wedge).find(agrees).unwrap_or(wedge)
    };
    let of_vertex = |ends: &[u32]| {
        let (begin, end) = (ends[0], ends[1]);
        (begin..end).map(move |wedge| first_of(begin, wedge))
    };
    starts.par_windows(2).with_min_len(CHUNK).flat_map_iter(of_vertex).collect()
}

impl Wedges {
    /// The flags that its seams give to every vertex of `mesh`, where such of them yield; none where there are no seams.
    pub fn seam_flags(&self, mesh: &Mesh, yields: Yields, around: Around<'_>) -> Vec<u32> {
        if self.are_vertices {
            return Vec::new();
        }
        let seams = SeamFinder::new(self, mesh, yields, around);
        let flags = |uses: &mut Vec<EdgeWedges>, (vertex, &fan): (usize, &Fan)| seams.flags(vertex as u32, fan, uses);
        around.fans.par_iter().enumerate().with_min_len(CHUNK).map_init(Vec::new, flags).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uses(rows: &[[u32; 3]]) -> Vec<EdgeWedges> {
        rows.iter().map(|&[end, near, far]| EdgeWedges { end, wedges: [near, far] }).collect()
    }

    #[test]
    fn every_two_faces_that_disagree_count_once() {
        let seams = |rows: &[[u32; 3]]| count_seams(&mut uses(rows));
        assert_eq!(seams(&[]), 0);
        // Two faces that agree, one alone, and two that disagree at the near end or at the far one.
        assert_eq!(seams(&[[5, 0, 1], [6, 0, 2], [5, 0, 1]]), 0);
        assert_eq!(seams(&[[5, 0, 1], [6, 0, 2], [5, 3, 1]]), 1);
        assert_eq!(seams(&[[5, 0, 1], [6, 0, 2], [6, 0, 4], [5, 3, 1]]), 2);
        // Three faces, of which the last disagrees with both others, or all do.
        assert_eq!(seams(&[[5, 0, 1], [5, 0, 1], [5, 0, 2]]), 2);
        assert_eq!(seams(&[[5, 0, 1], [5, 2, 1], [5, 3, 1]]), 3);
    }

    #[test]
    fn few_edges_and_many_are_counted_alike() {
        let mut counts = Vec::new();
        for case in 0..300 {
            let random = |i: u64, below: u64| (crate::math::random(case, i) % below) as u32;
            let edge = |i: u64| [random(3 * i, 1 + case / 4), random(3 * i + 1, 2), random(3 * i + 2, 3)];
            let rows: Vec<[u32; 3]> = (0..case % (FEW as u64 + 1)).map(edge).collect();
            counts.push(count_seams(&mut uses(&rows)));
            assert_eq!(counts.last(), Some(&count_seams_sorted(&mut uses(&rows))), "{rows:?}");
        }
        assert!(counts.iter().max() > Some(&10), "{counts:?}");
    }
}
