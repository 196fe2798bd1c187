//! The adapters of this machine: listing, describing and choosing.

use serde::Serialize;
use wgpu::DeviceType;

use super::Selector;
use crate::error::{Error, Result};

/// Storage buffers that the kernels of a run bind at most when no buffer is paged. Two kernels of a fit bind ten: the host fits
/// where an adapter has fewer.
const LEAST_STORAGE_BUFFERS: u32 = 8;

/// Where to look: the native interface of each platform.
const BACKENDS: wgpu::Backends = if cfg!(target_vendor = "apple") {
    wgpu::Backends::METAL
} else if cfg!(windows) {
    wgpu::Backends::VULKAN.union(wgpu::Backends::DX12)
} else {
    wgpu::Backends::VULKAN
};

/// What to do where there is no adapter.
const NO_ADAPTER: &str = "no Vulkan device: install a GPU driver, or software Vulkan (`apt install mesa-vulkan-drivers` \
    on Debian)";

/// An adapter as `coarsen devices` shows it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AdapterReport {
    /// What [`Selector::Index`] takes.
    pub index: usize,
    /// The adapter's name.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `other` (all hardware) or `software`.
    pub kind: &'static str,
    /// The driver with its version.
    pub driver: String,
    /// `Vulkan`, `Metal` or `Dx12`.
    pub backend: String,
    /// Bytes that one binding can hold.
    pub max_binding_bytes: u64,
    /// Bytes that one buffer can hold.
    pub max_buffer_bytes: u64,
    /// Storage buffers that one kernel can bind.
    pub storage_buffers_per_stage: u32,
    /// Whether kernels can run on it.
    pub usable: bool,
    /// Why not, or what else to know; empty if there is nothing.
    pub note: String,
}

/// The adapters of this machine: hardware before software, discrete before integrated, otherwise as the driver lists
/// them. Empty without a driver.
pub fn adapters() -> Vec<AdapterReport> {
    list().iter().enumerate().map(|(index, adapter)| report(index, adapter)).collect()
}

/// The adapter that `selector` names.
///
/// # Errors
/// [`Error::Device`] when there is none; the message says what there is, or what to install.
pub fn choose(selector: &Selector) -> Result<wgpu::Adapter> {
    let mut adapters = list();
    let reports: Vec<AdapterReport> = adapters.iter().enumerate().map(|(i, adapter)| report(i, adapter)).collect();
    let index = choose_among(selector, &reports)?;
    Ok(adapters.swap_remove(index))
}

fn choose_among(selector: &Selector, reports: &[AdapterReport]) -> Result<usize> {
    let fail = |message: String| Err(Error::Device(message));
    if reports.is_empty() {
        return fail(NO_ADAPTER.into());
    }
    let is_asked_for = |report: &AdapterReport| match selector {
        Selector::Auto | Selector::Gpu | Selector::Cpu => report.kind != "software",
        Selector::Software => report.kind == "software",
        Selector::Index(index) => report.index == *index,
        Selector::Name(part) => report.name.to_lowercase().contains(&part.to_lowercase()),
    };
    let asked_for = || reports.iter().filter(|report| is_asked_for(report));
    if let Some(usable) = asked_for().find(|report| report.usable) {
        return Ok(usable.index);
    }
    if let Some(unusable) = asked_for().next() {
        return fail(format!("{}: {}", unusable.name, unusable.note));
    }
    let names = reports.iter().map(|report| format!("{} {}", report.index, report.name)).collect::<Vec<_>>().join(", ");
    match selector {
        Selector::Auto => fail(format!("only a software adapter ({})", reports[0].name)),
        Selector::Gpu | Selector::Cpu => {
            fail(format!("only a software adapter ({}): install the driver of the GPU", reports[0].name))
        }
        Selector::Software => fail(format!(
            "no software adapter beside {names}: install one (`apt install mesa-vulkan-drivers` on Debian)"
        )),
        Selector::Index(index) => fail(format!("no adapter has the index {index}; there is {names}")),
        Selector::Name(part) => fail(format!("no adapter's name contains '{part}'; there is {names}")),
    }
}

fn list() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: BACKENDS,
        flags: wgpu::InstanceFlags::empty().with_env(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let mut adapters = pollster::block_on(instance.enumerate_adapters(BACKENDS));
    adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    });
    adapters
}

fn report(index: usize, adapter: &wgpu::Adapter) -> AdapterReport {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    let computes = adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS);
    let unusable = if !computes {
        Some("it has no compute shaders".to_string())
    } else if limits.max_storage_buffers_per_shader_stage < LEAST_STORAGE_BUFFERS {
        let bound = limits.max_storage_buffers_per_shader_stage;
        Some(format!("a kernel can bind {bound} storage buffers there and needs {LEAST_STORAGE_BUFFERS}"))
    } else {
        None
    };
    let is_software = info.device_type == DeviceType::Cpu;
    let note = if is_software { "software: slower than the CPU without it" } else { "" };
    AdapterReport {
        index,
        kind: kind(info.device_type),
        driver: driver(&info),
        backend: format!("{:?}", info.backend),
        max_binding_bytes: limits.max_storage_buffer_binding_size,
        max_buffer_bytes: limits.max_buffer_size,
        storage_buffers_per_stage: limits.max_storage_buffers_per_shader_stage,
        usable: unusable.is_none(),
        note: unusable.unwrap_or_else(|| note.into()),
        name: info.name,
    }
}

/// An open adapter in words: `llvmpipe (LLVM 15.0.6, 256 bits), software Vulkan, Mesa 22.3.6`.
pub fn describe(info: &wgpu::AdapterInfo) -> String {
    let software = if info.device_type == DeviceType::Cpu { "software " } else { "" };
    format!("{}, {software}{:?}, {}", info.name, info.backend, driver(info))
}

fn kind(device_type: DeviceType) -> &'static str {
    match device_type {
        DeviceType::DiscreteGpu => "discrete",
        DeviceType::IntegratedGpu => "integrated",
        DeviceType::VirtualGpu => "virtual",
        DeviceType::Other => "other",
        DeviceType::Cpu => "software",
    }
}

/// Mesa names itself in the version (`Mesa 22.3.6 (LLVM 15.0.6)`), others give the number alone.
fn driver(info: &wgpu::AdapterInfo) -> String {
    let version = info.driver_info.split(" (").next().unwrap_or_default();
    if version.starts_with(|c: char| c.is_ascii_digit()) || version.is_empty() {
        format!("{} {version}", info.driver).trim().to_string()
    } else {
        version.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(index: usize, name: &str, kind: &'static str, usable: bool) -> AdapterReport {
        AdapterReport {
            index,
            name: name.into(),
            kind,
            driver: String::new(),
            backend: "Vulkan".into(),
            max_binding_bytes: 1 << 27,
            max_buffer_bytes: 1 << 27,
            storage_buffers_per_stage: 8,
            usable,
            note: if usable { String::new() } else { "it has no compute shaders".into() },
        }
    }

    #[test]
    fn software_is_never_chosen_unasked() {
        let both = [adapter(0, "GeForce", "discrete", true), adapter(1, "llvmpipe", "software", true)];
        let choose = |selector: Selector, reports: &[AdapterReport]| {
            choose_among(&selector, reports).map_err(|error| error.to_string())
        };
        assert_eq!(choose(Selector::Auto, &both), Ok(0));
        assert_eq!(choose(Selector::Gpu, &both), Ok(0));
        assert_eq!(choose(Selector::Software, &both), Ok(1));
        assert_eq!(choose(Selector::Index(1), &both), Ok(1));
        assert_eq!(choose(Selector::Name("LLVM".into()), &both), Ok(1));

        let software = &both[1..];
        assert_eq!(choose(Selector::Auto, software), Err("device: only a software adapter (llvmpipe)".into()));
        assert!(choose(Selector::Gpu, software).unwrap_err().contains("install the driver"));
        assert!(choose(Selector::Auto, &[]).unwrap_err().contains("apt install mesa-vulkan-drivers"));
        assert_eq!(
            choose(Selector::Index(7), &both),
            Err("device: no adapter has the index 7; there is 0 GeForce, 1 llvmpipe".into())
        );
        let old = [adapter(0, "Old", "discrete", false), adapter(1, "New", "integrated", true)];
        assert_eq!(choose(Selector::Gpu, &old), Ok(1));
        assert_eq!(choose(Selector::Gpu, &old[..1]), Err("device: Old: it has no compute shaders".into()));
    }
}
