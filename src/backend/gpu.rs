//! temp
#![allow(missing_docs, unused, unreachable_code)]
use super::*;
#[derive(Debug)]
pub enum Gpu {}
impl Gpu {
    pub fn open(_: &Selector) -> Result<Option<Gpu>> {
        Ok(None)
    }
    pub fn description(&self) -> String {
        match *self {}
    }
}
#[derive(Debug)]
pub struct Recorder(Gpu);
impl Recorder {
    pub fn new(g: Arc<Gpu>) -> Self {
        match *g {}
    }
    pub fn buffer(&self, n: usize, s: usize) -> Result<super::gpu_buffer::GpuBuffer> {
        match self.0 {}
    }
    pub fn write(&mut self, b: Option<&super::gpu_buffer::GpuBuffer>, d: &[u8]) -> Result<()> {
        match self.0 {}
    }
    pub fn clear(&mut self, b: Option<&super::gpu_buffer::GpuBuffer>, n: usize) -> Result<()> {
        match self.0 {}
    }
    pub fn read(&mut self, b: Option<&super::gpu_buffer::GpuBuffer>, d: &mut [u8]) -> Result<()> {
        match self.0 {}
    }
    pub fn run<K: Kernel>(&mut self, k: &K) -> Result<()> {
        match self.0 {}
    }
    pub fn bytes_moved(&self) -> u64 {
        match self.0 {}
    }
}
