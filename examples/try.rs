//! dev only
use coarsen::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mesh = if let Some((n, f)) = mesh::parse_sample(&a[1]) { mesh::sample(n, f).unwrap() } else { formats::read(a[1].as_ref()).unwrap() };
    let n: usize = a[3].parse().unwrap();
    let metric =
        if a.get(4).is_some_and(|m| m == "plane") { contract::Metric::Plane } else { contract::Metric::Volume };
    let threads = a.get(5).and_then(|t| t.parse().ok()).unwrap_or(0);
    let opts = contract::Options { metric, ..Default::default() };
    let dev = if std::env::var("SW").is_ok() { Device::open(&backend::Selector::Software, threads).unwrap() } else { Device::cpu(threads).unwrap() };
    let out = simplify(&mesh, &Method::Contract(opts), &Budget::faces(n), &dev, None).unwrap();
    for w in &out.warnings { eprintln!("{w}"); }
    if std::env::var("V").is_ok() {
        for r in &out.rounds {
            eprintln!("{r:?}");
        }
    }
    eprintln!(
        "{} -> {} {:?} est {:.3e} {:?} rounds {}",
        out.faces_in,
        out.mesh.faces.len(),
        out.stop,
        out.error_estimate,
        out.seconds,
        out.rounds.len()
    );
    formats::write(&out.mesh, a[2].as_ref(), &Default::default()).unwrap();
    println!("{{\"simplify_ms\": {}}}", out.seconds.total * 1e3);
}
