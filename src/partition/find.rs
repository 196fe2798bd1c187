//! Faces to regions, by the method that was asked for, and what their borders may become.

use std::ops::ControlFlow;

use crate::error::Result;
use crate::mesh::Mesh;
use crate::simplify::Budget;

use super::chains::Tolerances;
use super::corners::Corners;
use super::cut::Parts;
use super::interior::Limits;
use super::plane::Plane;
use super::queues::Queues;
use super::surface::Surface;
use super::{By, Options, Partition, Superfaces, Variational, coplanar, superface, vsa};

/// What the rebuilding starts from.
#[derive(Debug)]
pub struct Found {
    pub partition: Partition,
    /// The plane that each region lies in, where its vertices were held to one; parts of it are drawn in that too.
    pub planes: Option<Vec<Option<Plane>>>,
    pub tolerances: Tolerances,
    /// Where it counts.
    pub light: Option<SurfaceLight>,
    pub proxies: Vec<vsa::Proxy>,
    pub energies: Vec<f64>,
    /// Whether what corners carry is linear over every region, so that those that stay keep it.
    pub keeps_corners: bool,
    pub is_cancelled: bool,
}

/// Where and with what.
pub struct Partitioner<'a> {
    pub mesh: &'a Mesh,
    pub surface: &'a Surface,
    pub budget: &'a Budget,
    pub queues: &'a mut Queues,
    pub warnings: &'a mut Vec<String>,
    /// May ask to stop.
    pub report: &'a mut (dyn FnMut() -> ControlFlow<()> + Send),
}

/// The light of a surface.
#[derive(Debug)]
pub struct SurfaceLight {
    /// The color of every vertex.
    pub colors: Vec<[f32; 4]>,
    /// What of it may be lost.
    pub limits: Limits,
    /// How far colors may be moved; nothing where they stay.
    pub most_moved: Option<f64>,
    /// Whether vertices slide with them.
    pub slides: bool,
}

/// Light may be off inside a region by this many times as much as at a vertex of its border: there it is only the few vertices
/// beside a hard shadow that are off so far.
const INNER: f64 = 4.0;
/// A vertex is worth keeping where its absence costs more light than this share of the squared tolerance of borders and the
/// squared diagonal. What is off over all, and not only where it is most, has to be even: with halved tolerances a flat of even
/// bends takes twice the triangles, each of half the area, so that both shrink by the square.
const WORTH: f64 = 1.0 / 12.0;

impl Found {
    fn new(partition: Partition, tolerances: Tolerances) -> Self {
        Self {
            partition,
            planes: None,
            tolerances,
            light: None,
            proxies: Vec::new(),
            energies: Vec::new(),
            keeps_corners: false,
            is_cancelled: false,
        }
    }

    /// The planes that parts of regions are drawn in. Held to its plane, a region is drawn in no other: that through all of it may
    /// be past the limit.
    pub fn planes_of(&self, parts: &Parts, surface: &Surface) -> Vec<Option<Plane>> {
        match &self.planes {
            Some(planes) => parts.whole.iter().map(|&whole| planes[whole as usize]).collect(),
            None => Plane::of_regions(surface, &parts.partition),
        }
    }
}

impl Partitioner<'_> {
    /// Finds the regions.
    pub fn find(mut self, options: &Options) -> Result<Found> {
        let surface = self.surface;
        let limit = self.budget.max_deviation(surface.frame.length_to_model(surface.diagonal))?;
        match &options.by {
            By::Coplanar(flatness) => {
                let given = flatness.distance * surface.diagonal;
                let distance = if limit.is_finite() { surface.frame.length_to_rows(limit) } else { given };
                let model_distance = surface.frame.length_to_model(distance);
                let corners = Corners::new(self.mesh, *flatness, model_distance);
                let angle_rad = flatness.angle_rad;
                let partition = coplanar::partition(surface, angle_rad, distance, corners.as_ref(), self.walls());
                let is_cancelled = (self.report)().is_break();
                let planes = Some(Plane::of_regions(surface, &partition));
                let tolerances = Tolerances { distance, ..Tolerances::ANY };
                Ok(Found { planes, is_cancelled, keeps_corners: true, ..Found::new(partition, tolerances) })
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
            ..Found::new(found.partition, Tolerances { chord_ratio, distance, ..Tolerances::ANY })
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
        let most = superfaces.inner_color.unwrap_or(INNER * superfaces.border_color) / 255.0;
        let limits = Limits { most, worth: WORTH * (most / INNER * surface.diagonal).powi(2) };
        let tolerances = Tolerances {
            distance: limit.min(superfaces.border_distance * surface.diagonal),
            color: superfaces.border_color / 255.0,
            worth: limits.worth,
            ..Tolerances::ANY
        };
        let colors = superface::vertex_lights(surface, mesh);
        let most_moved = superfaces.fits_light.then_some(most / INNER);
        Ok(Found {
            planes: Some(found.planes),
            light: Some(SurfaceLight { colors, limits, most_moved, slides: superfaces.slides }),
            is_cancelled: (self.report)().is_break(),
            ..Found::new(found.partition, tolerances)
        })
    }
}
