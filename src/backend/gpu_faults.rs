//! What goes wrong on a GPU, as values: wgpu reports through callbacks and scopes, and panics where nobody listens.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};

const LOST: &str = "the GPU was lost: its driver was reset, or it was unplugged";

/// The first fault of a device that no scope caught, or why it was lost: from then on every operation fails with it.
#[derive(Debug, Clone, Default)]
pub struct Faults {
    first: Arc<Mutex<Option<String>>>,
}

impl Faults {
    /// Listens to `device`.
    pub fn of(device: &wgpu::Device) -> Self {
        let faults = Self::default();
        let (uncaught, lost) = (faults.clone(), faults.clone());
        device.on_uncaptured_error(Arc::new(move |error| uncaught.note(in_words(&error))));
        device.set_device_lost_callback(move |_, message| {
            let reason = message.split_whitespace().collect::<Vec<_>>().join(" ");
            lost.note(if reason.is_empty() { LOST.into() } else { format!("{LOST} ({reason})") });
        });
        faults
    }

    /// Keeps `fault` if it is the first.
    pub fn note(&self, fault: String) {
        lock(&self.first).get_or_insert(fault);
    }

    /// # Errors
    /// [`Error::Device`] with the first fault.
    pub fn check(&self) -> Result<()> {
        match &*lock(&self.first) {
            Some(fault) => Err(Error::Device(fault.clone())),
            None => Ok(()),
        }
    }
}

/// Runs `work` and returns what wgpu reports about it; `what` names it in the message.
///
/// # Errors
/// [`Error::Device`] for the first report, or when the device was lost.
pub fn guard<R>(device: &wgpu::Device, faults: &Faults, what: &str, work: impl FnOnce() -> R) -> Result<R> {
    faults.check()?;
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let result = work();
    let reports = [internal, validation, memory].map(|scope| pollster::block_on(scope.pop()));
    let Some(report) = reports.into_iter().flatten().next() else {
        faults.check()?;
        return Ok(result);
    };
    // On a lost device everything is invalid, and only waiting says why.
    wait(device, faults, None)?;
    Err(Error::Device(format!("{what}: {}", in_words(&report))))
}

/// Waits for all that was submitted to `device`, or up to `submission`.
///
/// # Errors
/// [`Error::Device`] when the device was lost.
pub fn wait(device: &wgpu::Device, faults: &Faults, submission: Option<wgpu::SubmissionIndex>) -> Result<()> {
    let how = wgpu::PollType::Wait { submission_index: submission, timeout: None };
    // wgpu panics in `poll`, and only there, when the driver reports the loss of the device to it.
    match std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| device.poll(how))) {
        Ok(Ok(_)) => {}
        Ok(Err(error)) => faults.note(format!("cannot wait for the GPU: {error}")),
        Err(_) => faults.note(LOST.into()),
    }
    faults.check()
}

/// The lock, also after a panic of another holder: what these locks guard is whole at every point.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn in_words(error: &wgpu::Error) -> String {
    match error {
        wgpu::Error::OutOfMemory { .. } => "the GPU is out of memory".into(),
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => description.clone(),
    }
}
