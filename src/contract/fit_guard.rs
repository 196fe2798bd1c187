//! Which vertices of a fit stay: those around which a face would turn over, flatten or fold, or the samples lose.

use rayon::prelude::*;

use crate::kernel::rows::{Face, FaceFit, Position};
use crate::math::DVec3;

use super::filter::ShapeLimits;
use super::fit::{Shape, shifted};

/// Least cosine between the normals of two faces at an edge, unless it was less: about 154°.
const FOLD_COS: f64 = -0.9;
/// Squared normals below this are of faces without area, which may take any shape.
const NO_AREA_SQ: f64 = 1e-24;

/// Limits on how a fit may change the faces.
#[derive(Debug, Clone, Copy)]
pub struct Guard {
    pub limits: ShapeLimits,
}

/// A face before and after.
#[derive(Debug, Clone, Copy, Default)]
struct Change {
    before: DVec3,
    after: DVec3,
    is_bad: bool,
}

impl Guard {
    /// Holds the corners of what would turn over, flatten or fold, until nothing does.
    pub fn hold(&self, shape: Shape<'_>, positions: &[Position], offsets: &[[f32; 4]], held: &mut [bool]) {
        loop {
            let changes: Vec<Change> =
                shape.faces.par_iter().map(|&face| self.change(face, positions, offsets, held)).collect();
            let folds = (0..positions.len()).into_par_iter().flat_map_iter(|vertex| folds_at(vertex, shape, &changes));
            let mut bad: Vec<u32> = folds.collect();
            bad.extend((0..).zip(&changes).filter(|(_, change)| change.is_bad).map(|(face, _)| face));
            let mut holds_more = false;
            for vertex in bad.into_iter().flat_map(|face: u32| shape.faces[face as usize].corners()) {
                let can_move = offsets[vertex as usize][..3] != [0.0; 3];
                holds_more |= can_move && !std::mem::replace(&mut held[vertex as usize], true);
            }
            if !holds_more {
                return;
            }
        }
    }

    fn change(&self, face: Face, positions: &[Position], offsets: &[[f32; 4]], held: &[bool]) -> Change {
        let corners = face.corners().map(|v| v as usize);
        let at = |v: usize| positions[v].xyz().as_dvec3();
        let [a, b, c] = corners.map(at);
        let before = (b - a).cross(c - a);
        if corners.iter().all(|&v| held[v]) {
            return Change { before, after: before, is_bad: false };
        }
        let [p, q, r] =
            corners.map(|v| if held[v] { at(v) } else { shifted(positions[v], offsets[v]).xyz().as_dvec3() });
        let after = (q - p).cross(r - p);
        let (before_sq, after_sq) = (before.length_squared(), after.length_squared());
        if before_sq <= NO_AREA_SQ {
            return Change { before, after, is_bad: false };
        }
        let dot = before.dot(after);
        let ShapeLimits { min_cos, min_height } = self.limits;
        let turns = dot.is_nan() || dot <= 0.0 || dot * dot <= min_cos * min_cos * before_sq * after_sq;
        let sides_sq = |a: DVec3, b: DVec3, c: DVec3| {
            (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared()
        };
        let (sides_before, sides_after) = (sides_sq(a, b, c), sides_sq(p, q, r));
        let least = min_height * sides_after;
        let flattens = after_sq < least * least && after_sq.sqrt() / sides_after < before_sq.sqrt() / sides_before;
        Change { before, after, is_bad: turns || flattens }
    }
}

/// The faces at a vertex that fold onto another across an edge to a vertex of a higher number.
fn folds_at(vertex: usize, shape: Shape<'_>, changes: &[Change]) -> impl Iterator<Item = u32> {
    let (start, end) = (shape.ring_starts[vertex] as usize, shape.ring_starts[vertex + 1] as usize);
    let ring = &shape.ring_faces[start..end];
    let mut folded = Vec::new();
    for (i, &first) in ring.iter().enumerate() {
        for &second in &ring[..i] {
            let (f, g) = (changes[first as usize], changes[second as usize]);
            let cos_below = |a: DVec3, b: DVec3, limit: f64| {
                let dot = a.dot(b);
                dot < 0.0 && dot * dot > limit * limit * a.length_squared() * b.length_squared()
            };
            if !cos_below(f.after, g.after, FOLD_COS) || cos_below(f.before, g.before, FOLD_COS) {
                continue;
            }
            let corners = shape.faces[first as usize].corners();
            let shares_edge = |v: u32| v as usize > vertex && corners.contains(&v);
            if shape.faces[second as usize].corners().into_iter().any(shares_edge) {
                folded.extend([first, second]);
            }
        }
    }
    folded.into_iter()
}

/// Holds the vertices whose faces' samples are no nearer after than before; tells how many.
pub fn refused_by_samples(shape: Shape<'_>, before: &[FaceFit], after: &[FaceFit], held: &mut [bool]) -> usize {
    let loses = |bounds: &[u32]| {
        let ring = &shape.ring_faces[bounds[0] as usize..bounds[1] as usize];
        let sum = |sums: &[FaceFit]| ring.iter().map(|&face| f64::from(sums[face as usize].error)).sum::<f64>();
        let (was, is) = (sum(before), sum(after));
        // Not a number is a loss too; faces that nothing moved are as they were.
        let holds = is <= was;
        !holds
    };
    let refused = shape.ring_starts.par_windows(2).zip(held).map(|(bounds, held)| {
        let refused = !*held && loses(bounds);
        *held |= refused;
        usize::from(refused)
    });
    refused.sum()
}
