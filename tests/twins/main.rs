//! Kernels against their twins: the same names, layouts and, bit for bit, results.
//!
//! Without an adapter the tests that need one say so and pass; `REQUIRE_GPU=1` makes that a failure.

#![expect(clippy::print_stdout, reason = "a skipped test says so")]

mod backend;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod flushing;
mod modules;
mod trials;

use std::sync::OnceLock;

use coarsen::backend::{Device, GpuOptions, Selector};

/// Rows to a page in the tests of paging: enough for the self-test to stay at a few pages, whose code it repeats.
const SMALL_PAGE: u32 = 1 << 15;

/// A hardware GPU, or software Vulkan, opened once; `None` after saying that there is neither.
fn gpu() -> Option<&'static Device> {
    static GPU: OnceLock<Option<Device>> = OnceLock::new();
    GPU.get_or_init(|| open(&GpuOptions::default())).as_ref()
}

/// A hardware GPU, or software Vulkan, with these options.
fn open(options: &GpuOptions) -> Option<Device> {
    let device =
        Device::open_with(&Selector::Gpu, 2, options).or_else(|_| Device::open_with(&Selector::Software, 2, options));
    match device {
        Ok(device) => Some(device),
        Err(reason) if std::env::var_os("REQUIRE_GPU").is_some_and(|value| value == "1") => panic!("{reason}"),
        Err(reason) => {
            println!("skipped: {reason}");
            None
        }
    }
}
