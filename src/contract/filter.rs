//! Which contractions are legal, on the current state.

use crate::kernel::rows::{BORDER, Face, Position};
use crate::math::DVec3;
use crate::simplify::Blocked;

use super::star::{Marks, Star};

/// Why a pair was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rejection {
    /// Both ends lie on a border and the pair does not.
    Border,
    /// The link condition.
    Link,
    /// A face would turn over.
    Flip,
    /// A face would become a sliver.
    Aspect,
    /// The error limit.
    Error,
}

impl Blocked {
    /// Counts a rejection.
    pub fn count(&mut self, rejection: Rejection) {
        *match rejection {
            Rejection::Border => &mut self.border,
            Rejection::Link => &mut self.link,
            Rejection::Flip => &mut self.flip,
            Rejection::Aspect => &mut self.aspect,
            Rejection::Error => &mut self.error,
        } += 1;
    }
}

/// The link condition \[DEGN99\]: contracting keeps the surface's topology exactly when the links of the ends meet in
/// the link of the pair, borders coned to a vertex of their own.
///
/// In faces: the common neighbors are the opposite vertices of the one or two shared faces, all different; two border
/// vertices contract only along the border; no tetrahedron closes flat and no lone triangle vanishes.
pub fn link_condition(star: &Star, [u, w]: [u32; 2], flags: [u32; 2], marks: &mut Marks) -> Result<(), Rejection> {
    let on_border = flags[0] & flags[1] & BORDER != 0;
    match star.shared[..] {
        [k] => {
            let vanishes = star.first.is_empty() && star.second.is_empty();
            let tip = Star::opposite(k, u, w);
            if !on_border || vanishes || marks.common_neighbors(star, u, w) != 1 || tip == u {
                return Err(Rejection::Link);
            }
        }
        [k, l] => {
            if on_border {
                return Err(Rejection::Border);
            }
            let (k, l) = (Star::opposite(k, u, w), Star::opposite(l, u, w));
            if k == l || marks.common_neighbors(star, u, w) != 2 {
                return Err(Rejection::Link);
            }
            let joins = |face: &Face| face.corners().contains(&k) && face.corners().contains(&l);
            let closed_first = star.first.iter().any(joins);
            if closed_first && star.second.iter().any(joins) {
                return Err(Rejection::Link);
            }
        }
        _ => return Err(Rejection::Link),
    }
    Ok(())
}

/// Limits on the shape of the faces that survive a contraction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeLimits {
    /// Least cosine between a face's old and new normal.
    pub min_cos: f64,
    /// Least ratio of inradius to circumradius, unless the face was worse.
    pub min_aspect: f64,
}

/// Squared normals below this are of faces without area, which may take any shape that has some.
const NO_AREA_SQ: f64 = 1e-24;

/// Whether every surviving face keeps its side and its shape when the ends move to `x`.
pub fn shapes_hold(
    star: &Star,
    [u, w]: [u32; 2],
    x: DVec3,
    positions: &[Position],
    limits: ShapeLimits,
) -> Result<(), Rejection> {
    for (end, faces) in [(u, &star.first), (w, &star.second)] {
        for face in faces {
            let old = face.corners().map(|v| positions[v as usize].xyz().as_dvec3());
            let mut new = old;
            for (corner, v) in new.iter_mut().zip(face.corners()) {
                if v == end {
                    *corner = x;
                }
            }
            let (before, after) = (normal(old), normal(new));
            let (before_sq, after_sq) = (before.length_squared(), after.length_squared());
            if before_sq <= NO_AREA_SQ {
                continue;
            }
            let dot = before.dot(after);
            if !(dot > 0.0 && dot * dot > limits.min_cos * limits.min_cos * before_sq * after_sq) {
                return Err(Rejection::Flip);
            }
            if limits.min_aspect > 0.0 {
                let aspect = radius_ratio(new);
                if aspect < limits.min_aspect && aspect < radius_ratio(old) {
                    return Err(Rejection::Aspect);
                }
            }
        }
    }
    Ok(())
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Twice the inradius over the circumradius, 1 for an equilateral triangle: (b+c−a)(c+a−b)(a+b−c)/(abc).
fn radius_ratio([p, q, r]: [DVec3; 3]) -> f64 {
    let (a, b, c) = ((q - r).length(), (r - p).length(), (p - q).length());
    let product = a * b * c;
    if product > 0.0 { (b + c - a) * (c + a - b) * (a + b - c) / product } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radius_ratio_is_one_for_equilateral_and_zero_for_flat() {
        let equilateral = [DVec3::X, DVec3::Y, DVec3::Z];
        assert!((radius_ratio(equilateral) - 1.0).abs() < 1e-12);
        assert!(radius_ratio([DVec3::ZERO, DVec3::X, DVec3::X * 2.0]).abs() < 1e-12);
    }
}
