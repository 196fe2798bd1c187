//! Every kernel of a round by itself: the statue of a million faces, on the host's queue and on software Vulkan.
//!
//! A table first: each kernel's first run on a fresh device, which on an adapter makes its pipeline. Then criterion's
//! groups. A run counts from recording to the end of the wait for it, so an adapter's times hold one submission.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a benchmark prints what it measured")]

mod scene;
mod stages;

use std::time::{Duration, Instant};

use coarsen::Device;
use coarsen::backend::{Queue, Selector};
use criterion::{Criterion, SamplingMode, Throughput};
use scene::Scene;
use stages::{STAGES, Stage};

/// A queue with the scene on its device.
struct Place {
    name: &'static str,
    device: Device,
    queue: Queue,
    scene: Scene,
}

/// Runs a kernel and waits for it.
fn run(stage: &Stage, scene: &mut Scene, queue: &mut Queue) {
    (stage.run)(scene, queue).expect("the kernel runs");
    let mut waited_for = Vec::with_capacity(1);
    queue.read(&scene.new_vertex, 0..1, &mut waited_for).expect("the kernel ends");
}

fn places() -> Vec<Place> {
    let cpu = Device::cpu(2).expect("two threads start");
    let scene = cpu.install(|| Scene::new(&mut cpu.cpu_queue()));
    let mut places = Vec::new();
    match Device::open(&Selector::Software, 2) {
        Ok(device) => {
            let mut queue = device.gpu_queue().expect("a software adapter has a queue");
            let scene = scene.copy(&mut queue);
            places.push(Place { name: "software", device, queue, scene });
        }
        Err(error) => println!("software: left out, {error}"),
    }
    places.insert(0, Place { name: "cpu-2", queue: cpu.cpu_queue(), device: cpu, scene });
    places
}

fn print_first_runs(places: &mut [Place]) {
    let names: Vec<String> = places.iter().map(|place| format!("{:>10}", place.name)).collect();
    println!("first run, ms       {}", names.concat());
    for stage in STAGES {
        print!("{:<20}", stage.name);
        for Place { device, queue, scene, .. } in &mut *places {
            let clock = Instant::now();
            device.install(|| run(stage, scene, queue));
            print!("{:>10.1}", 1e3 * clock.elapsed().as_secs_f64());
        }
        println!();
    }
    println!();
}

fn groups(criterion: &mut Criterion, places: &mut [Place]) {
    for stage in STAGES {
        let mut group = criterion.benchmark_group(format!("{}/1m", stage.name));
        group.sampling_mode(SamplingMode::Flat).sample_size(10);
        group.warm_up_time(Duration::from_millis(50)).measurement_time(Duration::from_millis(300));
        for Place { name, device, queue, scene } in &mut *places {
            group.throughput(Throughput::Elements((stage.rows)(scene)));
            group.bench_function(*name, |bencher| {
                device.install(|| bencher.iter(|| run(stage, scene, queue)));
            });
        }
        group.finish();
    }
}

fn main() {
    let mut places = places();
    print_first_runs(&mut places);
    let mut criterion = Criterion::default().configure_from_args();
    groups(&mut criterion, &mut places);
    criterion.final_summary();
}
