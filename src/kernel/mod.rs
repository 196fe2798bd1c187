//! The kernels: one file a stage, the CPU twin of `shaders/<same stem>.wgsl`.
//!
//! A twin's body is a pure function with the shader's name, local names and statements; `run_cpu` only indexes, loads,
//! calls and stores, in parallel where the outputs can be split. Single-precision arithmetic goes through
//! [`crate::math::exact`], or through vectors of as many numbers side by side (`attribute_spreads`), of which nothing is fused
//! either, so that twin and shader agree bit for bit.

pub mod angle_defects;
pub mod attribute_spreads;
pub mod block_maxima;
pub mod block_sums;
pub mod border_curvatures;
pub mod boundary_gains;
pub mod cell_faces;
pub mod cell_keys;
pub mod cell_sums;
pub mod cells;
pub mod chain_deviations;
pub mod compact_faces;
pub mod compact_quadrics;
pub mod compact_rings;
pub mod compact_vertices;
pub mod contract_faces;
pub mod contract_quadrics;
pub mod contract_vertices;
pub mod cost_histogram;
pub mod count_candidates;
pub mod count_pairs;
pub mod count_spanning;
pub mod curvatures;
pub mod decode_quadrics;
pub mod eigen;
pub mod encode_quadrics;
pub mod exact_probe;
pub mod face_corners;
pub mod face_normals;
pub mod feature_weights;
pub mod find_threshold;
pub mod fit_points;
pub mod fit_steps;
pub mod fit_sums;
pub mod flip_gains;
pub mod format_frame;
pub mod gather_candidates;
pub mod gather_pairs;
pub mod gradient_operators;
pub mod gradient_table;
pub mod label_moves;
pub mod light_changes;
pub mod live_vertices;
pub mod near_vertices;
pub mod nearest;
pub mod nearest_corners;
pub mod nearest_faces;
pub mod nearest_point;
pub mod opposite_faces;
pub mod pair_quadric;
pub mod pairs;
pub mod plane_costs;
pub mod plane_quadric;
pub mod plane_sums;
pub mod quadric_bounds;
pub mod quadric_format;
pub mod removal_costs;
pub mod representatives;
pub mod rows;
pub mod sample_distances;
pub mod scan_add;
pub mod scan_blocks;
pub(crate) mod split;
pub mod stars;
pub mod triangle_costs;
pub mod volume_costs;
pub mod volume_rows;
pub mod volume_sums;
pub mod warm;
pub mod weigh_keys;
pub mod weigh_quadrics;

use crate::backend::{Device, Exactness, GpuOptions, Selector, Threads, row};
use crate::error::{Error, Result};
use crate::math::exact::Sym3;

row!(Sym3 { xx, xy, xz, yy, yz, zz: f32 });

impl Device {
    /// Opens the device that `selector` names, with `threads` threads for the CPU's part (0: one a core).
    ///
    /// A GPU must pass a self-test: [`exact_probe`] has to return the CPU's bits. [`Selector::Auto`] never fails for
    /// want of a GPU: it takes the CPU, and [`Device::notes`] says why.
    ///
    /// # Errors
    /// [`Error::Device`] when the asked-for adapter is missing, cannot be opened or fails the self-test; the message
    /// says what to install.
    pub fn open(selector: &Selector, threads: usize) -> Result<Self> {
        Self::open_with(selector, threads, &GpuOptions::default())
    }

    /// [`Device::open`] with `options` for the GPU.
    ///
    /// # Errors
    /// As [`Device::open`].
    pub fn open_with(selector: &Selector, threads: usize, options: &GpuOptions) -> Result<Self> {
        Self::open_on(selector, Threads::Own(threads), options)
    }

    /// [`Device::open_with`] for a program that runs from one thread: without a GPU the calling thread is the first of the
    /// device's, so that work is neither handed over nor waits for a thread to wake. No other thread may ask such a device for
    /// work. A thread is the first of one device at most; any other that it opens has its own.
    ///
    /// # Errors
    /// As [`Device::open`].
    pub fn open_here(selector: &Selector, threads: usize, options: &GpuOptions) -> Result<Self> {
        Self::open_on(selector, Threads::WithThis(threads), options)
    }

    fn open_on(selector: &Selector, threads: Threads, options: &GpuOptions) -> Result<Self> {
        match (Self::open_tested(selector, threads, options), selector) {
            (Err(reason), Selector::Auto) => {
                Ok(Self::on_cpu(threads)?.with_note(format!("no GPU is used: {}", text(&reason))))
            }
            (result, _) => result,
        }
    }

    fn open_tested(selector: &Selector, threads: Threads, options: &GpuOptions) -> Result<Self> {
        let device = Self::open_untested(selector, threads, options)?;
        match device.self_test() {
            Err(_) if options.exactness.is_none() && device.is_software() => {
                let guarded = GpuOptions { exactness: Some(Exactness::Guarded), ..*options };
                Self::open_tested(selector, threads, &guarded)
            }
            result => result.map(|()| device),
        }
    }

    fn self_test(&self) -> Result<()> {
        let Some(mut queue) = self.gpu_queue() else { return Ok(()) };
        self.install(|| exact_probe::self_test(&mut queue))
            .map_err(|e| Error::Device(format!("{} fails the self-test: {}", self.description(), text(&e))))
    }
}

/// An error's message without its kind, to stand in another.
fn text(error: &Error) -> String {
    match error {
        Error::Device(message) | Error::Limit(message) => message.clone(),
        other => other.to_string(),
    }
}
