//! Typed buffers on the host or on a GPU, and how kernels name them.

use bytemuck::Pod;

use super::gpu_buffer::{GpuBuffer, stride};
use super::gpu_texels::TEXEL_BYTES;
use crate::error::{Error, Result};

/// A row of a buffer: plain 32-bit scalars, the same bytes in Rust and in WGSL.
pub trait Row: Pod + Send + Sync {
    /// The type's name in WGSL.
    const WGSL: &'static str;
    /// A struct's members in order; empty for WGSL's own types.
    const MEMBERS: &'static [Member] = &[];
}

/// A member of a row that is a struct.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Member {
    /// Its name.
    pub name: &'static str,
    /// Where it is, in bytes.
    pub offset: usize,
    /// Its type: `u32` or `f32`.
    pub scalar: &'static str,
}

impl Row for u32 {
    const WGSL: &'static str = "u32";
}

impl Row for f32 {
    const WGSL: &'static str = "f32";
}

impl Row for [u32; 2] {
    const WGSL: &'static str = "vec2u";
}

impl Row for [u32; 4] {
    const WGSL: &'static str = "vec4u";
}

impl Row for [f32; 2] {
    const WGSL: &'static str = "vec2f";
}

impl Row for [f32; 4] {
    const WGSL: &'static str = "vec4f";
}

/// Makes a struct of 32-bit scalars a [`Row`]: `row!(Position { x, y, z: f32; flags: u32 });` for the WGSL struct of that
/// name and those members. The struct is `repr(C)` and `Pod`.
macro_rules! row {
    ($name:ident { $($($member:ident),+ : $scalar:ident);+ }) => {
        impl $crate::backend::Row for $name {
            const WGSL: &'static str = stringify!($name);
            const MEMBERS: &'static [$crate::backend::Member] = &[$($($crate::backend::Member {
                name: stringify!($member),
                offset: std::mem::offset_of!($name, $member),
                scalar: stringify!($scalar),
            }),+),+];
        }

        // The declared types are the members' own.
        const _: fn($name) = |row| { $($(let _: $scalar = row.$member;)+)+ };
    };
}
pub(crate) use row;

/// Rows of one type on one device.
#[derive(Debug)]
pub struct Buffer<T> {
    store: Store<T>,
    len: usize,
}

#[derive(Debug)]
enum Store<T> {
    Host(Vec<T>),
    Gpu(GpuBuffer),
}

impl<T: Row> Buffer<T> {
    /// Rows on the host.
    pub(crate) fn on_host(rows: Vec<T>) -> Self {
        Self { len: rows.len(), store: Store::Host(rows) }
    }

    pub(super) fn on_gpu(buffer: GpuBuffer, len: usize) -> Self {
        Self { store: Store::Gpu(buffer), len }
    }

    /// Rows it can hold.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it can hold no row.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The rows of a buffer on the host; empty for one on a GPU.
    pub fn host(&self) -> &[T] {
        match &self.store {
            Store::Host(rows) => rows,
            Store::Gpu(_) => &[],
        }
    }

    /// The rows of a buffer on the host; empty for one on a GPU.
    pub fn host_mut(&mut self) -> &mut [T] {
        match &mut self.store {
            Store::Host(rows) => rows,
            Store::Gpu(_) => &mut [],
        }
    }

    fn gpu(&self) -> Option<&GpuBuffer> {
        match &self.store {
            Store::Host(_) => None,
            Store::Gpu(buffer) => Some(buffer),
        }
    }

    pub(super) fn on_device(&self) -> Result<&GpuBuffer> {
        self.gpu().ok_or_else(|| Error::Device("a buffer on the host is used on a GPU's queue".into()))
    }
}

/// What a kernel does with a binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// `load_NAME(i)`.
    Read,
    /// `load_NAME(i)` and `store_NAME(i, row)`.
    Write,
    /// `add_NAME(i, n)`: atomic addition to a `u32`, whose order cannot be seen in the result.
    Add,
}

/// A storage buffer as a kernel names it.
#[derive(Debug, Clone)]
pub struct Binding<'a> {
    /// The field's name.
    pub name: &'static str,
    /// The row's type in WGSL.
    pub row: &'static str,
    /// Bytes a row.
    pub stride: usize,
    /// What the kernel does with it.
    pub access: Access,
    /// Rows bound.
    pub len: usize,
    /// The row's members, for a struct.
    pub members: &'static [Member],
    pub(super) gpu: Option<&'a GpuBuffer>,
}

impl<'a> Binding<'a> {
    /// `buffer`, called `name`, used as `access` says.
    pub fn new<T: Row>(name: &'static str, access: Access, buffer: &'a Buffer<T>) -> Self {
        Self {
            name,
            row: T::WGSL,
            stride: size_of::<T>(),
            access,
            len: buffer.len,
            members: T::MEMBERS,
            gpu: buffer.gpu(),
        }
    }

    /// Whether a device may hold its rows in texels. Rows of a word or two are stored in buffers, where that is as fast.
    pub fn may_be_texels(&self) -> bool {
        match self.access {
            Access::Read => true,
            Access::Write => stride(self.stride) >= TEXEL_BYTES,
            Access::Add => false,
        }
    }
}
