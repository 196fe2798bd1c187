//! Which faces may be repetitions of each other: of those of two materials none is.

use super::Materials;

/// The layer of every face, by its number in a mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layers<'a>(Option<&'a [u32]>);

impl<'a> Layers<'a> {
    /// All faces are of one.
    pub const ONE: Self = Self(None);

    /// Those of each material are one, or all where there are no materials.
    pub fn new(materials: Option<&'a Materials>) -> Self {
        Self(materials.map(|materials| materials.of_face.as_slice()))
    }

    /// Those of one number are one.
    pub fn numbered(of_face: &'a [u32]) -> Self {
        Self(Some(of_face))
    }

    /// The number of a face; 0 where none is told.
    pub fn of(self, face: u32) -> u32 {
        self.0.and_then(|of_face| of_face.get(face as usize).copied()).unwrap_or(0)
    }

    /// The same of these faces, in their order; `None` where all are of one.
    pub fn of_faces(self, faces: &[u32]) -> Option<Vec<u32>> {
        self.0.map(|_| faces.iter().map(|&face| self.of(face)).collect())
    }
}
