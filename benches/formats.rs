//! Reading and writing a sheet of about a million faces, through files in the system's temporary folder.
//!
//! Writing includes putting the bytes on the disk. The page cache is warm when reading, so what is measured is parsing.
//! Compression is left out: it measures flate2 and zstd.

use std::hint::black_box;
use std::time::Duration;

use coarsen::Mesh;
use coarsen::formats::{self, WriteOptions};
use coarsen::math::DVec3;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Cells along a side; 2 · 708² = 1,002,528 faces.
const CELLS: u32 = 708;

/// A wavy height field: its coordinates have as many digits as those of a scan.
fn sheet() -> Mesh {
    let place = |i: u32| {
        let (x, y) = (f64::from(i % (CELLS + 1)) * 0.013, f64::from(i / (CELLS + 1)) * 0.017);
        DVec3::new(x, y, (3.0 * x).sin() * (2.0 * y).cos()).as_vec3().as_dvec3()
    };
    let faces = (0..CELLS * CELLS).flat_map(|cell| {
        let a = cell / CELLS * (CELLS + 1) + cell % CELLS;
        [[a, a + 1, a + CELLS + 2], [a, a + CELLS + 2, a + CELLS + 1]]
    });
    Mesh::new((0..(CELLS + 1) * (CELLS + 1)).map(place).collect(), faces.collect())
}

fn formats(criterion: &mut Criterion) {
    let mesh = sheet();
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, file, ascii) in [
        ("ply-binary", "a.ply", false),
        ("ply-text", "b.ply", true),
        ("stl-binary", "a.stl", false),
        ("stl-text", "b.stl", true),
        ("obj", "a.obj", true),
        ("off", "a.off", true),
    ] {
        let path = folder.path().join(file);
        let options = WriteOptions { ascii };
        let mut group = criterion.benchmark_group(format!("formats/sheet-1m/{name}"));
        group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
        group.throughput(Throughput::Elements(mesh.faces.len() as u64));
        group.bench_function("write", |bencher| {
            bencher.iter(|| formats::write(black_box(&mesh), &path, &options).expect("the folder is writable"));
        });
        group.bench_function("read", |bencher| {
            bencher.iter(|| formats::read(black_box(&path)).expect("the file was just written"));
        });
        group.finish();
    }
}

criterion_group!(benches, formats);
criterion_main!(benches);
