//! The files of a chain.

use coarsen::formats::{self, Document, Format};
use coarsen::{Mesh, Outcome, lod};

use super::job::{Job, Outputs};
use crate::cli::simplify::warn_about;

/// Where the indices of each level are in their file, first and count; none where there is no such file.
pub type Ranges = Vec<[usize; 2]>;

/// Writes the levels, and the log where it is asked for. Each file appears when it is complete.
///
/// # Errors
/// As [`formats::write_scene`], and levels that do not share their vertices though they are to.
pub fn write(job: &Job, document: &Document, outcomes: &[Outcome]) -> anyhow::Result<Ranges> {
    let ranges = match &job.outputs {
        Outputs::Each(files) => {
            for (file, outcome) in files.iter().zip(outcomes) {
                let losses = formats::write_scene(&outcome.mesh, document, file, &job.setup.writing)?;
                warn_about(job.setup.verbosity, &job.setup.source, &losses);
            }
            Ranges::new()
        }
        Outputs::Shared { .. } => {
            let losses = outcomes.first().and_then(|outcome| left_out(&outcome.mesh, document));
            warn_about(job.setup.verbosity, &job.setup.source, losses.as_slice());
            write_shared(job, outcomes)?
        }
    };
    if let (Some(path), Some(log)) = (&job.setup.log, outcomes.iter().find_map(|outcome| outcome.log.as_ref())) {
        log.write(path)?;
    }
    Ok(ranges)
}

/// What levels that share their vertices are written without.
fn left_out(mesh: &Mesh, document: &Document) -> Option<String> {
    let has_nodes = matches!(document, Document::Gltf(_));
    let has_many = mesh.materials.as_ref().is_some_and(|materials| materials.names.len() > 1);
    let lost: Vec<&str> = [
        (has_nodes, "nodes"),
        (has_nodes || has_many, "materials and groups"),
        (mesh.texcoords.is_some(), "texture coordinates"),
    ]
    .into_iter()
    .filter_map(|(is_lost, what)| is_lost.then_some(what))
    .collect();
    (!lost.is_empty()).then(|| format!("levels that share their vertices are written without {}", lost.join(", ")))
}

fn write_shared(job: &Job, outcomes: &[Outcome]) -> anyhow::Result<Ranges> {
    let Outputs::Shared { file, indices } = &job.outputs else { return Ok(Ranges::new()) };
    let lod::SharedLevels { vertices, levels } = lod::share_vertices(outcomes)?;
    let Some(indices) = indices else {
        let named = (1..).zip(&levels).map(|(number, level)| (format!("lod{number}"), &level.faces[..]));
        formats::write_objects(&vertices, &named.collect::<Vec<_>>(), file)?;
        return Ok(Ranges::new());
    };
    debug_assert!(Format::from_path(file).is_ok_and(|(format, _)| format != Format::Obj));
    let (mut bytes, mut ranges) = (Vec::new(), Ranges::new());
    for level in &levels {
        ranges.push([bytes.len() / size_of::<u32>(), 3 * level.faces.len()]);
        bytes.extend(level.faces.as_flattened().iter().flat_map(|index| index.to_le_bytes()));
    }
    let finest = levels.into_iter().next().map(|level| level.faces).unwrap_or_default();
    formats::write(&Mesh { faces: finest, ..vertices }, file, &job.setup.writing)?;
    formats::write_file(indices, &bytes)?;
    Ok(ranges)
}
