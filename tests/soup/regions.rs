//! Rubbish through the methods that make regions.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};

use coarsen::mesh::{Materials, Normals, Rings, dual, weld};
use coarsen::partition::superface::Criterion;
use coarsen::partition::{By, Flatness, NO_REGION, Options, Partition, Superfaces, Triangulation, vsa};
use coarsen::{Budget, Device, Mesh, Method, Outcome};

use super::rubbish::{below, pick};
use super::support::deviation::Random;
use super::{Parts, assert_topology, flips, outcome, start};

/// One mesh by one of the methods, with options that follow from the seed.
pub fn run(seed: u64, mesh: &Mesh, device: &Device) {
    // A sequence of its own: what the seeds stand for elsewhere stays.
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let options = options(&mut random);
    let budget = pick(&mut random, &[Budget::default(), Budget::default(), Budget::error(0.01), Budget::error(0.0)]);
    if catch_unwind(AssertUnwindSafe(|| assert_rebuilds(mesh, &options, budget, device))).is_err() {
        panic!("seed {seed}: {options:?} {budget:?}");
    }
}

fn options(random: &mut Random) -> Options {
    let mut options = match below(random, 3) {
        0 => Options::coplanar(Flatness {
            angle_rad: pick(random, &[0.0, 0.02, 0.5, 1.5]),
            distance: pick(random, &[0.0, 1e-5, 0.02, 10.0]),
        }),
        1 => {
            let goal = pick(
                random,
                &[vsa::Goal::Regions(1), vsa::Goal::Regions(7), vsa::Goal::Energy(0.2), vsa::Goal::Deviation(0.1)],
            );
            let mut options = Options::variational(goal);
            if let By::Variational(found) = &mut options.by {
                found.regions.solver = pick(random, &[vsa::Solver::Greedy, vsa::Solver::Rounds, vsa::Solver::Lloyd]);
                found.regions.connectivity = pick(random, &[vsa::Connectivity::Local, vsa::Connectivity::Exact]);
                found.regions.seed = random.bits();
                found.chord_ratio = pick(random, &[0.2, 1e-3, 5.0]);
            }
            options
        }
        _ => {
            let mut superfaces = Superfaces::default();
            superfaces.regions.criterion = pick(
                random,
                &[
                    Criterion::Contrast { epsilon: 0.3, range_cap: 0.9 },
                    Criterion::Paper { epsilon: 1.0, area_unit: 0.1 },
                ],
            );
            superfaces.regions.guard.angle_rad = pick(random, &[0.02, 0.5]);
            superfaces.border_color = pick(random, &[2.0, 200.0]);
            Options::superfaces(superfaces)
        }
    };
    options.triangulation = pick(random, &[Triangulation::Earcut, Triangulation::Ears]);
    options.weld = pick(random, &[Some(0.0), Some(0.0), None, Some(1e-3), Some(0.5)]);
    options.flips = flips(random);
    options.dropped.materials = below(random, 4) == 0;
    options.dropped.texcoords = below(random, 4) == 0;
    options.normals = pick(random, &[Normals::Keep, Normals::Keep, Normals::Recompute]);
    if let By::Superfaces(superfaces) = &mut options.by {
        superfaces.slides = below(random, 2) == 0;
    }
    options
}

/// How many edges of a result lie between two regions; all sides of faces where edges were turned after, and nobody tells.
fn edges_between_regions(outcome: &Outcome) -> usize {
    let labels = outcome.regions.as_ref().map(|regions| &regions.face_labels[..]).unwrap_or_default();
    let faces = &outcome.mesh.faces;
    if labels.len() != faces.len() {
        return 3 * faces.len();
    }
    let mut regions = BTreeMap::<[u32; 2], BTreeSet<u32>>::new();
    for (face, &label) in faces.iter().zip(labels) {
        for [a, b] in [[face[0], face[1]], [face[1], face[2]], [face[2], face[0]]] {
            regions.entry([a.min(b), a.max(b)]).or_default().insert(label);
        }
    }
    regions.values().filter(|labels| labels.len() > 1).count()
}

/// Vertices are the input's, the topology is kept, and regions hang together.
fn assert_rebuilds(mesh: &Mesh, options: &Options, budget: Budget, device: &Device) {
    let Some(outcome) = outcome(mesh, Method::Partition(options.clone()), budget, device) else { return };
    // Where corners disagree in what vertices carry, flats have several at one place.
    let is_split = mesh.normals.is_some() || mesh.colors.is_some() || !mesh.channels.is_empty();
    let joined = options.weld.filter(|_| is_split && matches!(options.by, By::Coplanar(_)));
    let result = joined.map_or_else(|| outcome.mesh.clone(), |distance| weld(&outcome.mesh, distance).mesh);
    let is_turned = outcome.warnings.iter().any(|warning| warning.contains("wound"));
    let parts = if is_turned { Parts::MayTurn(edges_between_regions(&outcome)) } else { Parts::Stay };
    assert_topology(&start(mesh, options.weld, false), &result, parts, 0);
    let told = |materials: &Option<Materials>| materials.is_some() && !options.dropped.materials;
    assert_eq!(outcome.mesh.materials.is_some(), told(&mesh.materials));
    outcome.mesh.check().expect("a valid mesh");

    let regions = outcome.regions.expect("regions");
    let labeled = if outcome.flips == 0 { outcome.mesh.faces.len() } else { 0 };
    assert_eq!(regions.face_labels.len(), labeled);
    if options.weld.is_none() {
        let (faces, labels): (Vec<_>, Vec<_>) = mesh
            .faces
            .iter()
            .zip(&regions.labels)
            .filter(|(_, label)| **label != NO_REGION)
            .map(|(f, l)| (*f, *l))
            .unzip();
        let neighbors = dual::neighbors(&faces, &Rings::new(&faces, mesh.positions.len()));
        let faults = Partition { labels, region_count: regions.count }.validate(&neighbors);
        // Faces that were turned over to agree with their neighbors lie across walls here.
        assert!(is_turned || faults.is_empty(), "{faults:?}");
    }
}
