//! temp
#[derive(Debug)]
#[allow(missing_docs)]
pub struct AdapterReport;
/// temp
pub fn adapters() -> Vec<AdapterReport> {
    Vec::new()
}
