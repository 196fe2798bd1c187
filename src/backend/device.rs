//! The devices to choose from, and an open one.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::thread;

use super::gpu::Gpu;
use super::gpu_clock::KernelTime;
use super::gpu_recorder::Recorder;
use super::module::{Exactness, Packing};
use super::queue::Queue;
use crate::error::{Error, Result};

/// Which device to open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Selector {
    /// A hardware GPU where one is worth it, otherwise the CPU; never a software adapter.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The first hardware GPU.
    Gpu,
    /// The hardware or software adapter of this index in [`adapters`](super::adapters).
    Index(usize),
    /// The first adapter whose name contains this text, without regard to case.
    Name(String),
    /// A software adapter, such as Mesa's lavapipe.
    Software,
}

/// How to open a GPU. The default suits every adapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GpuOptions {
    /// Bytes of buffers and texels to allocate at most, all queues together; `None` leaves the limit to the driver.
    pub memory_limit: Option<u64>,
    /// Rows to a binding at most, rounded down to a power of two; `None` takes what the adapter can bind. A small number
    /// is for tests: results do not depend on it.
    pub page_rows: Option<u32>,
    /// How kernels keep their arithmetic exact; `None` guards it, except on software that passes the self-test without.
    pub exactness: Option<Exactness>,
    /// What rows are loaded by; `None` takes what suits the adapter. One that cannot load pairs loads words.
    pub packing: Option<Packing>,
    /// Whether rows may be held in textures, where the adapter can store there, beside buffers; `None` where that is faster, on
    /// software, unless memory is limited.
    pub texels: Option<bool>,
    /// Whether to time every kernel, for [`Device::kernel_times`]; not every adapter can.
    pub time_kernels: bool,
    /// Whether a copy of a surface follows the host's by replaying its contractions, or is sent anew; `None` sends it to
    /// software, which has the host's memory, and replays elsewhere.
    pub replays: Option<bool>,
    /// Live faces below which the CPU goes on by itself; `None` takes what was measured for such adapters.
    pub handover_faces: Option<usize>,
}

/// The threads of a device: so many, or one a core with 0.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Threads {
    /// None but its own.
    Own(usize),
    /// With the calling thread as the first, unless that is one of another device already.
    WithThis(usize),
}

impl Threads {
    fn count(self) -> usize {
        let (Self::Own(count) | Self::WithThis(count)) = self;
        count
    }

    fn start(self) -> Result<rayon::ThreadPool> {
        if self.count() > Device::MOST_THREADS {
            let (count, most) = (self.count(), Device::MOST_THREADS);
            return Err(Error::Device(format!(
                "{count} threads are more than the {most} it can have: ask for fewer, or 0"
            )));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.count());
        let is_free = rayon::current_thread_index().is_none();
        let pool = if matches!(self, Self::WithThis(_)) && is_free { pool.use_current_thread() } else { pool };
        pool.build().map_err(|e| Error::Device(format!("cannot start the threads: {e}")))
    }
}

/// Where the kernels run: the CPU, or a GPU with its pipelines. Open once, use for many meshes; cloning is cheap.
///
/// Many meshes may be simplified on one device at a time, from the threads of another rayon pool too: such a thread waits until its
/// mesh is done, and takes up nothing else of its own pool meanwhile. What runs on a device, as a progress callback, must therefore
/// neither wait for that pool nor use a device that waits for this one.
///
/// `Device::open` stands with the kernels, for it runs the self-test.
#[derive(Debug, Clone)]
pub struct Device {
    threads: Arc<rayon::ThreadPool>,
    gpu: Option<Arc<Gpu>>,
    is_auto: bool,
    options: GpuOptions,
    notes: Vec<String>,
}

impl Device {
    /// The most threads of a device. More than cores gain nothing, and some hundred thousand would take the machine.
    pub const MOST_THREADS: usize = 1024;

    /// The CPU with `threads` threads, or one a core with 0.
    ///
    /// # Errors
    /// [`Error::Device`] when the threads cannot be started, or are more than [`Device::MOST_THREADS`].
    pub fn cpu(threads: usize) -> Result<Self> {
        Self::on_cpu(Threads::Own(threads))
    }

    /// The CPU with these threads.
    pub(crate) fn on_cpu(threads: Threads) -> Result<Self> {
        Ok(Self {
            threads: Arc::new(threads.start()?),
            gpu: None,
            is_auto: false,
            options: GpuOptions::default(),
            notes: Vec::new(),
        })
    }

    /// The adapter that `selector` names, not yet tested; for [`Selector::Cpu`] the CPU.
    ///
    /// # Errors
    /// [`Error::Device`] when the adapter is missing or cannot be opened.
    pub(crate) fn open_untested(selector: &Selector, threads: Threads, options: &GpuOptions) -> Result<Self> {
        let gpu = match selector {
            Selector::Cpu => return Self::on_cpu(threads),
            _ => Some(Arc::new(Gpu::open(selector, options)?)),
        };
        Ok(Self { gpu, is_auto: *selector == Selector::Auto, options: *options, ..Self::cpu(threads.count())? })
    }

    /// This device with one more note.
    pub(crate) fn with_note(mut self, note: String) -> Self {
        self.notes.push(note);
        self
    }

    /// Whether the GPU was taken by itself and is to be used only where it gains.
    pub(crate) fn is_auto(&self) -> bool {
        self.is_auto
    }

    /// The same GPU, to be used for meshes of any size; `None` without one.
    pub(crate) fn for_any_mesh(&self) -> Option<Self> {
        let options = GpuOptions { handover_faces: Some(0), ..self.options };
        self.is_gpu().then(|| Self { is_auto: false, options, ..self.clone() })
    }

    /// How it was opened.
    pub(crate) fn options(&self) -> &GpuOptions {
        &self.options
    }

    /// Whether kernels run on software that stands in for a GPU.
    pub fn is_software(&self) -> bool {
        self.gpu.as_ref().is_some_and(|gpu| gpu.is_software())
    }

    /// What a person should know about the choice of device; empty when all is as asked.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Whether kernels run on a GPU (or a software adapter).
    pub fn is_gpu(&self) -> bool {
        self.gpu.is_some()
    }

    /// The device in words: `CPU, 2 threads`, or the adapter's name, kind and driver.
    pub fn description(&self) -> String {
        self.gpu.as_ref().map_or_else(|| self.cpu_description(), |gpu| gpu.description())
    }

    /// The CPU's part in words.
    pub fn cpu_description(&self) -> String {
        match self.threads.current_num_threads() {
            1 => "CPU, 1 thread".into(),
            n => format!("CPU, {n} threads"),
        }
    }

    /// Runs `work` on this device's threads. One of its own goes on with it; another waits, and takes up nothing else.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        let is_of_another = rayon::current_thread_index().is_some() && self.threads.current_thread_index().is_none();
        if !is_of_another {
            return self.threads.install(work);
        }
        // A worker that waits for another pool takes up more of its own pool's work, on the same stack: of a thousand meshes each would
        // wait for a device upon the one before, until the stack is full. A thread of no pool has nothing to take up.
        let done = thread::scope(|scope| scope.spawn(|| self.threads.install(work)).join());
        done.unwrap_or_else(|panic| resume_unwind(panic))
    }

    /// A queue on the CPU.
    pub fn cpu_queue(&self) -> Queue {
        Queue::on_cpu()
    }

    /// A queue on the GPU, if the device has one.
    pub fn gpu_queue(&self) -> Option<Queue> {
        self.gpu.as_ref().map(|gpu| Queue::on_gpu(Recorder::new(Arc::clone(gpu))))
    }

    /// How long every kernel ran on the GPU so far, the longest first: where [`GpuOptions::time_kernels`] asked for it and
    /// the adapter has a clock, otherwise nothing.
    pub fn kernel_times(&self) -> Vec<KernelTime> {
        self.gpu.as_ref().map_or_else(Vec::new, |gpu| gpu.kernel_times())
    }

    /// Starts [`Device::kernel_times`] anew.
    pub fn forget_kernel_times(&self) {
        if let Some(gpu) = &self.gpu {
            gpu.forget_kernel_times();
        }
    }

    /// Bytes of buffers and texels that live on the GPU now, all queues together.
    pub fn gpu_bytes(&self) -> u64 {
        self.gpu.as_ref().map_or(0, |gpu| gpu.allocated())
    }

    /// How many kernels are loaded, each variant for itself: for tests of what is loaded beforehand.
    #[doc(hidden)]
    pub fn loaded_kernels(&self) -> usize {
        self.gpu.as_ref().map_or(0, |gpu| gpu.loaded_kernels())
    }

    /// Loses the GPU as a driver's reset would: for tests of what follows.
    #[doc(hidden)]
    pub fn lose_gpu(&self) {
        if let Some(gpu) = &self.gpu {
            gpu.lose();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::time::Duration;

    use rayon::prelude::*;

    use super::*;

    /// Whether a device works on the thread that asks.
    fn works_here(device: &Device) -> bool {
        let this = thread::current().id();
        device.install(|| thread::current().id()) == this
    }

    #[test]
    fn more_threads_than_any_machine_has_are_refused() {
        let error = Device::cpu(Device::MOST_THREADS + 1).expect_err("too many");
        assert!(error.to_string().contains("1025 threads"), "{error}");
    }

    #[test]
    fn one_device_of_a_thread_works_on_it() {
        // The thread is part of its pool for the rest of its life.
        let threads = thread::spawn(|| {
            let open = |threads| Device::on_cpu(threads).expect("a device");
            let (own, first, second) = (open(Threads::Own(2)), open(Threads::WithThis(2)), open(Threads::WithThis(2)));
            assert_eq!([&own, &first, &second].map(works_here), [false, true, false]);
            first.install(|| assert_eq!(rayon::join(|| 1, || 2), (1, 2)));
            let one = thread::spawn(|| works_here(&Device::on_cpu(Threads::WithThis(1)).expect("a device")));
            assert!(one.join().expect("no panic"));
            [own, first, second].map(|device| device.threads.current_num_threads())
        });
        assert_eq!(threads.join().expect("no panic"), [2; 3]);
    }

    thread_local! {
        /// How many items wait for a device on this thread.
        static WAITING: Cell<usize> = const { Cell::new(0) };
    }

    /// Where each began another while it waited, a thousand of them overflowed the stack.
    #[test]
    fn a_thread_of_another_pool_waits_for_one_thing_at_a_time() {
        let device = Device::cpu(1).expect("a device");
        let callers = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
        let most = callers.install(|| {
            let item = |i: usize| {
                WAITING.set(WAITING.get() + 1);
                device.install(|| thread::sleep(Duration::from_millis(1)));
                let waiting = WAITING.replace(WAITING.get() - 1);
                (i, waiting)
            };
            let done: Vec<(usize, usize)> = (0..40).into_par_iter().with_max_len(1).map(item).collect();
            assert!(done.iter().map(|&(i, _)| i).eq(0..40));
            done.into_iter().map(|(_, waiting)| waiting).max()
        });
        assert_eq!(most, Some(1));
    }

    #[test]
    fn a_panic_comes_back_to_the_thread_that_waits() {
        let (device, caller) = (Device::cpu(1).expect("a device"), Device::cpu(1).expect("a device"));
        let work = || caller.install(|| device.install(|| panic!("told")));
        let panic = catch_unwind(AssertUnwindSafe(work)).expect_err("it panics");
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"told"));
    }
}
