#![allow(missing_docs, clippy::print_stdout)]
use coarsen::mesh::*;
use std::time::Instant;
fn time<T>(name: &str, mut f: impl FnMut() -> T) {
    let mut best = f64::MAX;
    for _ in 0..7 {
        let t = Instant::now();
        let r = f();
        best = best.min(t.elapsed().as_secs_f64());
        drop(r);
    }
    println!("{name:40} {:8.1} ms", best * 1e3);
}
fn main() {
    let mesh = shapes::torus(1000, 500);
    time("weld 1M clean", || weld(&mesh, 0.0));
    let rings = Rings::new(&mesh.faces, mesh.positions.len());
    time("rings", || Rings::new(&mesh.faces, mesh.positions.len()));
    time("orient check", || orient(&mesh.faces, &rings));
    time("complex", || complex_vertices(&mesh.faces, &rings));
    time("topology", || topology(&mesh));
    let soup = Mesh::new(
        mesh.faces.as_flattened().iter().map(|&v| mesh.positions[v as usize]).collect(),
        (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(),
    );
    time("weld soup 3M", || weld(&soup, 0.0));
    time("weld 1M tolerance 1e-6", || weld(&mesh, 1e-6));
    time("weld 1M tolerance 0.01", || weld(&mesh, 0.01));
    let mut turned = mesh.faces.clone();
    for f in turned.iter_mut().step_by(3) {
        f.swap(0, 1);
    }
    time("orient turn", || orient(&turned, &rings));
    // shuffled
    let n = mesh.positions.len() as u32;
    let mut perm: Vec<u32> = (0..n).collect();
    let mut s = 1u64;
    for i in (1..n as usize).rev() {
        s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        perm.swap(i, (s >> 33) as usize % (i + 1));
    }
    let mut positions = mesh.positions.clone();
    for (i, &p) in perm.iter().enumerate() {
        positions[p as usize] = mesh.positions[i];
    }
    let shuffled = Mesh::new(positions, mesh.faces.iter().map(|f| f.map(|v| perm[v as usize])).collect());
    let rings = Rings::new(&shuffled.faces, n as usize);
    time("shuffled weld", || weld(&shuffled, 0.0));
    time("shuffled rings", || Rings::new(&shuffled.faces, n as usize));
    time("shuffled complex", || complex_vertices(&shuffled.faces, &rings));
}
