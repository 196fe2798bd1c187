//! Who runs a kernel. Knows none of them; only `gpu*.rs` may name wgpu.
//!
//! A [`Kernel`] is a struct whose fields are its bindings in order. A [`Queue`] runs it: at once on the CPU, recorded
//! and submitted on a GPU. The driver that issues kernels is the same code for both.
//!
//! # Invariants
//! - All buffers of one queue live on that queue's device.
//! - A kernel writes only through the buffers it holds by `&mut`, and no element twice in one dispatch.
//! - An error leaves the host's data untouched, so that the CPU can finish what a GPU began.

mod buffer;
mod gpu;
mod gpu_adapters;
mod gpu_buffer;
mod gpu_pipeline;

use std::sync::Arc;

use bytemuck::Pod;

pub use buffer::{Access, Binding, Buffer, Row};
pub use gpu_adapters::{AdapterReport, adapters};

use crate::error::{Error, Result};

/// A stage of the computation: a WGSL compute shader and its CPU twin.
///
/// The shader's module is the shared sources, the declarations generated from [`Kernel::bindings`] (a load and a store
/// function for each, which hide how many pages a buffer is bound in), and [`Kernel::SOURCE`].
pub trait Kernel {
    /// The stem of the shader's and the twin's file.
    const NAME: &'static str;
    /// The text of `shaders/<NAME>.wgsl`.
    const SOURCE: &'static str;
    /// WGSL sources between the declarations and [`Kernel::SOURCE`], beside the rows and the exact arithmetic that every
    /// module has.
    const SHARED: &'static [&'static str] = &[];
    /// The uniform block: `repr(C)`, 32-bit scalars only.
    type Params: Pod;

    /// The uniform block's fields in order, as WGSL declares them: name and type (`u32` or `f32`).
    const PARAMS: &'static [(&'static str, &'static str)];
    /// Constants the shader names, written once in Rust.
    const CONSTANTS: &'static [(&'static str, Constant)] = &[];

    /// Invocations a workgroup.
    const WORKGROUP: u32 = 64;

    /// The uniform block of this run.
    fn params(&self) -> Self::Params;
    /// The storage buffers, in the order of the fields.
    fn bindings(&self) -> Vec<Binding<'_>>;
    /// How many invocations do the work, each one index from 0.
    fn invocations(&self) -> u32;
    /// The twin: the same result, bit for bit, in the host's buffers.
    fn run_cpu(&mut self);
}

/// A constant as a shader declares it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constant {
    /// `u32`
    U32(u32),
    /// `f32`
    F32(f32),
}

/// Which device to open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Selector {
    /// A hardware GPU where one is worth it, otherwise the CPU; never a software adapter.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The first hardware GPU.
    Gpu,
    /// The hardware or software adapter of this index in [`adapters`].
    Index(usize),
    /// The first adapter whose name contains this text, without regard to case.
    Name(String),
    /// A software adapter, such as Mesa's lavapipe.
    Software,
}

/// Where the kernels run: the CPU, or a GPU with its pipelines. Open once, use for many meshes; cloning is cheap.
#[derive(Debug, Clone)]
pub struct Device {
    threads: Arc<rayon::ThreadPool>,
    gpu: Option<Arc<gpu::Gpu>>,
    notes: Vec<String>,
}

impl Device {
    /// The CPU with `threads` threads, or one a core with 0.
    ///
    /// # Errors
    /// [`Error::Device`] when the threads cannot be started.
    pub fn cpu(threads: usize) -> Result<Self> {
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::Device(format!("cannot start the threads: {e}")))?;
        Ok(Self { threads: Arc::new(threads), gpu: None, notes: Vec::new() })
    }

    /// Opens the device that `selector` names, with `threads` threads for the CPU's part.
    ///
    /// [`Selector::Auto`] never fails for want of a GPU: it takes the CPU, and [`Device::notes`] says why.
    ///
    /// # Errors
    /// [`Error::Device`] when the asked-for adapter is missing, cannot be opened or fails the self-test; the message
    /// says what to install.
    pub fn open(selector: &Selector, threads: usize) -> Result<Self> {
        let mut device = Self::cpu(threads)?;
        match (selector, gpu::Gpu::open(selector)) {
            (Selector::Cpu, _) => {}
            (_, Ok(gpu)) => device.gpu = gpu.map(Arc::new),
            (Selector::Auto, Err(reason)) => device.notes.push(format!("no GPU is used: {reason}")),
            (_, Err(reason)) => return Err(reason),
        }
        Ok(device)
    }

    /// What a person should know about the choice of device; empty when all is as asked.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Whether kernels run on a GPU (or a software adapter).
    pub fn is_gpu(&self) -> bool {
        self.gpu.is_some()
    }

    /// The device in words: `CPU, 2 threads`, or the adapter's name, kind and driver.
    pub fn description(&self) -> String {
        self.gpu.as_ref().map_or_else(|| self.cpu_description(), |gpu| gpu.description())
    }

    /// The CPU's part in words.
    pub fn cpu_description(&self) -> String {
        match self.threads.current_num_threads() {
            1 => "CPU, 1 thread".into(),
            n => format!("CPU, {n} threads"),
        }
    }

    /// Runs `work` on this device's threads.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.threads.install(work)
    }

    /// A queue on the CPU.
    pub fn cpu_queue(&self) -> Queue {
        Queue { gpu: None }
    }

    /// A queue on the GPU, if the device has one.
    pub fn gpu_queue(&self) -> Option<Queue> {
        Some(Queue { gpu: Some(gpu::Recorder::new(Arc::clone(self.gpu.as_ref()?))) })
    }
}

/// Runs kernels in order. On the CPU each call does its work at once; on a GPU it is recorded, and [`Queue::read`]
/// submits what was recorded and waits.
#[derive(Debug)]
pub struct Queue {
    gpu: Option<gpu::Recorder>,
}

impl Queue {
    /// A buffer of `len` zeroed rows.
    ///
    /// # Errors
    /// [`Error::Device`] when the device is out of memory or was lost.
    pub fn buffer<T: Row>(&self, len: usize) -> Result<Buffer<T>> {
        match &self.gpu {
            Some(recorder) => Ok(Buffer::on_gpu(recorder.buffer(len.max(1), size_of::<T>())?, len)),
            None => Ok(Buffer::on_host(vec![T::zeroed(); len])),
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
    /// [`Error::Device`] when the device was lost.
    pub fn write<T: Row>(&mut self, buffer: &mut Buffer<T>, rows: &[T]) -> Result<()> {
        match &mut self.gpu {
            Some(recorder) => recorder.write(buffer.gpu(), bytemuck::cast_slice(rows)),
            None => {
                buffer.host_mut()[..rows.len()].copy_from_slice(rows);
                Ok(())
            }
        }
    }

    /// Fills the first `len` rows with zeros.
    ///
    /// # Errors
    /// [`Error::Device`] when the device was lost.
    pub fn clear<T: Row>(&mut self, buffer: &mut Buffer<T>, len: usize) -> Result<()> {
        match &mut self.gpu {
            Some(recorder) => recorder.clear(buffer.gpu(), len * size_of::<T>()),
            None => {
                buffer.host_mut()[..len].fill(T::zeroed());
                Ok(())
            }
        }
    }

    /// Runs a kernel.
    ///
    /// # Errors
    /// [`Error::Device`] when the device refuses it, is out of memory or was lost.
    pub fn run<K: Kernel>(&mut self, mut kernel: K) -> Result<()> {
        match &mut self.gpu {
            Some(recorder) => recorder.run(&kernel),
            None => {
                kernel.run_cpu();
                Ok(())
            }
        }
    }

    /// Appends the first `len` rows of `buffer` to `rows`, after all that was issued before.
    ///
    /// # Errors
    /// [`Error::Device`] when the device was lost.
    pub fn read<T: Row>(&mut self, buffer: &Buffer<T>, len: usize, rows: &mut Vec<T>) -> Result<()> {
        match &mut self.gpu {
            Some(recorder) => {
                let start = rows.len();
                rows.resize(start + len, T::zeroed());
                recorder.read(buffer.gpu(), bytemuck::cast_slice_mut(&mut rows[start..]))
            }
            None => {
                rows.extend_from_slice(&buffer.host()[..len]);
                Ok(())
            }
        }
    }

    /// Bytes moved to and from a GPU so far.
    pub fn bytes_moved(&self) -> u64 {
        self.gpu.as_ref().map_or(0, gpu::Recorder::bytes_moved)
    }
}
