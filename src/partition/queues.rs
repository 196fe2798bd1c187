//! A GPU while it works, and the host.

use crate::backend::{Device, Queue, fallback};
use crate::error::{Error, Result};

/// A GPU's queue while it works, and the host's.
#[derive(Debug)]
pub struct Queues {
    gpu: Option<Queue>,
    host: Queue,
    used_gpu: bool,
}

impl Queues {
    pub fn new(device: &Device) -> Self {
        // One that was taken by itself would not gain: what kernels do here takes less than moving the mesh.
        let gpu = device.gpu_queue().filter(|_| !device.is_auto());
        Self { used_gpu: gpu.is_some(), gpu, host: device.cpu_queue() }
    }

    /// Runs `work` on the GPU, or on the host when there is none or it fails.
    pub fn run<T>(&mut self, warnings: &mut Vec<String>, mut work: impl FnMut(&mut Queue) -> Result<T>) -> Result<T> {
        if let Some(queue) = &mut self.gpu {
            match work(queue) {
                Err(reason @ (Error::Device(_) | Error::Limit(_))) => {
                    warnings.push(fallback(&reason));
                    self.gpu = None;
                    self.used_gpu = false;
                }
                result => return result,
            }
        }
        work(&mut self.host)
    }

    pub fn bytes_moved(&self) -> u64 {
        self.gpu.as_ref().map_or(0, Queue::bytes_moved)
    }

    pub fn seconds_moving(&self) -> f64 {
        self.gpu.as_ref().map_or(0.0, |queue| queue.time_moving().as_secs_f64())
    }

    pub fn description(&self, device: &Device) -> String {
        if self.used_gpu { device.description() } else { device.cpu_description() }
    }
}
