//! The fewest faces that the parts of a surface leave a run: the regions of faces which seams bound that hold.

use crate::mesh::Mesh;
use crate::mesh::disjoint::DisjointSets;

use super::seam_flags::standing;
use super::wedges::Wedges;
use super::yielding::Yields;

/// Faces that a part keeps at least, where it has as many: none may lose its last one, and hardly any comes to that. A scan with
/// 4,740 charts, of which 1,987 are one face, gets stuck with 2.6 faces a chart.
const KEPT_EACH: u32 = 2;

impl Wedges {
    /// About the fewest faces that parts leave: where all seams hold but creases, and where none does but between materials.
    pub fn least_faces_of_parts(&self, mesh: &Mesh) -> [usize; 2] {
        let (_, starts) = self.connectivity();
        let materials = self.materials_for(mesh, Yields::Corners);
        let of_charts = standing(self, &materials, starts, |a, b| self.layout.agree_but_in_shading(a, b));
        let of_materials = standing(self, &materials, starts, |_, _| true);
        [of_charts, of_materials].map(|standing| self.kept_by_parts(&standing))
    }

    /// About the fewest faces of parts that are one where wedges are, each stood for by one of its vertex. Parts that meet in a wedge
    /// count as one: that is fewer faces, not more.
    fn kept_by_parts(&self, standing: &[u32]) -> usize {
        let (corners, _) = self.connectivity();
        let mut parts = DisjointSets::new(standing.len());
        for face in corners {
            let [a, b, c] = face.corners().map(|wedge| standing[wedge as usize]);
            parts.join(a, b);
            parts.join(a, c);
        }
        let mut faces = vec![0; standing.len()];
        corners.iter().for_each(|face| faces[parts.find(standing[face.a as usize]) as usize] += 1);
        faces.into_iter().map(|faces: u32| faces.min(KEPT_EACH) as usize).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::prepare::prepare;
    use crate::math::Vec2;
    use crate::mesh::{Materials, shapes};

    /// About the fewest faces of a plane of 4 × 4 squares, whose faces are in these charts and have these materials.
    fn least(chart: impl Fn(usize) -> usize, material: impl Fn(usize) -> u32) -> [usize; 2] {
        let mut mesh = shapes::plane(4, 4);
        let at = |(f, face): (usize, &[u32; 3])| {
            face.map(|v| Vec2::new((v % 5) as f32 + 10.0 * chart(f) as f32, (v / 5) as f32))
        };
        mesh.texcoords = Some(mesh.faces.iter().enumerate().map(at).collect());
        let of_face = (0..mesh.faces.len()).map(material).collect();
        mesh.materials = Some(Materials { of_face, names: vec![String::new(); 32] });
        let prepared = prepare(&mesh, &Options::default()).expect("a valid mesh");
        prepared.carried.wedges.expect("a texture").least_faces_of_parts(&mesh)
    }

    #[test]
    fn a_part_keeps_two_faces_if_it_has_as_many() {
        let of_charts = |each: usize| least(|f| f / each, |_| 0);
        assert_eq!([32, 16, 2, 1].map(of_charts), [[2, 2], [4, 2], [32, 2], [32, 2]]);
        // One of five faces and others of one.
        assert_eq!(least(|f| f.saturating_sub(4), |_| 0), [2 + 27, 2]);
        // Materials part what no chart does.
        assert_eq!(least(|_| 0, |f| (f / 8) as u32), [8, 8]);
    }
}
