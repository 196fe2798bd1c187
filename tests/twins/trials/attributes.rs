//! Gradients of attributes, and how far they spread.

use coarsen::Result;
use coarsen::backend::{Device, Queue};
use coarsen::kernel::attribute_spreads::AttributeSpreads;
use coarsen::kernel::gradient_operators::GradientOperators;
use coarsen::kernel::rows::{Face, GradientOperator, Normal};

use super::inputs::{Random, Round, flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 2] = [
    Trial { name: "gradient_operators", run: gradient_operators },
    Trial { name: "attribute_spreads", run: attribute_spreads },
];

/// How many numbers a wedge has: of small rounds also the most, for the bindings of small pages are few.
fn costed_of(round: &Round) -> &'static [usize] {
    if round.faces.len() < 500 { &[2, 7, 16] } else { &[2] }
}

/// The wedges of a round.
struct Wedges {
    corners: Vec<Face>,
    starts: Vec<u32>,
    values: Vec<f32>,
    width: usize,
}

/// The wedges of the corners of vertices, in turn: two halves of the ring, one for every face, one for the first face and one
/// for the others, and one for all, twice.
fn wedges(round: &Round, costed: usize) -> Wedges {
    let mut corners = vec![[0; 3]; round.faces.len()];
    let mut starts = vec![0];
    for vertex in 0..round.positions.len() as u32 {
        let ring = &round.ring_faces
            [round.ring_starts[vertex as usize] as usize..round.ring_starts[vertex as usize + 1] as usize];
        let first = *starts.last().expect("the first start");
        let part = |i: usize| match vertex % 5 {
            0 => usize::from(2 * i >= ring.len()),
            1 => i,
            2 => usize::from(i > 0),
            _ => 0,
        };
        for (i, &f) in ring.iter().enumerate() {
            let face = round.faces[f as usize].corners();
            let corner = face.iter().position(|&v| v == vertex).expect("a face of the ring");
            corners[f as usize][corner] = first + part(i) as u32;
        }
        starts.push(first + 1 + ring.len().checked_sub(1).map_or(0, part) as u32);
    }
    let count = *starts.last().expect("the last start") as usize;
    let mut random = Random::new();
    // Of any size, but for one, where a bit of one of them shows.
    let scales = if costed == 2 { [1.0; 6] } else { [1.0, 1.0, 1.0, 0.0, 1e-30, 1e9] };
    // More than those that decide.
    let width = costed + 1;
    let values = (0..count * width).map(|_| random.centered() * scales[random.below(6) as usize]).collect();
    let corners = corners.into_iter().map(|[a, b, c]| Face { a, b, c }).collect();
    Wedges { corners, starts, values, width }
}

fn operators(queue: &mut Queue, round: &Round, normals: &[Normal], seen: &mut Seen) -> Result<Vec<GradientOperator>> {
    let operators = &mut queue.buffer(round.faces.len())?;
    let kernel = GradientOperators {
        positions: &queue.buffer_from(round.positions.clone())?,
        faces: &queue.buffer_from(round.faces.clone())?,
        normals: &queue.buffer_from(normals.to_vec())?,
        face_count: round.faces.len() as u32,
        operators,
    };
    seen.run(queue, kernel)?;
    seen.output(queue, "operators", operators)?;
    Ok(operators.host().to_vec())
}

fn gradient_operators(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut normals = round.normals.clone();
        flip(&mut normals[0].x, perturbed);
        operators(queue, round, &normals, seen)?;
    }
    Ok(())
}

fn attribute_spreads(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut host = Device::cpu(1)?.cpu_queue();
        let operators = operators(&mut host, round, &round.normals, &mut Seen::default())?;
        for &costed in costed_of(round) {
            let mut wedges = wedges(round, costed);
            // That of a vertex with one for all of its faces.
            flip(&mut wedges.values[wedges.starts[3] as usize * wedges.width], perturbed);
            let sums = &mut queue.buffer_from(round.volume_sums.clone())?;
            let kernel = AttributeSpreads {
                ring_starts: &queue.buffer_from(round.ring_starts.clone())?,
                ring_faces: &queue.buffer_from(round.ring_faces.clone())?,
                corners: &queue.buffer_from(wedges.corners)?,
                wedge_starts: &queue.buffer_from(wedges.starts)?,
                values: &queue.buffer_from(wedges.values)?,
                operators: &queue.buffer_from(operators.clone())?,
                vertex_count: round.positions.len() as u32,
                width: wedges.width as u32,
                costed: costed as u32,
                sums,
            };
            seen.run(queue, kernel)?;
            seen.output(queue, "sums", sums)?;
        }
    }
    Ok(())
}
