//! How far a point is from four triangles at once: [`closest_point`]'s distances, with the same bits.
//!
//! Which of its seven regions a point is in is told for every lane, and the closest point is from one corner so far along two
//! sides: nothing along them at a corner, and along one of them on an edge.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4, mask64x4};

use super::triangle::{SLIVER, closest_point};
use crate::math::DVec3;
use crate::math::wide::{WIDE, WideVec3};

/// The squared distances of `p` from triangles; of slivers, which are seldom, as for one of them.
#[inline(always)]
pub fn distances_sq<S: Simd>(simd: S, p: DVec3, triangles: [WideVec3<S>; 3]) -> [f64; WIDE] {
    let [a, b, c] = triangles;
    let (zero, one) = (f64x4::splat(simd, 0.0), f64x4::splat(simd, 1.0));
    let wide_p = WideVec3::splat(simd, p);
    let (e, f) = (b - a, c - a);
    let (from_a, from_b, from_c) = (wide_p - a, wide_p - b, wide_p - c);
    let is_sliver =
        e.cross(f).length_squared().simd_le(f64x4::splat(simd, SLIVER) * e.length_squared() * f.length_squared());

    let (e_a, f_a) = (e.dot(from_a), f.dot(from_a));
    let (e_b, f_b) = (e.dot(from_b), f.dot(from_b));
    let (e_c, f_c) = (e.dot(from_c), f.dot(from_c));
    let at_c = e_a * f_b - e_b * f_a;
    let at_b = e_c * f_a - e_a * f_c;
    let at_a = e_b * f_c - e_c * f_b;
    let (toward_c, toward_b) = (f_b - e_b, e_c - f_c);
    // The first of these that holds is the region; where none does, the point lies above the inside.
    let by_a = e_a.simd_le(zero) & f_a.simd_le(zero);
    let by_b = e_b.simd_ge(zero) & f_b.simd_le(e_b);
    let by_c = f_c.simd_ge(zero) & e_c.simd_le(f_c);
    let by_ab = at_c.simd_le(zero) & e_a.simd_ge(zero) & e_b.simd_le(zero);
    let by_ca = at_b.simd_le(zero) & f_a.simd_ge(zero) & f_c.simd_le(zero);
    let by_bc = at_a.simd_le(zero) & toward_c.simd_ge(zero) & toward_b.simd_ge(zero);

    let corner = by_a | by_b | by_c;
    let first = by_ab.select(e_a, by_ca.select(zero, by_bc.select(toward_c, at_b)));
    let second = by_ab.select(zero, by_ca.select(f_a, by_bc.select(zero, at_c)));
    let edge = by_ab.select(e_a - e_b, by_ca.select(f_a - f_c, toward_c + toward_b));
    let total = corner.select(one, (by_ab | by_ca | by_bc).select(edge, at_a + at_b + at_c));
    let (along_first, along_second) = (corner.select(zero, first) / total, corner.select(zero, second) / total);

    let from_b_on = !by_a & (by_b | (!by_c & !by_ab & !by_ca & by_bc));
    let from_c_on = !by_a & !by_b & by_c;
    let base = select(from_b_on, from_b, select(from_c_on, from_c, from_a));
    let side = select(from_b_on, c - b, e);
    let mut found: [f64; WIDE] = (base - side.scaled(along_first) - f.scaled(along_second)).length_squared().into();
    let slivers = is_sliver.to_bitmask();
    if slivers != 0 {
        of_slivers(p, triangles, slivers, &mut found);
    }
    found
}

/// Replaces the distances from those of the triangles that are slivers.
#[cold]
fn of_slivers<S: Simd>(p: DVec3, triangles: [WideVec3<S>; 3], slivers: u64, found: &mut [f64; WIDE]) {
    let corners = triangles.map(WideVec3::store);
    for (lane, found) in found.iter_mut().enumerate().filter(|(lane, _)| slivers >> lane & 1 != 0) {
        *found = closest_point(p, corners.each_ref().map(|rows| rows.get(lane))).distance_sq;
    }
}

#[inline(always)]
fn select<S: Simd>(mask: mask64x4<S>, a: WideVec3<S>, b: WideVec3<S>) -> WideVec3<S> {
    WideVec3 { x: mask.select(a.x, b.x), y: mask.select(a.y, b.y), z: mask.select(a.z, b.z) }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::math::wide::WideRows;

    /// The distances of a point from four triangles, each row those of one corner.
    fn distances(p: DVec3, corners: &[[DVec3; 3]; WIDE]) -> [f64; WIDE] {
        let mut rows = [WideRows::default(); 3];
        for (corner, rows) in rows.iter_mut().enumerate() {
            corners.iter().enumerate().for_each(|(lane, corners)| rows.set(lane, corners[corner]));
        }
        load(p, &rows)
    }

    fn load(p: DVec3, rows: &[WideRows; 3]) -> [f64; WIDE] {
        #[inline(always)]
        fn loaded<S: Simd>(simd: S, p: DVec3, rows: &[WideRows; 3]) -> [f64; WIDE] {
            let triangles = [rows[0].load(simd), rows[1].load(simd), rows[2].load(simd)];
            distances_sq(simd, p, triangles)
        }
        dispatch!(Level::new(), simd => loaded(simd, p, rows))
    }

    /// From all sides, over every region and its rims, beside triangles that are slivers, segments and points.
    #[test]
    fn lanes_have_the_bits_of_one_triangle() {
        let number = |seed: u32| f64::from(seed.wrapping_mul(2_654_435_761) >> 20) / 4096.0;
        let point = |seed: u32| DVec3::new(number(seed), number(seed + 1), number(seed + 2));
        let mut slivers = 0;
        let is_sliver = |[a, b, c]: [DVec3; 3]| {
            let (e, f) = (b - a, c - a);
            e.cross(f).length_squared() <= SLIVER * e.length_squared() * f.length_squared()
        };
        for seed in (0..6000).step_by(20) {
            let [a, b, c] = [0, 3, 6].map(|k| point(seed + k));
            let thin = [1e-4, 1e-7, 1e-12][seed as usize / 20 % 3];
            let nearly = a.lerp(b, 0.4) + (c - a) * thin;
            let corners = [[a, b, c], [a, b, nearly], [c, a, c], [b * 3.0, c, a]];
            slivers += corners.into_iter().filter(|&corners| is_sliver(corners)).count();
            let beside = [0.0, 0.5, 1.0].map(|t| a.lerp(b, t));
            let along = beside.into_iter().chain([point(seed + 9), point(seed + 12) * 3.0 - DVec3::ONE, a, b, c]);
            for p in along {
                let expected = corners.map(|corners| closest_point(p, corners).distance_sq);
                assert_eq!(distances(p, &corners).map(f64::to_bits), expected.map(f64::to_bits), "{p} {corners:?}");
            }
        }
        // One of each four, and two thirds of another.
        assert!(slivers > 400, "{slivers}");
    }

    #[test]
    fn a_point_in_each_region_is_as_far_as_it_is() {
        let triangle = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];
        for (p, expected) in [
            ([1.0, 1.0, 3.0], 9.0),
            ([-1.0, -2.0, 2.0], 9.0),
            ([6.0, -1.0, 2.0], 9.0),
            ([-2.0, 5.0, 2.0], 9.0),
            ([1.0, -3.0, 4.0], 25.0),
            ([-3.0, 2.0, -4.0], 25.0),
            ([4.0, 4.0, 0.0], 8.0),
        ] {
            assert_eq!(distances(DVec3::from(p), &[triangle; WIDE]), [expected; WIDE], "{p:?}");
        }
    }
}
