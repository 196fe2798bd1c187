//! From a mesh as it comes to the start of a run: welded, sorted in space, oriented, normalized, with flags at its
//! vertices.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::kernel::contract_vertices::VERTEX;
use crate::kernel::rows::{BORDER, Face, HELD, JOINED, LOCKED, Position, with_hub};
use crate::kernel::split::CHUNK;
use crate::math::DVec3;
use crate::mesh::adjacency::{EdgeUse, Rings};
use crate::mesh::arrange::{self, Arranged, no_face_left};
use crate::mesh::cut::cut;
use crate::mesh::fan::{Fan, NOT_MANIFOLD};
use crate::mesh::frame::Frame;
use crate::mesh::layers::Layers;
use crate::mesh::orient::{Oriented, turn_to_agree};
use crate::mesh::prune::prune;
use crate::mesh::separate::separate;
use crate::mesh::weld::{Welded, joined_attributes, weld_layers};
use crate::mesh::{self, FACE_COLORS_DROPPED, Mesh};

use super::attributes::Attributes;
use super::between_rounds::Earlier;
use super::carry::{Carried, MOVED_FROM};
use super::gather_wedges::Creases;
use super::layout::Layout;
use super::seam_flags::Around;
use super::surface::Start;
use super::wedges::Wedges;
use super::yielding::Yields;
use super::{Metric, Options};

/// What a vertex is flagged with that nothing holds but that the surface is not manifold there.
const HELD_COMPLEX: u32 = LOCKED | HELD | JOINED;
/// What the user is told where such vertices move.
const COMPLEX_YIELD: &str = "vertices where the surface is not manifold move, and its topology may change there: holding them would keep too many faces";

/// The start of a run on the host.
#[derive(Debug)]
pub struct Prepared {
    pub frame: Frame,
    pub positions: Vec<Position>,
    pub faces: Vec<Face>,
    pub rings: Rings,
    pub carried: Carried,
    pub fans: Vec<Fan>,
    /// The lowest input vertex joined with each, for a log; `None` where each is on its own.
    pub lowest: Option<Vec<u32>>,
    pub border_vertices: usize,
    pub warnings: Vec<String>,
    pub weld_secs: f64,
    pub earlier: Earlier,
    /// Whether vertices move where the surface is not manifold.
    pub complex_yield: bool,
}

impl Prepared {
    /// The flags that its seams give to every vertex of `mesh`, where such of them yield; none where there are no seams.
    pub fn seam_flags(&self, mesh: &Mesh, yields: Yields, options: &Options) -> Vec<u32> {
        let Some(wedges) = &self.carried.wedges else { return Vec::new() };
        let mut seams =
            wedges.seam_flags(mesh, yields, Around { faces: &self.faces, rings: &self.rings, fans: &self.fans });
        if options.attributes.lock_seams {
            seams.iter_mut().filter(|flags| **flags != 0).for_each(|flags| *flags |= LOCKED);
        }
        seams
    }

    /// Whether it carries what shading is made of, so that there may be creases.
    pub fn has_shading(&self) -> bool {
        self.carried.wedges.as_ref().is_some_and(|wedges| wedges.layout.has_shading())
    }

    /// The fewest faces that any run leaves with seams of such flags, by all that is known yet: locked vertices stay, and one
    /// that vanishes takes two faces along at most.
    pub fn least_faces(&self, seams: &[u32]) -> usize {
        let is_free = |(vertex, p): &(usize, &Position)| {
            (p.flags | seams.get(*vertex).copied().unwrap_or_default()) & LOCKED == 0
        };
        let free = self.positions.par_iter().enumerate().with_min_len(CHUNK).filter(is_free).count();
        self.faces.len().saturating_sub(2 * free)
    }

    /// Flags the vertices on seams, of which such yield; for good. What was refused before may be legal where more yield.
    pub fn flag_seams(&mut self, mesh: &Mesh, seams: &[u32], yields: Yields) {
        self.fans = Vec::new();
        self.earlier.pace.take_if(|_| yields != Yields::Nothing);
        self.earlier.yields = yields;
        if let Some(wedges) = &mut self.carried.wedges {
            wedges.let_yield(mesh, yields);
        }
        let rows = self.positions.par_iter_mut().zip(seams).with_min_len(CHUNK);
        rows.for_each(|(p, seam)| p.flags |= seam);
    }

    /// Finds the vertices on seams, of which such yield, and flags them.
    pub fn let_yield(&mut self, mesh: &Mesh, yields: Yields, options: &Options) {
        let seams = self.seam_flags(mesh, yields, options);
        self.flag_seams(mesh, &seams, yields);
    }

    /// How many vertices stay for nothing but that the surface is not manifold there.
    pub fn held_complex(&self) -> usize {
        self.positions.iter().filter(|p| p.flags & HELD_COMPLEX == HELD_COMPLEX).count()
    }

    /// Lets them move; for good. What was refused before may be legal now.
    pub fn let_complex_yield(&mut self) {
        let held = self.positions.iter_mut().filter(|p| p.flags & HELD_COMPLEX == HELD_COMPLEX);
        held.for_each(|p| p.flags &= !(LOCKED | HELD));
        self.complex_yield = true;
        self.earlier.pace = None;
        self.warnings.retain(|warning| !warning.starts_with(NOT_MANIFOLD));
        self.warnings.push(COMPLEX_YIELD.into());
    }

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

/// Prepares `mesh` for a run in which no seam yields.
///
/// # Errors
/// As [`begin`].
pub fn prepare(mesh: &Mesh, options: &Options) -> Result<Prepared> {
    let mut prepared = begin(mesh, options)?;
    prepared.let_yield(mesh, Yields::Nothing, options);
    Ok(prepared)
}

/// Prepares `mesh` for a run, but for the flags of its seams.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh or one that has no face left after welding.
pub fn begin(mesh: &Mesh, options: &Options) -> Result<Prepared> {
    arrange::check(mesh, options.weld)?;
    // Before the work, as a name that is not there ends the run, and after the check, as it reads the mesh.
    let locked = options.held(mesh)?;
    let clock = std::time::Instant::now();
    let layers = options.layers(mesh);
    let (arranged, mut warnings) = arranged(mesh, options, layers)?;
    let weld_secs = clock.elapsed().as_secs_f64();

    let Arranged { mut vertex_source, mut faces, mut face_source, mut rings, lowest, bounds, covering_faces, .. } =
        arranged;
    if covering_faces > 0
        && let Some(was) = separate(&mut faces, &mut rings, |f| layers.of(face_source[f as usize]))
    {
        vertex_source = mesh::take(&vertex_source, &was);
    }
    let Oriented { mut fans, warning, .. } = turn_to_agree(&mut faces, &mut face_source, &rings);
    warnings.extend(warning);
    if options.cuts()
        && let Some(was) =
            cut(&mut faces, &mut rings, &mut fans, |v| mesh.positions[vertex_source[v as usize] as usize])
    {
        let copies = was.len() - vertex_source.len();
        warnings.push(format!("the surface touches itself: it is cut there, which takes {copies} more vertices"));
        vertex_source = mesh::take(&vertex_source, &was);
    }
    check_count(vertex_source.len())?;
    let held = locked.map(|locked| held(locked, lowest.as_deref()));
    let weights = options.weighting.given(&vertex_source).unwrap_or_default();
    let mut prepared = Prepared {
        frame: Frame::new(&faces, |v| mesh.positions[vertex_source[v as usize] as usize], bounds),
        positions: Vec::new(),
        faces: Vec::new(),
        rings,
        carried: Carried { origin: vertex_source, wedges: None, drift: Vec::new(), weights, face_origin: face_source },
        fans,
        lowest,
        border_vertices: 0,
        warnings,
        weld_secs,
        earlier: Earlier { faces: faces.len(), ..Earlier::default() },
        complex_yield: false,
    };
    prepared.earlier.vertices = prepared.carried.origin.len();
    prepared.find_wedges(mesh, &faces, options)?;
    prepared.lowest = prepared.lowest.filter(|_| options.log);
    prepared.place(&mesh.positions, &faces, held.as_deref().unwrap_or_default(), options);
    prepared.faces = faces.into_iter().map(|[a, b, c]| Face { a, b, c }).collect();
    Ok(prepared)
}

/// What the user is told where so many small parts are.
pub fn parts_dropped(count: usize) -> String {
    format!("small parts dropped: {count}")
}

impl Options {
    /// Which faces may be repetitions of each other: all, where nothing is cut apart or no material is kept to tell them by.
    pub(crate) fn layers<'a>(&self, mesh: &'a Mesh) -> Layers<'a> {
        let keeps_materials = !(self.attributes.dropped.materials || self.attributes.smooth);
        Layers::new(mesh.materials.as_ref().filter(|_| self.cuts() && keeps_materials))
    }
}

fn check_count(vertices: usize) -> Result<()> {
    if vertices > VERTEX as usize {
        return Err(Error::Limit(format!("{vertices} vertices, more than the {VERTEX} that a run can number")));
    }
    Ok(())
}

/// Welds, prunes and sorts `mesh`, of such layers; also returns warnings.
fn arranged(mesh: &Mesh, options: &Options, layers: Layers<'_>) -> Result<(Arranged, Vec<String>)> {
    let mut arranged;
    let mut pruned = 0;
    let limit = options.prune.unwrap_or(0.0);
    if limit > 0.0 {
        let mut welded = weld(mesh, options.weld, layers);
        pruned = prune(&mut welded, limit);
        let of_face = layers.of_faces(&welded.face_source);
        let left = of_face.as_deref().map_or(Layers::ONE, Layers::numbered);
        arranged = Arranged::new(&welded.mesh, None, left);
        let onto =
            |sources: &mut [u32], before: &[u32]| sources.iter_mut().for_each(|row| *row = before[*row as usize]);
        onto(&mut arranged.vertex_source, &welded.vertex_source);
        onto(&mut arranged.face_source, &welded.face_source);
        (arranged.degenerate_faces, arranged.duplicate_faces) = (welded.degenerate_faces, welded.duplicate_faces);
        arranged.unreferenced_vertices = welded.unreferenced_vertices;
        arranged.lowest = Some(welded.lowest);
    } else {
        arranged = Arranged::new(mesh, options.weld, layers);
    }
    if arranged.faces.is_empty() {
        return Err(Error::Mesh(match pruned {
            0 => no_face_left(mesh, options.weld),
            _ => "every part is below the prune limit: give a smaller one".into(),
        }));
    }
    let parts = (pruned > 0).then(|| parts_dropped(pruned));
    let dropped = (options.log && holds_more_than_a_log(mesh, &options.attributes)).then(|| {
        "a log holds one normal and one color a vertex: texture coordinates, creases, materials and channels are dropped".into()
    });
    let face_colors = mesh.face_colors.is_some().then(|| FACE_COLORS_DROPPED.into());
    let weights = options.attributes.weights.warnings(mesh);
    let warnings = arranged.warnings().chain(weights).chain(parts).chain(dropped).chain(face_colors).collect();
    Ok((arranged, warnings))
}

impl Prepared {
    /// Finds the wedges of the attributes that are kept.
    fn find_wedges(&mut self, mesh: &Mesh, faces: &[[u32; 3]], options: &Options) -> Result<()> {
        let is_smooth = options.log || options.attributes.smooth;
        let layout = Layout::new(mesh, &options.attributes, options.metric, self.frame, is_smooth);
        let Some(layout) = layout else { return Ok(()) };
        if 3 * mesh.faces.len() > MOVED_FROM as usize {
            let count = mesh.faces.len();
            return Err(Error::Limit(format!(
                "{count} faces, more than those whose corners a run can number: drop attributes"
            )));
        }
        let find = |layout, creases| Wedges::new(mesh, layout, &self.rings, &self.carried.face_origin, faces, creases);
        if is_smooth {
            let own = joined_attributes(mesh, self.lowest.as_ref(), &self.carried.origin);
            let wedges = Wedges::smooth(layout, &self.rings, &self.carried.face_origin, faces, own);
            self.carried.wedges = Some(wedges);
            return Ok(());
        }
        self.carried.wedges = find(layout.clone(), Creases::All);
        if self.carried.wedges.is_none() {
            self.carried.wedges = find(layout, Creases::Sharp);
            self.warnings.push("normals are those of facets: only creases of more than 30° are kept".into());
        }
        Ok(())
    }

    /// Fills in the rows of the vertices, with their flags but for those of seams. Those `held` are numbered as in the input.
    fn place(&mut self, input: &[DVec3], faces: &[[u32; 3]], held: &[bool], options: &Options) {
        let Self { frame, rings, carried, fans, .. } = &*self;
        let row = |uses: &mut Vec<EdgeUse>, (vertex, (&origin, &fan)): (usize, (&u32, &Fan))| {
            let on_border = match fan {
                Fan::Closed => false,
                Fan::Open => true,
                Fan::Complex => rings.edges_at(faces, vertex as u32, uses).any(|uses| uses.len() == 1),
            };
            let is_complex = fan == Fan::Complex;
            let is_held = held.get(origin as usize).is_some_and(|&is_held| is_held);
            let other_holds = (on_border && options.lock_border) || is_held;
            let locked = (is_complex && !options.joins()) || other_holds;
            let joined = is_complex && (options.joins() || !other_holds);
            let flags = if on_border { BORDER } else { 0 }
                | if locked { LOCKED | HELD } else { 0 }
                | if joined { JOINED } else { 0 };
            let hub = with_hub(flags, rings.ring(vertex as u32).len() as u32);
            Position::new(frame.to_rows(input[origin as usize]), hub)
        };
        let rows: Vec<Position> =
            carried.origin.par_iter().zip(fans).enumerate().with_min_len(CHUNK).map_init(Vec::new, row).collect();
        // Those that stay in any case need no word, and the cuts between the parts of a mesh make such of any vertex.
        let is_free = |origin: u32| !held.get(origin as usize).is_some_and(|&is_held| is_held);
        let complex =
            carried.origin.iter().zip(fans).filter(|&(&origin, &fan)| fan == Fan::Complex && is_free(origin)).count();
        self.border_vertices = rows.iter().filter(|p| p.flags & BORDER != 0).count();
        if complex > 0 && !options.joins() {
            self.warnings.push(format!("{NOT_MANIFOLD}: {complex}"));
        }
        if options.metric == Metric::Volume {
            self.carried.drift = vec![0.0; rows.len()];
        }
        self.positions = rows;
    }
}

/// Whether a mesh carries what a log does not hold, and it is to be kept.
fn holds_more_than_a_log(mesh: &Mesh, options: &Attributes) -> bool {
    let dropped = &options.dropped;
    (mesh.texcoords.is_some() && !dropped.texcoords)
        || (mesh.materials.is_some() && !dropped.materials)
        || (!mesh.channels.is_empty() && !dropped.channels)
}

/// Whether each input vertex, or any that is joined into it, is locked.
fn held(mut locked: Vec<bool>, lowest: Option<&[u32]>) -> Vec<bool> {
    for (vertex, &onto) in lowest.unwrap_or_default().iter().enumerate() {
        locked[onto as usize] |= locked[vertex];
    }
    locked
}

/// The mesh welded, or as it is less faces with a repeated corner.
fn weld(mesh: &Mesh, tolerance: Option<f64>, layers: Layers<'_>) -> Welded {
    if let Some(tolerance) = tolerance {
        return weld_layers(mesh, tolerance, layers);
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
    use crate::kernel::rows::SEAM;
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
    fn what_is_left_out_is_told() {
        let told = |mesh: &Mesh, options: &Options| prepare(mesh, options).expect("a valid mesh").warnings;
        let mut mesh = shapes::plane(3, 2);
        mesh.texcoords = Some(vec![[Vec2::ZERO; 3]; mesh.faces.len()]);
        assert_eq!(told(&mesh, &Options::default()), [""; 0]);
        let with_log = told(&mesh, &Options { log: true, ..Options::default() });
        assert!(with_log[0].starts_with("a log holds one normal"));
        mesh.face_colors = Some(vec![[0.5; 4]; mesh.faces.len()]);
        assert!(told(&mesh, &Options::default()).iter().any(|warning| warning == FACE_COLORS_DROPPED));
    }

    /// Two caps of very many faces, with a texture that is cut along their rims: what compares each edge of a vertex with
    /// each would take a minute.
    #[test]
    fn hubs_within_seams_are_no_trap() {
        let mut can = shapes::cylinder(100_000);
        let texcoords = |face: &[u32; 3]| {
            let points = face.map(|v| can.positions[v as usize]);
            let is_cap = points.iter().all(|p| p.z == points[0].z);
            points.map(|p| Vec2::new(p.x as f32 + if is_cap { 4.0 } else { 0.0 }, p.y as f32))
        };
        can.texcoords = Some(can.faces.iter().map(texcoords).collect());
        let clock = std::time::Instant::now();
        let prepared = prepare(&can, &Options::default()).expect("a valid mesh");
        let on_seam = prepared.positions.iter().filter(|p| p.flags & SEAM != 0).count();
        assert_eq!((on_seam, prepared.positions.len()), (200_000, 200_002));
        assert!(clock.elapsed().as_secs() < 10, "{:?}", clock.elapsed());
    }

    #[test]
    fn faces_of_one_point_are_an_error() {
        let mesh = Mesh::new(vec![DVec3::ONE; 3], vec![[0, 1, 2]]);
        assert!(matches!(prepare(&mesh, &Options::default()), Err(Error::Mesh(_))));
    }
}
