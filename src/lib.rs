//! Triangle-mesh simplification on the GPU and the CPU, with the same bytes on both.
//!
//! Quadric pair contraction in rounds: compute kernels sum quadrics and cost every edge in parallel, the CPU contracts
//! an independent set of the cheapest and validates topology. Without a GPU the kernels' twins do the same work on the
//! CPU and the result is the same, byte for byte.
//!
//! # Tour
//!
//! ```
//! use coarsen::contract::{Metric, Options};
//! use coarsen::{Budget, Device, Method, Result, StopReason, formats, mesh, metrics, simplify};
//!
//! # fn main() -> Result<()> {
//! // Read a mesh, or make one: `formats::read("scan.ply".as_ref())?`.
//! let scan = mesh::sample("statue", Some(20_000))?;
//!
//! // Open a device once and use it for many meshes. `Device::open(&Selector::Auto, 0)` takes a GPU where there is one.
//! let device = Device::cpu(0)?;
//!
//! // Simplify to a face count; `Budget::keep`, `Budget::error` and others stop elsewhere.
//! let outcome = simplify(&scan, &Method::default(), &Budget::faces(2_000), &device, None)?;
//! assert_eq!(outcome.mesh.faces.len(), 2_000);
//! assert_eq!(outcome.stop, StopReason::FacesReached);
//!
//! // How far off it is by estimate, and what every round did.
//! assert!(outcome.error_estimate < 0.01 * scan.diagonal());
//! assert!(outcome.rounds.iter().all(|round| round.contracted <= round.candidates));
//!
//! // Methods are data: another metric, vertices only at input vertices, and so on.
//! let method = Method::Contract(Options { metric: Metric::Plane, ..Options::default() });
//! let fine = simplify(&scan, &method, &Budget::error(0.001), &device, None)?;
//!
//! // How far off it is by measure: from either side, at vertices, along edges and on faces.
//! let deviation = metrics::deviation(&scan, &outcome.mesh, &metrics::Options::default(), &device)?;
//! assert!(deviation.symmetric().rms < 0.002 * deviation.diagonal);
//!
//! // Every contraction keeps the topology: closed stays closed, parts stay parts. Small parts, small holes and vertices where the
//! // surface is not manifold give way where they would keep a run from its number of faces, and a warning tells. Not with
//! // `Options { prune: Some(0.0), close_holes: Some(0.0), non_manifold: NonManifold::Hold, .. }`.
//! assert_eq!(mesh::topology(&fine.mesh).border_edges, 0);
//!
//! // Write it; the file appears whole or not at all.
//! let path = std::env::temp_dir().join(format!("coarsen-tour-{}.ply", std::process::id()));
//! formats::write(&outcome.mesh, &path, &formats::WriteOptions::default())?;
//! # std::fs::remove_file(path).ok();
//! # Ok(())
//! # }
//! ```
//!
//! # Where to read on
//! - [`simplify()`]: the one entry; [`Budget`], [`Method`], [`Outcome`]; [`simplify_levels()`]: a chain of levels from one run,
//!   and [`lod`]: its vertices in one list.
//! - [`contract`]: the engine and its options; [`cluster`]: vertex clustering, the fast first pass;
//!   [`removal`]: vertices taken away one by one, their holes filled; [`partition`]: regions of faces, each triangulated anew;
//!   [`polish`]: edges turned after any of them.
//! - [`out_of_core`]: contraction of files larger than memory, in parts.
//! - [`kernel`]: what runs on a GPU, each kernel beside its twin; [`backend`]: who runs it.
//! - [`batch`]: many files in one run that can be killed and resumed.
//! - [`progressive`]: the contractions of a run, to replay to any face count and back.
//! - [`metrics`]: how far two surfaces are apart; [`spatial`]: the tree behind it.
//! - [`papers`]: the tables of papers as jobs, run and measured.
//! - [`report`]: heat maps and pictures of it; [`looks`]: the colors and textures in them.
//! - [`mesh`]: welding, topology, validation, shapes and samples; [`formats`]: files.

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod backend;
pub mod batch;
pub mod cluster;
pub mod contract;
pub mod error;
pub mod formats;
pub mod kernel;
pub mod lod;
pub mod looks;
pub mod math;
pub mod mesh;
pub mod metrics;
pub mod out_of_core;
pub mod papers;
pub mod partition;
pub mod polish;
pub mod progressive;
pub mod removal;
pub mod report;
pub mod simplify;
pub mod spatial;

pub use backend::Device;
pub use error::{Error, Result};
pub use mesh::Mesh;
pub use simplify::{Budget, Method, Outcome, StopReason, simplify, simplify_levels, warm_up};
