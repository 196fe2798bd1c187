//! From a mesh as it comes to the start of a run: welded, oriented, normalized, with flags at its vertices.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::kernel::contract_vertices::VERTEX;
use crate::kernel::rows::{BORDER, Face, LOCKED, Position, with_hub};
use crate::mesh::Mesh;
use crate::mesh::adjacency::{EdgeUse, Rings};
use crate::mesh::orient::orient;
use crate::mesh::prune::prune;
use crate::mesh::topology::complex_vertices;
use crate::mesh::weld::{Welded, weld};

use super::carry::Carried;
use super::frame::Frame;
use super::surface::Start;
use super::{Metric, Options};

/// The start of a run on the host.
#[derive(Debug)]
pub struct Prepared {
    pub frame: Frame,
    pub positions: Vec<Position>,
    pub faces: Vec<Face>,
    pub rings: Rings,
    pub carried: Carried,
    pub has_border: bool,
    pub warnings: Vec<String>,
    pub weld_secs: f64,
}

impl Prepared {
    /// Takes the start of a run out, for the host's surface.
    pub fn take_start(&mut self) -> Start {
        let Rings { starts, faces } =
            std::mem::replace(&mut self.rings, Rings { starts: Vec::new(), faces: Vec::new() });
        Start {
            positions: std::mem::take(&mut self.positions),
            faces: std::mem::take(&mut self.faces),
            ring_starts: starts,
            ring_faces: faces,
        }
    }
}

/// Prepares `mesh`.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh or one that has no face left after welding.
pub fn prepare(mesh: &Mesh, options: &Options) -> Result<Prepared> {
    mesh.check()?;
    if mesh.faces.is_empty() {
        return Err(Error::Mesh("it has no faces".into()));
    }
    let clock = std::time::Instant::now();
    let mut welded = welded(mesh, options.weld)?;
    let pruned = if options.prune > 0.0 { prune(&mut welded, options.prune) } else { 0 };
    let weld_secs = clock.elapsed().as_secs_f64();
    if welded.mesh.faces.is_empty() {
        let reason = if pruned > 0 {
            "every part is below the prune limit: give a smaller one"
        } else {
            "all its faces are degenerate: two corners of each lie at one point"
        };
        return Err(Error::Mesh(reason.into()));
    }
    if welded.mesh.positions.len() > VERTEX as usize {
        let count = welded.mesh.positions.len();
        return Err(Error::Limit(format!("{count} vertices, more than the {VERTEX} that a run can number")));
    }
    let mut warnings = weld_warnings(&welded);
    if pruned > 0 {
        warnings.push(format!("{pruned} small parts dropped"));
    }
    if mesh.texcoords.is_some() {
        warnings.push("texture coordinates are dropped: they are not carried through contractions yet".into());
    }
    let Welded { mesh: Mesh { positions, mut faces, normals, colors, .. }, vertex_source, .. } = welded;

    let rings = Rings::new(&faces, positions.len());
    let turned = orient(&faces, &rings);
    if let Some(turned) = &turned {
        let count = turned.iter().filter(|&&turned| turned).count();
        warnings
            .push(format!("{count} faces are wound against their neighbors; they keep their winding in the result"));
        faces.par_iter_mut().zip(turned).filter(|(_, turned)| **turned).for_each(|(face, _)| face.swap(1, 2));
    }
    let locked = complex_vertices(&faces, &rings);
    let frame = Frame::new(&positions, &faces);
    let rows: Vec<Position> = positions
        .par_iter()
        .zip(&locked)
        .enumerate()
        .map_init(Vec::new, |uses, (vertex, (&position, &locked))| {
            let on_border = on_border(vertex as u32, locked, &faces, &rings, uses);
            let locked = locked || (on_border && options.lock_border);
            let flags = if on_border { BORDER } else { 0 } | if locked { LOCKED } else { 0 };
            frame.to_rows(position, with_hub(flags, rings.ring(vertex as u32).len() as u32))
        })
        .collect();
    let has_border = rows.iter().any(|p| p.flags & BORDER != 0);
    let complex = locked.iter().filter(|&&locked| locked).count();
    if complex > 0 {
        warnings.push(format!("{complex} vertices where the surface is not manifold stay where they are"));
    }
    let drift = match options.metric {
        Metric::Volume => vec![0.0; rows.len()],
        Metric::Plane => Vec::new(),
    };
    Ok(Prepared {
        frame,
        positions: rows,
        faces: faces.into_iter().map(|[a, b, c]| Face { a, b, c }).collect(),
        rings,
        carried: Carried { origin: vertex_source, normals, colors, drift, turned },
        has_border,
        warnings,
        weld_secs,
    })
}

/// Whether a vertex ends a border edge.
///
/// Around a vertex that is not complex there is one fan: its neighbors after and before it in the faces are the same
/// set, or on a border differ by the two ends of the fan. Their sums tell.
fn on_border(vertex: u32, complex: bool, faces: &[[u32; 3]], rings: &Rings, uses: &mut Vec<EdgeUse>) -> bool {
    if complex {
        return rings.edges_at(faces, vertex, uses).any(|uses| uses.len() == 1);
    }
    let mut difference = 0_u64;
    for &f in rings.ring(vertex) {
        let [a, b, c] = faces[f as usize];
        let (after, before) = match vertex {
            v if v == a => (b, c),
            v if v == b => (c, a),
            _ => (a, b),
        };
        difference = difference.wrapping_add(u64::from(after)).wrapping_sub(u64::from(before));
    }
    difference != 0
}

fn welded(mesh: &Mesh, tolerance: Option<f64>) -> Result<Welded> {
    match tolerance {
        Some(tolerance) if tolerance >= 0.0 && tolerance.is_finite() => Ok(weld(mesh, tolerance)),
        Some(tolerance) => Err(Error::Parameter(format!("the weld distance is {tolerance}: give 0 or more"))),
        None => Ok(unwelded(mesh)),
    }
}

/// The mesh as it is, less faces with a repeated corner.
fn unwelded(mesh: &Mesh) -> Welded {
    let live = |face: &[u32; 3]| face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
    let face_source: Vec<u32> = (0..mesh.faces.len() as u32).filter(|&f| live(&mesh.faces[f as usize])).collect();
    let degenerate_faces = mesh.faces.len() - face_source.len();
    let faces = face_source.iter().map(|&f| mesh.faces[f as usize]).collect();
    Welded {
        mesh: Mesh {
            positions: mesh.positions.clone(),
            faces,
            normals: mesh.normals.clone(),
            colors: mesh.colors.clone(),
            texcoords: mesh.texcoords.as_ref().map(|rows| face_source.iter().map(|&f| rows[f as usize]).collect()),
        },
        vertex_source: (0..mesh.positions.len() as u32).collect(),
        face_source,
        joined_vertices: 0,
        unreferenced_vertices: 0,
        degenerate_faces,
        duplicate_faces: 0,
        opposite_faces: 0,
    }
}

fn weld_warnings(welded: &Welded) -> Vec<String> {
    [
        (welded.degenerate_faces, "degenerate faces dropped"),
        (welded.duplicate_faces, "duplicate faces dropped"),
        (welded.unreferenced_vertices, "unreferenced vertices dropped"),
    ]
    .into_iter()
    .filter(|&(count, _)| count > 0)
    .map(|(count, what)| format!("{count} {what}"))
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Vec2};
    use crate::mesh::shapes;

    #[test]
    fn open_plane_has_a_border_and_no_locks() {
        let prepared = prepare(&shapes::plane(3, 2), &Options::default()).expect("a valid mesh");
        let on_border = prepared.positions.iter().filter(|p| p.flags & BORDER != 0).count();
        assert_eq!((on_border, prepared.positions.len()), (10, 12));
        assert!(prepared.positions.iter().all(|p| p.flags & LOCKED == 0));
    }

    #[test]
    fn lock_border_locks_the_border() {
        let options = Options { lock_border: true, ..Options::default() };
        let prepared = prepare(&shapes::plane(3, 2), &options).expect("a valid mesh");
        assert!(prepared.positions.iter().all(|p| (p.flags & LOCKED != 0) == (p.flags & BORDER != 0)));
    }

    #[test]
    fn dropped_texture_coordinates_are_told() {
        let dropped = |mesh: &Mesh, options: &Options| {
            let prepared = prepare(mesh, options).expect("a valid mesh");
            prepared.warnings.iter().any(|warning| warning.starts_with("texture coordinates are dropped"))
        };
        let mut mesh = shapes::plane(3, 2);
        assert!(!dropped(&mesh, &Options::default()));
        mesh.texcoords = Some(vec![[Vec2::ZERO; 3]; mesh.faces.len()]);
        assert!(dropped(&mesh, &Options::default()));
        assert!(dropped(&mesh, &Options { weld: None, ..Options::default() }));
    }

    #[test]
    fn faces_of_one_point_are_an_error() {
        let mesh = Mesh::new(vec![DVec3::ONE; 3], vec![[0, 1, 2]]);
        assert!(matches!(prepare(&mesh, &Options::default()), Err(Error::Mesh(_))));
    }
}
