//! Which contractions are legal, on the current state.

use crate::kernel::rows::BORDER;
use crate::math::DVec3;
use crate::simplify::Blocked;

use super::star::{Marks, Star, StarFace};

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

/// The link condition \[DE99\]: contracting keeps the surface's topology exactly when the links of the ends meet in
/// the link of the pair, borders coned to a vertex of their own.
///
/// In faces: the common neighbors are the opposite vertices of the one or two shared faces, all different; two border
/// vertices contract only along the border; no tetrahedron closes flat and no lone triangle vanishes.
pub fn link_condition(star: &Star, [u, w]: [u32; 2], flags: [u32; 2], marks: &mut Marks) -> Result<(), Rejection> {
    let on_border = flags[0] & flags[1] & BORDER != 0;
    match &star.shared[..] {
        [_] => {
            let vanishes = star.first.is_empty() && star.second.is_empty();
            if !on_border || vanishes || marks.common_neighbors(star, u, w) != 1 {
                return Err(Rejection::Link);
            }
        }
        [k, l] => {
            if on_border {
                return Err(Rejection::Border);
            }
            let (k, l) = (Star::opposite(k, w), Star::opposite(l, w));
            if k == l || marks.common_neighbors(star, u, w) != 2 {
                return Err(Rejection::Link);
            }
            let joins = |face: &StarFace| face.corners.contains(&k) && face.corners.contains(&l);
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

/// Whether every surviving face keeps its side and its shape when the ends move to `x`, about the pair's midpoint.
pub fn shapes_hold(star: &Star, x: DVec3, limits: ShapeLimits) -> Result<(), Rejection> {
    for face in star.first.iter().chain(&star.second) {
        let [_, p1, p2] = face.points;
        let (before, after) = (face.normal, (p1 - x).cross(p2 - x));
        let before_sq = before.length_squared();
        if before_sq <= NO_AREA_SQ {
            continue;
        }
        let dot = before.dot(after);
        if !(dot > 0.0 && dot * dot > limits.min_cos * limits.min_cos * before_sq * after.length_squared()) {
            return Err(Rejection::Flip);
        }
        if limits.min_aspect > 0.0 {
            let aspect = radius_ratio([x, p1, p2]);
            if aspect < limits.min_aspect && aspect < radius_ratio(face.points) {
                return Err(Rejection::Aspect);
            }
        }
    }
    Ok(())
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
