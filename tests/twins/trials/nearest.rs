//! The nearest triangle of samples around real and hostile meshes.

use coarsen::backend::Queue;
use coarsen::kernel::rows::{Face, Position, TreeNode};
use coarsen::kernel::sample_distances::SampleDistances;
use coarsen::math::DVec3;
use coarsen::mesh::{sample, shapes};
use coarsen::spatial::{Bvh, Frame};
use coarsen::{Mesh, Result};

use super::inputs::{Random, flip};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 1] = [Trial { name: "sample_distances", run: sample_distances }];

/// A tree and samples as the kernel takes them.
struct Case {
    name: &'static str,
    nodes: Vec<TreeNode>,
    faces: Vec<Face>,
    positions: Vec<Position>,
    samples: Vec<Position>,
}

impl Case {
    /// Samples anywhere, at corners, on edges and next to them.
    fn new(name: &'static str, mesh: &Mesh) -> Self {
        let frame = Frame::of(mesh, mesh);
        let bvh = Bvh::new(mesh, frame);
        let positions: Vec<Position> = mesh.positions.iter().map(|&p| row(frame.to_frame(p))).collect();
        let mut random = Random::new();
        let sample = |i: u32| {
            let anywhere = [0; 3].map(|_| 2.0 * random.centered());
            let [p, q] = [0, 1].map(|_| positions[random.below(positions.len() as u32) as usize]);
            let [x, y, z] = match i % 4 {
                0 => anywhere,
                1 => [p.x, p.y, p.z],
                2 => [0.5 * (p.x + q.x), 0.5 * (p.y + q.y), 0.5 * (p.z + q.z)],
                _ => [p.x + 1e-3 * anywhere[0], p.y, p.z],
            };
            Position { x, y, z, flags: 0 }
        };
        let samples = (0..2000).map(sample).collect();
        Self {
            name,
            nodes: bytemuck::cast_slice(bvh.nodes()).to_vec(),
            faces: bytemuck::cast_slice(bvh.corners()).to_vec(),
            positions,
            samples,
        }
    }

    fn all() -> Vec<Self> {
        let torus = shapes::torus(40, 24);
        let squeezed =
            |by: DVec3| Mesh { positions: torus.positions.iter().map(|&p| p * by).collect(), ..torus.clone() };
        vec![
            Self::new("statue", &sample("statue", Some(3000)).expect("a sample")),
            Self::new("ties", &shapes::cube(6)),
            Self::new("one face", &Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]])),
            Self::new("coincident", &Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]; 3000])),
            Self::new("segments", &squeezed(DVec3::X)),
            Self::new("slivers", &squeezed(DVec3::new(1.0, 1e-6, 1e-20))),
            Self::new("specks", &specks()),
            Self::new("soup", &soup()),
            Self::new("pages", &shapes::plane(131, 131)),
        ]
    }
}

fn row(p: DVec3) -> Position {
    Position { x: p.x as f32, y: p.y as f32, z: p.z as f32, flags: 0 }
}

/// Smaller and smaller about the center, down to where squares underflow.
fn specks() -> Mesh {
    let corner = |i: i32| DVec3::from_array([0, 1, 2].map(|k| if (i + k) % 3 == 0 { 1.0 } else { -0.5 }));
    let positions = (0..300).map(|i| corner(i) * 0.5f64.powi(i / 2)).collect();
    Mesh::new(positions, (0..298).map(|i| [i, i + 1, i + 2]).collect())
}

/// Triangles of random corners: boxes over boxes, so that a sample visits most of the tree.
fn soup() -> Mesh {
    let mut random = Random::new();
    let positions = (0..900).map(|_| DVec3::from_array([0; 3].map(|_| f64::from(random.centered())))).collect();
    Mesh::new(positions, (0..1500).map(|_| [0; 3].map(|_| random.below(900))).collect())
}

fn sample_distances(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, Case { name, nodes, faces, positions, mut samples }) in Case::all().into_iter().enumerate() {
        seen.input(name);
        flip(&mut samples[0].x, perturbed && case == 0);
        let (nodes, faces) = (&queue.buffer_from(nodes)?, &queue.buffer_from(faces)?);
        let positions = &queue.buffer_from(positions)?;
        let sample_count = samples.len() as u32;
        let nearest = &mut queue.buffer(samples.len())?;
        let samples = &queue.buffer_from(samples)?;
        seen.run(queue, SampleDistances { samples, sample_count, nodes, faces, positions, nearest })?;
        seen.output(queue, "nearest", nearest)?;
    }
    Ok(())
}

/// What the kernel proposes is as close as the closest triangle, to the digits of single precision.
#[test]
fn proposals_are_good() {
    for mesh in [sample("statue", Some(3000)).expect("a sample"), shapes::cube(6), soup()] {
        let bvh = Bvh::new(&mesh, Frame::of(&mesh, &mesh));
        let Case { nodes, faces, positions, samples, .. } = Case::new("", &mesh);
        let points: Vec<DVec3> = samples.iter().map(|sample| sample.xyz().as_dvec3()).collect();
        let mut queue = coarsen::Device::cpu(1).expect("a thread").cpu_queue();
        let mut host = || -> Result<Vec<[u32; 2]>> {
            let (nodes, faces) = (&queue.buffer_from(nodes.clone())?, &queue.buffer_from(faces.clone())?);
            let (positions, samples) = (&queue.buffer_from(positions.clone())?, &queue.buffer_from(samples.clone())?);
            let mut nearest = queue.buffer(points.len())?;
            let sample_count = points.len() as u32;
            queue.run(SampleDistances { samples, sample_count, nodes, faces, positions, nearest: &mut nearest })?;
            Ok(nearest.host().to_vec())
        };
        for (&p, [_, bits]) in points.iter().zip(host().expect("the twin runs")) {
            let want = bvh.closest(p, 0).expect("a face").distance_sq.sqrt();
            let got = f64::from(f32::from_bits(bits)).sqrt();
            assert!((got - want).abs() < 1e-6, "{p}: {got}, not {want}");
        }
    }
}
