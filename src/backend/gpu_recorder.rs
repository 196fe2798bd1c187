//! Records kernels, submits them in bounded batches, and moves rows to and from the GPU.

use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use super::gpu::Gpu;
use super::gpu_buffer::{GpuBuffer, Piece};
use super::gpu_pipeline::Pipeline;
use super::module::{Signature, uniform_block};
use crate::error::{Error, Result};

/// Bytes of uniform blocks in one submission: room for 256 dispatches or more.
const UNIFORM_BYTES: u64 = 64 << 10;

/// Invocations in one submission, after the first dispatch. Drivers kill work that takes seconds; an invocation takes
/// some nanoseconds.
const MAX_INVOCATIONS: u64 = 1 << 26;

/// Bytes moved at a time. Larger pieces are no faster and hold more memory.
const PIECE_BYTES: usize = 8 << 20;

/// Pieces of an upload in flight.
const PIECES_AHEAD: usize = 2;

/// How long an answer may take after the work it is about is done: some microseconds, unless the machine stalls.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(10);

/// The recording half of a queue on a GPU.
#[derive(Debug)]
pub struct Recorder {
    gpu: Arc<Gpu>,
    commands: Vec<Command>,
    blocks: Vec<u8>,
    invocations: u64,
    uniforms: Option<wgpu::Buffer>,
    staging: Option<wgpu::Buffer>,
    bytes_moved: u64,
    time_moving: Duration,
}

#[derive(Debug)]
enum Command {
    Dispatch { pipeline: Arc<Pipeline>, bind_group: wgpu::BindGroup, block_offset: u32, grid: [u32; 2] },
    Clear { page: wgpu::Buffer, bytes: u64 },
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
            staging: None,
            bytes_moved: 0,
            time_moving: Duration::ZERO,
        }
    }

    /// A zeroed buffer.
    pub fn buffer(&self, rows: usize, stride: usize) -> Result<GpuBuffer> {
        self.gpu.buffer(rows, stride)
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
        let pages: Vec<_> = buffers.iter().map(|buffer| buffer.shape()).collect();
        let pipeline = self.gpu.pipeline(signature, &pages)?;
        let block_offset = self.record_block(&uniform_block(params, invocations), u64::from(invocations))?;
        let uniforms = self.uniforms()?;
        let bind_group = self.gpu.guard(signature.name, || pipeline.bind(self.gpu.device(), &uniforms, &buffers))?;
        let groups = invocations.div_ceil(signature.workgroup);
        let grid = tight_grid(groups, self.gpu.limits().max_compute_workgroups_per_dimension);
        self.commands.push(Command::Dispatch { pipeline, bind_group, block_offset, grid });
        Ok(())
    }

    /// Puts a uniform block beside the others of this submission, which ends first if it is full. Returns its offset.
    fn record_block(&mut self, block: &[u8], invocations: u64) -> Result<u32> {
        let alignment = self.gpu.limits().min_uniform_buffer_offset_alignment as usize;
        let mut offset = self.blocks.len().next_multiple_of(alignment);
        let is_full = (offset + block.len()) as u64 > UNIFORM_BYTES;
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

    /// Records zeros over the first `bytes` bytes.
    pub fn clear(&mut self, buffer: &GpuBuffer, bytes: usize) -> Result<()> {
        let whole_pages = buffer.pieces(0..bytes, usize::MAX);
        self.commands.extend(
            whole_pages.map(|piece| Command::Clear { page: piece.page.clone(), bytes: piece.range.len() as u64 }),
        );
        Ok(())
    }

    /// Submits what was recorded; does not wait.
    pub fn submit(&mut self) -> Result<()> {
        self.invocations = 0;
        let (commands, blocks) = (std::mem::take(&mut self.commands), std::mem::take(&mut self.blocks));
        if commands.is_empty() {
            return Ok(());
        }
        let uniforms = self.uniforms()?;
        self.gpu.guard("cannot submit", || {
            // Ordered after the earlier submissions, so that they still read their own blocks.
            self.gpu.queue().write_buffer(&uniforms, 0, &blocks);
            self.gpu.queue().submit([encode(self.gpu.device(), &commands)]);
        })
    }

    /// Copies `bytes` to the start of `buffer`, after all that was recorded.
    pub fn write(&mut self, buffer: &GpuBuffer, bytes: &[u8]) -> Result<()> {
        self.submit()?;
        let clock = Instant::now();
        self.bytes_moved += bytes.len() as u64;
        let mut in_flight = std::collections::VecDeque::new();
        for piece in buffer.pieces(0..bytes.len(), PIECE_BYTES) {
            if in_flight.len() == PIECES_AHEAD {
                self.gpu.wait(in_flight.pop_front())?;
            }
            let submission = self.gpu.guard("cannot write", || {
                self.gpu.queue().write_buffer(piece.page, piece.offset, &bytes[piece.range]);
                self.gpu.queue().submit([])
            })?;
            in_flight.push_back(submission);
        }
        self.time_moving += clock.elapsed();
        Ok(())
    }

    /// Fills `bytes` from byte `start` of `buffer` on, after all that was recorded.
    pub fn read(&mut self, buffer: &GpuBuffer, start: usize, bytes: &mut [u8]) -> Result<()> {
        self.submit()?;
        self.gpu.wait(None)?;
        let clock = Instant::now();
        self.bytes_moved += bytes.len() as u64;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = own_buffer(&self.gpu, &mut self.staging, PIECE_BYTES as u64, usage)?;
        let result = buffer.pieces(start..start + bytes.len(), PIECE_BYTES).try_for_each(|piece| {
            let into = &mut bytes[piece.range.clone()];
            self.gpu.read_piece(&piece, &staging, into)
        });
        if result.is_err() {
            // It may be mapped still.
            self.staging = None;
        }
        self.time_moving += clock.elapsed();
        result
    }
}

impl Gpu {
    fn read_piece(&self, piece: &Piece<'_>, staging: &wgpu::Buffer, into: &mut [u8]) -> Result<()> {
        let size = into.len() as u64;
        let (answer, heard) = mpsc::channel();
        self.guard("cannot read", || {
            let mut encoder = self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(piece.page, piece.offset, staging, 0, size);
            self.queue().submit([encoder.finish()]);
            // Nobody listens any more only after an error.
            staging.map_async(wgpu::MapMode::Read, ..size, move |result| drop(answer.send(result)));
        })?;
        self.wait(None)?;
        let unread = || Error::Device("cannot read from the GPU".into());
        // Another thread that waits may be the one that is about to deliver the answer.
        let Ok(Ok(())) = heard.recv_timeout(ANSWER_TIMEOUT) else { return Err(unread()) };
        let mapped = staging.get_mapped_range(..size).map_err(|_| unread())?;
        into.copy_from_slice(&mapped);
        drop(mapped);
        staging.unmap();
        Ok(())
    }
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

fn encode(device: &wgpu::Device, commands: &[Command]) -> wgpu::CommandBuffer {
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let is_dispatch = |command: &Command| matches!(command, Command::Dispatch { .. });
    for run in commands.chunk_by(|a, b| is_dispatch(a) && is_dispatch(b)) {
        if let [Command::Clear { page, bytes }] = run {
            encoder.clear_buffer(page, 0, Some(*bytes));
            continue;
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        for command in run {
            if let Command::Dispatch { pipeline, bind_group, block_offset, grid: [x, y] } = command {
                pass.set_pipeline(&pipeline.pipeline);
                pass.set_bind_group(0, bind_group, &[*block_offset]);
                pass.dispatch_workgroups(*x, *y, 1);
            }
        }
    }
    encoder.finish()
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
