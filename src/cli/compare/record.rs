//! A comparison, for the table that people read and the JSON that programs read.

use std::path::Path;

use coarsen::Device;
use coarsen::mesh::Topology;
use coarsen::metrics::{Comparison, Kinds, MaterialTexture, Quality, Side, Spread, TextureDeviation, View};
use coarsen::report::ImageDifference;
use serde::Serialize;

use super::Job;
use crate::cli::memory;

/// A comparison, as `--json` prints it: lengths in model units, angles in radians. Fields are only ever added under this
/// `schema`.
#[derive(Debug, Serialize)]
pub struct Record {
    schema: u32,
    version: &'static str,
    pub a: String,
    pub b: String,
    device: String,
    /// Samples on the faces of each side that were asked for; null for ten a face of the larger mesh.
    samples: Option<usize>,
    seed: u64,
    kinds: Kinds,
    /// Of the bounding box of A.
    pub diagonal: f64,
    /// From A to B.
    pub forward: Side,
    /// From B to A.
    pub backward: Side,
    /// The greater of both; its maximum is the Hausdorff distance.
    pub symmetric: Spread,
    /// The same as a fraction of the diagonal.
    pub relative: Spread,
    pub quality: Pair<Quality>,
    /// After equal positions are joined.
    pub topology: Pair<Topology>,
    /// Where both have texture coordinates.
    pub texture: Option<TextureDeviation>,
    /// The same of every material, where both have materials.
    pub texture_materials: Vec<MaterialTexture>,
    /// With --images.
    pub images: Option<ImageDifference>,
    /// With --view.
    pub screen: Option<Screen>,
    heatmap: Option<String>,
    picture: Option<String>,
    pub seconds: Seconds,
    /// Bytes resident at most; null where the system does not tell.
    peak_memory: Option<u64>,
}

#[derive(Debug, Serialize)]
pub struct Pair<T> {
    pub a: T,
    pub b: T,
}

/// What the deviation comes to on a screen.
#[derive(Debug, Serialize)]
pub struct Screen {
    pub view: View,
    /// The symmetric deviation in pixels.
    pub pixels: Spread,
}

/// Wall-clock seconds by phase.
#[derive(Debug, Default, Serialize)]
pub struct Seconds {
    pub read: f64,
    pub measure: f64,
    pub draw: f64,
    pub total: f64,
}

impl Record {
    /// The record of a job that is done.
    pub fn new(
        job: &Job,
        device: &Device,
        comparison: Comparison,
        images: Option<ImageDifference>,
        seconds: Seconds,
    ) -> Self {
        let Comparison { deviation, quality, topology, texture, texture_materials } = comparison;
        let symmetric = deviation.symmetric();
        let diagonal = deviation.diagonal;
        let path = |path: &Path| path.display().to_string();
        Self {
            schema: 1,
            version: env!("CARGO_PKG_VERSION"),
            a: job.a.to_string(),
            b: job.b.to_string(),
            device: device.description(),
            samples: job.options.samples,
            seed: job.options.seed,
            kinds: job.options.kinds,
            diagonal,
            forward: deviation.forward,
            backward: deviation.backward,
            symmetric,
            relative: each(symmetric, |length| if diagonal > 0.0 { length / diagonal } else { 0.0 }),
            quality: quality.into(),
            topology: topology.into(),
            texture,
            texture_materials,
            images,
            screen: job.view.map(|view| Screen { view, pixels: each(symmetric, |length| view.pixels(length)) }),
            heatmap: job.heatmap.as_deref().map(path),
            picture: job.picture.as_deref().map(path),
            seconds,
            peak_memory: memory::peak(),
        }
    }
}

fn each(Spread { max, mean, rms }: Spread, of: impl Fn(f64) -> f64) -> Spread {
    Spread { max: of(max), mean: of(mean), rms: of(rms) }
}

impl<T> From<[T; 2]> for Pair<T> {
    fn from([a, b]: [T; 2]) -> Self {
        Self { a, b }
    }
}
