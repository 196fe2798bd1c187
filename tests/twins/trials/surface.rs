//! A round's contractions applied to the surface.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::compact_faces::CompactFaces;
use coarsen::kernel::compact_quadrics::CompactQuadrics;
use coarsen::kernel::compact_rings::CompactRings;
use coarsen::kernel::compact_vertices::CompactVertices;
use coarsen::kernel::contract_faces::ContractFaces;
use coarsen::kernel::contract_quadrics::ContractQuadrics;
use coarsen::kernel::contract_vertices::{ContractVertices, KEEPS};
use coarsen::kernel::live_vertices::LiveVertices;

use super::inputs::{flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 8] = [
    Trial { name: "contract_vertices", run: contract_vertices },
    Trial { name: "contract_quadrics", run: contract_quadrics },
    Trial { name: "contract_faces", run: contract_faces },
    Trial { name: "live_vertices", run: live_vertices },
    Trial { name: "compact_vertices", run: compact_vertices },
    Trial { name: "compact_rings", run: compact_rings },
    Trial { name: "compact_faces", run: compact_faces },
    Trial { name: "compact_quadrics", run: compact_quadrics },
];

fn contract_vertices(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut contractions = round.contractions.clone();
        flip(&mut contractions[0].x, perturbed);
        let contraction_count = contractions.len() as u32;
        let contractions = &queue.buffer_from(contractions)?;
        let positions = &mut queue.buffer_from(round.positions.clone())?;
        let roles = &mut queue.buffer(round.roles.len())?;
        seen.run(queue, ContractVertices { contractions, contraction_count, positions, roles })?;
        seen.output(queue, "positions", positions)?;
        seen.output(queue, "roles", roles)?;
    }
    Ok(())
}

fn contract_quadrics(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut quadrics = round.quadrics.clone();
        flip(&mut quadrics[round.contractions[0].gone as usize].c, perturbed);
        let contraction_count = round.contractions.len() as u32;
        let contractions = &queue.buffer_from(round.contractions.clone())?;
        let positions = &queue.buffer_from(round.positions.clone())?;
        let quadrics = &mut queue.buffer_from(quadrics)?;
        seen.run(queue, ContractQuadrics { contractions, contraction_count, positions, quadrics })?;
        seen.output(queue, "quadrics", quadrics)?;
    }
    Ok(())
}

fn contract_faces(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut roles = round.roles.clone();
        roles[round.contractions[0].gone as usize] ^= u32::from(perturbed);
        let roles = &queue.buffer_from(roles)?;
        let face_count = round.faces.len() as u32;
        let faces = &mut queue.buffer_from(round.faces.clone())?;
        let live = &mut queue.buffer(round.faces.len() + 1)?;
        seen.run(queue, ContractFaces { roles, faces, face_count, live })?;
        seen.output(queue, "faces", faces)?;
        seen.output(queue, "live", live)?;
    }
    Ok(())
}

fn live_vertices(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut face_live = round.face_live.clone();
        face_live[0] ^= u32::from(perturbed);
        let roles = &queue.buffer_from(round.roles.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let face_live = &queue.buffer_from(face_live)?;
        let vertex_count = round.positions.len() as u32;
        let live = &mut queue.buffer(round.positions.len() + 1)?;
        let ring_lengths = &mut queue.buffer(round.positions.len() + 1)?;
        seen.run(queue, LiveVertices { roles, ring_starts, ring_faces, face_live, vertex_count, live, ring_lengths })?;
        seen.output(queue, "live", live)?;
        seen.output(queue, "ring_lengths", ring_lengths)?;
    }
    Ok(())
}

fn compact_vertices(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut positions = round.positions.clone();
        flip(&mut positions[round.contractions[0].keep as usize].x, perturbed);
        let new_vertex = &queue.buffer_from(round.new_vertex.clone())?;
        let new_starts = &queue.buffer_from(round.new_starts.clone())?;
        let vertex_count = positions.len() as u32;
        let positions_out = &mut queue.buffer(positions.len())?;
        let starts_out = &mut queue.buffer(positions.len() + 1)?;
        let positions = &queue.buffer_from(positions)?;
        seen.run(
            queue,
            CompactVertices { new_vertex, new_starts, positions, vertex_count, positions_out, starts_out },
        )?;
        seen.output(queue, "positions_out", positions_out)?;
        seen.output(queue, "starts_out", starts_out)?;
    }
    Ok(())
}

fn compact_rings(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut roles = round.roles.clone();
        roles[round.contractions[0].keep as usize] ^= KEEPS * u32::from(perturbed);
        let roles = &queue.buffer_from(roles)?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let new_face = &queue.buffer_from(round.new_face.clone())?;
        let new_vertex = &queue.buffer_from(round.new_vertex.clone())?;
        let new_starts = &queue.buffer_from(round.new_starts.clone())?;
        let vertex_count = round.positions.len() as u32;
        let rings_out = &mut queue.buffer(round.ring_faces.len())?;
        seen.run(
            queue,
            CompactRings { roles, ring_starts, ring_faces, new_face, new_vertex, new_starts, vertex_count, rings_out },
        )?;
        seen.output(queue, "rings_out", rings_out)?;
    }
    Ok(())
}

fn compact_faces(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut new_vertex = round.new_vertex.clone();
        let live_face = round.renamed_faces.iter().find(|face| face.is_live()).copied().unwrap_or_default();
        new_vertex[live_face.a as usize] ^= u32::from(perturbed);
        let new_face = &queue.buffer_from(round.new_face.clone())?;
        let new_vertex = &queue.buffer_from(new_vertex)?;
        let faces = &queue.buffer_from(round.renamed_faces.clone())?;
        let face_count = round.faces.len() as u32;
        let faces_out = &mut queue.buffer(round.faces.len())?;
        seen.run(queue, CompactFaces { new_face, new_vertex, faces, face_count, faces_out })?;
        seen.output(queue, "faces_out", faces_out)?;
    }
    Ok(())
}

fn compact_quadrics(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut quadrics = round.quadrics.clone();
        flip(&mut quadrics[round.contractions[0].keep as usize].weight, perturbed);
        let new_vertex = &queue.buffer_from(round.new_vertex.clone())?;
        let vertex_count = quadrics.len() as u32;
        let quadrics_out = &mut queue.buffer(quadrics.len())?;
        let quadrics = &queue.buffer_from(quadrics)?;
        seen.run(queue, CompactQuadrics { new_vertex, quadrics, vertex_count, quadrics_out })?;
        seen.output(queue, "quadrics_out", quadrics_out)?;
    }
    Ok(())
}
