//! What [Wu12] and [GH97] promise of quadrics and of single contractions, and what rounds add: that a round is its
//! contractions one by one, in any order.

mod support;

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use coarsen::backend::Device;
use coarsen::contract::{Metric, Options, Placement, PlaneWeight};
use coarsen::kernel::contract_quadrics::contracted;
use coarsen::kernel::pairs::{half_edge_corners, pairs_at};
use coarsen::kernel::plane_costs::PlaneCosts;
use coarsen::kernel::rows::{Face, PlaneQuadric, Position};
use coarsen::kernel::stars::Stars;
use coarsen::math::{DMat3, DVec3, Vec3};
use coarsen::mesh::adjacency::Rings;
use coarsen::mesh::{sample, shapes};
use coarsen::progressive::Contraction;
use coarsen::simplify::MOVED;
use coarsen::{Budget, Mesh, Method, StopReason, simplify};
use support::deviation::Random;
use support::engine::{METRICS, contract, cpu, plane_quadrics};
use support::independent::topology;

/// Least cosine between a face's normals before and after a contraction, less what single precision adds.
const LEAST_COS: f64 = 0.2 - 1e-3;

/// A closed mesh without a border, of edges about as long as a unit.
fn closed() -> Mesh {
    let mesh = sample("statue", Some(3000)).expect("a sample");
    assert_eq!(topology(&mesh).border_edges, 0);
    let edge = (2.0 * mesh.area() / mesh.faces.len() as f64).sqrt();
    Mesh { positions: mesh.positions.iter().map(|p| p / edge).collect(), ..mesh }
}

/// A mesh in the rows of the kernels.
struct Rows {
    positions: Vec<Position>,
    faces: Vec<Face>,
    rings: Rings,
}

impl Rows {
    fn new(mesh: &Mesh) -> Self {
        let row = |p: &DVec3| Position { x: p.x as f32, y: p.y as f32, z: p.z as f32, flags: 0 };
        Self {
            positions: mesh.positions.iter().map(row).collect(),
            faces: mesh.faces.iter().map(|&[a, b, c]| Face { a, b, c }).collect(),
            rings: Rings::new(&mesh.faces, mesh.positions.len()),
        }
    }

    /// The quadric of every vertex.
    fn quadrics(&self) -> Vec<PlaneQuadric> {
        let mut queue = Device::cpu(1).expect("a thread").cpu_queue();
        let positions = queue.buffer_from(self.positions.clone()).expect("host memory");
        let faces = queue.buffer_from(self.faces.clone()).expect("host memory");
        let ring_starts = queue.buffer_from(self.rings.starts.clone()).expect("host memory");
        let ring_faces = queue.buffer_from(self.rings.faces.clone()).expect("host memory");
        let (rings, surface) = ([&ring_starts, &ring_faces], (&positions, &faces));
        let (_, quadrics) = plane_quadrics(&mut queue, rings, surface, self.positions.len() as u32, PlaneWeight::Area);
        quadrics.host().to_vec()
    }

    /// The cost of every pair, by its ends.
    fn costs(&self) -> BTreeMap<[u32; 2], f32> {
        let Self { positions, faces, rings } = self;
        let stars = Stars { positions, faces, ring_starts: &rings.starts, ring_faces: &rings.faces };
        let mut pairs = Vec::new();
        (0..positions.len() as u32).for_each(|v| pairs_at(v, &stars, |pair| pairs.push(pair)));
        let mut queue = Device::cpu(1).expect("a thread").cpu_queue();
        let ends = pairs.iter().map(|pair| half_edge_corners(pair.half_edge, faces));
        let ends: Vec<[u32; 2]> = ends.map(|[u, w, _]| [u.min(w), u.max(w)]).collect();
        let pair_count = pairs.len() as u32;
        let quadrics = queue.buffer_from(self.quadrics()).expect("host memory");
        let positions = queue.buffer_from(positions.clone()).expect("host memory");
        let faces = queue.buffer_from(faces.clone()).expect("host memory");
        let pairs = queue.buffer_from(pairs).expect("host memory");
        let mut keys = queue.buffer(pairs.len()).expect("host memory");
        let costs = PlaneCosts {
            positions: &positions,
            faces: &faces,
            quadrics: &quadrics,
            pairs: &pairs,
            pair_count,
            placement: 0,
            keys: &mut keys,
        };
        queue.run(costs).expect("runs on the host");
        ends.into_iter().zip(keys.host().iter().map(|&key| f32::from_bits(key))).collect()
    }
}

fn matrix(q: &PlaneQuadric) -> DMat3 {
    let [xx, xy, xz, yy, yz, zz] = [q.xx, q.xy, q.xz, q.yy, q.yz, q.zz].map(f64::from);
    DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz))
}

/// The value of a quadric that stands at `origin`.
fn value(q: &PlaneQuadric, origin: Vec3, x: DVec3) -> f64 {
    let y = x - origin.as_dvec3();
    let b = DVec3::from_array([q.bx, q.by, q.bz].map(f64::from));
    y.dot(matrix(q) * y) + 2.0 * b.dot(y) + f64::from(q.c)
}

fn anywhere(random: &mut Random) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| 4.0 * random.unit() - 2.0))
}

#[test]
fn a_quadric_is_the_squared_distances_to_the_planes_and_zero_at_its_vertex() {
    let mesh = closed();
    let rows = Rows::new(&mesh);
    let mut random = Random(1);
    for (v, q) in rows.quadrics().iter().enumerate() {
        assert_eq!([q.bx, q.by, q.bz, q.c], [0.0; 4], "vertex {v}");
        let p = rows.positions[v].xyz();
        let x = p.as_dvec3() + anywhere(&mut random);
        let around = mesh.faces.iter().filter(|face| face.contains(&(v as u32)));
        let expected: f64 = around
            .map(|face| {
                let [a, b, c] = face.map(|corner| rows.positions[corner as usize].xyz().as_dvec3());
                let n = (b - a).cross(c - a);
                0.5 * n.length() * n.normalize().dot(x - a).powi(2)
            })
            .sum();
        let found = value(q, p, x);
        assert!((found - expected).abs() <= 1e-5 * (1.0 + expected), "vertex {v}: {found} for {expected}");
    }
}

#[test]
fn quadrics_have_no_negative_direction() {
    let rows = Rows::new(&closed());
    let mut random = Random(2);
    for q in rows.quadrics() {
        let a = matrix(&q);
        let trace = a.x_axis.x + a.y_axis.y + a.z_axis.z;
        assert!(trace > 0.0 && q.weight > 0.0, "{q:?}");
        // Of planes with unit normals the trace is the weight.
        assert!((trace / f64::from(q.weight) - 1.0).abs() < 1e-5, "{q:?}");
        for _ in 0..20 {
            let d = anywhere(&mut random).normalize();
            assert!(d.dot(a * d) >= -1e-6 * trace, "{q:?} along {d}");
        }
    }
}

#[test]
fn the_sum_of_two_is_no_less_than_either() {
    let rows = Rows::new(&closed());
    let quadrics = rows.quadrics();
    let mut random = Random(3);
    for [u, w] in rows.costs().into_keys() {
        let [pu, pw] = [u, w].map(|v| rows.positions[v as usize].xyz());
        let at = pu.lerp(pw, random.unit() as f32);
        let [qu, qw] = [u, w].map(|v| quadrics[v as usize]);
        let sum = contracted(qu, qw, pu, pw, at);
        let x = at.as_dvec3() + anywhere(&mut random);
        let [first, second, both] = [value(&qu, pu, x), value(&qw, pw, x), value(&sum, at, x)];
        assert!(both >= first.max(second) - 1e-5 * both, "{u}, {w}: {first} and {second} make {both}");
        assert!((both - first - second).abs() <= 1e-5 * both, "{u}, {w}: {first} and {second} make {both}");
    }
}

#[test]
fn costs_on_a_plane_are_zero() {
    let flat = shapes::plane(12, 9);
    for metric in METRICS {
        let options = Options { metric, ..Options::default() };
        let outcome = contract(&flat, &options, Budget::faces(20));
        assert_eq!(outcome.stop, StopReason::FacesReached);
        assert!(outcome.mesh.positions.iter().all(|p| p.z.to_bits() == flat.positions[0].z.to_bits()));
        let greatest = outcome.rounds.iter().map(|round| round.greatest_cost).fold(0.0, f32::max);
        assert!(greatest < 1e-9, "{metric:?}: {greatest}");
    }
    let inside = |&[u, w]: &[u32; 2]| {
        let on_rim = |v: u32| [0, 12].contains(&(v % 13)) || [0, 9].contains(&(v / 13));
        !on_rim(u) && !on_rim(w)
    };
    let costs = Rows::new(&flat).costs();
    assert!(costs.iter().filter(|(pair, _)| inside(pair)).all(|(_, &cost)| cost == 0.0));
}

#[test]
fn costs_do_not_depend_on_where_the_mesh_looks() {
    let mesh = closed();
    let costs = Rows::new(&mesh).costs();
    let typical = costs.values().sum::<f32>() / costs.len() as f32;
    let quarter = DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z);
    let askew = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    for turn in [quarter, askew] {
        let turned = Mesh { positions: mesh.positions.iter().map(|&p| turn * p).collect(), ..mesh.clone() };
        let others = Rows::new(&turned).costs();
        assert_eq!(costs.len(), others.len());
        for (pair, &cost) in &costs {
            let other = others[pair];
            assert!((cost - other).abs() <= 2e-3 * cost + 1e-4 * typical, "{pair:?}: {cost} and {other}");
        }
    }
}

#[test]
fn candidates_without_a_distance_are_the_edges() {
    let mesh = closed();
    for metric in METRICS {
        let options = Options { metric, ..Options::default() };
        let outcome = contract(&mesh, &options, Budget::keep(0.9));
        assert_eq!(outcome.rounds[0].pairs, topology(&mesh).edges as u64);
    }
    assert_eq!(Rows::new(&mesh).costs().len(), topology(&mesh).edges);
}

/// A mesh that is contracted by the definition: by renaming, in faces that keep their numbers.
#[derive(Clone)]
struct Plain {
    positions: Vec<DVec3>,
    faces: Vec<Option<[u32; 3]>>,
}

impl Plain {
    fn new(mesh: &Mesh) -> Self {
        Self { positions: mesh.positions.clone(), faces: mesh.faces.iter().copied().map(Some).collect() }
    }

    /// Contracts; returns the faces that vanish and those that change, with their corners before.
    fn contract(&mut self, contraction: &Contraction) -> (usize, Vec<([DVec3; 3], usize)>) {
        let Contraction { keep, gone, position } = *contraction;
        let (mut vanished, mut changed) = (0, Vec::new());
        for (f, slot) in self.faces.iter_mut().enumerate() {
            let Some(face) = slot else { continue };
            let before = face.map(|v| self.positions[v as usize]);
            match (face.contains(&keep), face.contains(&gone)) {
                (true, true) => {
                    *slot = None;
                    vanished += 1;
                }
                (false, false) => {}
                _ => {
                    *face = face.map(|v| if v == gone { keep } else { v });
                    changed.push((before, f));
                }
            }
        }
        self.positions[keep as usize] = position;
        (vanished, changed)
    }

    /// The live faces by the bits of their corners, from the least corner on, sorted.
    fn faces(&self) -> Vec<[[u64; 3]; 3]> {
        let bits = |v: u32| self.positions[v as usize].to_array().map(f64::to_bits);
        let mut faces: Vec<_> = self.faces.iter().flatten().map(|face| first_least(face.map(bits))).collect();
        faces.sort_unstable();
        faces
    }

    fn mesh(&self) -> Mesh {
        Mesh::new(self.positions.clone(), self.faces.iter().flatten().copied().collect())
    }
}

fn first_least<T: Ord + Copy>([a, b, c]: [T; 3]) -> [T; 3] {
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().expect("three of them")
}

#[test]
fn a_round_is_its_contractions_in_any_order() {
    let mesh = closed();
    for metric in METRICS {
        let options = Options { metric, log: true, ..Options::default() };
        let mut stop = |_| ControlFlow::Break(());
        let method = Method::Contract(options);
        let outcome = simplify(&mesh, &method, &Budget::faces(100), &cpu(2), Some(&mut stop)).expect("a good mesh");
        let log = outcome.log.as_ref().expect("asked for");
        let contractions = log.contractions();
        assert_eq!((outcome.rounds.len(), outcome.rounds[0].contracted as usize), (1, contractions.len()));
        assert!(contractions.len() > 100);
        let expected = Plain::new(&outcome.mesh).faces();
        let mut orders = vec![contractions.to_vec(); 3];
        orders[1].reverse();
        let mut random = Random(4);
        for i in (1..contractions.len()).rev() {
            orders[2].swap(i, random.bits() as usize % (i + 1));
        }
        for order in orders {
            let mut plain = Plain::new(&mesh);
            order.iter().for_each(|contraction| drop(plain.contract(contraction)));
            assert!(plain.faces() == expected, "{metric:?}");
        }
    }
}

#[test]
fn every_contraction_removes_two_faces_or_one_and_turns_none_over() {
    let open = sample("terrain", Some(2000)).expect("a sample");
    for (name, mesh, least) in [("closed", closed(), 2), ("open", open, 1)] {
        for metric in METRICS {
            for placement in [Placement::Optimal, Placement::Endpoint] {
                let name = format!("{name} {metric:?} {placement:?}");
                let options = Options { metric, placement, log: true, ..Options::default() };
                let outcome = contract(&mesh, &options, Budget::keep(0.1));
                let log = outcome.log.expect("asked for");
                let mut plain = Plain::new(&mesh);
                let mut fewest = 2;
                for (step, contraction) in log.contractions().iter().enumerate() {
                    let (vanished, changed) = plain.contract(contraction);
                    assert!((least..=2).contains(&vanished), "{name}: step {step} removes {vanished} faces");
                    fewest = fewest.min(vanished);
                    for (before, f) in changed {
                        let after = plain.faces[f].expect("it changed").map(|v| plain.positions[v as usize]);
                        let [was, is] = [before, after].map(|[a, b, c]| (b - a).cross(c - a));
                        let cos = was.dot(is) / (was.length() * is.length());
                        assert!(cos >= LEAST_COS, "{name}: step {step} turns face {f}, cosine {cos}");
                    }
                    if step % 50 == 0 {
                        let found = topology(&plain.mesh());
                        assert_eq!((found.non_manifold_edges, found.bow_ties), (0, 0), "{name}: step {step}");
                    }
                }
                assert_eq!(fewest, least, "{name}: on a border one face goes");
                assert!(plain.faces() == Plain::new(&outcome.mesh).faces(), "{name}: the result");
            }
        }
    }
}

#[test]
fn half_edges_leave_input_positions_to_the_bit() {
    let mesh = closed();
    for metric in METRICS {
        let options = Options { metric, placement: Placement::Endpoint, ..Options::default() };
        let outcome = contract(&mesh, &options, Budget::keep(0.1));
        for (p, &origin) in outcome.mesh.positions.iter().zip(&outcome.vertex_origin) {
            let bits = |p: DVec3| p.to_array().map(f64::to_bits);
            assert_eq!(bits(*p), bits(mesh.positions[origin as usize]), "{metric:?}");
        }
    }
    let optimal = contract(&mesh, &Options { metric: Metric::Plane, ..Options::default() }, Budget::keep(0.1));
    assert!(optimal.vertex_origin.contains(&MOVED));
}
