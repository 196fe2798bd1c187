//! A buffer on a GPU: one or more pages, each small enough to bind.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::module::PageShape;
use crate::error::{Error, Result};

/// Rows in pages of equal length, a power of two of rows; the last page is as long as its rows.
#[derive(Debug)]
pub struct GpuBuffer {
    pages: Vec<wgpu::Buffer>,
    shift: u32,
    page_bytes: u64,
    _lease: Lease,
}

impl GpuBuffer {
    /// Zeroed `rows` of `stride` bytes, in pages of `1 << shift`. Allocation faults go to the device's error scope.
    pub fn new(device: &wgpu::Device, rows: usize, stride: usize, shift: u32, lease: Lease) -> Self {
        let page_bytes = (stride as u64) << shift;
        let bytes = rows as u64 * stride as u64;
        let pages = (0..bytes.div_ceil(page_bytes)).map(|page| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: page_bytes.min(bytes - page * page_bytes),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        });
        Self { pages: pages.collect(), shift, page_bytes, _lease: lease }
    }

    /// The pages in the order of their rows.
    pub fn pages(&self) -> &[wgpu::Buffer] {
        &self.pages
    }

    /// How a shader finds a row.
    pub fn shape(&self) -> PageShape {
        PageShape { count: self.pages.len() as u32, shift: self.shift }
    }

    /// These bytes in stretches of at most `piece` that each lie in one page.
    pub fn pieces(&self, bytes: Range<usize>, piece: usize) -> impl Iterator<Item = Piece<'_>> {
        let (first, past, piece) = (bytes.start as u64, bytes.end as u64, piece as u64);
        self.pages.iter().zip(0u64..).flat_map(move |(page, index)| {
            let page_start = index * self.page_bytes;
            let start = first.max(page_start);
            let end = past.min(page_start + self.page_bytes);
            (start..end).step_by(piece as usize).map(move |at| Piece {
                page,
                offset: at - page_start,
                range: (at - first) as usize..(end.min(at.saturating_add(piece)) - first) as usize,
            })
        })
    }
}

/// A stretch of a buffer within one page.
#[derive(Debug)]
pub struct Piece<'a> {
    /// The page.
    pub page: &'a wgpu::Buffer,
    /// The first byte's place in the page.
    pub offset: u64,
    /// The bytes' place among those asked for.
    pub range: Range<usize>,
}

/// Bytes allocated on a GPU, against a limit.
#[derive(Debug, Clone)]
pub struct Meter {
    used: Arc<AtomicU64>,
    limit: u64,
}

impl Meter {
    /// A meter that leases at most `limit` bytes.
    pub fn new(limit: Option<u64>) -> Self {
        Self { used: Arc::default(), limit: limit.unwrap_or(u64::MAX) }
    }

    /// Bytes leased now.
    pub fn used(&self) -> u64 {
        self.used.load(Ordering::Relaxed)
    }

    /// Sets `bytes` aside until the lease is dropped.
    ///
    /// # Errors
    /// [`Error::Limit`] when the limit leaves less.
    pub fn lease(&self, bytes: u64) -> Result<Lease> {
        let grown = |used: u64| used.checked_add(bytes).filter(|&sum| sum <= self.limit);
        match self.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, grown) {
            Ok(_) => Ok(Lease { meter: self.clone(), bytes }),
            Err(used) => Err(Error::Limit(format!(
                "{bytes} bytes more on the GPU, beside the {used} in use, pass the memory limit of {}",
                self.limit
            ))),
        }
    }
}

/// Bytes set aside, until dropped.
#[derive(Debug)]
pub struct Lease {
    meter: Meter,
    bytes: u64,
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.meter.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lease_ends_when_dropped() {
        let meter = Meter::new(Some(100));
        let lease = meter.lease(60).unwrap();
        assert!(matches!(meter.lease(41), Err(Error::Limit(_))));
        assert_eq!(meter.used(), 60);
        drop(lease);
        assert_eq!(meter.used(), 0);
        assert!(meter.lease(100).is_ok());
        assert!(Meter::new(None).lease(u64::MAX).is_ok());
    }
}
