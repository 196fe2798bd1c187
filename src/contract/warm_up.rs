//! Loading the kernels of a GPU before they are needed, by runs on small shapes. Which variants of them a mesh needs is not known
//! until it is read.

use std::sync::Arc;

use rayon::prelude::*;

use crate::backend::Device;
use crate::error::Result;
use crate::mesh::{Mesh, shapes};
use crate::simplify::Budget;

use super::{Options, Weighting, run};

/// The closed shape has 20 · 4³ faces, enough for some rounds, the open one so many squares a side; the share that is kept.
const SPHERE_LEVEL: u32 = 3;
const SHEET_SIDE: u32 = 25;
const KEEP: f64 = 0.2;

/// Loads the kernels: see [`crate::simplify::warm_up()`].
pub(crate) fn warm_up(options: &Options, device: &Device) -> Result<()> {
    let Some(device) = device.for_any_mesh() else { return options.check() };
    let shapes = [shapes::icosphere(SPHERE_LEVEL), colored_sheet()];
    // Software compiles on the cores that read the mesh, and so only what any mesh needs.
    let runs = if device.is_software() { &[(0, false)][..] } else { &[(0, false), (1, false), (0, true), (1, true)] };
    let result = device.install(|| {
        runs.par_iter().try_for_each(|&(shape, is_held)| {
            let shape: &Mesh = &shapes[shape];
            run(shape, &for_shape(options, shape, is_held), &[Budget::keep(KEEP)], &device, None).map(|_| ())
        })
    });
    device.forget_kernel_times();
    result
}

/// An open surface that carries colors.
fn colored_sheet() -> Mesh {
    let mut sheet = shapes::plane(SHEET_SIDE, SHEET_SIDE);
    let colors = sheet.positions.iter().map(|p| [(0.3 * p.x).fract() as f32, (0.7 * p.y).fract() as f32, 0.5, 1.0]);
    sheet.colors = Some(colors.collect());
    sheet
}

/// The options without what is of another mesh, such as lengths; with a vertex that is held, or none.
fn for_shape(options: &Options, shape: &Mesh, is_held: bool) -> Options {
    let vertices = shape.positions.len();
    let weighting = match &options.weighting {
        Weighting::Given(_) => Weighting::Given(vec![1.0; vertices].into()),
        other => other.clone(),
    };
    let locked = is_held.then(|| (0..vertices).map(|v| v == 0).collect::<Arc<[bool]>>());
    Options {
        weighting,
        locked,
        lock: None,
        log: false,
        weld: Some(0.0),
        join_within: 0.0,
        prune: Some(0.0),
        close_holes: Some(0.0),
        ..options.clone()
    }
}
