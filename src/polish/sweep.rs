//! Sweeps over the edges of a result.

use rayon::prelude::*;

use crate::backend::Queue;
use crate::error::Result;
use crate::kernel::flip_gains::FlipGains;
use crate::kernel::pairs::{half_edge_corners, pairs_at};
use crate::kernel::rows::{BORDER, Edge, Face, LOCKED, Position, with_hub};
use crate::kernel::stars::{Stars, spoke};
use crate::math::Vec2;
use crate::math::tie_hash;
use crate::mesh::fan::{Fan, fans};
use crate::mesh::frame::Frame;
use crate::mesh::weld::lowest_at_position;
use crate::mesh::{Mesh, Rings};

use super::samples::Samples;
use super::seams::Seams;
use super::{Flips, Objective};

/// Vertices that a thread lists the edges of at a time.
const ROWS: usize = 1 << 12;

/// An edge that gains.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    gain: f32,
    edge: Edge,
}

/// Faces, the texture at their corners, and how many edges were turned.
type Turned = (Vec<[u32; 3]>, Option<Vec<[Vec2; 3]>>, usize);

/// Turns edges in sweeps on the device of `queue`; returns the faces, their texture, and how many edges were
/// turned.
pub fn run(mut queue: Queue, original: &Mesh, result: &Mesh, flips: Flips) -> Result<Turned> {
    let frame = Frame::new(&result.faces, |v| result.positions[v as usize], result.bounds());
    let mut faces = result.faces.clone();
    let mut rings = Rings::new(&faces, result.positions.len());
    let row = |(vertex, fan): (usize, Fan)| {
        let flags = match fan {
            Fan::Closed => 0,
            Fan::Open => BORDER,
            Fan::Complex => LOCKED,
        };
        Position::new(frame.to_rows(result.positions[vertex]), flags)
    };
    let mut positions: Vec<Position> = fans(&faces, &rings).into_iter().enumerate().map(row).collect();
    let mut samples = match flips.objective {
        Objective::Distance => Samples::new(original, result, frame),
        Objective::Bend | Objective::Shape => Samples::default(),
    };
    let mut seams = Seams::new(result, &rings);
    // Vertices of one place are one, whatever else they carry.
    let place = lowest_at_position(&result.positions);
    let repeats = (0..).zip(&place).any(|(vertex, &lowest)| vertex != lowest);
    let mut turned = 0;
    for sweep in 0..flips.sweeps {
        for (position, ends) in positions.iter_mut().zip(rings.starts.windows(2)) {
            position.flags = with_hub(position.flags, ends[1] - ends[0]);
        }
        let (starts, rows, order) = samples.by_face(faces.len());
        let live = Live { positions: &positions, faces: bytemuck::cast_slice(&faces), rings: &rings };
        let mut candidates = candidates(&mut queue, live, (&starts, rows), flips.objective)?;
        // No gain is negative, so that its bits order as it does.
        let order_of = |c: &Candidate| (!c.gain.to_bits(), tie_hash(c.edge.half_edge, sweep));
        candidates.par_sort_unstable_by_key(order_of);
        let joined = repeats.then(|| Joined::new(&faces, &place));
        let mut used = vec![false; positions.len()];
        let before = turned;
        for Candidate { edge, .. } in candidates {
            let [u, v, k, l] = diamond(edge, &faces);
            let sides = [edge.half_edge / 3, edge.across];
            let places = [u, v, k, l].map(|corner| place[corner as usize]);
            let is_used = places.iter().any(|&place| used[place as usize]);
            let is_known = || joined.as_ref().is_some_and(|joined| joined.has_edge([places[2], places[3]]));
            if is_used || is_known() || !seams.allow([u, v, k, l], sides, &faces) {
                continue;
            }
            places.iter().for_each(|&place| used[place as usize] = true);
            let new = [(edge.half_edge / 3, [u, l, k]), (edge.across, [l, v, k])];
            let own = new
                .iter()
                .flat_map(|(face, _)| &order[starts[*face as usize] as usize..starts[*face as usize + 1] as usize]);
            samples.follow(own, new, &positions);
            seams.turn([u, v, k, l], sides, &faces);
            new.into_iter().for_each(|(face, corners)| faces[face as usize] = corners);
            turned += 1;
        }
        if turned == before {
            break;
        }
        rings = Rings::new(&faces, positions.len());
    }
    Ok((faces, seams.texcoords, turned))
}

/// The faces as a sweep began, by the places of their corners.
struct Joined {
    faces: Vec<[u32; 3]>,
    rings: Rings,
}

impl Joined {
    fn new(faces: &[[u32; 3]], place: &[u32]) -> Self {
        let faces: Vec<_> = faces.iter().map(|face| face.map(|v| place[v as usize])).collect();
        Self { rings: Rings::new(&faces, place.len()), faces }
    }

    /// Whether there is an edge between two places.
    fn has_edge(&self, [a, b]: [u32; 2]) -> bool {
        a == b || self.rings.faces_of_edge(&self.faces, a, b).next().is_some()
    }
}

/// A result between sweeps.
#[derive(Clone, Copy)]
struct Live<'a> {
    positions: &'a [Position],
    faces: &'a [Face],
    rings: &'a Rings,
}

/// The edges that gain.
fn candidates(
    queue: &mut Queue,
    live: Live<'_>,
    (sample_starts, samples): (&[u32], Vec<[f32; 4]>),
    objective: Objective,
) -> Result<Vec<Candidate>> {
    let Live { positions, faces, rings } = live;
    let stars = Stars { positions, faces, ring_starts: &rings.starts, ring_faces: &rings.faces };
    let edges_at = |vertex: u32| {
        let mut edges = Vec::new();
        pairs_at(vertex, &stars, |edge| edges.push(edge));
        edges
    };
    let pairs: Vec<Edge> =
        (0..positions.len() as u32).into_par_iter().with_min_len(ROWS).flat_map_iter(edges_at).collect();
    let mut gains = queue.buffer(pairs.len())?;
    let pair_count = pairs.len() as u32;
    let (positions, faces) = (&queue.buffer_from(positions.to_vec())?, &queue.buffer_from(faces.to_vec())?);
    let ring_starts = &queue.buffer_from(rings.starts.clone())?;
    let ring_faces = &queue.buffer_from(rings.faces.clone())?;
    let sample_starts = &queue.buffer_from(sample_starts.to_vec())?;
    let samples = &queue.buffer_from(samples)?;
    let edges = &queue.buffer_from(pairs.clone())?;
    queue.run(FlipGains {
        positions,
        faces,
        ring_starts,
        ring_faces,
        pairs: edges,
        pair_count,
        sample_starts,
        samples,
        objective: objective.code(),
        gains: &mut gains,
    })?;
    let rows = queue.rows(&gains)?;
    let gaining = rows.iter().zip(pairs).filter(|(gain, _)| **gain > 0.0);
    Ok(gaining.map(|(&gain, edge)| Candidate { gain, edge }).collect())
}

/// The ends of an edge and the corners across.
fn diamond(edge: Edge, faces: &[[u32; 3]]) -> [u32; 4] {
    let faces: &[Face] = bytemuck::cast_slice(faces);
    let [u, v, k] = half_edge_corners(edge.half_edge, faces);
    [u, v, k, spoke(faces[edge.across as usize], u).next]
}
