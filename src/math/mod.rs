//! Vectors for the rest of the crate: glam's, and the exact single-precision arithmetic that kernels share with WGSL.

pub mod exact;
pub mod lanes;

pub use glam::{DMat3, DVec2, DVec3, Vec2, Vec3, Vec4};
