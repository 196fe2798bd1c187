//! Who runs a kernel. Knows none of them; only `gpu*.rs` may name wgpu.

use crate::error::Result;

/// Where the kernels run: the CPU, or a GPU with its pipelines and buffers. Open once, use for many meshes.
#[derive(Debug)]
pub struct Device {}

impl Device {
    /// The CPU with `threads` threads, or one a core with 0.
    pub fn cpu(threads: usize) -> Result<Self> {
        let _ = threads;
        Ok(Self {})
    }
}
