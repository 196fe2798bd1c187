//! Rows on their way to a GPU, through buffers that both reach. They are used again and again: the system clears fresh ones,
//! which takes as long as the copies.

use std::collections::VecDeque;
use std::sync::mpsc;

use rayon::prelude::*;

use super::gpu::Gpu;
use super::gpu_pipeline::Bound;
use super::gpu_readback::ANSWER_TIMEOUT;
use super::gpu_texels::Way;
use crate::error::{Error, Result};

/// Bytes copied at a time, and on software, whose threads share the processor's caches; how many such copies are on their way.
const PIECE_BYTES: u64 = 4 << 20;
const SOFTWARE_PIECE_BYTES: u64 = 2 << 20;
const PIECES: usize = 4;

/// Bytes that wgpu takes on its own way: for so few a fresh buffer is no matter.
const FEW_BYTES: u64 = 64 << 10;

/// Bytes that a thread copies at a time: whole rows of nearly any kind.
const STRIP_BYTES: usize = 48 << 11;

/// The buffers, the one used last at the end.
#[derive(Debug, Default)]
pub struct Upload {
    pieces: VecDeque<Staging>,
}

/// A buffer that the host can write to, once the copy from it is done.
#[derive(Debug)]
struct Staging {
    buffer: wgpu::Buffer,
    copy: Option<Copying>,
}

#[derive(Debug)]
struct Copying {
    submission: wgpu::SubmissionIndex,
    /// Tells when the host can write.
    answer: mpsc::Receiver<bool>,
}

impl Upload {
    /// Copies the bytes of rows to the start of a buffer, to its texels if they are given; returns how many bytes that are there.
    pub fn write(&mut self, gpu: &Gpu, Bound { buffer, texels }: Bound<'_>, bytes: &[u8]) -> Result<u64> {
        let (row_bytes, stride) = (buffer.row_bytes(), buffer.stride() as usize);
        let mut moved = 0;
        for piece in buffer.pieces(0..bytes.len() / row_bytes, piece_bytes(gpu)) {
            moved += piece.bytes;
            let rows = &bytes[piece.rows.start * row_bytes..piece.rows.end * row_bytes];
            let texels = texels.map(|texels| &texels.pages()[piece.index]);
            if piece.bytes <= FEW_BYTES {
                let written = gpu.guard("cannot write", || match texels {
                    Some(texels) => {
                        let mut padded = vec![0; piece.bytes as usize];
                        pad(rows, row_bytes, wgpu::WriteOnly::from_mut(&mut padded), stride);
                        texels.write(gpu.queue(), piece.offset, &padded);
                        Some(())
                    }
                    None => {
                        let bytes = wgpu::BufferSize::new(piece.bytes)?;
                        let mut view = gpu.queue().write_buffer_with(piece.page, piece.offset, bytes)?;
                        pad(rows, row_bytes, view.slice(..), stride);
                        Some(())
                    }
                })?;
                written.ok_or_else(unwritten)?;
                continue;
            }
            let Staging { buffer: staging, .. } = self.next(gpu)?;
            let (answer, heard) = mpsc::channel();
            let view = gpu.guard("cannot write", || staging.get_mapped_range_mut(..piece.bytes).ok())?;
            let mut view = view.ok_or_else(unwritten)?;
            pad_in_parallel(rows, row_bytes, view.slice(..), stride);
            drop(view);
            let submission = gpu.guard("cannot write", || {
                staging.unmap();
                let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                match texels {
                    Some(texels) => {
                        texels.encode(&mut encoder, Way::In, &staging, piece.offset..piece.offset + piece.bytes);
                    }
                    None => encoder.copy_buffer_to_buffer(&staging, 0, piece.page, piece.offset, piece.bytes),
                }
                let submission = gpu.queue().submit([encoder.finish()]);
                staging.map_async(wgpu::MapMode::Write, .., move |result| {
                    let _ = answer.send(result.is_ok());
                });
                submission
            })?;
            self.pieces.push_back(Staging { buffer: staging, copy: Some(Copying { submission, answer: heard }) });
        }
        Ok(moved)
    }

    /// A buffer that the host can write to.
    fn next(&mut self, gpu: &Gpu) -> Result<Staging> {
        if self.pieces.len() == PIECES
            && let Some(Staging { buffer, copy }) = self.pieces.pop_front()
        {
            if let Some(Copying { submission, answer }) = copy {
                gpu.wait(Some(submission))?;
                if answer.recv_timeout(ANSWER_TIMEOUT) != Ok(true) {
                    return Err(unwritten());
                }
            }
            return Ok(Staging { buffer, copy: None });
        }
        let usage = wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC;
        let descriptor =
            wgpu::BufferDescriptor { label: None, size: piece_bytes(gpu), usage, mapped_at_creation: true };
        let buffer = gpu.guard("cannot allocate", || gpu.device().create_buffer(&descriptor))?;
        Ok(Staging { buffer, copy: None })
    }
}

fn piece_bytes(gpu: &Gpu) -> u64 {
    if gpu.is_software() { SOFTWARE_PIECE_BYTES } else { PIECE_BYTES }
}

fn unwritten() -> Error {
    Error::Device("cannot write to the GPU".into())
}

/// Writes rows of `row_bytes` as a GPU holds them, on all threads: one alone writes to the memory of a GPU far slower than the bus
/// could take it.
fn pad_in_parallel(rows: &[u8], row_bytes: usize, into: wgpu::WriteOnly<'_, [u8]>, stride: usize) {
    let (strips, mut last) = if STRIP_BYTES.is_multiple_of(stride) {
        let (strips, last) = into.into_chunks::<STRIP_BYTES>();
        (strips.into_iter().collect(), last)
    } else {
        (Vec::new(), into)
    };
    let strip_row_bytes = STRIP_BYTES / stride * row_bytes;
    let (whole, rest) = rows.split_at(strips.len() * strip_row_bytes);
    let strips = strips.into_par_iter().zip(whole.par_chunks(strip_row_bytes));
    strips.for_each(|(strip, rows)| pad(rows, row_bytes, strip.into(), stride));
    pad(rest, row_bytes, last.slice(..), stride);
}

/// The same on this thread.
fn pad(rows: &[u8], row_bytes: usize, mut into: wgpu::WriteOnly<'_, [u8]>, stride: usize) {
    match stride {
        _ if stride == row_bytes => into.copy_from_slice(rows),
        16 => pad_to::<16>(rows, row_bytes, into),
        32 => pad_to::<32>(rows, row_bytes, into),
        48 => pad_to::<48>(rows, row_bytes, into),
        _ => {
            for (i, row) in rows.chunks_exact(row_bytes).enumerate() {
                into.slice(i * stride..i * stride + row_bytes).copy_from_slice(row);
            }
        }
    }
}

fn pad_to<const STRIDE: usize>(rows: &[u8], row_bytes: usize, into: wgpu::WriteOnly<'_, [u8]>) {
    let padded = |row: &[u8]| {
        let mut padded = [0; STRIDE];
        padded[..row_bytes].copy_from_slice(row);
        padded
    };
    into.into_chunks().0.write_iter(rows.chunks_exact(row_bytes).map(padded));
}
