//! From arguments to the options of methods that make regions of faces.

use coarsen::partition::{self, By, Flatness};
use coarsen::{Method, contract};

use super::Exit;
use super::args::{self, Triangulation};
use super::failure::refuse;

/// The options of flat regions; `shared` are those of shape, as contraction would take them.
///
/// # Errors
/// An option that regions do not have.
pub fn coplanar(args: &args::Regions, shared: &contract::Options) -> anyhow::Result<Method> {
    let defaults = Flatness::default();
    let angle_rad = args.flat_angle.map_or(defaults.angle_rad, f64::from);
    options(By::Coplanar(Flatness { angle_rad, ..defaults }), args, shared)
}

fn options(by: By, args: &args::Regions, shared: &contract::Options) -> anyhow::Result<Method> {
    let contract::Options { weld, flips, .. } = *shared;
    if *shared != (contract::Options { weld, flips, ..contract::Options::default() }) {
        let message =
            "methods that make regions take --weld and --flips of the options of shape: leave the others away";
        return Err(refuse(Exit::Usage, message));
    }
    Ok(Method::Partition(partition::Options {
        by,
        triangulation: match args.triangulation {
            Some(Triangulation::Earcut) => partition::Triangulation::Earcut,
            Some(Triangulation::Ears) => partition::Triangulation::Ears,
            None => partition::Triangulation::default(),
        },
        weld,
        flips,
    }))
}

/// Whether an option is given that only regions have.
pub fn is_asked(args: &args::Regions) -> bool {
    args.flat_angle.is_some() || args.triangulation.is_some()
}
