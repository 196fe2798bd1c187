//! Who runs a kernel. Knows none of them; only `gpu*.rs` may name wgpu.
//!
//! A [`Kernel`] is a struct whose fields are its bindings in order. A [`Queue`] runs it: at once on the CPU, recorded
//! and submitted on a GPU. The driver that issues kernels is the same code for both.
//!
//! # Invariants
//! - All buffers of one queue live on that queue's device.
//! - A kernel writes only through the buffers it holds by `&mut`, and no element twice in one dispatch.
//! - An error leaves the host's data untouched, so that the CPU can finish what a GPU began.

mod awake;
mod buffer;
mod device;
mod gpu;
mod gpu_adapters;
mod gpu_buffer;
mod gpu_clock;
mod gpu_faults;
mod gpu_pipeline;
mod gpu_readback;
mod gpu_recorder;
mod gpu_texels;
mod gpu_upload;
mod module;
mod queue;

use bytemuck::Pod;

use crate::error::Error;

pub(crate) use awake::Awake;
pub use buffer::{Access, Binding, Buffer, Member, Row};
pub(crate) use device::Threads;
pub use device::{Device, GpuOptions, Selector};
pub use gpu_adapters::{AdapterReport, adapters};
pub use gpu_clock::KernelTime;
#[doc(hidden)]
pub use module::{Dialect, Exactness, Packing, PageShape, Signature};
pub use queue::Queue;

pub(crate) use buffer::row;
pub(crate) use module::params;

/// A stage of the computation: a WGSL compute shader and its CPU twin.
///
/// The shader's module is the shared sources, the declarations generated from [`Kernel::PARAMS`] and
/// [`Kernel::bindings`] (functions to load and store a row, which hide how many pages a buffer is bound in), and
/// [`Kernel::SOURCE`]. The source defines `fn run(i: u32)`, called once for each index below
/// [`Kernel::invocations`]. A kernel whose invocations work together in workgroups has its own `@compute` entry `main`
/// instead, and is dispatched in as many groups of [`Kernel::WORKGROUP`] as hold all invocations.
pub trait Kernel {
    /// The stem of the shader's and the twin's file.
    const NAME: &'static str;
    /// The text of `shaders/<NAME>.wgsl`.
    const SOURCE: &'static str;
    /// What [`Kernel::SOURCE`] builds on beside the exact arithmetic and the rows, which every module has.
    const SHARED: &'static [&'static str] = &[];
    /// Constants that the shader names, written once in Rust.
    const CONSTANTS: &'static [(&'static str, Constant)] = &[];
    /// Invocations a workgroup: `WORKGROUP` in the shader.
    const WORKGROUP: u32 = 64;
    /// The uniform block: `repr(C)`, 32-bit scalars only, or `()`.
    type Params: Pod;

    /// The uniform block's fields in order, as WGSL declares them: name and type (`u32` or `f32`).
    const PARAMS: &'static [(&'static str, &'static str)];

    /// The uniform block of this run.
    fn params(&self) -> Self::Params;
    /// The storage buffers, in the order of the fields.
    fn bindings(&self) -> Vec<Binding<'_>>;
    /// Constants of this run, true or false: every combination is a pipeline of its own, without the code for what is not.
    fn switches(&self) -> Vec<Switch> {
        Vec::new()
    }
    /// How many invocations do the work, each one index from 0: at most 2³¹.
    fn invocations(&self) -> u32;
    /// The twin: the same result, bit for bit, in the host's buffers.
    fn run_cpu(&mut self);
}

/// A constant of a run, by its name in the shader.
pub type Switch = (&'static str, bool);

/// A constant as a shader declares it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constant {
    /// `u32`
    U32(u32),
    /// `f32`, finite.
    F32(f32),
}

/// The warning of a driver whose GPU failed.
pub(crate) fn fallback(reason: &Error) -> String {
    format!("the CPU went on where the GPU failed: {reason}")
}
