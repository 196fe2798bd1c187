//! temp
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[allow(missing_docs)]
pub struct AdapterReport {
    pub index: usize,
    pub name: String,
    pub kind: &'static str,
    pub driver: String,
    pub backend: String,
    pub max_binding_bytes: u64,
    pub max_buffer_bytes: u64,
    pub storage_buffers_per_stage: u32,
    pub usable: bool,
    pub note: String,
}
/// temp
pub fn adapters() -> Vec<AdapterReport> {
    Vec::new()
}
