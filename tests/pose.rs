//! Shapes that joints and morph targets move: what is nothing at rest, and the bend of a limb in a pose.

mod support;

use coarsen::contract::{AttributeWeights, Attributes, Options};
use coarsen::math::DVec3;
use coarsen::mesh::{Channel, ChannelKind};
use coarsen::{Budget, Mesh, Outcome};
use support::deviation::deviation;
use support::engine::{contract, contract_on, cpu, gpu};

/// An open straight tube along z, ten times as long as it is wide, of so many faces around it.
fn tube(around: u32, along: u32) -> Mesh {
    let at = |i: u32, j: u32| j * around + i % around;
    let place = |v: u32| {
        let angle = std::f64::consts::TAU * f64::from(v % around) / f64::from(around);
        DVec3::new(angle.cos(), angle.sin(), 20.0 * f64::from(v / around) / f64::from(along))
    };
    let quads = (0..along).flat_map(|j| (0..around).map(move |i| (i, j)));
    let faces = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    Mesh::new((0..around * (along + 1)).map(place).collect(), faces.collect())
}

/// How much of the second joint there is: none below a height of 8, all above 12.
fn share(p: DVec3) -> f64 {
    ((p.z - 8.0) / 4.0).clamp(0.0, 1.0)
}

/// Numbers at every vertex.
fn channel(mesh: &Mesh, name: &str, kind: ChannelKind, of: impl Fn(DVec3) -> Vec<f64>) -> Channel {
    let rows: Vec<Vec<f64>> = mesh.positions.iter().map(|&p| of(p)).collect();
    let values = rows.concat().into_iter().map(|x| x as f32).collect();
    Channel { name: name.into(), kind, width: rows[0].len(), values }
}

/// The tube with two joints, of which the second turns what it moves about a height of 10.
fn limb() -> Mesh {
    let mut mesh = tube(24, 60);
    mesh.channels = vec![channel(&mesh, "JOINTS", ChannelKind::Joints, |p| vec![0.0, 1.0, 1.0 - share(p), share(p)])];
    mesh
}

/// The tube with a target that bends it.
fn morph() -> Mesh {
    let mut mesh = tube(24, 60);
    mesh.channels = vec![channel(&mesh, "target_0.POSITION", ChannelKind::Displacement, |p| {
        vec![8.0 * share(p) * share(p), 0.0, 0.0]
    })];
    mesh
}

/// As it is when its second joint has turned by a right angle, or its target is there in full.
fn posed(mesh: &Mesh) -> Mesh {
    let channel = &mesh.channels[0];
    let moved = |(v, &p): (usize, &DVec3)| {
        let row: Vec<f64> = channel.row(v).iter().map(|&x| f64::from(x)).collect();
        match channel.kind {
            ChannelKind::Joints => {
                let of_second: f64 = (0..2).filter(|&i| row[i] == 1.0).map(|i| row[2 + i]).sum();
                p.lerp(DVec3::new(p.z - 10.0, p.y, 10.0 - p.x), of_second)
            }
            _ => p + DVec3::from_slice(&row),
        }
    };
    Mesh::new(mesh.positions.iter().enumerate().map(moved).collect(), mesh.faces.clone())
}

fn with_pose(weight: f32) -> Options {
    let weights = AttributeWeights { pose: weight, ..AttributeWeights::default() };
    Options { attributes: Attributes { weights, ..Attributes::default() }, ..Options::default() }
}

/// How far the result is off in the pose, of the diagonal.
fn off(mesh: &Mesh, outcome: &Outcome) -> f64 {
    deviation(&posed(mesh), &posed(&outcome.mesh), 20_000).rms
}

#[test]
fn limbs_keep_what_they_bend_at() {
    for (name, mesh) in [("joints", limb()), ("target", morph())] {
        let run = |options: &Options| contract(&mesh, options, Budget::keep(0.2));
        let (with, without) = (run(&Options::default()), run(&with_pose(0.0)));
        let (with, without) = (off(&mesh, &with), off(&mesh, &without));
        assert!(with <= 0.5 * without, "{name}: off by {with}, and by {without} where poses count nothing");
    }
}

/// What targets are told by name counts as it is told, and no second time.
#[test]
fn targets_with_a_weight_of_their_own_are_no_pose() {
    let mesh = morph();
    let mut options = with_pose(1.0);
    options.attributes.weights.channels = [("target_0.POSITION".into(), 0.0)].into();
    let run = |options: &Options| contract(&mesh, options, Budget::keep(0.08)).mesh;
    assert!(run(&options) == run(&with_pose(0.0)) && run(&options) != run(&with_pose(1.0)));
}

#[test]
fn poses_do_not_part_the_devices() {
    let Some(device) = gpu(&coarsen::backend::GpuOptions::default()) else { return };
    let mut mesh = limb();
    let numbers = [0.1, 0.2, 0.3];
    mesh.channels.extend(numbers.map(|by| {
        let name = format!("target_{by}.POSITION");
        channel(&mesh, &name, ChannelKind::Displacement, |p| vec![by * p.z.sin(), by * p.y, (by * p.z).cos()])
    }));
    let reference = contract(&mesh, &Options::default(), Budget::keep(0.2));
    for device in [&device, &cpu(3)] {
        let outcome = contract_on(device, &mesh, &Options::default(), Budget::keep(0.2));
        assert!(outcome.mesh == reference.mesh, "{}", device.description());
    }
}
