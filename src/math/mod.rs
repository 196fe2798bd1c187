//! Vectors for the rest of the crate: glam's, the exact single-precision arithmetic that kernels share with WGSL, and how
//! ties are ordered.

pub mod exact;
pub mod lanes;
pub mod luv;
pub mod places;
pub mod wide;

pub use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3, Vec2, Vec3, Vec4};

/// The ratio of the radii of the circles in and around a triangle with these sides, 0 … ½: cos A + cos B + cos C − 1 \[Liu99\].
pub fn radius_ratio([a, b, c]: [f64; 3]) -> f64 {
    let product = 2.0 * a * b * c;
    if product > 0.0 { (b + c - a) * (c + a - b) * (a + b - c) / product } else { 0.0 }
}

/// A bijective mix of 32 bits, another in every round: orders ties so that no two tie and no region comes first.
pub fn tie_hash(index: u32, round: u32) -> u32 {
    let mut x = index ^ round.wrapping_mul(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// 64 bits that look random: the splitmix64 generator \[SLF14\] from `seed` on, after so many steps.
pub fn random(seed: u64, steps: u64) -> u64 {
    let z = seed.wrapping_add(steps.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the sum of the cosines, by the law of cosines; known values by hand.
    #[test]
    fn ratios_are_sums_of_cosines() {
        assert_eq!(radius_ratio([1.0; 3]), 0.5);
        assert_eq!((radius_ratio([1.0, 2.0, 3.0]), radius_ratio([0.0; 3])), (0.0, 0.0));
        // r = (3 + 4 − 5) / 2 and R = 5 / 2.
        assert!((radius_ratio([3.0, 4.0, 5.0]) - 0.4).abs() < 1e-15);
        for i in 0..1000 {
            let side = |round: u32| 0.5 + f64::from(tie_hash(i, round) % 1000) / 2001.0;
            let [a, b, c] = [1, 2, 3].map(side);
            let cos = |a: f64, b: f64, c: f64| (b * b + c * c - a * a) / (2.0 * b * c);
            let sum = cos(a, b, c) + cos(b, c, a) + cos(c, a, b) - 1.0;
            assert!((radius_ratio([a, b, c]) - sum).abs() < 1e-12, "{a} {b} {c}");
        }
    }
}
