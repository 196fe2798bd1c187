//! Gradients of attributes, their sums, and the cost of pairs with them.

use coarsen::Result;
use coarsen::backend::{Device, Queue};
use coarsen::kernel::attribute_costs::{AttributeCosts, WedgeBuffers};
use coarsen::kernel::attribute_sums::AttributeSums;
use coarsen::kernel::face_gradients::FaceGradients;
use coarsen::kernel::rows::{AttributeSum, CORNER, Face, SEAM, Slope};
use coarsen::kernel::volume_costs::BORDER_FACTOR;

use super::inputs::{Random, Round, flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 3] = [
    Trial { name: "face_gradients", run: face_gradients },
    Trial { name: "attribute_sums", run: attribute_sums },
    Trial { name: "attribute_costs", run: attribute_costs },
];

/// How many numbers a wedge has: of small rounds also the most, for the bindings of small pages are few.
fn costed_of(round: &Round) -> &'static [usize] {
    if round.faces.len() < 500 { &[2, 16] } else { &[2] }
}

/// The wedges of a round.
struct Wedges {
    corners: Vec<Face>,
    starts: Vec<u32>,
    values: Vec<f32>,
    costed: usize,
}

/// One wedge at most vertices, and two at every fifth: of the first faces of its ring, and of the others.
fn wedges(round: &Round, costed: usize) -> Wedges {
    let mut corners = vec![[0; 3]; round.faces.len()];
    let mut starts = vec![0];
    for vertex in 0..round.positions.len() as u32 {
        let ring = &round.ring_faces
            [round.ring_starts[vertex as usize] as usize..round.ring_starts[vertex as usize + 1] as usize];
        let first = *starts.last().expect("the first start");
        let halves = if vertex % 5 == 0 && ring.len() > 2 { 2 } else { 1 };
        for (i, &f) in ring.iter().enumerate() {
            let face = round.faces[f as usize].corners();
            let corner = face.iter().position(|&v| v == vertex).expect("a face of the ring");
            corners[f as usize][corner] = first + u32::from(halves == 2 && 2 * i >= ring.len());
        }
        starts.push(first + halves);
    }
    let count = *starts.last().expect("the last start") as usize;
    let mut random = Random::new();
    // Of any size, but for one, where a bit of one of them shows.
    let scales = if costed == 2 { [1.0; 6] } else { [1.0, 1.0, 1.0, 0.0, 1e-30, 1e9] };
    let values = (0..count * costed).map(|_| random.centered() * scales[random.below(6) as usize]).collect();
    let corners = corners.into_iter().map(|[a, b, c]| Face { a, b, c }).collect();
    Wedges { corners, starts, values, costed }
}

/// Sums of faces or wedges, and the slopes of each.
type Sums = (Vec<AttributeSum>, Vec<Slope>);

fn gradients(queue: &mut Queue, round: &Round, wedges: &Wedges, seen: &mut Seen) -> Result<Sums> {
    let sums = &mut queue.buffer(round.faces.len())?;
    let gradients = &mut queue.buffer(round.faces.len() * wedges.costed)?;
    let kernel = FaceGradients {
        positions: &queue.buffer_from(round.positions.clone())?,
        faces: &queue.buffer_from(round.faces.clone())?,
        normals: &queue.buffer_from(round.normals.clone())?,
        corners: &queue.buffer_from(wedges.corners.clone())?,
        values: &queue.buffer_from(wedges.values.clone())?,
        face_count: round.faces.len() as u32,
        costed: wedges.costed as u32,
        sums,
        gradients,
    };
    seen.run(queue, kernel)?;
    seen.output(queue, "sums", sums)?;
    seen.output(queue, "gradients", gradients)?;
    Ok((sums.host().to_vec(), gradients.host().to_vec()))
}

fn face_gradients(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        for &costed in costed_of(round) {
            let mut wedges = wedges(round, costed);
            flip(&mut wedges.values[wedges.corners[0].a as usize * costed], perturbed);
            gradients(queue, round, &wedges, seen)?;
        }
    }
    Ok(())
}

fn summed(queue: &mut Queue, round: &Round, wedges: &Wedges, rows: Sums, seen: &mut Seen) -> Result<Sums> {
    let count = wedges.values.len() / wedges.costed;
    let (sums, slopes) = (&mut queue.buffer(count)?, &mut queue.buffer(count * wedges.costed)?);
    let kernel = AttributeSums {
        positions: &queue.buffer_from(round.positions.clone())?,
        faces: &queue.buffer_from(round.faces.clone())?,
        ring_starts: &queue.buffer_from(round.ring_starts.clone())?,
        ring_faces: &queue.buffer_from(round.ring_faces.clone())?,
        corners: &queue.buffer_from(wedges.corners.clone())?,
        wedge_starts: &queue.buffer_from(wedges.starts.clone())?,
        values: &queue.buffer_from(wedges.values.clone())?,
        face_sums: &queue.buffer_from(rows.0)?,
        gradients: &queue.buffer_from(rows.1)?,
        vertex_count: round.positions.len() as u32,
        costed: wedges.costed as u32,
        sums,
        slopes,
    };
    seen.run(queue, kernel)?;
    seen.output(queue, "sums", sums)?;
    seen.output(queue, "slopes", slopes)?;
    Ok((sums.host().to_vec(), slopes.host().to_vec()))
}

fn attribute_sums(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        for &costed in costed_of(round) {
            let wedges = wedges(round, costed);
            let mut rows = gradients(&mut Device::cpu(1)?.cpu_queue(), round, &wedges, &mut Seen::default())?;
            flip(&mut rows.1[0].x, perturbed);
            summed(queue, round, &wedges, rows, seen)?;
        }
    }
    Ok(())
}

fn attribute_costs(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        for &costed in costed_of(round) {
            let wedges = wedges(round, costed);
            let mut host = Device::cpu(1)?.cpu_queue();
            let rows = gradients(&mut host, round, &wedges, &mut Seen::default())?;
            let (sums, mut slopes) = summed(&mut host, round, &wedges, rows, &mut Seen::default())?;
            let pair = round.pairs[0].half_edge as usize;
            let wedge = wedges.corners[pair / 3].corners()[pair % 3] as usize;
            flip(&mut slopes[wedge * costed].at, perturbed);
            let mut positions = round.positions.clone();
            let on_seam = wedges.starts.windows(2).map(|ends| ends[1] - ends[0] == 2);
            for (vertex, (position, on_seam)) in positions.iter_mut().zip(on_seam).enumerate() {
                let corner = if vertex.is_multiple_of(3) { CORNER } else { 0 };
                position.flags |= if on_seam { SEAM | corner } else { 0 };
            }
            let buffers = WedgeBuffers {
                corners: &queue.buffer_from(wedges.corners)?,
                wedge_sums: &queue.buffer_from(sums)?,
                slopes: &queue.buffer_from(slopes)?,
                costed,
            };
            let (positions, faces) = (&queue.buffer_from(positions)?, &queue.buffer_from(round.faces.clone())?);
            let normals = &queue.buffer_from(round.normals.clone())?;
            let sums = &queue.buffer_from(round.volume_sums.clone())?;
            let borders = &queue.buffer_from(round.border_sums.clone())?;
            let pairs = &queue.buffer_from(round.pairs.clone())?;
            for placement in 0..4 {
                let keys = &mut queue.buffer(round.pairs.len())?;
                let WedgeBuffers { corners, wedge_sums, slopes, costed } = buffers;
                let kernel = AttributeCosts {
                    positions,
                    faces,
                    normals,
                    sums,
                    borders,
                    corners,
                    wedge_sums,
                    slopes,
                    pairs,
                    pair_count: round.pairs.len() as u32,
                    border_weight: BORDER_FACTOR,
                    placement,
                    costed: costed as u32,
                    keys,
                };
                seen.run(queue, kernel)?;
                seen.output(queue, "keys", keys)?;
            }
        }
    }
    Ok(())
}
