//! The flow on a device: sites, keys, the grid, the faces left, sums and representatives.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::backend::{Buffer, Queue};
use crate::error::{Error, Result};
use crate::kernel::cell_faces::CellFaces;
use crate::kernel::cell_keys::{CellKeys, LEAST_STEPS};
use crate::kernel::cell_sums::CellSums;
use crate::kernel::count_spanning::{CountSpanning, SPAN_BLOCK};
use crate::kernel::nearest_corners::NearestCorners;
use crate::kernel::representatives::Representatives;
use crate::kernel::rows::{Face, Site};
use crate::mesh::Mesh;
use crate::simplify::Phases;

use super::Representative;
use super::driver::Goal;
use super::lattice::{Lattice, unit};
use super::left::Left;
use super::made::{Cells, Points, made};
use super::pieces::Pieces;
use super::search::{Count, Unless, coarsest, finest, go_on};

/// Faces that a thread copies at a time.
const ROWS: usize = 1 << 12;

/// What came of it.
pub struct Done {
    pub mesh: Mesh,
    pub origin: Vec<u32>,
    /// Steps to the side of a cell.
    pub steps: u32,
    /// Of the worst cell, in model units.
    pub estimate: f64,
    /// Faces of the input in cells that no face is left of.
    pub vanished: usize,
    pub seconds: Phases,
    pub bytes_moved: u64,
}

impl Done {
    /// The input as it is.
    pub fn nothing(mesh: &Mesh) -> Self {
        Self {
            mesh: Mesh { texcoords: None, face_colors: None, ..mesh.clone() },
            origin: (0..mesh.positions.len() as u32).collect(),
            steps: 0,
            estimate: 0.0,
            vanished: 0,
            seconds: Phases::default(),
            bytes_moved: 0,
        }
    }
}

/// Takes the faces that a grid leaves, and may ask to stop.
pub type Report<'a> = dyn FnMut(usize) -> ControlFlow<()> + Send + 'a;

/// A mesh on a queue's device.
pub struct Work<'a> {
    queue: Queue,
    mesh: &'a Mesh,
    lattice: Lattice,
    report: &'a mut Report<'a>,
    sites: Buffer<Site>,
    faces: Buffer<Face>,
    keys: Buffer<[u32; 2]>,
    counts: Buffer<u32>,
    /// The steps of the grid that the keys are of.
    keyed: u32,
    /// What a grid of so many steps leaves, the last that was counted.
    left: Option<(u32, Left)>,
    seconds: Phases,
    /// When the phase began, and the time spent moving until then.
    began: (Instant, Duration),
}

impl<'a> Work<'a> {
    /// Moves the mesh to the device.
    pub fn new(
        mut queue: Queue,
        mesh: &'a Mesh,
        lattice: Lattice,
        used: &[bool],
        report: &'a mut Report<'a>,
    ) -> Result<Self> {
        let began = (Instant::now(), Duration::ZERO);
        let faces = mesh.faces.par_iter().with_min_len(ROWS).map(|&[a, b, c]| Face { a, b, c }).collect();
        let mut work = Self {
            sites: queue.buffer_from(lattice.sites(&mesh.positions, used))?,
            faces: queue.buffer_from(faces)?,
            keys: queue.buffer(mesh.positions.len())?,
            counts: queue.buffer(mesh.faces.len().div_ceil(SPAN_BLOCK as usize))?,
            mesh,
            lattice,
            report,
            keyed: 0,
            left: None,
            seconds: Phases::default(),
            began,
            queue,
        };
        work.seconds.build = work.lap();
        Ok(work)
    }

    /// The seconds since the last lap, less those spent moving.
    fn lap(&mut self) -> f64 {
        let now = (Instant::now(), self.queue.time_moving());
        let began = std::mem::replace(&mut self.began, now);
        (now.0 - began.0).saturating_sub(now.1 - began.1).as_secs_f64()
    }

    /// Finds the grid and clusters.
    pub fn run(mut self, goal: Goal, representative: Representative) -> Unless<Done> {
        let extent = self.lattice.extent;
        let faces_in = self.mesh.faces.len();
        let mut count = |steps, what| self.count(steps, what);
        let steps = match goal {
            Goal::Grid(steps) => Some(steps),
            // All that differ by a step or two.
            Goal::Faces { target, .. } if target >= faces_in => Some(LEAST_STEPS),
            Goal::Faces { target, most } => match go_on!(finest(target, most, extent, &mut count)) {
                None => go_on!(coarsest(most, count)),
                found => found,
            },
            Goal::Deviation { most } => go_on!(coarsest(most, count)),
        };
        let Some(steps) = steps else {
            return Err(Error::Mesh("all its faces are degenerate: no grid leaves one".into()));
        };
        let left = match self.left.take() {
            Some((of, left)) if of == steps => left,
            _ => {
                go_on!(self.count(steps, Count::Left));
                self.left.take().map(|(_, left)| left).unwrap_or_default()
            }
        };
        if left.sources.is_empty() {
            return Err(Error::Parameter("the grid leaves no face: give a finer one".into()));
        }
        self.make(left, steps, representative).map(ControlFlow::Continue)
    }

    /// The keys of a grid, on the device.
    fn key(&mut self, steps: u32) -> Result<()> {
        if self.keyed != steps {
            let vertex_count = self.mesh.positions.len() as u32;
            self.queue.run(CellKeys { sites: &self.sites, vertex_count, steps, keys: &mut self.keys })?;
            self.keyed = steps;
        }
        Ok(())
    }

    /// Counts the faces of a grid and reports them.
    fn count(&mut self, steps: u32, what: Count) -> Unless<usize> {
        self.key(steps)?;
        let count = match what {
            Count::Spanning => {
                let face_count = self.mesh.faces.len() as u32;
                let counts = &mut self.counts;
                self.queue.run(CountSpanning { faces: &self.faces, keys: &self.keys, face_count, counts })?;
                self.queue.rows(&self.counts)?.iter().map(|&count| count as usize).sum()
            }
            Count::Left => {
                let left = Left::new(&self.mesh.faces, &self.queue.rows(&self.keys)?);
                let count = left.sources.len();
                self.left = Some((steps, left));
                count
            }
        };
        Ok(match (self.report)(count) {
            ControlFlow::Continue(()) => ControlFlow::Continue(count),
            ControlFlow::Break(()) => ControlFlow::Break(()),
        })
    }

    /// Makes the mesh of the faces left.
    fn make(mut self, mut left: Left, steps: u32, representative: Representative) -> Result<Done> {
        self.key(steps)?;
        let (of_vertices, firsts) = left.number(&self.queue.rows(&self.keys)?);
        let cells = Cells { of_vertices, firsts, steps };
        let vanished = cells.vanished(&self.mesh.faces);
        self.keys = self.queue.buffer(0)?;
        self.seconds.select = self.lap();
        let (points, estimate) = self.points(&cells, representative)?;
        self.seconds.cost = self.lap();
        let (mut mesh, origin) = made(self.mesh, &self.lattice, &cells, &points, left.faces);
        // A face that is left is one of the input.
        mesh.materials = self.mesh.materials.as_ref().map(|materials| materials.take(&left.sources));
        self.seconds.apply = self.lap();
        self.seconds.transfer = self.queue.time_moving().as_secs_f64();
        let (seconds, bytes_moved) = (self.seconds, self.queue.bytes_moved());
        Ok(Done { mesh, origin, steps, estimate, vanished, seconds, bytes_moved })
    }

    /// The faces of every cell.
    fn pieces(&mut self, cells: &Cells) -> Result<Pieces> {
        let face_count = self.mesh.faces.len();
        let vertex_cells = &self.queue.buffer_from(cells.of_vertices.clone())?;
        let mut cell_faces = self.queue.buffer(face_count)?;
        self.queue.run(CellFaces {
            faces: &self.faces,
            vertex_cells,
            face_count: face_count as u32,
            cell_faces: &mut cell_faces,
        })?;
        let pieces = Pieces::new(&self.queue.rows(&cell_faces)?, cells.firsts.len());
        // On a GPU the host has none of its rows.
        if cell_faces.host().is_empty() {
            pieces.check_for_gpu()?;
        }
        Ok(pieces)
    }

    /// Where the vertices of the cells go, and how far the worst is from its planes, in model units.
    fn points(&mut self, cells: &Cells, representative: Representative) -> Result<(Points, f64)> {
        let pieces = self.pieces(cells)?;
        let Self { queue, mesh, lattice, sites, faces, .. } = self;
        let (piece_count, cell_count) = (pieces.count(), cells.firsts.len());
        let origins = cells.firsts.iter().map(|&v| lattice.site(mesh.positions[v as usize])).collect();
        let (origins, unit) = (&queue.buffer_from(origins)?, unit(cells.steps));
        let (piece_faces, rows) = (&queue.buffer_from(pieces.faces)?, &queue.buffer_from(pieces.rows)?);
        let cell_pieces = queue.buffer_from(pieces.cell_starts.clone())?;
        let mut sums = queue.buffer(piece_count)?;
        let mut points = queue.buffer(cell_count)?;
        queue.run(CellSums {
            sites,
            faces,
            origins,
            pieces: rows,
            piece_faces,
            piece_count: piece_count as u32,
            steps: cells.steps,
            unit,
            sums: &mut sums,
        })?;
        queue.run(Representatives {
            origins,
            cell_pieces: &cell_pieces,
            sums: &sums,
            cell_count: cell_count as u32,
            steps: cells.steps,
            unit,
            at_mean: representative == Representative::Mean,
            representatives: &mut points,
        })?;
        let model_units = lattice.length(1.0 / f64::from(unit));
        let free = queue.rows(&points)?.into_owned();
        let distance = |point: &[f32; 4]| f64::from(point[3]).sqrt();
        if representative != Representative::Input {
            let estimate = free.iter().map(distance).fold(0.0, f64::max) * model_units;
            return Ok((Points::Free(free), estimate));
        }
        let mut nearest = queue.buffer(piece_count)?;
        queue.run(NearestCorners {
            sites,
            faces,
            origins,
            pieces: rows,
            piece_faces,
            representatives: &points,
            piece_count: piece_count as u32,
            steps: cells.steps,
            unit,
            nearest: &mut nearest,
        })?;
        let nearest = queue.rows(&nearest)?;
        let of_cell = |ends: &[u32]| nearest[ends[0] as usize..ends[1] as usize].iter().copied().min();
        let chosen: Vec<[u32; 2]> = pieces.cell_starts.windows(2).filter_map(of_cell).collect();
        // A root mean squared distance grows by at most the way from one point to another.
        let farther =
            |(point, &[key, _]): (&[f32; 4], &[u32; 2])| distance(point) + f64::from(f32::from_bits(key)).sqrt();
        let estimate = free.iter().zip(&chosen).map(farther).fold(0.0, f64::max) * model_units;
        Ok((Points::At(chosen.into_iter().map(|[_, vertex]| vertex).collect()), estimate))
    }
}
