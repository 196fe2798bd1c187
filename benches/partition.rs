//! Simplification by partition: a million faces each by variational shape approximation, coplanar merging and superfaces, from
//! mesh to mesh.

use std::time::Duration;

use coarsen::backend::Selector;
use coarsen::partition::{By, Flatness, Options, Superfaces, Variational, vsa};
use coarsen::{Budget, Device, Method, mesh, simplify};
use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};

const FACES: usize = 1_000_000;

fn partition(criterion: &mut Criterion) {
    let variational = |solver| {
        let goal = vsa::Goal::Regions(1000);
        let regions = vsa::Options { solver, ..vsa::Options::new(goal) };
        Options { by: By::Variational(Variational { regions, ..Variational::new(goal) }), ..Options::variational(goal) }
    };
    let jobs = [
        ("coplanar", "part", Options::coplanar(Flatness::default())),
        ("superfaces", "room", Options::superfaces(Superfaces::default())),
        ("vsa", "statue", variational(vsa::Solver::Greedy)),
        ("vsa-rounds", "statue", variational(vsa::Solver::Rounds)),
    ];
    let cpu = Device::cpu(2).expect("two threads start");
    let software = Device::open(&Selector::Software, 2).ok();
    for (name, sample, options) in jobs {
        let mesh = mesh::sample(sample, Some(FACES)).expect("a sample");
        let method = Method::Partition(options);
        let mut group = criterion.benchmark_group(format!("partition/{name}-{sample}-1m"));
        group.sampling_mode(SamplingMode::Flat).sample_size(10).measurement_time(Duration::from_secs(10));
        group.throughput(Throughput::Elements(mesh.faces.len() as u64));
        for (name, device) in [("cpu-2", Some(&cpu)), ("software", software.as_ref())] {
            let Some(device) = device else { continue };
            group.bench_function(name, |bencher| {
                bencher.iter(|| simplify(&mesh, &method, &Budget::default(), device, None).expect("a valid mesh"));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, partition);
criterion_main!(benches);
