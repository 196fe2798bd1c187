//! From a mesh as it comes to the start of a run, and from its end back to a mesh.

use rayon::prelude::*;

use crate::backend::Queue;
use crate::error::Result;
use crate::kernel::rows::{BORDER, Face, LOCKED, Position, with_hub};
use crate::mesh::Mesh;
use crate::mesh::arrange::Arranged;
use crate::mesh::fan::{Fan, NOT_MANIFOLD};
use crate::mesh::frame::Frame;
use crate::mesh::kept::dropped_through;
use crate::mesh::orient::{Oriented, TURNED, turn_to_agree};
use crate::mesh::weld::joined_attributes;

use super::Options;
use super::samples::Samples;
use super::surface::Surface;

/// The start of a run.
#[derive(Debug)]
pub struct Prepared {
    pub frame: Frame,
    pub surface: Surface,
    pub samples: Samples,
    pub has_border: bool,
    /// The input vertex of every vertex of the start.
    pub vertex_source: Vec<u32>,
    /// The lowest input vertex joined with each; `None` where each is on its own.
    pub lowest: Option<Vec<u32>>,
    pub warnings: Vec<String>,
    pub weld_secs: f64,
}

/// Prepares `mesh`, with buffers of the host's `queue`.
///
/// # Errors
/// As [`Arranged::checked`].
pub fn prepare(mesh: &Mesh, options: &Options, queue: &mut Queue) -> Result<Prepared> {
    let clock = std::time::Instant::now();
    let mut arranged = Arranged::checked(mesh, options.weld)?;
    let weld_secs = clock.elapsed().as_secs_f64();
    let mut warnings: Vec<String> = arranged.warnings().collect();
    warnings.extend(dropped_through(mesh, "removals"));
    let has_many = mesh.materials.as_ref().is_some_and(|materials| materials.on_all(0).is_none());
    warnings.extend(has_many.then(|| "materials are dropped: they are not carried through removals".into()));
    let fans = oriented(&mut arranged, &mut warnings);
    let Arranged { vertex_source, faces, face_source, rings, lowest, bounds, .. } = arranged;
    let at = |v: u32| mesh.positions[vertex_source[v as usize] as usize];
    let frame = Frame::new(&faces, at, bounds);
    let row = |(vertex, &fan): (usize, &Fan)| {
        let locked = fan == Fan::Complex || (fan == Fan::Open && options.lock_border);
        let flags = if fan == Fan::Open { BORDER } else { 0 } | if locked { LOCKED } else { 0 };
        let vertex = vertex as u32;
        Position::new(frame.to_rows(at(vertex)), with_hub(flags, rings.ring(vertex).len() as u32))
    };
    let positions: Vec<Position> = fans.par_iter().enumerate().map(row).collect();
    let complex = fans.iter().filter(|&&fan| fan == Fan::Complex).count();
    if complex > 0 {
        warnings.push(format!("{NOT_MANIFOLD}: {complex}"));
    }
    Ok(Prepared {
        frame,
        has_border: positions.iter().any(|p| p.flags & BORDER != 0),
        samples: Samples::new(&positions, faces.len()),
        surface: Surface {
            source: (0..positions.len() as u32).collect(),
            positions: queue.buffer_from(positions)?,
            faces: queue.buffer_from(faces.into_iter().map(|[a, b, c]| Face { a, b, c }).collect())?,
            ring_starts: queue.buffer_from(rings.starts)?,
            ring_faces: queue.buffer_from(rings.faces)?,
            deviations: queue.buffer(face_source.len())?,
            face_source,
        },
        vertex_source,
        lowest,
        warnings,
        weld_secs,
    })
}

/// Turns faces over until neighbors agree, as far as they can; returns the fans of the vertices.
fn oriented(arranged: &mut Arranged, warnings: &mut Vec<String>) -> Vec<Fan> {
    let Arranged { faces, face_source, rings, .. } = arranged;
    let Oriented { mut fans, turned, warning } = turn_to_agree(faces, face_source, rings);
    warnings.extend(warning);
    if turned.is_empty() {
        return fans;
    }
    // What fills the hole of a vertex is wound as all faces around it are.
    for (vertex, fan) in (0..).zip(&mut fans) {
        let mut around = rings.ring(vertex).iter().map(|&f| turned[f as usize]);
        if around.next().is_some_and(|first| around.any(|other| other != first)) {
            *fan = Fan::Complex;
        }
    }
    fans
}

/// The mesh at the end of a run in the order of the input, and the input vertex of each of its vertices.
pub fn restore(input: &Mesh, surface: &Surface, vertex_source: &[u32], lowest: Option<&Vec<u32>>) -> (Mesh, Vec<u32>) {
    let source = |v: u32| vertex_source[surface.source[v as usize] as usize];
    let starts = surface.ring_starts.host();
    let has_face = |&v: &u32| starts[v as usize] != starts[v as usize + 1];
    let mut order: Vec<u32> = (0..surface.source.len() as u32).filter(has_face).collect();
    order.sort_unstable_by_key(|&v| source(v));
    let mut renamed = vec![0; surface.source.len()];
    (0..).zip(&order).for_each(|(new, &old)| renamed[old as usize] = new);
    let origin: Vec<u32> = order.into_iter().map(source).collect();

    let mut face_order: Vec<u32> = (0..surface.face_source.len() as u32).collect();
    face_order.sort_unstable_by_key(|&f| surface.face_source[f as usize] & !TURNED);
    let corners = |f: u32| {
        let [a, b, c] = surface.faces.host()[f as usize].corners().map(|v| renamed[v as usize]);
        if surface.face_source[f as usize] & TURNED == 0 { [a, b, c] } else { [a, c, b] }
    };
    let (normals, colors) = joined_attributes(input, lowest, &origin);
    let mesh = Mesh {
        positions: origin.iter().map(|&v| input.positions[v as usize]).collect(),
        faces: face_order.into_iter().map(corners).collect(),
        normals,
        colors,
        materials: input.materials.as_ref().and_then(|materials| materials.on_all(surface.face_source.len())),
        ..Mesh::default()
    };
    (mesh, origin)
}
