//! Vectors for the rest of the crate: glam's, and the small fixed-size algebra that glam lacks.

pub mod exact;

pub use glam::{DMat3, DVec3, Vec3, Vec4};
