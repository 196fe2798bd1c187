//! The one list of kernels: for each a run on hostile inputs, whose outputs must not depend on the device.

mod attributes;
mod cells;
mod costs;
mod features;
mod fit;
mod formats;
mod gate;
mod inputs;
mod light;
mod near;
mod nearest;
mod partition;
mod regions;
mod removal;
mod surface;

use coarsen::Result;
use coarsen::backend::{Buffer, Device, Exactness, GpuOptions, Kernel, Packing, Queue, Row, Signature};
use coarsen::kernel::exact_probe::{ExactProbe, RESULTS, hostile_operands};

use crate::{SMALL_PAGE, gpu, open};

/// A kernel and its run.
pub struct Trial {
    /// The kernel's stem.
    pub name: &'static str,
    /// Runs it on the queue; with `perturbed`, one bit of one input is another.
    pub run: fn(&mut Queue, perturbed: bool, &mut Seen) -> Result<()>,
}

/// Takes a kernel's signature and the bytes of its parameters.
pub type Look = Box<dyn FnOnce(&Signature<'_>, usize)>;

/// What a trial shows: the kernel, as the module tests see it, and its outputs as bits, by name and input.
#[derive(Default)]
pub struct Seen {
    /// Looks at the kernel before it runs first.
    pub look: Option<Look>,
    around: Option<Around>,
    input: &'static str,
    outputs: Vec<Output>,
}

/// A kernel's output as bits, after its name and that of the input.
pub type Output = (String, Vec<u32>);

/// Runs what every run of a kernel is.
pub type Around = fn(&mut dyn FnMut());

impl Trial {
    /// What it writes.
    pub fn outputs(&self, mut queue: Queue, around: Option<Around>, perturbed: bool) -> Vec<Output> {
        let mut seen = Seen { around, ..Seen::default() };
        (self.run)(&mut queue, perturbed, &mut seen).unwrap_or_else(|error| panic!("{}: {error}", self.name));
        seen.outputs
    }
}

impl Seen {
    /// Names the input of the outputs that follow.
    fn input(&mut self, name: &'static str) {
        self.input = name;
    }

    fn run<K: Kernel>(&mut self, queue: &mut Queue, kernel: K) -> Result<()> {
        if let Some(look) = self.look.take() {
            look(&Signature::of(&kernel), size_of::<K::Params>());
        }
        let Some(around) = self.around else { return queue.run(kernel) };
        let (mut kernel, mut result) = (Some(kernel), Ok(()));
        around(&mut || result = kernel.take().map_or(Ok(()), |kernel| queue.run(kernel)));
        result
    }

    fn output<T: Row>(&mut self, queue: &mut Queue, name: &'static str, buffer: &Buffer<T>) -> Result<()> {
        let mut rows = Vec::new();
        queue.read(buffer, 0..buffer.len(), &mut rows)?;
        let name = format!("{name} of {}", self.input);
        self.outputs.push((name, bytemuck::cast_slice(&rows).to_vec()));
        Ok(())
    }
}

/// The trial of every kernel.
pub fn trials() -> impl Iterator<Item = Trial> {
    let arithmetic = [Trial { name: "exact_probe", run: exact_probe }];
    arithmetic
        .into_iter()
        .chain(surface::TRIALS)
        .chain(attributes::TRIALS)
        .chain(costs::TRIALS)
        .chain(features::TRIALS)
        .chain(formats::TRIALS)
        .chain(gate::TRIALS)
        .chain(near::TRIALS)
        .chain(nearest::TRIALS)
        .chain(fit::TRIALS)
        .chain(cells::TRIALS)
        .chain(removal::TRIALS)
        .chain(light::TRIALS)
        .chain(partition::TRIALS)
        .chain(regions::TRIALS)
}

fn exact_probe(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    seen.input("hostile operands");
    let mut rows = hostile_operands(5_000);
    rows[4_998][0] ^= u32::from(perturbed);
    let mut results = queue.buffer::<u32>(rows.len() * RESULTS)?;
    let operands = queue.buffer_from(rows)?;
    seen.run(queue, ExactProbe { operands: &operands, results: &mut results })?;
    seen.output(queue, "results", &results)
}

/// Runs `trial` on both queues and says where they differ first, if they do.
fn difference(trial: &Trial, gpu: &Device, perturbed: bool) -> Option<String> {
    let on_cpu = trial.outputs(gpu.cpu_queue(), None, false);
    let on_gpu = trial.outputs(gpu.gpu_queue().expect("an open GPU"), None, perturbed);
    assert!(on_cpu.iter().any(|(_, bits)| bits.iter().any(|&b| b != 0)), "{} writes nothing", trial.name);
    first_difference(&on_cpu, &on_gpu).map(|at| format!("{}: {at} on the GPU", trial.name))
}

/// Where outputs on the CPU differ first from others, if they do.
pub fn first_difference(on_cpu: &[Output], others: &[Output]) -> Option<String> {
    assert_eq!(on_cpu.len(), others.len());
    on_cpu.iter().zip(others).find_map(|((name, ours), (_, theirs))| {
        assert_eq!(ours.len(), theirs.len());
        let i = (0..ours.len()).find(|&i| ours[i] != theirs[i])?;
        Some(format!("{name}[{i}] is {:08x} on the CPU, {:08x}", ours[i], theirs[i]))
    })
}

#[test]
fn equal() {
    let Some(device) = gpu() else { return };
    let differences: Vec<_> = trials().filter_map(|trial| difference(&trial, device, false)).collect();
    assert!(differences.is_empty(), "{differences:#?}");
}

#[test]
fn can_fail() {
    let Some(device) = gpu() else { return };
    let unseen = trials().filter(|trial| difference(trial, device, true).is_none());
    assert_eq!(unseen.map(|trial| trial.name).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn equal_in_small_pages() {
    let Some(device) = open(&GpuOptions { page_rows: Some(SMALL_PAGE), ..GpuOptions::default() }) else { return };
    let differences: Vec<_> = trials().filter_map(|trial| difference(&trial, &device, false)).collect();
    assert!(differences.is_empty(), "{differences:#?}");
}

/// Software runs without the guards that other devices need, holds rows in texels and loads pairs of words: here as they do.
#[test]
fn equal_as_on_hardware() {
    let (exactness, packing, texels) = (Some(Exactness::Guarded), Some(Packing::Words), Some(false));
    let Some(device) = open(&GpuOptions { exactness, packing, texels, ..GpuOptions::default() }) else { return };
    let differences: Vec<_> = trials().filter_map(|trial| difference(&trial, &device, false)).collect();
    assert!(differences.is_empty(), "{differences:#?}");
}
