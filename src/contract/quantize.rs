//! Initial quadrics on their way through a format, on one device; and as they are stored, for callers.

use std::ops::RangeInclusive;
use std::time::Instant;

use rayon::prelude::*;

use crate::backend::{Buffer, Device, Queue};
use crate::error::{Error, Result};
use crate::kernel::block_maxima::{BlockMaxima, MAXIMUM_BLOCK};
use crate::kernel::decode_quadrics::{DecodeQuadrics, entries_of};
use crate::kernel::encode_quadrics::{EncodeQuadrics, word_count};
use crate::kernel::format_frame::FormatFrame;
use crate::kernel::quadric_bounds::QuadricBounds;
use crate::kernel::rows::{Normal, Position, QuadricBound};
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;

use super::Options;
use super::evaluate::plane_sums;
use super::prepare::{Prepared, prepare};
use super::quadrics::{QuadricFormat, QuadricFrame, QuadricRecord};
use super::surface::Surface;
use super::weigh::{start_weights, weigh_start};
use crate::mesh::frame::Frame;

/// How long raw coordinates and edges may be: squares of others leave single precision.
const RAW: RangeInclusive<f64> = 1e-12..=1e12;

/// A format, and its coordinates in those of the rows.
#[derive(Debug, Clone, Copy)]
pub struct Storage {
    format: QuadricFormat,
    frame: FormatFrame,
    /// See [`QuadricRecord`].
    reach: f64,
    diagonal: f64,
}

/// The quadrics of a surface as they are stored.
#[derive(Debug)]
struct Stored {
    /// Its first row is the greatest of all.
    bound: Buffer<QuadricBound>,
    words: Buffer<u32>,
}

impl Storage {
    /// For a run that begins with these rows; `None` where its options store nothing.
    ///
    /// # Errors
    /// [`Error::Parameter`] for raw coordinates that single precision has no room for.
    pub fn new(options: &Options, rows: &[Position], frame: Frame) -> Result<Option<Self>> {
        let Some(format) = options.quadrics.format else { return Ok(None) };
        let farthest = rows.par_iter().map(|row| row.xyz().abs()).reduce(|| Vec3::ZERO, Vec3::max).as_dvec3();
        let (origin, unit) = match options.quadrics.frame {
            QuadricFrame::Normalized if farthest.length() > 0.0 => (DVec3::ZERO, farthest.length().recip()),
            QuadricFrame::Normalized => (DVec3::ZERO, 1.0),
            QuadricFrame::Raw => (frame.origin_in_rows(), frame.length_to_model(1.0)),
        };
        let box_corner = (origin.abs() + farthest) * unit;
        if options.quadrics.frame == QuadricFrame::Raw && ![unit, box_corner.length()].iter().all(|x| RAW.contains(x)) {
            let [x, y, z] = box_corner.to_array();
            return Err(Error::Parameter(format!(
                "raw coordinates up to {x:e}, {y:e}, {z:e} with edges of {unit:e} have no squares in single precision"
            )));
        }
        let [origin_x, origin_y, origin_z] = origin.as_vec3().to_array();
        Ok(Some(Self {
            format,
            frame: FormatFrame { origin_x, origin_y, origin_z, unit: unit as f32 },
            reach: box_corner.element_sum(),
            diagonal: 2.0 * farthest.length() * unit,
        }))
    }

    /// `normals` are those of the surface's faces.
    fn store(self, queue: &mut Queue, surface: &Surface, normals: &Buffer<Normal>) -> Result<Option<Stored>> {
        let Some(quadrics) = &surface.quadrics else { return Ok(None) };
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let (vertex_count, frame, format) = (surface.vertex_count as u32, self.frame, self.format.code());
        let mut bound = queue.buffer(surface.vertex_count)?;
        let bounds = &mut bound;
        queue.run(QuadricBounds {
            positions,
            faces,
            ring_starts,
            ring_faces,
            normals,
            quadrics,
            vertex_count,
            frame,
            bounds,
        })?;
        let mut bound_count = vertex_count;
        while bound_count > 1 {
            let blocks = bound_count.div_ceil(MAXIMUM_BLOCK);
            let mut maxima = queue.buffer(blocks as usize)?;
            queue.run(BlockMaxima { bounds: &bound, bound_count, maxima: &mut maxima })?;
            (bound, bound_count) = (maxima, blocks);
        }
        let mut stored = Stored { bound, words: queue.buffer(word_count(format, surface.vertex_count))? };
        let Stored { bound, words } = &mut stored;
        queue.run(EncodeQuadrics { positions, quadrics, bound, vertex_count, frame, format, words })?;
        Ok(Some(stored))
    }

    fn record(self, bound: QuadricBound, secs: f64) -> Result<QuadricRecord> {
        if bound.weight <= 0.0 {
            return Err(Error::Mesh("no face has an area or a weight: there is no plane to average".into()));
        }
        let Self { format, reach, diagonal, .. } = self;
        Ok(QuadricRecord { format, max_num: bound.weight, max_d2: bound.offset_sq, reach, diagonal, secs })
    }
}

/// Puts the quadrics of a surface through its format, if it has one; tells how they were stored where that is the host.
/// `normals` are those of its faces.
pub fn quantize(
    queue: &mut Queue,
    surface: &mut Surface,
    normals: Option<&Buffer<Normal>>,
    storage: Option<Storage>,
) -> Result<Option<QuadricRecord>> {
    let clock = Instant::now();
    let (Some(storage), Some(normals)) = (storage, normals) else { return Ok(None) };
    let Some(Stored { bound, words }) = storage.store(queue, surface, normals)? else { return Ok(None) };
    let Surface { positions, quadrics: Some(quadrics), vertex_count, .. } = surface else { return Ok(None) };
    let (vertex_count, frame, format) = (*vertex_count as u32, storage.frame, storage.format.code());
    queue.run(DecodeQuadrics { positions, words: &words, bound: &bound, vertex_count, frame, format, quadrics })?;
    let bound = bound.host().first();
    bound.map(|&bound| storage.record(bound, clock.elapsed().as_secs_f64())).transpose()
}

/// The initial quadrics of a mesh as a format stores them.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialQuadrics {
    /// What they were divided by, and how far off they may be. Its seconds are those of the device, reading back included.
    pub record: QuadricRecord,
    /// The input vertex that each is of: without those that were joined with others or belong to no face.
    pub vertices: Vec<u32>,
    /// The codes of one after the other from the lowest bits on, those of an even number.
    pub words: Vec<u32>,
}

impl InitialQuadrics {
    /// The entries xx, xy, xz, xd, yy, yz, yd, zz, zd and dd of an average quadric, as they are stored; of a local one those
    /// with d are 0.
    /// `None` past the last.
    pub fn average(&self, index: usize) -> Option<[f32; 10]> {
        let format = self.record.format.code();
        let is_stored = index < self.vertices.len() && self.words.len() >= word_count(format, self.vertices.len());
        is_stored.then(|| entries_of(index as u32, &self.words, format))
    }
}

/// The initial quadrics of `mesh` in the format of `options`, found on `device`, or on the host where a GPU fails: what a run
/// begins with, to be kept or sent.
///
/// # Errors
/// As [`run`](super::run()), and [`Error::Parameter`] for options without a format.
pub fn initial_quadrics(mesh: &Mesh, options: &Options, device: &Device) -> Result<InitialQuadrics> {
    options.check()?;
    options.weighting.check(mesh.positions.len())?;
    let missing = || Error::Parameter("the options name no format of quadrics".into());
    device.install(|| {
        let mut prepared = prepare(mesh, options)?;
        let start = prepared.take_start();
        let storage = Storage::new(options, &start.positions, prepared.frame)?.ok_or_else(missing)?;
        let Prepared { mut carried, border_vertices, .. } = prepared;
        let weights = &mut carried.weights;
        let mut find = |mut queue: Queue| -> Result<_> {
            let mut surface = Surface::new(&mut queue, start.clone(), true)?;
            let clock = Instant::now();
            let normals = plane_sums(&mut queue, &mut surface, options)?.ok_or_else(missing)?;
            start_weights(&mut queue, &surface, options, border_vertices > 0, weights)?;
            weigh_start(&mut queue, &mut surface, weights)?;
            let stored = storage.store(&mut queue, &surface, &normals)?.ok_or_else(missing)?;
            let (mut words, mut bound) = (Vec::new(), Vec::new());
            queue.read(&stored.words, 0..stored.words.len(), &mut words)?;
            queue.read(&stored.bound, 0..1, &mut bound)?;
            let bound = bound.first().copied().unwrap_or_default();
            Ok((storage.record(bound, clock.elapsed().as_secs_f64())?, words))
        };
        let (record, words) = match device.gpu_queue().map(&mut find) {
            Some(Ok(found)) => found,
            Some(Err(Error::Device(_) | Error::Limit(_))) | None => find(device.cpu_queue())?,
            Some(Err(reason)) => return Err(reason),
        };
        Ok(InitialQuadrics { record, vertices: carried.origin, words })
    })
}
