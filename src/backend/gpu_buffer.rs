//! A buffer on a GPU: one or more pages, each small enough to bind.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use super::gpu_texels::Texels;
use super::module::PageShape;
use crate::error::{Error, Result};

/// Rows in pages of equal length, a power of two of rows; the last page is as long as its rows. They are in buffers, in texels,
/// or in both: what was not written last is brought up to date before it is read.
#[derive(Debug)]
pub struct GpuBuffer {
    pages: Vec<wgpu::Buffer>,
    shift: u32,
    row_bytes: usize,
    stride: u64,
    /// Made when first needed; none, for good, where they could not be.
    texels: OnceLock<Option<Texels>>,
    /// Whether each form, by its number, holds the rows once what is recorded has run: one does, and at first both, which are
    /// zeros. One recorder at a time uses a buffer, and none after a submission that failed.
    are_current: [AtomicBool; 2],
    _lease: Lease,
}

/// What rows are held in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Storage buffers.
    Buffers,
    /// Textures.
    Texels,
}

impl GpuBuffer {
    /// Zeroed `rows` of `row_bytes` on the host, in pages of `1 << shift`. Allocation faults go to the device's error
    /// scope.
    pub fn new(device: &wgpu::Device, rows: usize, row_bytes: usize, shift: u32, lease: Lease) -> Self {
        let stride = stride(row_bytes);
        let page_bytes = stride << shift;
        let bytes = rows as u64 * stride;
        let pages = (0..bytes.div_ceil(page_bytes)).map(|page| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: page_bytes.min(bytes - page * page_bytes),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        });
        let (texels, are_current) = (OnceLock::new(), [true, true].map(AtomicBool::new));
        Self { pages: pages.collect(), shift, row_bytes, stride, texels, are_current, _lease: lease }
    }

    /// The pages in the order of their rows.
    pub fn pages(&self) -> &[wgpu::Buffer] {
        &self.pages
    }

    /// How a shader finds a row.
    pub fn shape(&self) -> PageShape {
        PageShape { count: self.pages.len() as u32, shift: self.shift, are_texels: false }
    }

    /// Its texels, which `make` makes on first use if there is room.
    pub fn texels(&self, make: impl FnOnce() -> Option<Texels>) -> Option<&Texels> {
        self.texels.get_or_init(make).as_ref()
    }

    /// Its texels, if they were made.
    pub fn made_texels(&self) -> Option<&Texels> {
        self.texels.get()?.as_ref()
    }

    /// Bytes of all pages.
    pub fn bytes(&self) -> u64 {
        self.pages.iter().map(wgpu::Buffer::size).sum()
    }

    /// Whether a form holds the rows.
    pub fn is_current(&self, form: Form) -> bool {
        self.are_current[form as usize].load(Ordering::Relaxed)
    }

    /// Notes that a form is brought up to date from the other.
    pub fn note_copy_to(&self, form: Form) {
        self.are_current[form as usize].store(true, Ordering::Relaxed);
    }

    /// Notes that a form, which is current, is written, and the other is not.
    pub fn note_write_in(&self, form: Form) {
        self.are_current[1 - form as usize].store(false, Ordering::Relaxed);
    }

    /// Bytes a row on the host.
    pub fn row_bytes(&self) -> usize {
        self.row_bytes
    }

    /// Bytes a row here.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// These rows in stretches of at most `most_bytes` that each lie in one page.
    pub fn pieces(&self, rows: Range<usize>, most_bytes: u64) -> impl Iterator<Item = Piece<'_>> {
        let (first, past, most) = (rows.start as u64, rows.end as u64, (most_bytes / self.stride).max(1));
        self.pages.iter().enumerate().flat_map(move |(index, page)| {
            let page_first = (index as u64) << self.shift;
            let start = first.max(page_first);
            let end = past.min(page_first + (1 << self.shift));
            (start..end).step_by(most as usize).map(move |at| {
                let end = end.min(at.saturating_add(most));
                let rows = (at - first) as usize..(end - first) as usize;
                Piece { page, index, offset: (at - page_first) * self.stride, bytes: (end - at) * self.stride, rows }
            })
        })
    }
}

/// Bytes that a row of `row_bytes` takes on a GPU. More than two words are whole vectors of four there: a vector is loaded
/// and stored at once, scalars one by one.
pub const fn stride(row_bytes: usize) -> u64 {
    if row_bytes <= 8 { row_bytes as u64 } else { row_bytes.next_multiple_of(16) as u64 }
}

/// A stretch of a buffer within one page.
#[derive(Debug)]
pub struct Piece<'a> {
    /// The page.
    pub page: &'a wgpu::Buffer,
    /// Which one that is.
    pub index: usize,
    /// The first byte's place in the page.
    pub offset: u64,
    /// Bytes in the page.
    pub bytes: u64,
    /// The rows' place among those asked for.
    pub rows: Range<usize>,
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
    fn rows_of_more_than_two_words_are_whole_vectors() {
        assert_eq!([4, 8, 12, 16, 24, 36, 44, 52].map(stride), [4, 8, 16, 16, 32, 48, 48, 64]);
    }

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
