//! Measuring: the tree over a statue of a million faces, and its deviation from a tenth of itself by a million samples.

use std::time::Duration;

use coarsen::backend::Selector;
use coarsen::metrics::{Options, deviation};
use coarsen::spatial::{Bvh, Frame};
use coarsen::{Budget, Device, Mesh, Method, mesh, simplify};
use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};

const SAMPLES: usize = 1_000_000;

/// The statue and its simplification.
fn meshes(device: &Device) -> [Mesh; 2] {
    let statue = mesh::sample("statue", Some(1_000_000)).expect("a sample");
    let coarse = simplify(&statue, &Method::default(), &Budget::keep(0.1), device, None).expect("a valid mesh").mesh;
    [statue, coarse]
}

fn metrics(criterion: &mut Criterion) {
    let cpu = Device::cpu(2).expect("two threads start");
    let [statue, coarse] = meshes(&cpu);
    let frame = Frame::of(&statue, &coarse);

    let mut group = criterion.benchmark_group("bvh/statue-1m");
    group.sampling_mode(SamplingMode::Flat).sample_size(10).measurement_time(Duration::from_secs(3));
    group.throughput(Throughput::Elements(statue.faces.len() as u64));
    group.bench_function("cpu-2", |bencher| cpu.install(|| bencher.iter(|| Bvh::new(&statue, frame))));
    group.finish();

    // Both trees, both directions.
    let mut group = criterion.benchmark_group("deviation/statue-1m-100k");
    group.sampling_mode(SamplingMode::Flat).sample_size(10).measurement_time(Duration::from_secs(10));
    group.throughput(Throughput::Elements(2 * SAMPLES as u64));
    let options = Options { samples: Some(SAMPLES), ..Options::default() };
    let software = Device::open(&Selector::Software, 2).ok();
    for (name, device) in [("cpu-2", Some(&cpu)), ("software", software.as_ref())] {
        let Some(device) = device else { continue };
        group.bench_function(name, |bencher| {
            bencher.iter(|| deviation(&statue, &coarse, &options, device).expect("two meshes with faces"));
        });
    }
    group.finish();
}

criterion_group!(benches, metrics);
criterion_main!(benches);
