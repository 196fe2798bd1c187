//! Topology of real meshes against the counts of an independent reader (`facts.tsv`), as stored and welded.

#![expect(clippy::print_stdout, reason = "a skipped test says so")]

use std::fs;
use std::path::{Path, PathBuf};

use coarsen::Mesh;
use coarsen::math::DVec3;
use coarsen::mesh::{topology, weld};

fn models() -> PathBuf {
    match std::env::var_os("COARSEN_MODELS") {
        Some(folder) => folder.into(),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/models"),
    }
}

/// Positions and fan-triangulated polygons of plain OBJ and OFF text: enough for these files, and independent of the readers.
fn read(path: &Path) -> Mesh {
    let text = fs::read_to_string(path).expect("a text file");
    let mut mesh = Mesh::default();
    let number = |word: &str| word.parse::<f64>().expect("a number");
    let point = |words: &[&str]| DVec3::new(number(words[0]), number(words[1]), number(words[2]));
    let fan = |corners: &[u32], mesh: &mut Mesh| {
        mesh.faces.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]));
    };
    if path.extension().is_some_and(|extension| extension == "obj") {
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.first() {
                Some(&"v") => mesh.positions.push(point(&words[1..])),
                Some(&"f") => {
                    let index = |word: &&str| {
                        let index: i64 = word.split('/').next().expect("an index").parse().expect("an index");
                        (if index < 0 { mesh.positions.len() as i64 + index } else { index - 1 }) as u32
                    };
                    let corners: Vec<u32> = words[1..].iter().map(index).collect();
                    fan(&corners, &mut mesh);
                }
                _ => {}
            }
        }
    } else {
        let mut lines =
            text.lines().map(|line| line.split('#').next().unwrap_or("")).filter(|line| !line.trim().is_empty());
        let mut next = || lines.next().expect("a line").split_whitespace().collect::<Vec<_>>();
        let head = next();
        let counts = if head.len() >= 3 { head[head.len() - 3..].to_vec() } else { next() };
        let [vertices, faces] = [0, 1].map(|k| counts[k].parse::<usize>().expect("a count"));
        mesh.positions = (0..vertices).map(|_| point(&next())).collect();
        for _ in 0..faces {
            let words = next();
            let corners: usize = words[0].parse().expect("a count");
            let corners: Vec<u32> = words[1..=corners].iter().map(|word| word.parse().expect("an index")).collect();
            fan(&corners, &mut mesh);
        }
    }
    mesh
}

#[test]
fn counts_agree_with_the_facts() {
    let Ok(facts) = fs::read_to_string(models().join("facts.tsv")) else {
        println!("skipped: no models at '{}'", models().display());
        return;
    };
    let mut rows = facts.lines().map(|line| line.split('\t').collect::<Vec<_>>());
    let names = rows.next().expect("a head line");
    let mut compared = 0;
    let mut failures = Vec::new();
    for row in rows {
        let field = |name: &str| {
            names.iter().position(|n| *n == name).and_then(|column| row.get(column)).copied().unwrap_or("")
        };
        let path = field("path");
        if !["obj", "off"].contains(&field("format")) || field("euler").is_empty() || path.contains("inf_nan") {
            continue;
        }
        let mesh = read(&models().join(path));
        let stored = topology(&mesh);
        let welded = weld(&mesh, 0.0);
        let merged = topology(&welded.mesh);
        let counts = if field("mode") == "welded" { merged } else { stored };
        let number = |name: &str| field(name).parse::<i64>().unwrap_or(-1);
        let mut compare = |name: &str, ours: i64| {
            if ours != number(name) {
                failures.push(format!("{} {path} {name}: {ours}, not {}", field("mode"), field(name)));
            }
        };
        compare("components", counts.components as i64);
        // The facts count faces without area among the degenerate ones.
        if field("mode") == "stored" {
            compare("degenerate", (counts.degenerate_faces + counts.zero_area_faces) as i64);
            compare("dup_faces", counts.duplicate_faces as i64);
        } else {
            compare("degenerate", (welded.degenerate_faces + counts.zero_area_faces) as i64);
            compare("dup_faces", (welded.duplicate_faces + welded.opposite_faces) as i64);
        }
        // The facts keep duplicate faces, welding drops them: what follows is only comparable without.
        if field("mode") == "stored" || welded.duplicate_faces == 0 {
            compare("euler", counts.euler);
            compare("boundary_e", counts.border_edges as i64);
            compare("boundary_loops", counts.border_loops as i64);
            compare("nonman_e", counts.nonmanifold_edges as i64);
            compare("nonman_v", counts.nonmanifold_vertices as i64);
            compare("orient_bad", counts.misoriented_edges as i64);
            if !field("genus").is_empty() {
                compare("genus", counts.genus.unwrap_or(-1));
            }
        }
        compared += 1;
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(compared >= 40, "only {compared} rows compared");
}
