use std::time::Instant;

use super::cases::*;
use super::*;

const BOTH: [Triangulation; 2] = [Triangulation::Earcut, Triangulation::Ears];

#[test]
fn probe() {
    let cases: Vec<(&str, Outline)> = vec![
        ("comb", comb(20)),
        ("turned comb", turned(comb(20), 0.7)),
        ("spiral", spiral(100, 4.0)),
        ("star", outline(&[star([0.0; 2], 300, 1.0, 0.9, 1)])),
        ("plate", plate(10, 20, 0.5, 1)),
        ("turned plate", turned(plate(10, 20, 0.5, 1), 0.3)),
        ("square holes", plate(10, 4, 0.0, 1)),
    ];
    for (name, outline) in cases {
        assert_eq!(outline.fault(), None, "{name}");
        for by in BOTH {
            let triangles = triangulate(&outline, by);
            println!("{name} {by:?} {:?}", triangles.map(|t| t.len()));
        }
    }
}

#[test]
fn time() {
    for n in [1_000, 10_000, 100_000_u32] {
        for (name, outline) in [
            ("comb", comb(n / 5)),
            ("turned comb", turned(comb(n / 5), 0.7)),
            ("spiral", spiral(n / 2, f64::from(n).sqrt() / 10.0)),
            ("star", outline(&[star([0.0; 2], n, 1.0, 0.1, 1)])),
            ("rough star", outline(&[star([0.0; 2], n, 1.0, 0.9, 1)])),
            ("plate", plate(f64::from(n / 30).sqrt() as u32, 30, 0.5, 1)),
        ] {
            let start = Instant::now();
            let fault = outline.fault();
            let crossing = start.elapsed();
            let times = BOTH.map(|by| {
                let start = Instant::now();
                let triangles = triangulate(&outline, by);
                let elapsed = start.elapsed();
                let start = Instant::now();
                let ok = triangles.map(|mut t| {
                    improve(&outline, &mut t, |_, _| false);
                    is_whole(&outline, &t)
                });
                (elapsed, ok, start.elapsed())
            });
            println!("{name} {n} {fault:?} {crossing:?} {times:?}");
        }
    }
}
