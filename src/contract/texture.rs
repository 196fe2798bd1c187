//! Where the texture goes with a contraction, and whether it would fold: the kernel test \[Wu12\].
//!
//! The faces around the ends cover a region of the texture, whose rim is the polygon of the far edges of those that
//! survive. The new vertex takes the place of the texture at the nearest point of the surface so far; where not all of the
//! rim is seen from there, the nearest place from which it is. On a border or a seam the polygon is open: only edges of
//! faces count. Faces without an area in the texture demand nothing but to get none of the other sign.

use crate::kernel::rows::SEAM;
use crate::math::{DVec2, DVec3, Vec2, Vec3};
use crate::spatial::triangle::closest_point;

use super::filter::Rejection;
use super::patch::Patch;
use super::uv_kernel::{Kernel, orientation};

/// How much of a kernel is left for a place that has to be moved into it.
const SHRUNK: f64 = 0.95;

/// Most ends of a contraction.
const ENDS: usize = 3;

/// Where the texture goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mapped {
    /// For the corners at each end; what is left over repeats the first.
    pub uv: [Vec2; ENDS],
    /// Whether the ends' corners get different ones: the new vertex is on a seam.
    pub tears: bool,
}

/// A live face at one of the ends.
#[derive(Debug, Clone, Copy)]
struct MappedFace {
    /// Which of the ends told it.
    end: usize,
    /// That end and the corners after it.
    corners: [u32; 3],
    uv: [DVec2; 3],
    points: [DVec3; 3],
    /// Twice its area in the texture.
    area: f64,
    dies: bool,
}

/// Examines contractions, with scratch that outlives each.
#[derive(Debug, Default)]
pub struct TextureFilter {
    faces: Vec<MappedFace>,
    kernel: Kernel,
}

impl TextureFilter {
    /// Where the texture goes when `ends`, of which one at most is on a seam, become one vertex at `at`; `None` without a
    /// texture. All faces of the ends lie in the patch.
    ///
    /// # Errors
    /// [`Rejection::Texture`] when it would fold or tear, or had to move at a vertex that stays where it is.
    pub fn place(&mut self, patch: &Patch<'_>, ends: &[u32], at: Vec3) -> Result<Option<Mapped>, Rejection> {
        if !patch.is_textured() {
            return Ok(None);
        }
        self.gather(patch, ends);
        let is_seam = |end: usize| patch.position(ends[end]).flags & SEAM != 0;
        let stands_at = |end: usize| patch.position(ends[end]).xyz() == at;
        let joins = self.faces.iter().all(|face| !face.dies);
        if joins && ends.len() > 1 {
            let mut uv = [Vec2::ZERO; ENDS];
            for end in (0..ends.len()).filter(|&end| !is_seam(end)) {
                let own = self.faces.iter().find(|face| face.end == end).map(|face| face.uv[0]);
                let fixed = own.filter(|_| stands_at(end));
                uv[end] = self.mapped(fixed, at.as_dvec3(), |face| face.end == end)?;
            }
            return Ok(Some(Mapped { uv, tears: uv[0] != uv[1] }));
        }
        let at_ends = self.at_ends(ends)?;
        let seam = (0..ends.len()).find(|&end| is_seam(end));
        let fixed = seam.or_else(|| (0..ends.len()).find(|&end| stands_at(end)));
        let fixed = fixed.and_then(|end| at_ends[end]);
        let uv = self.mapped(fixed, at.as_dvec3(), |face| Some(face.end) != seam || face.dies)?;
        Ok(Some(Mapped { uv: [uv; ENDS], tears: false }))
    }

    /// Gathers the live faces of the ends, each at the first of its ends.
    fn gather(&mut self, patch: &Patch<'_>, ends: &[u32]) {
        self.faces.clear();
        for (end, &vertex) in ends.iter().enumerate() {
            for &f in patch.connectivity.ring(vertex) {
                let corners = patch.connectivity.faces[f as usize].corners();
                let first = corners.iter().position(|&v| v == vertex).unwrap_or(0);
                let around = [first, (first + 1) % 3, (first + 2) % 3];
                let now = around.map(|k| patch.current(corners[k]).unwrap_or(vertex));
                if now[1] == now[2] || now[1..].iter().any(|v| ends[..end].contains(v)) {
                    continue;
                }
                let uv = around.map(|k| patch.uv(f, k, corners[k]).as_dvec2());
                let points = now.map(|v| patch.position(v).xyz().as_dvec3());
                let [a, b, c] = uv;
                let dies = now[1..].iter().any(|v| ends.contains(v));
                self.faces.push(MappedFace { end, corners: now, uv, points, area: orientation(a, b, c), dies });
            }
        }
    }

    /// The coordinates at each end, on which the faces that die agree; `None` where none of them has it.
    fn at_ends(&self, ends: &[u32]) -> Result<[Option<DVec2>; ENDS], Rejection> {
        let mut found = [None; ENDS];
        for face in self.faces.iter().filter(|face| face.dies) {
            for (&uv, corner) in face.uv.iter().zip(&face.corners) {
                let Some(end) = ends.iter().position(|end| end == corner) else { continue };
                if *found[end].get_or_insert(uv) != uv {
                    return Err(Rejection::Texture);
                }
            }
        }
        Ok(found)
    }

    /// The place of the texture for a vertex at `at`, or `fixed`, from the faces that `counts` takes; those of them that
    /// survive do not fold.
    fn mapped(
        &mut self,
        fixed: Option<DVec2>,
        at: DVec3,
        counts: impl Fn(&MappedFace) -> bool,
    ) -> Result<Vec2, Rejection> {
        let Self { faces, kernel } = self;
        let faces = || faces.iter().filter(|face| counts(face));
        let surviving = || faces().filter(|face| !face.dies);
        let has = |sign: f64| faces().any(|face| face.area * sign > 0.0);
        let sign = match (has(1.0), has(-1.0)) {
            (true, true) => return Err(Rejection::Texture),
            (false, true) => -1.0,
            _ => 1.0,
        };
        let holds = |uv: Vec2| {
            surviving().all(|face| {
                let after = sign * orientation(uv.as_dvec2(), face.uv[1], face.uv[2]);
                after > 0.0 || (after >= 0.0 && face.area == 0.0)
            })
        };
        let uv = fixed.unwrap_or_else(|| nearest(faces(), at));
        let placed = uv.as_vec2();
        let is_flat = faces().all(|face| face.area == 0.0);
        if is_flat || holds(placed) {
            return Ok(placed);
        }
        if fixed.is_some() {
            return Err(Rejection::Texture);
        }
        let corners = || faces().flat_map(|face| face.uv);
        let low = corners().fold(DVec2::INFINITY, DVec2::min);
        let high = corners().fold(DVec2::NEG_INFINITY, DVec2::max);
        kernel.start(low, high);
        for face in surviving() {
            let [_, a, b] = face.uv;
            if sign > 0.0 { kernel.clip(a, b) } else { kernel.clip(b, a) }
        }
        let inside = kernel.nearest(uv, SHRUNK).map(DVec2::as_vec2);
        inside.filter(|&uv| holds(uv)).ok_or(Rejection::Texture)
    }
}

/// The place of the texture at the point of these faces that is nearest to `at`, the first of equals.
fn nearest<'a>(faces: impl Iterator<Item = &'a MappedFace>, at: DVec3) -> DVec2 {
    let found = faces.map(|face| (closest_point(at, face.points), face));
    let least = found.min_by(|(a, _), (b, _)| a.distance_sq.total_cmp(&b.distance_sq));
    least.map_or(DVec2::ZERO, |(nearest, face)| {
        let [a, b, c] = nearest.weights;
        face.uv[0] * a + face.uv[1] * b + face.uv[2] * c
    })
}
