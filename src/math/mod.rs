//! Vectors for the rest of the crate: glam's, the exact single-precision arithmetic that kernels share with WGSL, and how
//! ties are ordered.

pub mod exact;
pub mod lanes;

pub use glam::{DMat3, DVec2, DVec3, Vec2, Vec3, Vec4};

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
