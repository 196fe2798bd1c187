//! `coarsen inspect`: what a mesh is, what is wrong with it, how far it can be reduced.

use std::borrow::Cow;
use std::fmt::Write;

use coarsen::Mesh;
use coarsen::formats::Scene;
use coarsen::mesh::Materials;
use coarsen::mesh::survey::{Survey, survey};
use coarsen::mesh::topology::{Topology, topology};
use serde::Serialize;

use super::Exit;
use super::console::{self, Verbosity};
use super::simplify::warn_about;
use super::source::Source;

/// A mesh, as `--json` prints it. Fields are only ever added under this `schema`.
#[derive(Debug, Serialize)]
struct Record {
    schema: u32,
    version: &'static str,
    input: String,
    has_normals: bool,
    has_colors: bool,
    has_face_colors: bool,
    has_texcoords: bool,
    /// What else vertices carry.
    channels: Vec<ChannelRecord>,
    /// What faces are made of, where the file says so.
    materials: Vec<MaterialRecord>,
    bounds: Bounds,
    /// In squared model units.
    area: f64,
    /// In cubed model units; null unless the surface is closed.
    volume: Option<f64>,
    /// As it is in the file.
    stored: Topology,
    /// As a reduction will see it.
    welded: Survey,
    /// What nodes of a glTF show, a mesh that several show once for each; null where that is what is stored, or too much to count.
    shown: Option<Shown>,
}

/// What nodes show.
#[derive(Debug, Serialize)]
struct Shown {
    faces: usize,
    bounds: Bounds,
}

/// Numbers at vertices.
#[derive(Debug, Serialize)]
struct ChannelRecord {
    name: String,
    width: usize,
}

/// A material and its faces.
#[derive(Debug, Serialize)]
struct MaterialRecord {
    name: String,
    faces: usize,
}

/// The bounding box, in model units.
#[derive(Debug, Serialize)]
struct Bounds {
    low: [f64; 3],
    high: [f64; 3],
    diagonal: f64,
}

/// Reads a mesh and prints what it is.
///
/// # Errors
/// An input that cannot be read, an output that cannot be written.
pub fn run(source: &Source, json: bool) -> anyhow::Result<Exit> {
    let Scene { mesh, document, warnings } = source.read_scene()?;
    warn_about(Verbosity::Normal, source, &warnings);
    let shown = match document.all_shown(&mesh) {
        (Cow::Owned(all), _) => Some(Shown { faces: all.faces.len(), bounds: Bounds::of(&all) }),
        (Cow::Borrowed(_), _) => None,
    };
    let record = Record { shown, ..Record::new(source.to_string(), &mesh) };
    if json {
        console::print_json(&record)?;
    } else {
        console::print(record.table().as_bytes())?;
    }
    Ok(Exit::Done)
}

/// The faces of each material; lines of a name that says its groups too are joined, of faces without a material these alone.
fn materials(materials: &Materials) -> Vec<MaterialRecord> {
    let mut faces = vec![0; materials.names.len()];
    materials.of_face.iter().for_each(|&material| faces[material as usize] += 1);
    let names =
        materials.names.iter().map(|name| name.lines().filter(|line| !line.is_empty()).collect::<Vec<_>>().join(", "));
    names.zip(faces).map(|(name, faces)| MaterialRecord { name, faces }).collect()
}

impl Bounds {
    fn of(mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds();
        Self { low: low.to_array(), high: high.to_array(), diagonal: mesh.diagonal() }
    }
}

impl Record {
    fn new(input: String, mesh: &Mesh) -> Self {
        let welded = survey(mesh);
        Self {
            schema: 1,
            version: env!("CARGO_PKG_VERSION"),
            input,
            has_normals: mesh.normals.is_some(),
            has_colors: mesh.colors.is_some(),
            has_face_colors: mesh.face_colors.is_some(),
            has_texcoords: mesh.texcoords.is_some(),
            channels: mesh.channels.iter().map(|c| ChannelRecord { name: c.name.clone(), width: c.width }).collect(),
            materials: mesh.materials.as_ref().map(materials).unwrap_or_default(),
            bounds: Bounds::of(mesh),
            area: mesh.area(),
            volume: welded.topology.is_closed().then(|| mesh.volume()),
            stored: topology(mesh),
            welded,
            shown: None,
        }
    }

    /// The table for people: as stored beside as welded, then the box, then the floor.
    fn table(&self) -> String {
        let (stored, welded) = (&self.stored, &self.welded.topology);
        let mut table = format!("{}\n\n{:24}{:>14}{:>14}\n", self.input, "", "as stored", "as welded");
        // Writing to a text cannot fail.
        let mut row = |name: &str, a: &dyn ToString, b: &dyn ToString| {
            let _ = writeln!(table, "{name:24}{:>14}{:>14}", a.to_string(), b.to_string());
        };
        let genus = |t: &Topology| t.genus.map_or_else(|| "-".to_string(), |genus| genus.to_string());
        row("vertices", &stored.vertices, &welded.vertices);
        row("faces", &stored.faces, &welded.faces);
        row("edges", &stored.edges, &welded.edges);
        row("components", &stored.components, &welded.components);
        row("Euler characteristic", &stored.euler, &welded.euler);
        row("genus", &genus(stored), &genus(welded));
        row("border loops", &stored.border_loops, &welded.border_loops);
        row("border edges", &stored.border_edges, &welded.border_edges);
        row("non-manifold edges", &stored.nonmanifold_edges, &welded.nonmanifold_edges);
        row("non-manifold vertices", &stored.nonmanifold_vertices, &welded.nonmanifold_vertices);
        row("misoriented edges", &stored.misoriented_edges, &welded.misoriented_edges);
        row("unreferenced vertices", &stored.unreferenced_vertices, &welded.unreferenced_vertices);
        row("degenerate faces", &stored.degenerate_faces, &welded.degenerate_faces);
        row("faces of no area", &stored.zero_area_faces, &welded.zero_area_faces);
        row("duplicate faces", &stored.duplicate_faces, &welded.duplicate_faces);

        table.push('\n');
        let mut line = |name: &str, text: String| {
            let _ = writeln!(table, "{}", format!("{name:24}{text}").trim_end());
        };
        let point = |p: [f64; 3]| p.map(|x| format!("{x:.6}")).join("  ");
        let listed = |kinds: &[(bool, &str)]| {
            let kinds = kinds.iter().filter(|(is_there, _)| *is_there).map(|(_, kind)| kind.to_string());
            kinds.collect::<Vec<_>>()
        };
        let channel = |channel: &ChannelRecord| channel.name.clone();
        let mut at_vertices = listed(&[(self.has_normals, "normals"), (self.has_colors, "colors")]);
        at_vertices.extend(self.channels.iter().map(channel));
        let at_corners = listed(&[(self.has_texcoords, "texture coordinates")]);
        let at_faces = listed(&[(self.has_face_colors, "colors")]);
        line("box from", point(self.bounds.low));
        line("box to", point(self.bounds.high));
        line("diagonal", format!("{:.6}", self.bounds.diagonal));
        if let Some(Shown { faces, bounds }) = &self.shown {
            line("shown by nodes", format!("{faces} faces, in a box of diagonal {:.6}", bounds.diagonal));
        }
        line("area", format!("{:.6}", self.area));
        line("volume", self.volume.map_or_else(|| "- (not closed)".into(), |volume| format!("{volume:.6}")));
        line("carried at vertices", if at_vertices.is_empty() { "nothing".into() } else { at_vertices.join(", ") });
        for (place, kinds) in [("carried at corners", at_corners), ("carried at faces", at_faces)] {
            if !kinds.is_empty() {
                line(place, kinds.join(", "));
            }
        }
        let heads = ["materials"].into_iter().chain(std::iter::repeat(""));
        for (material, head) in self.materials.iter().zip(heads) {
            let name = if material.name.is_empty() { "without a name" } else { &material.name };
            line(head, format!("{name}, {} faces", material.faces));
        }
        line("", String::new());
        line("fewest faces possible", self.welded.floor_faces.to_string());
        for reason in &self.welded.reasons {
            line("", reason.clone());
        }
        let ways = [
            (self.welded.parts.len() > 1, "parts join (--join-within) or go (--prune)"),
            (self.welded.parts.iter().any(|part| part.border_loops > 1), "holes close (--close-holes)"),
        ];
        let ways: Vec<&str> = ways.into_iter().filter_map(|(is_one, way)| is_one.then_some(way)).collect();
        if !ways.is_empty() {
            line("", format!("fewer only where {}", ways.join(", or ")));
        }
        table
    }
}
