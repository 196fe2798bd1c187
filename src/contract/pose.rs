//! What joints and morph targets do to a shape, as numbers that decide: a shape is to hold in every pose, not at rest alone.
//!
//! - What moves with several joints goes between them: the mean of their places, by their weights, changes where a limb bends,
//!   by as much as the bones are long. It is three numbers, however many joints there are. The place of a joint is the centroid of
//!   the vertices that it moves. Joints of one number are one: skins of one file that number theirs differently share them.
//! - Up to two morph targets add what they displace. Of more there are two weighted sums: target k counts cos kφ in one and
//!   sin kφ in the other, φ the golden angle. One alone keeps its length; several at one place may add up, or cancel out in part.
//!
//! Three numbers each, as far as there is room beside normals, textures and colors: joints first.

use crate::math::{DVec3, Vec3};
use crate::mesh::{Channel, ChannelKind, Mesh};

/// Sums of displacements.
const SUMS: usize = 2;

/// The cosine and the sine of the golden angle, π (3 − √5): constants, for libraries differ in the last digit.
const GOLDEN: [f64; 2] = [-0.737_368_878_078_319_7, 0.675_490_294_261_523_8];

/// Numbers past this are of no joint.
const GREATEST_JOINT: f32 = 65_535.0;

/// How the vertices of a mesh move.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pose {
    joints: Option<Joints>,
    targets: Vec<Target>,
}

#[derive(Debug, Clone, PartialEq)]
struct Joints {
    channel: usize,
    /// Of each joint, about the center of the mesh.
    centroids: Vec<Vec3>,
}

#[derive(Debug, Clone, PartialEq)]
struct Target {
    channel: usize,
    /// How much it counts in either sum.
    factors: [f32; SUMS],
}

/// Three numbers of it, in units of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Where the joints are that move a vertex.
    Joints,
    /// One of the sums of what targets displace.
    Targets(usize),
}

impl Pose {
    /// That of the vertices of `mesh`, by its first channel of joints and those of displacements but for which `is_left_out`.
    pub fn of(mesh: &Mesh, is_left_out: impl Fn(&Channel) -> bool) -> Self {
        let of_kind = |kind: ChannelKind| {
            let channels = mesh.channels.iter().enumerate();
            channels.filter(move |(_, channel)| channel.kind == kind)
        };
        let joints = of_kind(ChannelKind::Joints)
            .next()
            .map(|(number, channel)| Joints { channel: number, centroids: joint_centroids(mesh, channel) });
        let displacements = of_kind(ChannelKind::Displacement).filter(|(_, channel)| !is_left_out(channel));
        let channels: Vec<usize> = displacements.map(|(number, _)| number).collect();
        let is_each_alone = channels.len() <= SUMS;
        let mut turned = [1.0, 0.0];
        let count = |channel: usize| {
            let factors = turned;
            let ([x, y], [cos, sin]) = (turned, GOLDEN);
            turned = if is_each_alone { [0.0, 1.0] } else { [x * cos - y * sin, x * sin + y * cos] };
            Target { channel, factors: factors.map(|factor| factor as f32) }
        };
        let targets = channels.into_iter().map(count).collect();
        Self { joints, targets }
    }

    /// What there is of it.
    pub fn motions(&self) -> impl Iterator<Item = Motion> {
        let sums = (0..self.targets.len().min(SUMS)).map(Motion::Targets);
        self.joints.iter().map(|_| Motion::Joints).chain(sums)
    }

    /// Three numbers of a vertex.
    pub fn read(&self, mesh: &Mesh, vertex: usize, motion: Motion) -> [f32; 3] {
        let sum = match (motion, &self.joints) {
            (Motion::Joints, Some(Joints { channel, centroids })) => {
                let influences = || influences(&mesh.channels[*channel], vertex);
                let total: f32 = influences().map(|(_, weight)| weight).sum();
                let sum: Vec3 = influences().map(|(joint, weight)| centroids[joint] * weight).sum();
                if total > 0.0 { sum / total } else { Vec3::ZERO }
            }
            (Motion::Joints, None) => Vec3::ZERO,
            (Motion::Targets(sum), _) => {
                let displaced =
                    |target: &Target| Vec3::from_slice(mesh.channels[target.channel].row(vertex)) * target.factors[sum];
                self.targets.iter().map(displaced).sum()
            }
        };
        sum.to_array()
    }
}

/// The joints that move a vertex, and their weights.
fn influences(channel: &Channel, vertex: usize) -> impl Iterator<Item = (usize, f32)> {
    let (joints, weights) = channel.row(vertex).split_at(channel.width / 2);
    let pairs = joints.iter().copied().zip(weights.iter().copied());
    let is_one =
        |&(joint, weight): &(f32, f32)| (0.0..=GREATEST_JOINT).contains(&joint) && weight > 0.0 && weight <= 1.0;
    pairs.filter(is_one).map(|(joint, weight)| (joint as usize, weight))
}

/// For each joint the mean of the vertices that it moves, by its weights, about the center of the mesh.
fn joint_centroids(mesh: &Mesh, channel: &Channel) -> Vec<Vec3> {
    let (low, high) = mesh.bounds();
    let center = low * 0.5 + high * 0.5;
    let mut sums: Vec<(DVec3, f64)> = Vec::new();
    for (vertex, &position) in mesh.positions.iter().enumerate() {
        for (joint, weight) in influences(channel, vertex) {
            if sums.len() <= joint {
                sums.resize(joint + 1, (DVec3::ZERO, 0.0));
            }
            let weight = f64::from(weight);
            sums[joint].0 += (position - center) * weight;
            sums[joint].1 += weight;
        }
    }
    let mean = |(sum, total): (DVec3, f64)| if total > 0.0 { (sum / total).as_vec3() } else { Vec3::ZERO };
    sums.into_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn channel(name: &str, kind: ChannelKind, width: usize, values: Vec<f32>) -> Channel {
        Channel { name: name.into(), kind, width, values }
    }

    fn all(mesh: &Mesh, vertex: usize) -> Vec<[f32; 3]> {
        let pose = Pose::of(mesh, |_| false);
        pose.motions().map(|motion| pose.read(mesh, vertex, motion)).collect()
    }

    /// Four vertices of a square of side 1; two joints, of which the second moves two of them.
    #[test]
    fn what_moves_with_two_joints_goes_between_them() {
        let mut mesh = shapes::plane(1, 1);
        let right: Vec<bool> = mesh.positions.iter().map(|p| p.x > mesh.positions[0].x).collect();
        let row = |&right: &bool| if right { [0.0, 1.0, 0.0, 1.0] } else { [0.0, 1.0, 2.0, 0.0] };
        let mut values: Vec<f32> = right.iter().flat_map(row).collect();
        // Weights past 1 are none, nor is what is no number.
        values[2] = 1.0;
        mesh.channels = vec![channel("JOINTS", ChannelKind::Joints, 4, values)];
        let first = mesh.positions[0];
        let size = (mesh.positions[3] - first).abs().max_element() as f32;
        let at = |vertex: usize| all(&mesh, vertex)[0];
        let of_right = right.iter().position(|&right| right).expect("one");
        assert_eq!(at(of_right)[0], 0.5 * size);
        assert_eq!(at(0)[0], -0.5 * size);
        let odd = (1..4).find(|&vertex| !right[vertex]).expect("one");
        assert_eq!(at(odd), [0.0; 3]);
        mesh.channels[0].values = [f32::NAN, 1e30, f32::NAN, 1.0].repeat(4);
        assert_eq!(all(&mesh, 0), [[0.0; 3]]);
    }

    #[test]
    fn few_targets_are_themselves_and_of_many_none_is_lost() {
        let mut mesh = shapes::plane(1, 1);
        let target = |number: usize, by: [f32; 3]| {
            channel(&format!("target_{number}"), ChannelKind::Displacement, 3, by.repeat(4))
        };
        assert_eq!(all(&mesh, 0), [[0.0; 3]; 0]);
        mesh.channels = vec![target(0, [1.0, 2.0, 3.0])];
        assert_eq!(all(&mesh, 1), [[1.0, 2.0, 3.0]]);
        mesh.channels.push(target(1, [4.0, 5.0, 6.0]));
        assert_eq!(all(&mesh, 2), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        // Of forty any one alone has its own length in both sums; no two at one place vanish, but 17 apart nearly.
        let squares = |mesh: &Mesh| all(mesh, 0).as_flattened().iter().map(|x| x * x).sum::<f32>();
        for (a, b, of_b) in
            [(0, None, 0.0), (39, None, 0.0), (0, Some(1), -1.0), (0, Some(34), -1.0), (0, Some(17), 1.0)]
        {
            let by = |number: usize| match number {
                number if number == a => [1.0, 0.0, 0.0],
                number if Some(number) == b => [of_b, 0.0, 0.0],
                _ => [0.0; 3],
            };
            mesh.channels = (0..40).map(|number| target(number, by(number))).collect();
            let found = squares(&mesh);
            if b.is_none() {
                assert!((found - 1.0).abs() < 1e-5, "{a}: {found}");
            } else {
                assert!(found > 1e-3, "{a} and {b:?}: {found}");
            }
        }
        let left_out = Pose::of(&mesh, |channel| channel.name != "target_7");
        assert_eq!(left_out.motions().count(), 1);
    }
}
