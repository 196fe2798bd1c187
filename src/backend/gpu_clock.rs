//! How long kernels take, by the GPU's own clock: only where asked for, for it parts passes that otherwise run together.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use serde::Serialize;

use super::gpu_faults::lock;

/// The runs of a kernel on a GPU.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct KernelTime {
    /// Its name.
    pub name: &'static str,
    /// How often it ran.
    pub runs: u64,
    /// Milliseconds of all runs together.
    pub ms: f64,
}

/// Sums of ticks by kernel.
#[derive(Debug)]
pub struct Clock {
    tick_ms: f64,
    sums: Arc<Mutex<HashMap<&'static str, Ticks>>>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Ticks {
    runs: u64,
    ticks: u64,
}

impl Clock {
    /// What a device must have.
    pub const FEATURES: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY;

    /// A clock of the device behind `queue`.
    pub fn new(queue: &wgpu::Queue) -> Self {
        Self { tick_ms: f64::from(queue.get_timestamp_period()) * 1e-6, sums: Arc::default() }
    }

    /// Times for these kernels, which run in one submission.
    pub fn readings(&self, device: &wgpu::Device, names: Vec<&'static str>) -> Readings {
        let count = 2 * names.len() as u32;
        let bytes = u64::from(count) * u64::from(wgpu::QUERY_SIZE);
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor { label: None, size: bytes, usage, mapped_at_creation: false })
        };
        Readings {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            readable: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            names,
            sums: Arc::clone(&self.sums),
        }
    }

    /// Forgets all that was read so far.
    pub fn forget(&self) {
        lock(&self.sums).clear();
    }

    /// All that was read so far, the longest first.
    pub fn times(&self) -> Vec<KernelTime> {
        let time = |(&name, sum): (&&'static str, &Ticks)| KernelTime {
            name,
            runs: sum.runs,
            ms: sum.ticks as f64 * self.tick_ms,
        };
        let mut times: Vec<KernelTime> = lock(&self.sums).iter().map(time).collect();
        times.sort_by(|a, b| b.ms.total_cmp(&a.ms).then(a.name.cmp(b.name)));
        times
    }
}

/// The clock's readings before and after every kernel of a submission.
#[derive(Debug)]
pub struct Readings {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    names: Vec<&'static str>,
    sums: Arc<Mutex<HashMap<&'static str, Ticks>>>,
}

impl Readings {
    /// What the pass of the kernel of this index reads.
    pub fn around(&self, kernel: u32) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * kernel),
            end_of_pass_write_index: Some(2 * kernel + 1),
        }
    }

    /// Records that the readings are to be copied where the host can read them.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2 * self.names.len() as u32, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, self.readable.size());
    }

    /// Adds the readings up, once their submission, which was made, is done.
    pub fn collect(self) {
        let Self { readable, names, sums, .. } = self;
        let mapped = readable.clone();
        mapped.map_async(wgpu::MapMode::Read, .., move |result| {
            let (Ok(()), Ok(bytes)) = (result, readable.get_mapped_range(..)) else { return };
            let mut sums = lock(&sums);
            for (name, [begin, end]) in names.into_iter().zip(bytemuck::pod_collect_to_vec::<u8, [u64; 2]>(&bytes)) {
                let sum = sums.entry(name).or_default();
                sum.runs += 1;
                sum.ticks += end.saturating_sub(begin);
            }
        });
    }
}
