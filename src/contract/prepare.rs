//! From a mesh as it comes to the start of a run: welded, sorted in space, oriented, normalized, with flags at its
//! vertices.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::kernel::contract_vertices::VERTEX;
use crate::kernel::rows::{BORDER, Face, JOINED, LOCKED, Position, SEAM, with_hub};
use crate::math::{DVec3, Vec3};
use crate::mesh::adjacency::{EdgeUse, Rings};
use crate::mesh::arrange::{self, Arranged, NO_FACE_LEFT};
use crate::mesh::fan::Fan;
use crate::mesh::frame::Frame;
use crate::mesh::orient::{Oriented, TURNED, turn_to_agree};
use crate::mesh::prune::prune;
use crate::mesh::weld::{Welded, joined_attributes};
use crate::mesh::{self, FACE_COLORS_DROPPED, Mesh};

use super::carry::Carried;
use super::charts::Charts;
use super::surface::Start;
use super::{Metric, Options, Texture};

/// Vertices that a thread places at a time.
const ROWS: usize = 1 << 12;

/// The start of a run on the host.
#[derive(Debug)]
pub struct Prepared {
    pub frame: Frame,
    pub positions: Vec<Position>,
    pub faces: Vec<Face>,
    pub rings: Rings,
    pub carried: Carried,
    /// The lowest input vertex joined with each, for a log; `None` where each is on its own.
    pub lowest: Option<Vec<u32>>,
    pub border_vertices: usize,
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
    arrange::check(mesh, options.weld)?;
    let textured = mesh.texcoords.is_some();
    if textured && options.texture == Texture::Keep && options.log {
        return Err(Error::Parameter("a log holds no texture coordinates: drop them, or leave out the log".into()));
    }
    let clock = std::time::Instant::now();
    let (arranged, attributes, warnings) = arranged(mesh, options)?;
    let weld_secs = clock.elapsed().as_secs_f64();

    let Arranged { vertex_source, mut faces, face_source, rings, lowest, bounds, .. } = arranged;
    let held = options.locked.as_deref().map(|locked| held(locked, lowest.as_deref()));
    let weights = options.weighting.given(&vertex_source).unwrap_or_default();
    let mut prepared = Prepared {
        frame: Frame::new(&faces, |v| mesh.positions[vertex_source[v as usize] as usize], bounds),
        positions: Vec::new(),
        faces: Vec::new(),
        rings,
        carried: Carried {
            origin: vertex_source,
            normals: attributes.0,
            colors: attributes.1,
            charts: None,
            drift: Vec::new(),
            weights,
            face_origin: face_source,
        },
        lowest: lowest.filter(|_| options.log),
        border_vertices: 0,
        warnings,
        weld_secs,
    };
    let Oriented { fans, warning, .. } = turn_to_agree(&mut faces, &mut prepared.carried.face_origin, &prepared.rings);
    prepared.warnings.extend(warning);
    let seams = prepared.chart(mesh, &faces, options.texture);
    prepared.place(
        &mesh.positions,
        &faces,
        &fans,
        [held.as_deref(), Some(&seams)].map(Option::unwrap_or_default),
        options,
    );
    prepared.faces = faces.into_iter().map(|[a, b, c]| Face { a, b, c }).collect();
    Ok(prepared)
}

type Attributes = (Option<Vec<Vec3>>, Option<Vec<[f32; 4]>>);

/// Welds, prunes and sorts `mesh`; also returns the kept vertices' normals and colors, and warnings.
fn arranged(mesh: &Mesh, options: &Options) -> Result<(Arranged, Attributes, Vec<String>)> {
    let mut arranged;
    let attributes;
    let mut pruned = 0;
    if options.prune > 0.0 {
        let mut welded = weld(mesh, options.weld);
        pruned = prune(&mut welded, options.prune);
        arranged = Arranged::new(&welded.mesh, None);
        attributes = joined_attributes(&welded.mesh, None, &arranged.vertex_source);
        let onto =
            |sources: &mut [u32], before: &[u32]| sources.iter_mut().for_each(|row| *row = before[*row as usize]);
        onto(&mut arranged.vertex_source, &welded.vertex_source);
        onto(&mut arranged.face_source, &welded.face_source);
        (arranged.degenerate_faces, arranged.duplicate_faces) = (welded.degenerate_faces, welded.duplicate_faces);
        arranged.unreferenced_vertices = welded.unreferenced_vertices;
        arranged.lowest = Some(welded.lowest);
    } else {
        arranged = Arranged::new(mesh, options.weld);
        attributes = joined_attributes(mesh, arranged.lowest.as_ref(), &arranged.vertex_source);
    }
    if arranged.faces.is_empty() {
        let reason = if pruned > 0 { "every part is below the prune limit: give a smaller one" } else { NO_FACE_LEFT };
        return Err(Error::Mesh(reason.into()));
    }
    if arranged.vertex_source.len() > VERTEX as usize {
        let count = arranged.vertex_source.len();
        return Err(Error::Limit(format!("{count} vertices, more than the {VERTEX} that a run can number")));
    }
    let parts = (pruned > 0).then(|| format!("{pruned} small parts dropped"));
    let drops = mesh.texcoords.is_some() && options.texture == Texture::Drop;
    let dropped = drops.then(|| "texture coordinates are dropped: the option 'texture' keeps them".into());
    let face_colors = mesh.face_colors.is_some().then(|| FACE_COLORS_DROPPED.into());
    let warnings = arranged.warnings().chain(parts).chain(dropped).chain(face_colors).collect();
    Ok((arranged, attributes, warnings))
}

impl Prepared {
    /// Takes up the texture coordinates that are kept; returns which vertices are on their seams, or nothing.
    fn chart(&mut self, mesh: &Mesh, faces: &[[u32; 3]], texture: Texture) -> Vec<bool> {
        let Some(texcoords) = mesh.texcoords.as_ref().filter(|_| texture == Texture::Keep) else { return Vec::new() };
        let corners = |&origin: &u32| {
            let [a, b, c] = texcoords[(origin & !TURNED) as usize];
            if origin & TURNED == 0 { [a, b, c] } else { [a, c, b] }
        };
        let corners = self.carried.face_origin.par_iter().with_min_len(ROWS).map(corners).collect();
        let (charts, seams) = Charts::new(faces, &self.rings, corners);
        self.carried.charts = Some(charts);
        seams
    }

    /// Fills in the rows of the vertices, with their flags. Those `held` are numbered as in the input.
    fn place(
        &mut self,
        input: &[DVec3],
        faces: &[[u32; 3]],
        fans: &[Fan],
        [held, seams]: [&[bool]; 2],
        options: &Options,
    ) {
        let Self { frame, rings, carried, .. } = &*self;
        let row = |uses: &mut Vec<EdgeUse>, (vertex, (&origin, &fan)): (usize, (&u32, &Fan))| {
            let on_border = match fan {
                Fan::Closed => false,
                Fan::Open => true,
                Fan::Complex => rings.edges_at(faces, vertex as u32, uses).any(|uses| uses.len() == 1),
            };
            let is_complex = fan == Fan::Complex;
            let is_held = held.get(origin as usize).is_some_and(|&is_held| is_held);
            let locked = (is_complex && !options.joins()) || (on_border && options.lock_border) || is_held;
            let joined = is_complex && options.joins();
            let on_seam = seams.get(vertex).is_some_and(|&on_seam| on_seam);
            let flags = if on_border { BORDER } else { 0 }
                | if locked { LOCKED } else { 0 }
                | if joined { JOINED } else { 0 }
                | if on_seam { SEAM | LOCKED } else { 0 };
            let hub = with_hub(flags, rings.ring(vertex as u32).len() as u32);
            Position::new(frame.to_rows(input[origin as usize]), hub)
        };
        let rows: Vec<Position> =
            carried.origin.par_iter().zip(fans).enumerate().with_min_len(ROWS).map_init(Vec::new, row).collect();
        self.border_vertices = rows.iter().filter(|p| p.flags & BORDER != 0).count();
        let complex = fans.iter().filter(|&&fan| fan == Fan::Complex).count();
        if complex > 0 && !options.joins() {
            self.warnings.push(format!("{complex} vertices where the surface is not manifold stay where they are"));
        }
        if options.metric == Metric::Volume {
            self.carried.drift = vec![0.0; rows.len()];
        }
        self.positions = rows;
    }
}

/// Whether each input vertex, or any that is joined into it, is locked.
fn held(locked: &[bool], lowest: Option<&[u32]>) -> Vec<bool> {
    let mut held = locked.to_vec();
    for (&onto, _) in lowest.unwrap_or_default().iter().zip(locked).filter(|(_, is_locked)| **is_locked) {
        held[onto as usize] = true;
    }
    held
}

/// The mesh welded, or as it is less faces with a repeated corner.
fn weld(mesh: &Mesh, tolerance: Option<f64>) -> Welded {
    if let Some(tolerance) = tolerance {
        return mesh::weld(mesh, tolerance);
    }
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
            // A run carries none.
            face_colors: None,
            ..Mesh::default()
        },
        vertex_source: (0..mesh.positions.len() as u32).collect(),
        face_source,
        lowest: (0..mesh.positions.len() as u32).collect(),
        joined_vertices: 0,
        unreferenced_vertices: 0,
        degenerate_faces,
        duplicate_faces: 0,
        opposite_faces: 0,
    }
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
    fn a_lock_holds_the_vertex_that_its_own_is_joined_with() {
        // Two triangles side by side, which share no vertex until they are welded; the second's corner is locked.
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::new(corners.map(DVec3::from).to_vec(), vec![[0, 1, 2], [3, 4, 5]]);
        let locked = Some([false, false, false, true, false, false].into());
        let prepared = prepare(&mesh, &Options { locked, ..Options::default() }).expect("a valid mesh");
        let is_locked = |p: &Position| p.flags & LOCKED != 0;
        let origins: Vec<u32> = prepared
            .carried
            .origin
            .iter()
            .zip(&prepared.positions)
            .filter(|(_, p)| is_locked(p))
            .map(|(&o, _)| o)
            .collect();
        assert_eq!((origins, prepared.positions.len()), (vec![1], 4));
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
        mesh.face_colors = Some(vec![[0.5; 4]; mesh.faces.len()]);
        let told = |mesh| prepare(mesh, &Options::default()).expect("a valid mesh").warnings;
        assert!(told(&mesh).iter().any(|warning| warning == FACE_COLORS_DROPPED));
    }

    #[test]
    fn faces_of_one_point_are_an_error() {
        let mesh = Mesh::new(vec![DVec3::ONE; 3], vec![[0, 1, 2]]);
        assert!(matches!(prepare(&mesh, &Options::default()), Err(Error::Mesh(_))));
    }
}
