//! The points of a face that a fit measures, and what one point asks of the face's corners. In WGSL:
//! `shaders/shared/fit_points.wgsl`.

use super::rows::FaceFit;
use crate::backend::Constant;
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, add, dot3, flush, flush3, mul};

/// Points a face: its middle and three near its corners. With the middle alone the reverse deviation of a fitted mesh is
/// 8 % above that of one not fitted, with three points half way to the corners 4 % below, with these 7 %; three more near
/// the sides gain nothing.
pub const FACE_POINTS: u32 = 4;
/// Components of a unit normal below this are zero, so that no product with one underflows.
pub const LEAST_COMPONENT: f32 = f32::from_bits((127 - 24) << 23);
/// Faces below this squared doubled area have no normal.
pub const NO_NORMAL: f32 = 1e-30;
/// The constants above under their names in WGSL.
pub const CONSTANTS: &[(&str, Constant)] = &[
    ("NO_FACE", Constant::U32(super::nearest::NO_FACE)),
    ("FAR", Constant::F32(super::nearest::FAR)),
    ("MOST_STEPS", Constant::U32(super::nearest::MOST_STEPS)),
    ("APART", Constant::U32(super::nearest::APART)),
    ("FACE_POINTS", Constant::U32(FACE_POINTS)),
    ("LEAST_COMPONENT", Constant::F32(LEAST_COMPONENT)),
    ("NO_NORMAL", Constant::F32(NO_NORMAL)),
];

/// The corner weights of point `k` of a face.
#[inline(always)]
pub fn face_point(k: u32) -> Vec3 {
    if k == 0 {
        return Vec3::splat(0.333_333_34);
    }
    Vec3::new(if k == 1 { 0.8 } else { 0.1 }, if k == 2 { 0.8 } else { 0.1 }, if k == 3 { 0.8 } else { 0.1 })
}

/// Adds a point of the face, given by its corner weights, that lies `away` from where it should.
#[inline(always)]
pub fn with_point(fit: FaceFit, corner_weights: Vec3, away: Vec3, weight: f32) -> FaceFit {
    let v = flush3(corner_weights, LEAST_FACTOR);
    let wa = flush(mul(weight, v.x), LEAST_FACTOR);
    let wb = flush(mul(weight, v.y), LEAST_FACTOR);
    let wc = flush(mul(weight, v.z), LEAST_FACTOR);
    let r = flush3(away, LEAST_FACTOR);
    let height = flush(dot3(fit.normal(), r), LEAST_FACTOR);
    FaceFit {
        nx: fit.nx,
        ny: fit.ny,
        nz: fit.nz,
        aa: add(fit.aa, mul(wa, v.x)),
        ab: add(fit.ab, mul(wa, v.y)),
        ac: add(fit.ac, mul(wa, v.z)),
        bb: add(fit.bb, mul(wb, v.y)),
        bc: add(fit.bc, mul(wb, v.z)),
        cc: add(fit.cc, mul(wc, v.z)),
        a: add(fit.a, mul(wa, height)),
        b: add(fit.b, mul(wb, height)),
        c: add(fit.c, mul(wc, height)),
        error: add(fit.error, mul(weight, flush(dot3(r, r), LEAST_FACTOR))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_balance_and_lie_inside() {
        let points: Vec<Vec3> = (0..FACE_POINTS).map(face_point).collect();
        let sum: Vec3 = points.iter().sum();
        assert!((sum / FACE_POINTS as f32 - Vec3::splat(1.0 / 3.0)).length() < 1e-6, "{sum}");
        assert!(points.iter().all(|p| p.min_element() > 0.0 && (p.element_sum() - 1.0).abs() < 1e-6));
    }

    #[test]
    fn a_point_asks_its_corners_by_their_weights() {
        let flat = FaceFit { nz: 1.0, ..FaceFit::default() };
        let fit = with_point(flat, Vec3::new(0.5, 0.5, 0.0), Vec3::new(3.0, 0.0, 4.0), 2.0);
        assert_eq!([fit.aa, fit.ab, fit.ac, fit.bb, fit.bc, fit.cc], [0.5, 0.5, 0.0, 0.5, 0.0, 0.0]);
        assert_eq!([fit.a, fit.b, fit.c, fit.error], [4.0, 4.0, 0.0, 50.0]);
    }
}
