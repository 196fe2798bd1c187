//! Who runs: coarsen by device, and meshoptimizer.

use coarsen::backend::Selector;
use coarsen::{Budget, Device, Method, simplify};
use meshopt::{SimplifyOptions, VertexDataAdapter};

use crate::input::Case;

/// The name of the one that the others are compared with.
pub const BASELINE: &str = "meshopt";

/// One that simplifies.
pub struct Contender {
    /// Its name in identifiers and on the command line of a child.
    pub name: &'static str,
    /// Coarsen's device; meshoptimizer has none.
    device: Option<Device>,
}

impl Contender {
    /// The contender of this name; nothing for software Vulkan where there is none.
    pub fn open(name: &str) -> Option<Self> {
        Some(match name {
            "cpu-1" => Self { name: "cpu-1", device: Some(Device::cpu(1).expect("a thread starts")) },
            "cpu-2" => Self { name: "cpu-2", device: Some(Device::cpu(2).expect("two threads start")) },
            "software" => Self { name: "software", device: Some(Device::open(&Selector::Software, 2).ok()?) },
            BASELINE => Self { name: BASELINE, device: None },
            _ => return None,
        })
    }

    /// Simplifies to about `target` faces and returns how many there are.
    pub fn simplify(&self, case: &Case, target: usize) -> usize {
        match &self.device {
            Some(device) => contract(case, target, device),
            None => baseline(case, target),
        }
    }
}

/// All that this machine has, the baseline last.
pub fn contenders() -> Vec<Contender> {
    ["cpu-1", "cpu-2", "software", BASELINE]
        .into_iter()
        .filter_map(|name| {
            let contender = Contender::open(name);
            if contender.is_none() {
                println!("{name}: left out, there is no such adapter");
            }
            contender
        })
        .collect()
}

fn contract(case: &Case, target: usize, device: &Device) -> usize {
    let outcome = simplify(&case.mesh, &Method::default(), &Budget::faces(target), device, None);
    outcome.expect("the statue simplifies").mesh.faces.len()
}

fn baseline(case: &Case, target: usize) -> usize {
    let points = bytemuck::cast_slice(&case.points);
    let vertices = VertexDataAdapter::new(points, size_of::<[f32; 3]>(), 0).expect("whole rows of points");
    let indices = case.mesh.faces.as_flattened();
    meshopt::simplify(indices, &vertices, 3 * target, 1e6, SimplifyOptions::None, None).len() / 3
}
