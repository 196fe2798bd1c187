//! `coarsen devices`: every adapter, and what `auto` would take and why.

use std::fmt::Write;

use coarsen::Device;
use coarsen::backend::{AdapterReport, Selector, adapters};
use serde::Serialize;

use super::memory::Size;
use super::{Exit, console};

/// The adapters, as `--json` prints them. Fields are only ever added under this `schema`.
#[derive(Debug, Serialize)]
struct Record {
    schema: u32,
    version: &'static str,
    adapters: Vec<AdapterReport>,
    auto: Auto,
}

/// What `--device auto` takes.
#[derive(Debug, Serialize)]
struct Auto {
    device: String,
    is_gpu: bool,
    why: String,
}

/// Prints the adapters.
///
/// # Errors
/// Threads that cannot be started, an output that cannot be written.
pub fn run(json: bool) -> anyhow::Result<Exit> {
    let record = Record::new(adapters(), &Device::open(&Selector::Auto, 0)?);
    if json {
        console::print_json(&record)?;
    } else {
        console::print(record.table().as_bytes())?;
    }
    Ok(Exit::Done)
}

impl Record {
    fn new(adapters: Vec<AdapterReport>, auto: &Device) -> Self {
        let why = match (auto.is_gpu(), auto.notes().join("; ")) {
            (true, _) => "the first hardware GPU that passed its self-test".into(),
            (false, notes) if notes.is_empty() => "no GPU was found".into(),
            (false, notes) => notes,
        };
        let auto = Auto { device: auto.description(), is_gpu: auto.is_gpu(), why };
        Self { schema: 1, version: env!("CARGO_PKG_VERSION"), adapters, auto }
    }

    fn table(&self) -> String {
        let mut table = String::new();
        // Writing to a text cannot fail.
        for adapter in &self.adapters {
            let _ = writeln!(table, "gpu:{}  {}", adapter.index, adapter.name);
            for (name, value) in [
                ("kind", adapter.kind.to_string()),
                ("driver", format!("{}, {}", adapter.backend, adapter.driver)),
                ("largest binding", Size(adapter.max_binding_bytes).to_string()),
                ("largest buffer", Size(adapter.max_buffer_bytes).to_string()),
                ("buffers a kernel", adapter.storage_buffers_per_stage.to_string()),
                ("usable", if adapter.usable { "yes" } else { "no" }.to_string()),
                ("note", adapter.note.clone()),
            ] {
                if !value.is_empty() {
                    let _ = writeln!(table, "       {name:18}{value}");
                }
            }
            table.push('\n');
        }
        if self.adapters.is_empty() {
            table += "no adapters\n\n";
        }
        let _ = writeln!(table, "auto   {}\n       {}", self.auto.device, self.auto.why);
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(adapters: Vec<AdapterReport>) -> Record {
        Record::new(adapters, &Device::cpu(1).expect("one thread"))
    }

    #[test]
    fn an_adapter_is_shown_with_its_limits() {
        let adapter = AdapterReport {
            index: 0,
            name: "llvmpipe".into(),
            kind: "software",
            driver: "Mesa 22.3.6".into(),
            backend: "Vulkan".into(),
            max_binding_bytes: 1 << 27,
            max_buffer_bytes: 1 << 31,
            storage_buffers_per_stage: 32,
            usable: true,
            note: String::new(),
        };
        let expected = "\
gpu:0  llvmpipe
       kind              software
       driver            Vulkan, Mesa 22.3.6
       largest binding   128 MiB
       largest buffer    2 GiB
       buffers a kernel  32
       usable            yes

auto   CPU, 1 thread
       no GPU was found
";
        assert_eq!(record(vec![adapter]).table(), expected);
    }

    #[test]
    fn no_adapter_is_told() {
        assert!(record(Vec::new()).table().starts_with("no adapters\n\nauto   CPU, 1 thread\n"));
    }
}
