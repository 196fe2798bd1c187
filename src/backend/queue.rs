//! A queue: the one way to make buffers, move rows and run kernels, on the host or on a GPU.

use std::borrow::Cow;
use std::ops::Range;
use std::time::Duration;

use rayon::prelude::*;

use super::Kernel;
use super::buffer::{Buffer, Row};
use super::gpu_recorder::Recorder;
use super::module::Signature;
use crate::error::{Error, Result};

/// Rows that a thread takes at a time at least.
const ROWS_EACH: usize = 1 << 12;

/// Runs kernels in order. On the CPU each call does its work at once; on a GPU it is recorded, and [`Queue::read`]
/// submits what was recorded and waits. The work on the CPU, rows that are moved included, is that of the pool of whoever calls:
/// see [`Device::install`](super::Device::install).
///
/// Kernels are compiled when they are first submitted. One that a GPU refuses is an error of what submits it: of a read, of a
/// write, or of a run that finds no room. What was recorded is then lost, and its buffers are of no more use.
#[derive(Debug)]
pub struct Queue {
    gpu: Option<Recorder>,
}

impl Queue {
    pub(super) fn on_cpu() -> Self {
        Self { gpu: None }
    }

    pub(super) fn on_gpu(recorder: Recorder) -> Self {
        Self { gpu: Some(recorder) }
    }

    /// Whether it runs kernels on the host.
    pub fn is_on_host(&self) -> bool {
        self.gpu.is_none()
    }

    /// A buffer of `len` zeroed rows.
    ///
    /// # Errors
    /// [`Error::Device`] when the device is out of memory or was lost, [`Error::Limit`] past the memory limit.
    pub fn buffer<T: Row>(&self, len: usize) -> Result<Buffer<T>> {
        match &self.gpu {
            Some(recorder) => Ok(Buffer::on_gpu(recorder.buffer(len.max(1), size_of::<T>())?, len)),
            // From the system, which zeroes pages when they are touched: here that is by many threads, or never.
            None => Ok(Buffer::on_host(bytemuck::zeroed_vec(len))),
        }
    }

    /// A buffer with these rows.
    ///
    /// # Errors
    /// As [`Queue::buffer`].
    pub fn buffer_from<T: Row>(&mut self, rows: Vec<T>) -> Result<Buffer<T>> {
        if self.gpu.is_none() {
            return Ok(Buffer::on_host(rows));
        }
        let mut buffer = self.buffer(rows.len())?;
        self.write(&mut buffer, &rows)?;
        Ok(buffer)
    }

    /// Copies `rows` to the start of `buffer`.
    ///
    /// # Errors
    /// [`Error::Device`] when the rows do not fit, or the device refuses a kernel that was issued or was lost.
    pub fn write<T: Row>(&mut self, buffer: &mut Buffer<T>, rows: &[T]) -> Result<()> {
        fits(rows.len(), buffer)?;
        match &mut self.gpu {
            Some(recorder) => recorder.write(buffer.on_device()?, bytemuck::cast_slice(rows)),
            None => {
                buffer.host_mut()[..rows.len()].copy_from_slice(rows);
                Ok(())
            }
        }
    }

    /// Fills the first `len` rows with zeros.
    ///
    /// # Errors
    /// As [`Queue::write`].
    pub fn clear<T: Row>(&mut self, buffer: &mut Buffer<T>, len: usize) -> Result<()> {
        fits(len, buffer)?;
        match &mut self.gpu {
            Some(recorder) => recorder.clear(buffer.on_device()?, len),
            None => {
                buffer.host_mut()[..len].fill(T::zeroed());
                Ok(())
            }
        }
    }

    /// Runs a kernel.
    ///
    /// # Errors
    /// [`Error::Device`] when the device is out of memory, was lost, or refuses a kernel that was issued; [`Error::Limit`]
    /// when its buffers are too large to bind.
    pub fn run<K: Kernel>(&mut self, mut kernel: K) -> Result<()> {
        match &mut self.gpu {
            Some(recorder) => {
                recorder.run(&Signature::of(&kernel), bytemuck::bytes_of(&kernel.params()), kernel.invocations())
            }
            None => {
                kernel.run_cpu();
                Ok(())
            }
        }
    }

    /// Has a range of the rows of `buffer` copied along with what was recorded, once that is submitted: [`Queue::read`]
    /// then waits for no copy of its own, if nothing else was issued in between.
    ///
    /// # Errors
    /// [`Error::Device`] when the rows are not there.
    pub fn prefetch<T: Row>(&mut self, buffer: &Buffer<T>, range: Range<usize>) -> Result<()> {
        fits(range.end, buffer)?;
        match &mut self.gpu {
            Some(recorder) => recorder.prefetch(buffer.on_device()?, range),
            None => Ok(()),
        }
    }

    /// Appends a range of the rows of `buffer` to `rows`, after all that was issued before.
    ///
    /// # Errors
    /// [`Error::Device`] when the rows are not there, the device refuses a kernel that was issued, or was lost; `rows` is
    /// then as it was.
    pub fn read<T: Row>(&mut self, buffer: &Buffer<T>, range: Range<usize>, rows: &mut Vec<T>) -> Result<()> {
        fits(range.end, buffer)?;
        match &mut self.gpu {
            Some(recorder) => {
                let (kept, buffer) = (rows.len(), buffer.on_device()?);
                rows.reserve(range.len());
                let result = recorder.read(buffer, range, |padded| append(rows, padded, buffer.stride() as usize));
                result.inspect_err(|_| rows.truncate(kept))
            }
            None => {
                rows.extend_from_slice(&buffer.host()[range]);
                Ok(())
            }
        }
    }

    /// The rows of a buffer: those of the host where it lies there, else read back.
    ///
    /// # Errors
    /// As [`Queue::read`].
    pub fn rows<'b, T: Row>(&mut self, buffer: &'b Buffer<T>) -> Result<Cow<'b, [T]>> {
        if self.is_on_host() {
            return Ok(Cow::Borrowed(buffer.host()));
        }
        let mut rows = Vec::new();
        self.read(buffer, 0..buffer.len(), &mut rows)?;
        Ok(Cow::Owned(rows))
    }

    /// Submits what was recorded, without waiting for it.
    ///
    /// # Errors
    /// [`Error::Device`] when the device refuses a kernel or was lost.
    pub fn submit(&mut self) -> Result<()> {
        self.gpu.as_mut().map_or(Ok(()), Recorder::submit)
    }

    /// Time spent moving bytes to and from a GPU so far.
    pub fn time_moving(&self) -> Duration {
        self.gpu.as_ref().map_or(Duration::ZERO, Recorder::time_moving)
    }

    /// Bytes moved to and from a GPU so far.
    pub fn bytes_moved(&self) -> u64 {
        self.gpu.as_ref().map_or(0, Recorder::bytes_moved)
    }
}

/// Appends rows from the bytes in which a GPU holds them, on all threads.
fn append<T: Row>(rows: &mut Vec<T>, padded: &[u8], stride: usize) {
    let padded = padded.par_chunks_exact(stride).with_min_len(ROWS_EACH);
    rows.par_extend(padded.map(|row| bytemuck::pod_read_unaligned::<T>(&row[..size_of::<T>()])));
}

fn fits<T: Row>(len: usize, buffer: &Buffer<T>) -> Result<()> {
    if len <= buffer.len() {
        return Ok(());
    }
    Err(Error::Device(format!("{len} rows in a buffer of {}", buffer.len())))
}
