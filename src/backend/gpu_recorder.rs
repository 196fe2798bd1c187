//! Records kernels, submits them in bounded batches, and moves rows to and from the GPU.

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::gpu::Gpu;
use super::gpu_buffer::{Form, GpuBuffer, Piece};
use super::gpu_clock::{Clock, Readings};
use super::gpu_pipeline::{Bound, Pipeline};
use super::gpu_readback::Readback;
use super::gpu_texels::{TEXEL_BYTES, TexelPage, Way};
use super::gpu_upload::Upload;
use super::module::{Signature, uniform_block};
use super::{Access, Binding};
use crate::error::{Error, Result};

/// Bytes of uniform blocks in one submission: room for 256 dispatches or more.
const UNIFORM_BYTES: u64 = 64 << 10;

/// Invocations in one submission, after the first dispatch. Drivers kill work that takes seconds; an invocation takes
/// some nanoseconds.
const MAX_INVOCATIONS: u64 = 1 << 26;

/// Bytes read at a time. Larger pieces are no faster and hold more memory.
const PIECE_BYTES: u64 = 8 << 20;

/// Rows to an invocation at most of a kernel for which rows are copied to texels: of one that reads a few of them, copying takes
/// longer than it saves. As many as an invocation takes one after the other.
const MOST_ROWS_EACH: u64 = 64;

/// Bytes prefetched at most.
const AHEAD_BYTES: u64 = 64 << 20;

/// The recording half of a queue on a GPU.
#[derive(Debug)]
pub struct Recorder {
    gpu: Arc<Gpu>,
    commands: Vec<Command>,
    blocks: Vec<u8>,
    invocations: u64,
    uniforms: Option<wgpu::Buffer>,
    /// What is to be copied along with the next submission.
    wanted: Vec<(wgpu::Buffer, Range<u64>)>,
    /// What was copied along with the last one.
    ahead: Option<Readback>,
    staging: Option<Readback>,
    upload: Upload,
    bytes_moved: u64,
    time_moving: Duration,
}

#[derive(Debug)]
enum Command {
    Dispatch {
        pipeline: Arc<Pipeline>,
        bind_group: wgpu::BindGroup,
        block_offset: u32,
        grid: [u32; 2],
    },
    Clear {
        page: wgpu::Buffer,
        bytes: u64,
    },
    /// Of a page to its texels, or back.
    Copy {
        page: wgpu::Buffer,
        texels: TexelPage,
        way: Way,
    },
}

impl Recorder {
    /// A recorder with nothing in it.
    pub fn new(gpu: Arc<Gpu>) -> Self {
        Self {
            gpu,
            commands: Vec::new(),
            blocks: Vec::new(),
            invocations: 0,
            uniforms: None,
            wanted: Vec::new(),
            ahead: None,
            staging: None,
            upload: Upload::default(),
            bytes_moved: 0,
            time_moving: Duration::ZERO,
        }
    }

    /// A zeroed buffer.
    pub fn buffer(&self, rows: usize, row_bytes: usize) -> Result<GpuBuffer> {
        self.gpu.buffer(rows, row_bytes)
    }

    /// Bytes moved so far.
    pub fn bytes_moved(&self) -> u64 {
        self.bytes_moved
    }

    /// Time spent moving them; not the wait for the kernels before.
    pub fn time_moving(&self) -> Duration {
        self.time_moving
    }

    /// Records a dispatch; none for zero invocations.
    pub fn run(&mut self, signature: &Signature<'_>, params: &[u8], invocations: u32) -> Result<()> {
        if invocations == 0 {
            return Ok(());
        }
        if invocations > 1 << 31 {
            return Err(Error::Limit(format!("'{}' on {invocations} elements, more than 2^31", signature.name)));
        }
        let buffers: Vec<&GpuBuffer> = signature.bindings.iter().filter_map(|binding| binding.gpu).collect();
        if buffers.len() < signature.bindings.len() || params.len() != signature.params.len() * 4 {
            return Err(Error::Device(format!("'{}' has a buffer on the host or a misdeclared block", signature.name)));
        }
        let bound = self.choose_forms(&signature.bindings, &buffers, invocations);
        let pages: Vec<_> = bound.iter().map(|bound| bound.shape()).collect();
        let pipeline = self.gpu.pipeline(signature, &pages)?;
        let block_offset = self.record_block(&uniform_block(params, invocations), u64::from(invocations))?;
        let uniforms = self.uniforms()?;
        let bind_group = self.gpu.guard(signature.name, || pipeline.bind(self.gpu.device(), &uniforms, &bound))?;
        let groups = invocations.div_ceil(signature.workgroup);
        let grid = tight_grid(groups, self.gpu.limits().max_compute_workgroups_per_dimension);
        bound.iter().for_each(|bound| self.update(bound.buffer, bound.form()));
        self.commands.push(Command::Dispatch { pipeline, bind_group, block_offset, grid });
        let written = signature.bindings.iter().zip(&bound).filter(|(binding, _)| binding.access != Access::Read);
        written.for_each(|(_, bound)| bound.buffer.note_write_in(bound.form()));
        Ok(())
    }

    /// What a kernel binds: texels as far as they gain and the adapter binds so many.
    fn choose_forms<'a>(
        &self,
        bindings: &[Binding<'_>],
        buffers: &[&'a GpuBuffer],
        invocations: u32,
    ) -> Vec<Bound<'a>> {
        let mut room = self.gpu.limits().max_storage_textures_per_shader_stage as usize;
        let choose = |(binding, &buffer): (&Binding<'_>, &&'a GpuBuffer)| {
            let gains = gains_by_texels(binding, buffer, invocations) && buffer.pages().len() <= room;
            let texels = if gains { self.gpu.texels(buffer) } else { None };
            room -= texels.map_or(0, |texels| texels.pages().len());
            Bound { buffer, texels }
        };
        bindings.iter().zip(buffers).map(choose).collect()
    }

    /// Records copies that bring a form of a buffer's rows up to date.
    fn update(&mut self, buffer: &GpuBuffer, form: Form) {
        if let Some(texels) = buffer.made_texels()
            && !buffer.is_current(form)
        {
            let way = if form == Form::Texels { Way::In } else { Way::Out };
            let pages = buffer.pages().iter().zip(texels.pages());
            let copy = |(page, texels): (&wgpu::Buffer, &TexelPage)| Command::Copy {
                page: page.clone(),
                texels: texels.clone(),
                way,
            };
            self.commands.extend(pages.map(copy));
            buffer.note_copy_to(form);
        }
    }

    /// Puts a uniform block beside the others of this submission, which ends first if it is full. Returns its offset.
    fn record_block(&mut self, block: &[u8], invocations: u64) -> Result<u32> {
        let alignment = self.gpu.limits().min_uniform_buffer_offset_alignment as usize;
        let mut offset = self.blocks.len().next_multiple_of(alignment);
        // Each dispatch may be timed, from its start to its end.
        let is_full = (offset + block.len()) as u64 > UNIFORM_BYTES
            || self.commands.len() >= wgpu::QUERY_SET_MAX_QUERIES as usize / 2;
        if is_full || (self.invocations > 0 && self.invocations + invocations > MAX_INVOCATIONS) {
            self.submit()?;
            offset = 0;
        }
        self.invocations += invocations;
        self.blocks.resize(offset, 0);
        self.blocks.extend_from_slice(block);
        Ok(offset as u32)
    }

    fn uniforms(&mut self) -> Result<wgpu::Buffer> {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        own_buffer(&self.gpu, &mut self.uniforms, UNIFORM_BYTES, usage)
    }

    /// Records zeros over the first `rows` rows.
    pub fn clear(&mut self, buffer: &GpuBuffer, rows: usize) -> Result<()> {
        if (rows as u64) * buffer.stride() < buffer.bytes() {
            self.update(buffer, Form::Buffers);
        }
        buffer.note_write_in(Form::Buffers);
        let whole_pages = buffer.pieces(0..rows, u64::MAX);
        self.commands.extend(whole_pages.map(|piece| Command::Clear { page: piece.page.clone(), bytes: piece.bytes }));
        Ok(())
    }

    /// Submits what was recorded; does not wait.
    pub fn submit(&mut self) -> Result<()> {
        self.invocations = 0;
        let (commands, blocks) = (std::mem::take(&mut self.commands), std::mem::take(&mut self.blocks));
        if commands.is_empty() && self.wanted.is_empty() {
            return Ok(());
        }
        let compiled = self.compiled(&commands).inspect_err(|_| {
            self.forget_ahead();
            self.wanted.clear();
        })?;
        self.copy_ahead()?;
        let (uniforms, ahead) = (self.uniforms()?, &mut self.ahead);
        self.gpu.guard("cannot submit", || {
            // Ordered after the earlier submissions, so that they still read their own blocks.
            self.gpu.queue().write_buffer(&uniforms, 0, &blocks);
            let readings = self.gpu.clock().and_then(|clock| readings(clock, self.gpu.device(), &commands));
            let mut encoder = encode(self.gpu.device(), &commands, &compiled, readings.as_ref());
            if let Some(ahead) = ahead {
                ahead.encode(&mut encoder);
            }
            self.gpu.queue().submit([encoder.finish()]);
            if let Some(ahead) = ahead {
                ahead.ask();
            }
            if let Some(readings) = readings {
                readings.collect();
            }
        })
    }

    /// What every dispatch sets; what is not compiled yet is, on all threads.
    fn compiled(&self, commands: &[Command]) -> Result<Vec<wgpu::ComputePipeline>> {
        let pipelines = commands.iter().filter_map(|command| match command {
            Command::Dispatch { pipeline, .. } => Some(pipeline),
            Command::Clear { .. } | Command::Copy { .. } => None,
        });
        let (pipelines, gpu) = (pipelines.collect::<Vec<_>>(), &self.gpu);
        match pipelines.iter().map(|pipeline| pipeline.compiled()).collect() {
            Some(compiled) => Ok(compiled),
            None => pipelines.par_iter().map(|pipeline| pipeline.compile(gpu)).collect(),
        }
    }

    /// Has rows copied along with the next submission, as many as there is room for.
    pub fn prefetch(&mut self, buffer: &GpuBuffer, rows: Range<usize>) -> Result<()> {
        self.update(buffer, Form::Buffers);
        let pieces = buffer.pieces(rows, PIECE_BYTES);
        self.wanted.extend(pieces.map(|piece| (piece.page.clone(), piece.offset..piece.offset + piece.bytes)));
        Ok(())
    }

    /// Adds the copies that are wanted to a submission. What was copied before is out of date.
    fn copy_ahead(&mut self) -> Result<()> {
        self.forget_ahead();
        let wanted = std::mem::take(&mut self.wanted);
        let bytes = wanted.iter().map(|(_, bytes)| bytes.end - bytes.start).sum::<u64>().min(AHEAD_BYTES);
        if bytes == 0 {
            return Ok(());
        }
        let room_for = bytes + wanted.len() as u64 * wgpu::MAP_ALIGNMENT;
        let room = self.ahead.take().filter(|ahead| ahead.size() >= room_for);
        let mut ahead = room.map_or_else(|| Readback::new(&self.gpu, room_for.next_power_of_two()), Ok)?;
        wanted.iter().for_each(|(page, bytes)| ahead.add(page, bytes.clone()));
        self.bytes_moved += bytes;
        self.ahead = Some(ahead);
        Ok(())
    }

    fn forget_ahead(&mut self) {
        if let Some(ahead) = &mut self.ahead {
            ahead.clear();
        }
    }

    /// Copies the bytes of rows to the start of `buffer`, after all that was recorded.
    pub fn write(&mut self, buffer: &GpuBuffer, bytes: &[u8]) -> Result<()> {
        let texels = self.gpu.texels(buffer).filter(|_| buffer.is_current(Form::Texels));
        let bound = Bound { buffer, texels };
        self.submit()?;
        self.forget_ahead();
        let clock = Instant::now();
        buffer.note_write_in(bound.form());
        self.bytes_moved += self.upload.write(&self.gpu, bound, bytes)?;
        self.time_moving += clock.elapsed();
        Ok(())
    }

    /// Shows the bytes of these rows of `buffer` as a GPU holds them, after all that was recorded, piece by piece.
    pub fn read(&mut self, buffer: &GpuBuffer, rows: Range<usize>, mut take: impl FnMut(&[u8])) -> Result<()> {
        self.update(buffer, Form::Buffers);
        self.submit()?;
        match &mut self.ahead {
            Some(ahead) => ahead.wait(&self.gpu)?,
            None => self.gpu.wait(None)?,
        }
        let clock = Instant::now();
        let result = buffer.pieces(rows, PIECE_BYTES).try_for_each(|piece| {
            if self.ahead.as_ref().is_some_and(|ahead| ahead.show(&piece, &mut take)) {
                return Ok(());
            }
            self.read_piece(&piece, &mut take)
        });
        self.time_moving += clock.elapsed();
        result
    }

    fn read_piece(&mut self, piece: &Piece<'_>, take: impl FnOnce(&[u8])) -> Result<()> {
        // Not kept after an error, when it may be mapped still.
        let mut staging = self.staging.take().map_or_else(|| Readback::new(&self.gpu, PIECE_BYTES), Ok)?;
        staging.add(piece.page, piece.offset..piece.offset + piece.bytes);
        self.gpu.guard("cannot read", || {
            let mut encoder = self.gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            staging.encode(&mut encoder);
            self.gpu.queue().submit([encoder.finish()]);
            staging.ask();
        })?;
        staging.wait(&self.gpu)?;
        if !staging.show(piece, take) {
            return Err(Error::Device("cannot read from the GPU".into()));
        }
        staging.clear();
        self.staging = Some(staging);
        self.bytes_moved += piece.bytes;
        Ok(())
    }
}

/// Whether a kernel is faster with texels than with a buffer. Rows of a word or two are not copied for that: it takes as long as is
/// gained.
fn gains_by_texels(binding: &Binding<'_>, buffer: &GpuBuffer, invocations: u32) -> bool {
    let [in_buffers, in_texels] = [Form::Buffers, Form::Texels].map(|form| buffer.is_current(form));
    let reads_most = binding.len as u64 <= MOST_ROWS_EACH * u64::from(invocations);
    let is_worth_copying = buffer.stride() >= TEXEL_BYTES;
    binding.may_be_texels() && (!in_buffers || reads_most && (in_texels || is_worth_copying))
}

/// The buffer in `slot`, made on first use.
fn own_buffer(
    gpu: &Gpu,
    slot: &mut Option<wgpu::Buffer>,
    size: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer> {
    if let Some(buffer) = slot {
        return Ok(buffer.clone());
    }
    let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
    let buffer = gpu.guard("cannot allocate", || gpu.device().create_buffer(&descriptor))?;
    Ok(slot.insert(buffer).clone())
}

/// The clock's readings around the kernels among `commands`, if there are any.
fn readings(clock: &Clock, device: &wgpu::Device, commands: &[Command]) -> Option<Readings> {
    let name = |command: &Command| match command {
        Command::Dispatch { pipeline, .. } => Some(pipeline.name),
        Command::Clear { .. } | Command::Copy { .. } => None,
    };
    let names: Vec<_> = commands.iter().filter_map(name).collect();
    (!names.is_empty()).then(|| clock.readings(device, names))
}

/// Neighboring dispatches go in one pass, or each in its own, with readings around it.
fn encode(
    device: &wgpu::Device,
    commands: &[Command],
    compiled: &[wgpu::ComputePipeline],
    readings: Option<&Readings>,
) -> wgpu::CommandEncoder {
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let is_dispatch = |command: &Command| matches!(command, Command::Dispatch { .. });
    let (mut kernel, mut compiled) = (0, compiled.iter());
    for run in commands.chunk_by(|a, b| readings.is_none() && is_dispatch(a) && is_dispatch(b)) {
        match run {
            [Command::Clear { page, bytes }] => {
                encoder.clear_buffer(page, 0, Some(*bytes));
                continue;
            }
            [Command::Copy { page, texels, way }] => {
                texels.encode(&mut encoder, *way, page, 0..page.size());
                continue;
            }
            _ => {}
        }
        let timestamp_writes = readings.map(|readings| readings.around(kernel));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: None, timestamp_writes });
        kernel += 1;
        for command in run {
            if let (Command::Dispatch { bind_group, block_offset, grid: [x, y], .. }, Some(pipeline)) =
                (command, compiled.next())
            {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, bind_group, &[*block_offset]);
                pass.dispatch_workgroups(*x, *y, 1);
            }
        }
    }
    if let Some(readings) = readings {
        readings.resolve(&mut encoder);
    }
    encoder
}

/// The grid of at least `groups` workgroups with the fewest to spare and no side above `side`: software devices share
/// the groups out evenly, idle ones too.
fn tight_grid(groups: u32, side: u32) -> [u32; 2] {
    let y = groups.div_ceil(side);
    [groups.div_ceil(y), y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_is_tight() {
        assert_eq!(tight_grid(1, 65_535), [1, 1]);
        assert_eq!(tight_grid(65_535, 65_535), [65_535, 1]);
        assert_eq!(tight_grid(65_536, 65_535), [32_768, 2]);
        assert_eq!(tight_grid(200_001, 65_535), [50_001, 4]);
        for groups in [1, 7, 65_537, 1 << 25] {
            let [x, y] = tight_grid(groups, 65_535);
            assert!(x * y >= groups && x * y - groups < y && x <= 65_535 && y <= 65_535, "{groups}");
        }
    }
}
