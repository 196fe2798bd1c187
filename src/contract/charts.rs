//! What charts keep: the regions of faces that seams bound which do not yield.

use crate::mesh::Mesh;
use crate::mesh::disjoint::DisjointSets;

use super::seam_flags::standing;
use super::wedges::Wedges;
use super::yielding::Yields;

/// Faces that a chart keeps at least, where it has as many: none may lose its last one, and hardly any comes to that. A scan with
/// 4,740 charts, of which 1,987 are one face, gets stuck with 2.6 faces a chart.
const KEPT_EACH: u32 = 2;

impl Wedges {
    /// About the fewest faces that charts leave a run in which such seams yield, but not all.
    pub fn least_faces_of_charts(&self, mesh: &Mesh, yields: Yields) -> usize {
        let (corners, starts) = self.connectivity();
        let standing = standing(self, &self.materials_for(mesh, yields), starts);
        // Charts that meet in one wedge of a vertex count as one: fewer are left then, not more.
        let wedges = |face: [u32; 3]| face.map(|wedge| standing[wedge as usize]);
        let mut charts = DisjointSets::new(standing.len());
        for face in corners {
            let [a, b, c] = wedges(face.corners());
            charts.join(a, b);
            charts.join(a, c);
        }
        let mut faces = vec![0; standing.len()];
        corners.iter().for_each(|face| faces[charts.find(standing[face.a as usize]) as usize] += 1);
        faces.into_iter().map(|faces: u32| faces.min(KEPT_EACH) as usize).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::prepare::prepare;
    use super::*;
    use crate::math::Vec2;
    use crate::mesh::shapes;

    /// About the fewest faces of a plane of 4 × 4 squares, whose faces are in these charts.
    fn least(chart: impl Fn(usize) -> usize) -> usize {
        let mut mesh = shapes::plane(4, 4);
        let at = |(f, face): (usize, &[u32; 3])| {
            face.map(|v| Vec2::new((v % 5) as f32 + 10.0 * chart(f) as f32, (v / 5) as f32))
        };
        mesh.texcoords = Some(mesh.faces.iter().enumerate().map(at).collect());
        let prepared = prepare(&mesh, &Options::default()).expect("a valid mesh");
        assert_eq!(prepared.least_faces_of_charts(&mesh, Yields::Seams), 0);
        prepared.least_faces_of_charts(&mesh, Yields::Corners)
    }

    #[test]
    fn a_chart_keeps_two_faces_if_it_has_as_many() {
        assert_eq!([least(|_| 0), least(|f| f / 16), least(|f| f / 2), least(|f| f)], [2, 4, 32, 32]);
        // One of five faces and others of one.
        assert_eq!(least(|f| f.saturating_sub(4)), 2 + 27);
    }
}
