//! Rows on their way from a GPU to the host, through a buffer that both reach.

use std::ops::Range;
use std::sync::mpsc;
use std::time::Duration;

use super::gpu::Gpu;
use super::gpu_buffer::Piece;
use crate::error::{Error, Result};

/// How long an answer may take after the work it is about is done: some microseconds, unless the machine stalls.
pub const ANSWER_TIMEOUT: Duration = Duration::from_secs(10);

/// Copies of stretches of buffers. First they are added, then submitted, then read.
#[derive(Debug)]
pub struct Readback {
    staging: wgpu::Buffer,
    copies: Vec<Copied>,
    used: u64,
    /// From the submission on: tells when the host can read.
    answer: Option<mpsc::Receiver<bool>>,
    is_mapped: bool,
}

/// A stretch of a page, and where its copy starts.
#[derive(Debug)]
struct Copied {
    page: wgpu::Buffer,
    bytes: Range<u64>,
    at: u64,
}

impl Readback {
    /// With room for so many bytes.
    pub fn new(gpu: &Gpu, size: u64) -> Result<Self> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
        let staging = gpu.guard("cannot allocate", || gpu.device().create_buffer(&descriptor))?;
        Ok(Self { staging, copies: Vec::new(), used: 0, answer: None, is_mapped: false })
    }

    /// Bytes it has room for.
    pub fn size(&self) -> u64 {
        self.staging.size()
    }

    /// Forgets all copies.
    pub fn clear(&mut self) {
        if self.is_mapped || self.answer.is_some() {
            self.staging.unmap();
        }
        (self.used, self.answer, self.is_mapped) = (0, None, false);
        self.copies.clear();
    }

    /// Adds a stretch, if there is room.
    pub fn add(&mut self, page: &wgpu::Buffer, bytes: Range<u64>) {
        let len = bytes.end - bytes.start;
        if self.used + len <= self.size() {
            self.copies.push(Copied { page: page.clone(), bytes, at: self.used });
            self.used = (self.used + len).next_multiple_of(wgpu::MAP_ALIGNMENT);
        }
    }

    /// Records the copies.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        for Copied { page, bytes, at } in &self.copies {
            encoder.copy_buffer_to_buffer(page, bytes.start, &self.staging, *at, bytes.end - bytes.start);
        }
    }

    /// Asks for the copies, once they are submitted.
    pub fn ask(&mut self) {
        if self.copies.is_empty() {
            return;
        }
        let (answer, heard) = mpsc::channel();
        // Nobody listens any more only after an error.
        self.staging.map_async(wgpu::MapMode::Read, ..self.used, move |result| {
            let _ = answer.send(result.is_ok());
        });
        self.answer = Some(heard);
    }

    /// Waits for all that was submitted, and the copies that were asked for.
    pub fn wait(&mut self, gpu: &Gpu) -> Result<()> {
        gpu.wait(None)?;
        let Some(heard) = &self.answer else { return Ok(()) };
        // Another thread that waits may be the one that is about to deliver the answer.
        if heard.recv_timeout(ANSWER_TIMEOUT) != Ok(true) {
            return Err(Error::Device("cannot read from the GPU".into()));
        }
        (self.answer, self.is_mapped) = (None, true);
        Ok(())
    }

    /// Shows the copy of `piece`, if there is one that was waited for.
    pub fn show(&self, piece: &Piece<'_>, look: impl FnOnce(&[u8])) -> bool {
        let bytes = piece.offset..piece.offset + piece.bytes;
        let has = |copied: &&Copied| {
            copied.page == *piece.page && copied.bytes.start <= bytes.start && bytes.end <= copied.bytes.end
        };
        let Some(copied) = self.copies.iter().find(has).filter(|_| self.is_mapped) else { return false };
        let at = copied.at + (bytes.start - copied.bytes.start);
        match self.staging.get_mapped_range(at..at + piece.bytes) {
            Ok(mapped) => {
                look(&mapped);
                true
            }
            Err(_) => false,
        }
    }
}
