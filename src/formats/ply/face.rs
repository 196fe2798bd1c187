//! Where the values of a face stand in its row, and faces of any number of corners.

use super::FORMAT;
use super::color::ColorLayout;
use super::header::{Kind, Property};
use super::scalar::Scalar;
use crate::error::{Error, Place, Result};
use crate::formats::attributes;
use crate::formats::polygon::Triangulator;
use crate::math::Vec2;
use crate::mesh::Mesh;

/// The places of the values in the row, as indices of properties.
#[derive(Debug)]
pub(super) struct FaceLayout {
    pub(super) corners: usize,
    /// Two numbers a corner.
    pub(super) texcoords: Option<usize>,
    pub(super) color: Option<ColorLayout>,
}

impl FaceLayout {
    /// Finds the lists by their names.
    ///
    /// # Errors
    /// [`Error::Format`] when there are no corners.
    pub(super) fn of(properties: &[Property]) -> Result<Self> {
        let list = |names: &[&str], is_item: fn(Scalar) -> bool| {
            properties.iter().position(|property| {
                names.contains(&property.name.as_str())
                    && matches!(property.kind, Kind::List { item, .. } if is_item(item))
            })
        };
        let Some(corners) = list(&["vertex_indices", "vertex_index"], |_| true) else {
            let message = "the element 'face' has no list 'vertex_indices' or 'vertex_index'";
            return Err(Error::format(FORMAT, Place::File, message));
        };
        Ok(Self { corners, texcoords: list(&["texcoord"], Scalar::is_float), color: ColorLayout::of(properties) })
    }

    /// Whether the property at this place is read.
    pub(super) fn reads(&self, place: usize) -> bool {
        let is_color = self.color.as_ref().is_some_and(|color| color.contains(place));
        place == self.corners || self.texcoords == Some(place) || is_color
    }
}

/// The faces of a mesh as they are read, row by row.
pub(super) struct Faces<'a> {
    pub(super) mesh: &'a mut Mesh,
    /// The corners of the row.
    pub(super) corners: Vec<u32>,
    /// The row's texture coordinates, two numbers a corner or none.
    pub(super) texcoords: Vec<f64>,
    /// The row's color, where the layout has one.
    pub(super) color: [f32; 4],
    has_texcoords: bool,
    triangulator: Triangulator,
    pairs: Vec<Vec2>,
}

impl<'a> Faces<'a> {
    pub(super) fn new(mesh: &'a mut Mesh, layout: &FaceLayout) -> Self {
        mesh.texcoords = layout.texcoords.map(|_| Vec::new());
        mesh.face_colors = layout.color.as_ref().map(|_| Vec::new());
        Self {
            mesh,
            corners: Vec::new(),
            texcoords: Vec::new(),
            color: [0.0; 4],
            has_texcoords: false,
            triangulator: Triangulator::new(),
            pairs: Vec::new(),
        }
    }

    /// Ends a row, whose corners must be vertices of the mesh.
    ///
    /// # Errors
    /// What was found when the texture coordinates are not two a corner.
    #[inline]
    pub(super) fn end_row(&mut self) -> std::result::Result<(), String> {
        if !self.texcoords.is_empty() {
            self.pair_up()?;
        }
        self.triangulator.append(&self.corners, &self.pairs, self.mesh);
        if let Some(colors) = &mut self.mesh.face_colors {
            colors.resize(self.mesh.faces.len(), self.color);
        }
        self.corners.clear();
        self.texcoords.clear();
        self.pairs.clear();
        Ok(())
    }

    fn pair_up(&mut self) -> std::result::Result<(), String> {
        if self.texcoords.len() != 2 * self.corners.len() {
            return Err(format!(
                "found a face of {} corners with {} texture coordinates, expected {} or none",
                self.corners.len(),
                self.texcoords.len(),
                2 * self.corners.len()
            ));
        }
        self.has_texcoords = true;
        self.pairs.extend(self.texcoords.chunks_exact(2).map(|pair| attributes::texcoord(pair[0], pair[1])));
        Ok(())
    }

    /// Ends the rows: texture coordinates that no face has are none.
    pub(super) fn end(self) {
        if !self.has_texcoords {
            self.mesh.texcoords = None;
        }
    }
}
