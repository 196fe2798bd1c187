//! A machine without a usable Vulkan driver: the CPU works, and the message says what to install.

use std::process::Command;

use coarsen::backend::{Device, Selector, adapters};

/// Runs the test `name` of this file in a process whose Vulkan loader sees only `driver`.
fn rerun(name: &str, driver: &std::path::Path) {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", name, "--ignored", "--nocapture"])
        .env("VK_DRIVER_FILES", driver)
        .env("VK_ICD_FILENAMES", driver)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("1 passed"), "{text}{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn broken_drivers_are_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let library = file("libgarbage.so", "this is no library");
    let to = |library: &str| {
        format!(r#"{{"file_format_version": "1.0.0", "ICD": {{"library_path": "{library}", "api_version": "1.3.0"}}}}"#)
    };
    let drivers = [
        folder.path().join("missing.json"),
        file("garbage.json", "}{"),
        file("empty.json", ""),
        file("lost.json", &to("/nowhere/libvulkan_none.so")),
        file("broken.json", &to(&library.to_string_lossy())),
    ];
    for driver in drivers {
        rerun("without_a_driver", &driver);
    }
}

#[test]
#[ignore = "started by broken_drivers_are_no_panic in a process of its own"]
fn without_a_driver() {
    assert_eq!(adapters(), []);
    for selector in [Selector::Gpu, Selector::Software, Selector::Index(0), Selector::Name("any".into())] {
        let message = Device::open(&selector, 1).unwrap_err().to_string();
        assert!(message.contains("no Vulkan device: install"), "{message}");
    }
    let device = Device::open(&Selector::Auto, 1).unwrap();
    assert!(!device.is_gpu());
    assert_eq!(device.notes().len(), 1);
    assert!(device.notes()[0].starts_with("no GPU is used: no Vulkan device"), "{:?}", device.notes());
    assert_eq!(Device::open(&Selector::Cpu, 1).unwrap().notes(), [""; 0]);
}
