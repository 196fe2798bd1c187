//! Faces joined into polygons.

use super::Mesh;
use crate::error::{Error, Result};

/// Polygons in compressed rows, the first in the place of the first faces of a mesh and so on: one of k corners for k − 2 faces.
///
/// Every polygon is one ring, counter-clockwise as the faces are. Its holes are joined to what surrounds them by bridges: edges
/// that it has both ways.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Polygons {
    /// Where the corners of every polygon start, and the number of corners.
    pub starts: Vec<u32>,
    /// Vertices of the mesh.
    pub corners: Vec<u32>,
}

impl Polygons {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The corners of a polygon.
    pub fn corners_of(&self, polygon: usize) -> &[u32] {
        &self.corners[self.starts[polygon] as usize..self.starts[polygon + 1] as usize]
    }

    /// The corners of every polygon.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        (0..self.len()).map(|polygon| self.corners_of(polygon))
    }

    /// The first of the faces in whose place a polygon is.
    pub fn first_face(&self, polygon: usize) -> usize {
        self.starts[polygon] as usize - 2 * polygon
    }

    /// Whether they are polygons of `mesh`.
    ///
    /// # Errors
    /// [`Error::Mesh`] for a polygon of fewer than three corners, a corner that is no vertex, and another number of faces.
    pub fn check(&self, mesh: &Mesh) -> Result<()> {
        let wrong = |message: String| Err(Error::Mesh(message));
        let ends = [self.starts.first(), self.starts.last()].map(|end| end.map_or(0, |&end| end as usize));
        if ends != [0, self.corners.len()] {
            return wrong(format!("rows of {ends:?} for {} corners of polygons", self.corners.len()));
        }
        if let Some(at) = self.starts.windows(2).position(|ends| ends[1] < ends[0].saturating_add(3)) {
            return wrong(format!("polygon {at} has fewer than three corners"));
        }
        if let Some(corner) = self.corners.iter().find(|&&corner| corner as usize >= mesh.positions.len()) {
            return wrong(format!("a polygon has vertex {corner} of {}", mesh.positions.len()));
        }
        match self.corners.len() - 2 * self.len() {
            faces if faces == mesh.faces.len() => Ok(()),
            faces => wrong(format!("polygons in the place of {faces} faces for a mesh of {}", mesh.faces.len())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::cube;

    #[test]
    fn what_is_no_polygon_of_a_mesh_is_told() {
        let mesh = cube(1);
        let quads = |edit: fn(&mut Polygons)| {
            let mut polygons = Polygons { starts: (0..=6).map(|i| 4 * i).collect(), corners: vec![0; 24] };
            edit(&mut polygons);
            polygons.check(&mesh).map_err(|error| error.to_string())
        };
        assert_eq!(quads(|_| ()), Ok(()));
        assert!(Polygons::default().check(&Mesh::default()).is_ok() && Polygons::default().is_empty());
        for (edit, part) in [
            ((|p| p.corners[7] = 8) as fn(&mut Polygons), "vertex 8 of 8"),
            (|p| p.starts[3] = 6, "polygon 2 has fewer"),
            (|p| p.starts[3] = 60, "polygon 3 has fewer"),
            (|p| p.starts[6] = 23, "for 24 corners"),
            (|p| p.corners.push(0), "for 25 corners"),
            (|p| _ = p.starts.remove(3), "14 faces for a mesh of 12"),
            (|p| *p = Polygons::default(), "0 faces"),
        ] {
            let error = quads(edit).expect_err(part);
            assert!(error.contains(part), "{error}");
        }
    }
}
