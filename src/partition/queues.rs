//! A GPU while it works, and the host.

use std::time::Duration;

use crate::backend::{Device, Queue, fallback};
use crate::error::{Error, Result};

/// A GPU's queue while it works, and the host's.
#[derive(Debug)]
pub struct Queues {
    gpu: Option<Queue>,
    host: Queue,
    /// By a GPU that failed.
    bytes_moved: u64,
    time_moving: Duration,
}

impl Queues {
    pub fn new(device: &Device) -> Self {
        // One that was taken by itself would not gain: what kernels do here takes less than moving the mesh.
        let gpu = device.gpu_queue().filter(|_| !device.is_auto());
        Self { gpu, host: device.cpu_queue(), bytes_moved: 0, time_moving: Duration::ZERO }
    }

    /// Runs `work` on the GPU, or on the host when there is none or it fails.
    pub fn run<T>(&mut self, warnings: &mut Vec<String>, mut work: impl FnMut(&mut Queue) -> Result<T>) -> Result<T> {
        if let Some(queue) = &mut self.gpu {
            match work(queue) {
                Err(reason @ (Error::Device(_) | Error::Limit(_))) => {
                    warnings.push(fallback(&reason));
                    self.bytes_moved = queue.bytes_moved();
                    self.time_moving = queue.time_moving();
                    self.gpu = None;
                }
                result => return result,
            }
        }
        work(&mut self.host)
    }

    /// Whether there is a GPU that has not failed.
    pub fn is_on_gpu(&self) -> bool {
        self.gpu.is_some()
    }

    pub fn bytes_moved(&self) -> u64 {
        self.bytes_moved + self.gpu.as_ref().map_or(0, Queue::bytes_moved)
    }

    pub fn seconds_moving(&self) -> f64 {
        (self.time_moving + self.gpu.as_ref().map_or(Duration::ZERO, Queue::time_moving)).as_secs_f64()
    }

    pub fn description(&self, device: &Device) -> String {
        if self.is_on_gpu() { device.description() } else { device.cpu_description() }
    }
}

/// What is copied to a device once.
#[derive(Debug)]
pub struct OnDevice<T> {
    /// Whether it is on the host, and what it is.
    copied: Option<(bool, T)>,
}

impl<T> OnDevice<T> {
    pub fn new() -> Self {
        Self { copied: None }
    }

    /// What is on the device of `queue`, put there by `copy` where it is not: at first, and when the GPU has failed since.
    ///
    /// # Errors
    /// Those of `copy`.
    pub fn get(&mut self, queue: &mut Queue, copy: impl FnOnce(&mut Queue) -> Result<T>) -> Result<&mut T> {
        let on_host = queue.is_on_host();
        let copied = match self.copied.take().filter(|copied| copied.0 == on_host) {
            Some(copied) => copied,
            None => (on_host, copy(queue)?),
        };
        Ok(&mut self.copied.insert(copied).1)
    }
}
