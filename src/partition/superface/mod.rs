//! Faces to regions by their light: a superface is what is lit alike and lies in a plane.
//!
//! # Reference
//! \[Liu99\]: seeds in the order of how little the light changes around them, grown across edges while the criterion holds.
//! Departs: the criterion measures contrast by default, which needs no unit of area, and may cap the range of light within a
//! superface; what is not flat is kept apart, which the paper takes for granted. By default any light joins, for vertices come
//! back inside where it would be missed (`partition::interior`), colors are fitted to what lies between them (`partition::fit`), and
//! vertices slide to where the light bends (`partition::slide`).
//!
//! # Invariants
//! - The regions are a [`Partition`]: every face is in one, and each hangs together across edges.
//! - The vertices of a region lie within [`Flatness::distance`] of its plane, and its faces look to the plane's side.

mod grow;
mod light;
mod region;
#[cfg(test)]
mod tests;

use crate::backend::Queue;
use crate::error::{Error, Result};
use crate::kernel::light_changes::LightChanges;
use crate::kernel::rows::Face;
use crate::math::DVec3;
use crate::mesh::Mesh;
use crate::mesh::limits::{ONE_DEGREE, TWENTY_DEGREES};

use super::plane::Plane;
use super::surface::Surface;
use super::{Flatness, Partition};
use light::Lights;
pub(super) use light::vertex_lights;

/// When a face joins a superface. A face whose own change C is below `epsilon` joins while the mean of C over the superface,
/// by area, stays below it; any other by its step to the mean light of the superface. Red, green and blue must all pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// Steps of light as shares of the darker side: scenes of any size, lit by any lamps, give the same superfaces.
    Contrast {
        /// Steps are below this.
        epsilon: f64,
        /// The greatest light of a superface less the least, as a share of the greatest. Vertices inside come back for their
        /// light, so that it need not be capped.
        range_cap: f64,
    },
    /// The paper's: steps as shares of the darker side and of the area of both, so that the larger a superface is, the more it
    /// swallows.
    Paper {
        /// Steps are below this, one over units of area.
        epsilon: f64,
        /// The unit of area, in squared model units.
        area_unit: f64,
    },
}

/// Any range of light in a superface. With a cap of a quarter borders follow every soft shadow, raggedly.
pub const RANGE_CAP: f64 = 1.0;

/// Any light: superfaces are as large as they are flat.
impl Default for Criterion {
    fn default() -> Self {
        Self::Contrast { epsilon: f64::INFINITY, range_cap: RANGE_CAP }
    }
}

impl Criterion {
    fn epsilon(self) -> f64 {
        let (Self::Contrast { epsilon, .. } | Self::Paper { epsilon, .. }) = self;
        epsilon
    }

    /// The unit of area, where areas count.
    fn area_unit(self) -> Option<f64> {
        match self {
            Self::Contrast { .. } => None,
            Self::Paper { area_unit, .. } => Some(area_unit),
        }
    }
}

/// How faces become superfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// What is lit alike.
    pub criterion: Criterion,
    /// What lies in a plane.
    pub guard: Flatness,
}

impl Options {
    /// Rooms: what is flat, to one degree.
    pub const FLAT: Flatness = Flatness { angle_rad: ONE_DEGREE, distance: 1e-3 };
    /// Curved surfaces: faces within twenty degrees of the first.
    pub const BENT: Flatness = Flatness { angle_rad: TWENTY_DEGREES, distance: 1e-3 };

    /// # Errors
    /// [`Error::Parameter`] for what is out of range.
    pub(super) fn check(&self) -> Result<()> {
        self.guard.check()?;
        let epsilon = self.criterion.epsilon();
        if epsilon.is_nan() || epsilon < 0.0 {
            return Err(Error::Parameter(format!("the step of light is {epsilon}: give 0 or more")));
        }
        match self.criterion {
            Criterion::Contrast { range_cap, .. } if !(0.0..=1.0).contains(&range_cap) => {
                Err(Error::Parameter(format!("the range of light is {range_cap}, not in 0 … 1")))
            }
            Criterion::Paper { area_unit, .. } if !(area_unit > 0.0 && area_unit.is_finite()) => {
                Err(Error::Parameter(format!("the unit of area is {area_unit}: give a positive number")))
            }
            _ => Ok(()),
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { criterion: Criterion::default(), guard: Self::FLAT }
    }
}

/// Faces by their light.
#[derive(Debug, Clone)]
pub struct Grown {
    /// The regions.
    pub partition: Partition,
    /// The plane that each lies in; none for faces without an area.
    pub planes: Vec<Option<Plane>>,
    /// The mean light of each, by area: red, green and blue.
    pub lights: Vec<DVec3>,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// The superfaces of `surface`, which was made of `mesh`: its light is that of the faces, or else the mean of the colors at
/// their corners.
///
/// # Errors
/// [`Error::Mesh`] for a mesh without colors, [`Error::Parameter`] for options out of range, [`Error::Device`] and
/// [`Error::Limit`] when the device of `queue` fails.
pub fn partition(surface: &Surface, mesh: &Mesh, options: Options, queue: &mut Queue) -> Result<Grown> {
    options.check()?;
    let lights = Lights::new(surface, mesh, options.criterion.area_unit())?;
    let changes = changes(surface, &lights, options.criterion, queue)?;
    Ok(grow::grow(surface, lights, &changes, options))
}

/// How much the light changes around every face.
fn changes(surface: &Surface, lights: &Lights, criterion: Criterion, queue: &mut Queue) -> Result<Vec<[f32; 4]>> {
    let neighbors = surface.neighbors.iter().map(|&[a, b, c]| Face { a, b, c }).collect();
    let (rows, neighbors) = (queue.buffer_from(lights.rows.clone())?, queue.buffer_from(neighbors)?);
    let mut changes = queue.buffer(lights.rows.len())?;
    queue.run(LightChanges {
        lights: &rows,
        neighbors: &neighbors,
        face_count: lights.rows.len() as u32,
        floor: lights.floor,
        by_area: criterion.area_unit().is_some(),
        changes: &mut changes,
    })?;
    Ok(queue.rows(&changes)?.into_owned())
}
