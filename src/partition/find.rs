//! Faces to regions, by the method that was asked for, and what their borders may become.

use std::ops::ControlFlow;

use crate::error::Result;
use crate::mesh::Mesh;
use crate::simplify::Budget;

use super::chains::Tolerances;
use super::queues::Queues;
use super::surface::Surface;
use super::{By, Options, Partition, Superfaces, Variational, coplanar, superface, vsa};

/// What the rebuilding starts from.
#[derive(Debug)]
pub struct Found {
    pub partition: Partition,
    pub tolerances: Tolerances,
    /// The color of every vertex, where it counts.
    pub colors: Option<Vec<[f32; 4]>>,
    /// How far a vertex inside a region may be from the color in its place.
    pub inner_color: f64,
    /// Whether colors may move.
    pub fits_light: bool,
    pub proxies: Vec<vsa::Proxy>,
    pub energies: Vec<f64>,
    pub is_cancelled: bool,
}

/// Where and with what.
pub struct Search<'a> {
    pub mesh: &'a Mesh,
    pub surface: &'a Surface,
    pub budget: &'a Budget,
    pub queues: &'a mut Queues,
    pub warnings: &'a mut Vec<String>,
    /// May ask to stop.
    pub report: &'a mut (dyn FnMut() -> ControlFlow<()> + Send),
}

/// No limit.
const ANY: Tolerances = Tolerances { distance: f64::INFINITY, chord_ratio: f64::INFINITY, color: f64::INFINITY };

impl Found {
    fn new(partition: Partition, tolerances: Tolerances) -> Self {
        Self {
            partition,
            tolerances,
            colors: None,
            inner_color: f64::INFINITY,
            fits_light: false,
            proxies: Vec::new(),
            energies: Vec::new(),
            is_cancelled: false,
        }
    }
}

impl Search<'_> {
    /// Finds the regions.
    pub fn find(mut self, options: &Options) -> Result<Found> {
        let surface = self.surface;
        let limit = self.budget.max_deviation(surface.frame.length_to_model(surface.diagonal))?;
        match &options.by {
            By::Coplanar(flatness) => {
                let given = flatness.distance * surface.diagonal;
                let distance = if limit.is_finite() { surface.frame.length_to_rows(limit) } else { given };
                let is_wall = self.walls();
                let partition = coplanar::partition(surface, flatness.angle_rad, distance, is_wall);
                let is_cancelled = (self.report)().is_break();
                Ok(Found { is_cancelled, ..Found::new(partition, Tolerances { distance, ..ANY }) })
            }
            By::Variational(variational) => self.variational(variational, limit),
            By::Superfaces(superfaces) => self.superfaces(superfaces, limit),
        }
    }

    /// Faces of different colors are of different materials.
    fn walls(&self) -> impl Fn(u32, u32) -> bool + use<'_> {
        let (mesh, surface) = (self.mesh, self.surface);
        let color = |face: u32| mesh.face_colors.as_ref().map(|rows| rows[surface.input_face(face) as usize]);
        move |a, b| {
            mesh.face_colors.is_some() && color(a).map(|x| x.map(f32::to_bits)) != color(b).map(|x| x.map(f32::to_bits))
        }
    }

    fn variational(self, &Variational { regions, chord_ratio }: &Variational, limit: f64) -> Result<Found> {
        let goal = if limit.is_finite() { vsa::Goal::Deviation(limit) } else { regions.goal };
        let distance = self.surface.frame.length_to_rows(limit);
        let report = self.report;
        let mut on_pass = |_| report();
        let options = vsa::Options { goal, ..regions };
        let found = vsa::partition_on(self.queues, self.surface, &options, Some(&mut on_pass))?;
        self.warnings.extend(found.warnings);
        Ok(Found {
            proxies: found.proxies,
            energies: found.energies,
            is_cancelled: found.is_cancelled,
            ..Found::new(found.partition, Tolerances { chord_ratio, distance, ..ANY })
        })
    }

    fn superfaces(&mut self, superfaces: &Superfaces, limit: f64) -> Result<Found> {
        let (surface, mesh) = (self.surface, self.mesh);
        let mut regions = superfaces.regions;
        let limit = surface.frame.length_to_rows(limit);
        if limit.is_finite() && surface.diagonal > 0.0 {
            regions.guard.distance = limit / surface.diagonal;
        }
        let found = self.queues.run(self.warnings, |queue| superface::partition(surface, mesh, regions, queue))?;
        self.warnings.extend(found.warnings);
        let moved =
            mesh.face_colors.is_some().then(|| "face colors become those of vertices, without steps between".into());
        self.warnings.extend(moved);
        let tolerances = Tolerances {
            distance: limit.min(superfaces.border_distance * surface.diagonal),
            color: superfaces.border_color / 255.0,
            ..ANY
        };
        Ok(Found {
            colors: Some(superface::vertex_lights(surface, mesh)),
            inner_color: superfaces.inner_color.unwrap_or(2.0 * superfaces.border_color) / 255.0,
            fits_light: superfaces.fits_light,
            is_cancelled: (self.report)().is_break(),
            ..Found::new(found.partition, tolerances)
        })
    }
}
