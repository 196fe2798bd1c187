//! What may follow any method: turning edges to the other diagonal of their two faces where that brings the result closer.
//!
//! Sweeps: a kernel finds what every edge gains (`kernel::flip_gains`), the host turns those that share no vertex, the greatest gain
//! first. An edge is turned if none is there already, both new faces keep within 78° of the mean normal of the old ones,
//! and neither is a sliver; borders and edges of more than two faces stay. Vertices stay where they are, and so do
//! topology and face count.
//!
//! Samples are vertices and middles of faces of the original, at most a dozen a face of the result, each beside the nearest face;
//! a flip looks at those of its two faces alone.

mod samples;
mod seams;
mod sweep;

use std::time::Instant;

use crate::backend::{Device, fallback};
use crate::error::{Error, Result};
use crate::kernel::flip_gains::{BY_BEND, BY_DISTANCE, BY_SHAPE};
use crate::mesh::Mesh;

/// What turned edges are to lessen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Objective {
    /// The squared distances of samples of the original \[HDD93\].
    #[default]
    Distance,
    /// The lengths of edges times one less the cosine between their faces.
    Bend,
    /// Obtuse angles across flat edges: towards a Delaunay triangulation.
    Shape,
}

impl Objective {
    /// Its number in the kernel.
    fn code(self) -> u32 {
        match self {
            Self::Distance => BY_DISTANCE,
            Self::Bend => BY_BEND,
            Self::Shape => BY_SHAPE,
        }
    }
}

/// Edge flips after a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flips {
    /// At most this many sweeps; 0 for none.
    pub sweeps: u32,
    /// What they are to lessen.
    pub objective: Objective,
}

/// What flips did.
#[derive(Debug, Default)]
pub struct Flipped {
    /// Edges turned, some more than once.
    pub edges: usize,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// A device that was lost.
    pub warning: Option<String>,
}

/// Turns edges of `result`, which came of `original`. Only the faces change, and with them the texture at
/// their corners; no edge of a seam turns. Colors of faces, which belong to none any more, are dropped.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh, [`Error::Limit`] for more rows than the host can index; a GPU that fails gives way to the host.
pub fn flip(original: &Mesh, result: &mut Mesh, flips: Flips, device: &Device) -> Result<Flipped> {
    if flips.sweeps == 0 || result.faces.is_empty() {
        return Ok(Flipped::default());
    }
    original.check()?;
    result.check()?;
    let clock = Instant::now();
    device.install(|| {
        let mut flipped = Flipped::default();
        let gpu = device.gpu_queue().filter(|_| !device.is_auto());
        let on_gpu = gpu.map(|queue| sweep::run(queue, original, result, flips));
        let faces = match on_gpu {
            Some(Err(reason @ (Error::Device(_) | Error::Limit(_)))) => {
                flipped.warning = Some(fallback(&reason));
                sweep::run(device.cpu_queue(), original, result, flips)?
            }
            Some(done) => done?,
            None => sweep::run(device.cpu_queue(), original, result, flips)?,
        };
        (result.faces, result.texcoords, flipped.edges) = faces;
        if flipped.edges > 0 {
            result.face_colors = None;
        }
        flipped.seconds = clock.elapsed().as_secs_f64();
        Ok(flipped)
    })
}
