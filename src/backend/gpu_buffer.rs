//! temp
#[derive(Debug)]
pub struct GpuBuffer;
