//! Triangle-mesh simplification on the GPU and the CPU, with the same bytes on both.

pub mod backend;
pub mod contract;
pub mod error;
pub mod kernel;
pub mod math;
pub mod mesh;
pub mod simplify;

pub use backend::Device;
pub use error::{Error, Result};
pub use mesh::Mesh;
pub use simplify::{Budget, Method, Outcome, StopReason, simplify};
