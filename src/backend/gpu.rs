//! An open GPU: its wgpu device, its limits, and what is kept for all meshes.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use super::gpu_adapters::{choose, describe};
use super::gpu_buffer::{GpuBuffer, Meter, stride};
use super::gpu_clock::{Clock, KernelTime};
use super::gpu_faults::{Faults, guard, lock, wait};
use super::gpu_pipeline::Pipeline;
use super::gpu_texels::{self, Texels};
use super::module::{Dialect, Exactness, Packing, PageShape, Signature};
use super::{GpuOptions, Selector, Switch};
use crate::error::{Error, Result};

/// What loads of [`Packing::Pairs`] need.
const PAIRS: wgpu::Features = wgpu::Features::SHADER_INT64;

/// A kernel's name, its switches and its buffers' pages.
type PipelineKey = (&'static str, Vec<Switch>, Vec<PageShape>);

/// A wgpu device with its queue.
#[derive(Debug)]
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    limits: wgpu::Limits,
    faults: Faults,
    meter: Meter,
    page_rows: u32,
    dialect: Dialect,
    /// Whether rows may be texels.
    has_texels: bool,
    /// Where kernels are timed.
    clock: Option<Clock>,
    pipelines: Mutex<HashMap<PipelineKey, Arc<Pipeline>>>,
}

impl Gpu {
    /// Opens the adapter that `selector` names.
    ///
    /// # Errors
    /// [`Error::Device`] when there is none or its driver refuses.
    pub fn open(selector: &Selector, options: &GpuOptions) -> Result<Self> {
        let adapter = choose(selector)?;
        let (info, own) = (adapter.get_info(), adapter.limits());
        let limits = limits(&own);
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        let has = |features| adapter.features().contains(features);
        let is_timed = options.time_kernels && has(Clock::FEATURES);
        let packs_pairs = options.packing.map_or(is_software, |packing| packing == Packing::Pairs) && has(PAIRS);
        // Where memory is limited there is to be room for buffers.
        let suits_texels = is_software && options.memory_limit.is_none();
        let has_texels = options.texels.unwrap_or(suits_texels) && gpu_texels::are_usable(&adapter);
        let needed = |is_needed, features| if is_needed { features } else { wgpu::Features::empty() };
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: None,
            required_features: needed(is_timed, Clock::FEATURES)
                | needed(packs_pairs, PAIRS)
                | needed(has_texels, gpu_texels::FEATURES),
            required_limits: limits.clone(),
            experimental_features: wgpu::ExperimentalFeatures::disabled(),
            memory_hints: wgpu::MemoryHints::Performance,
            trace: wgpu::Trace::Off,
        });
        let (device, queue) =
            pollster::block_on(request).map_err(|e| Error::Device(format!("cannot open {}: {e}", info.name)))?;
        let faults = Faults::of(&device);
        let exactness = if is_software { Exactness::Plain } else { Exactness::Guarded };
        let dialect = Dialect {
            exactness: options.exactness.unwrap_or(exactness),
            packing: if packs_pairs { Packing::Pairs } else { Packing::Words },
        };
        Ok(Self {
            clock: is_timed.then(|| Clock::new(&queue)),
            device,
            queue,
            info,
            limits,
            faults,
            meter: Meter::new(options.memory_limit),
            page_rows: options.page_rows.unwrap_or(u32::MAX).max(1),
            dialect,
            has_texels,
            pipelines: Mutex::default(),
        })
    }

    /// The adapter in words.
    pub fn description(&self) -> String {
        describe(&self.info)
    }

    /// Bytes of buffers and texels that live now.
    pub fn allocated(&self) -> u64 {
        self.meter.used()
    }

    /// How long every kernel ran, where they are timed.
    pub fn kernel_times(&self) -> Vec<KernelTime> {
        let Some(clock) = &self.clock else { return Vec::new() };
        // What a lost device read before is told still.
        let _ = self.wait(None);
        clock.times()
    }

    /// Forgets how long they ran.
    pub fn forget_kernel_times(&self) {
        if let Some(clock) = &self.clock {
            let _ = self.wait(None);
            clock.forget();
        }
    }

    pub(super) fn clock(&self) -> Option<&Clock> {
        self.clock.as_ref()
    }

    /// What its kernels are written in.
    pub(super) fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// Whether it is software on this machine's own processor.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// How many kernels are loaded.
    pub fn loaded_kernels(&self) -> usize {
        lock(&self.pipelines).len()
    }

    /// Loses the device.
    pub fn lose(&self) {
        self.device.destroy();
    }

    pub(super) fn limits(&self) -> &wgpu::Limits {
        &self.limits
    }

    pub(super) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    pub(super) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Runs `work`, called `what` in messages, and returns what wgpu reports about it.
    pub(super) fn guard<R>(&self, what: &str, work: impl FnOnce() -> R) -> Result<R> {
        guard(&self.device, &self.faults, what, work)
    }

    /// Waits for what was submitted up to `submission`, or for all.
    pub(super) fn wait(&self, submission: Option<wgpu::SubmissionIndex>) -> Result<()> {
        wait(&self.device, &self.faults, submission)
    }

    /// A zeroed buffer for rows that have so many bytes on the host.
    ///
    /// # Errors
    /// [`Error::Limit`] for more rows than a 32-bit index tells apart, or more pages than the adapter binds.
    pub(super) fn buffer(&self, rows: usize, row_bytes: usize) -> Result<GpuBuffer> {
        if rows > u32::MAX as usize {
            return Err(Error::Limit(format!("the mesh is too large for a GPU: {rows} rows in one buffer")));
        }
        let stride = stride(row_bytes);
        let (bytes, shift) = (rows as u64 * stride, self.page_shift(stride));
        let (pages, bound) = ((rows as u64).div_ceil(1 << shift), self.max_pages());
        if pages > u64::from(bound) {
            return Err(Error::Limit(format!(
                "the mesh is too large for this adapter: {bytes} bytes in one buffer take {pages} bindings, {} has {bound}",
                self.description()
            )));
        }
        let lease = self.meter.lease(bytes)?;
        self.guard(&format!("cannot allocate {bytes} bytes"), || {
            GpuBuffer::new(&self.device, rows, row_bytes, shift, lease)
        })
    }

    /// The most pages that a kernel can bind: one buffer goes to the uniform block.
    pub(super) fn max_pages(&self) -> u32 {
        let buffers = self.limits.max_buffers_and_acceleration_structures_per_shader_stage.saturating_sub(1);
        self.limits.max_storage_buffers_per_shader_stage.min(buffers)
    }

    /// The texels of a buffer; none where the adapter has no use or no room for them.
    pub(super) fn texels<'a>(&self, buffer: &'a GpuBuffer) -> Option<&'a Texels> {
        let (pages, stride) = (buffer.pages(), buffer.stride());
        let most_lines = u64::from(self.limits.max_texture_dimension_2d);
        if !self.has_texels || pages.iter().any(|page| gpu_texels::lines(page.size(), stride) > most_lines) {
            return None;
        }
        buffer.texels(|| {
            let lease = self.meter.lease(Texels::bytes(pages, stride)).ok()?;
            self.guard("cannot allocate texels", || Texels::new(&self.device, pages, stride, lease)).ok()
        })
    }

    /// The binary logarithm of the most rows that one binding holds.
    fn page_shift(&self, stride: u64) -> u32 {
        let bytes = self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size);
        let rows = (bytes / stride).clamp(1, u64::from(self.page_rows));
        rows.ilog2()
    }

    /// The pipeline of a kernel whose buffers have these pages, built on first use.
    pub(super) fn pipeline(&self, signature: &Signature<'_>, pages: &[PageShape]) -> Result<Arc<Pipeline>> {
        let key = (signature.name, signature.switches.clone(), pages.to_vec());
        if let Some(pipeline) = lock(&self.pipelines).get(&key) {
            return Ok(Arc::clone(pipeline));
        }
        let pipeline = Arc::new(Pipeline::new(self, signature, pages)?);
        // Another thread may have built it too: one of them is compiled.
        Ok(Arc::clone(lock(&self.pipelines).entry(key).or_insert(pipeline)))
    }
}

/// The adapter's own limits where size and speed depend on them, the least common ones elsewhere.
fn limits(own: &wgpu::Limits) -> wgpu::Limits {
    wgpu::Limits {
        max_bindings_per_bind_group: own.max_bindings_per_bind_group,
        max_buffer_size: own.max_buffer_size,
        max_storage_buffer_binding_size: own.max_storage_buffer_binding_size,
        max_storage_buffers_per_shader_stage: own.max_storage_buffers_per_shader_stage,
        max_buffers_and_acceleration_structures_per_shader_stage: own
            .max_buffers_and_acceleration_structures_per_shader_stage,
        max_compute_workgroup_storage_size: own.max_compute_workgroup_storage_size,
        max_compute_workgroups_per_dimension: own.max_compute_workgroups_per_dimension,
        max_storage_textures_per_shader_stage: own.max_storage_textures_per_shader_stage,
        max_texture_dimension_2d: own.max_texture_dimension_2d,
        min_uniform_buffer_offset_alignment: own.min_uniform_buffer_offset_alignment,
        ..wgpu::Limits::downlevel_defaults()
    }
}
