//! Simplification by partition: faces into regions, the borders between regions simplified once for both sides, every region
//! triangulated anew.
//!
//! # Invariants
//! - A [`Partition`] puts every face into one region, and the faces of a region are connected across edges
//!   ([`Partition::validate`]).

mod labels;
mod surface;
pub mod vsa;

pub use labels::{Fault, Partition};
pub use surface::Surface;
