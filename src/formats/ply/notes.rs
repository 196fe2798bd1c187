//! What the header of a PLY file says beside its mesh.

use super::header::{Element, Header, Kind, Role};
use super::looks::texture_file;

/// The comments of a PLY file, and what of it is not read.
#[derive(Debug, Clone, Default)]
pub struct Notes {
    comments: Vec<String>,
    /// In words, for a warning.
    skipped: Vec<String>,
}

impl Notes {
    pub(super) fn of(header: Header) -> Self {
        let with_rows = header.elements.iter().filter(|element| element.count > 0);
        Self { skipped: with_rows.flat_map(skipped).collect(), comments: header.comments }
    }

    /// The comments, each with its first word.
    pub fn comments(&self) -> &[String] {
        &self.comments
    }

    /// What a user should know of what another format loses.
    pub(in crate::formats) fn loss_elsewhere(&self) -> Option<String> {
        texture_file(&self.comments).map(|name| format!("the picture '{name}' that the PLY file names is not written"))
    }

    /// What a user should know of what is lost, whatever the mesh is written as.
    pub(in crate::formats) fn loss(&self) -> Option<String> {
        (!self.skipped.is_empty()).then(|| format!("not read of the PLY file, and lost: {}", self.skipped.join(", ")))
    }
}

/// What is not read of an element.
fn skipped(element: &Element) -> Vec<String> {
    let properties = || element.properties.iter().enumerate();
    let named = |name: &String| format!("'{name}' of the element '{}'", element.name);
    match &element.role {
        Role::Skipped => vec![format!("the element '{}'", element.name)],
        Role::Vertex(_) => {
            let lists = properties().filter(|(_, property)| matches!(property.kind, Kind::List { .. }));
            lists.map(|(_, property)| named(&property.name)).collect()
        }
        Role::Face(layout) => {
            let others = properties().filter(|(place, _)| !layout.reads(*place));
            others.map(|(_, property)| named(&property.name)).collect()
        }
    }
}
