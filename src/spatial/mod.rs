//! Where things are: for measuring, a bounding volume hierarchy over a mesh's triangles and the exact closest point; for
//! contraction, a tree whose boxes may change, and whether triangles pass through each other.
//!
//! # Invariants
//! - What is measured is in a [`Frame`] common to the meshes that are compared: centered, within −1 .. 1.
//! - A node's box holds every corner below it: bounds of a [`Bvh`] are rounded outward to single precision, in which the corners
//!   of a [`wide_tree::WideTree`] are.
//! - [`Bvh::closest`] gives the least of the distances that [`triangle::closest_point`] computes over all faces, the
//!   lowest face where several are at that distance, whatever the guess: the tree only leaves out what is farther.

pub mod bounds;
pub mod bvh;
mod closest;
pub mod crossing;
mod frame;
mod split;
pub mod triangle;
pub mod wide_tree;
pub mod wide_triangle;

pub use bvh::{Bvh, Node};
pub use closest::Hit;
pub use frame::Frame;
