//! Which pairs seams refuse, told from the faces that vanish and those beside them: where most vertices are on seams, most pairs are
//! refused here in every round, before anything else is gathered.

use crate::kernel::rows::SEAM;
use crate::mesh::adjacency::corner_of;

use super::filter::Rejection;
use super::patch::Patch;
use super::star::{Star, StarFace};
use super::wedges::WedgeRows;
use super::yielding::Yields;

/// The wedges of a face from one of its corners on, and the vertices that they are at now.
struct FaceWedges {
    vertices: [u32; 3],
    wedges: [u32; 3],
}

impl FaceWedges {
    #[inline(always)]
    fn new(
        &StarFace { face, others: [next, last] }: &StarFace,
        end: u32,
        patch: &Patch<'_>,
        rows: &WedgeRows<'_>,
    ) -> Self {
        let corner = corner_of(patch.connectivity.faces[face as usize].corners(), end);
        Self { vertices: [end, next, last], wedges: rows.wedges_from(face, corner) }
    }

    /// Its wedge at another of its vertices.
    #[inline(always)]
    fn wedge_at(&self, vertex: u32) -> u32 {
        self.wedges[1 + usize::from(self.vertices[2] == vertex)]
    }
}

/// Whether seams let a pair whose ends are both on one contract. Unless all yield it has to run along one, and no part may lose its
/// last face; a region of a material may not in any case.
///
/// # Errors
/// [`Rejection::Seam`] for a pair that they hold.
pub fn seams_let(patch: &Patch<'_>, pair: [u32; 2], star: &Star) -> Result<(), Rejection> {
    let Some(rows) = patch.wedges() else { return Ok(()) };
    let [first, second] = pair.map(|v| patch.position(v).flags);
    if first & second & SEAM == 0 {
        return Ok(());
    }
    let vanishing = Vanishing { patch, rows, pair, star };
    let is_held = match rows.layout.yields {
        Yields::Nothing => vanishing.runs_across(|a, b| a == b) || vanishing.is_last(|a, b| rows.now(a) == rows.now(b)),
        // Which agree have the same material.
        Yields::Creases | Yields::Corners => {
            let agree = |a: u32, b: u32| rows.agree_but_in_shading(a, b);
            vanishing.runs_across(agree) || vanishing.is_last(agree)
        }
        Yields::Seams => rows.asks_for_materials() && vanishing.is_last(|a, b| rows.same_material(a, b)),
    };
    if is_held { Err(Rejection::Seam) } else { Ok(()) }
}

/// The faces that vanish with a pair.
struct Vanishing<'a> {
    patch: &'a Patch<'a>,
    rows: &'a WedgeRows<'a>,
    pair: [u32; 2],
    star: &'a Star,
}

impl Vanishing<'_> {
    fn all(&self) -> impl Iterator<Item = FaceWedges> {
        self.star.shared().iter().map(|face| FaceWedges::new(face, self.pair[0], self.patch, self.rows))
    }

    /// Whether the faces on both sides of the pair agree in the wedges of its ends.
    fn runs_across(&self, agree: impl Fn(u32, u32) -> bool) -> bool {
        let mut sides = self.all().map(|face| [face.wedges[0], face.wedge_at(self.pair[1])]);
        sides.next().is_some_and(|one| sides.all(|other| agree(one[0], other[0]) && agree(one[1], other[1])))
    }

    /// Whether the edges of one of them from both ends to its third corner are seams, by which wedges `agree`: its side has no
    /// other face there.
    fn is_last(&self, agree: impl Fn(u32, u32) -> bool) -> bool {
        let [u, w] = self.pair;
        let beside = [(u, self.star.first()), (w, self.star.second())];
        self.all().zip(self.star.shared()).any(|(own, face)| {
            let tip = Star::opposite(face, w);
            let at_tip = own.wedge_at(tip);
            let at_ends = [own.wedges[0], own.wedge_at(w)];
            beside.iter().zip(at_ends).all(|(&(end, faces), at_end)| {
                faces.iter().filter(|other| other.has(tip)).any(|other| {
                    let other = FaceWedges::new(other, end, self.patch, self.rows);
                    !(agree(at_end, other.wedges[0]) && agree(at_tip, other.wedge_at(tip)))
                })
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::commit::Committer;
    use super::super::prepare::begin;
    use super::super::rules::Rules;
    use super::super::surface::Surface;
    use super::super::work::Quota;
    use super::super::{Candidates, Options};
    use super::*;
    use crate::backend::Device;
    use crate::kernel::rows::Candidate;
    use crate::math::{DVec3, Vec2, tie_hash};
    use crate::mesh::{Materials, Mesh, shapes};

    /// A plane of 10 × 10 squares in charts of a few faces, each of a material of its own, and the chart of each face.
    fn charted(seed: u32) -> (Mesh, Vec<u32>) {
        let mut mesh = shapes::plane(10, 10);
        let chart: Vec<u32> = (0..mesh.faces.len() as u32).map(|f| tie_hash(f / 3, seed) % 3).collect();
        let at = |(face, chart): (&[u32; 3], &u32)| {
            face.map(|v| Vec2::new((v % 11) as f32 + 20.0 * *chart as f32, (v / 11) as f32))
        };
        mesh.texcoords = Some(mesh.faces.iter().zip(&chart).map(at).collect());
        mesh.materials = Some(Materials { of_face: chart.clone(), names: vec![String::new(); 3] });
        (mesh, chart)
    }

    /// Whether faces told by their charts let an edge contract: it lies along a seam or may lie across, and no side loses its last face
    /// there.
    fn let_by_charts(faces: &[[u32; 3]], chart: &[u32], pair: [u32; 2], may_lie_across: bool) -> bool {
        let on = |ends: [u32; 2]| (0..faces.len()).filter(move |&f| ends.iter().all(|v| faces[f].contains(v)));
        let is_seam = |ends: [u32; 2], f: usize| on(ends).any(|other| chart[other] != chart[f]);
        let is_last = |f: usize| {
            let tip = faces[f].into_iter().find(|v| !pair.contains(v)).expect("a face has three corners");
            pair.iter().all(|&end| is_seam([end, tip], f))
        };
        (may_lie_across || on(pair).any(|f| is_seam(pair, f))) && !on(pair).any(is_last)
    }

    /// Compares what is let with what charts tell at all pairs whose ends took part in nothing; tells how many were held, and let.
    fn compare(patch: &Patch<'_>, chart: &[u32], yields: Yields) -> [usize; 2] {
        let now = |v: u32| patch.current(v).expect("the patch is the whole surface");
        let faces = patch.connectivity.faces.iter().map(|face| face.corners().map(now));
        let is_live = |([a, b, c], _): &([u32; 3], u32)| a != b && b != c && c != a;
        let (faces, chart): (Vec<_>, Vec<_>) = faces.zip(chart.iter().copied()).filter(is_live).unzip();
        let is_asked = |pair: &[u32; 2]| pair.iter().all(|&v| patch.is_free(v) && patch.position(v).flags & SEAM != 0);
        let mut told = [0; 2];
        for pair in faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).filter(is_asked) {
            let mut star = Star::default();
            star.gather(pair, DVec3::X, patch).expect("the patch is the whole surface");
            let expected = let_by_charts(&faces, &chart, pair, yields == Yields::Seams);
            assert_eq!(seams_let(patch, pair, &star).is_ok(), expected, "{pair:?}, {yields:?}");
            told[usize::from(expected)] += 1;
        }
        told
    }

    #[test]
    fn pairs_are_let_along_seams_that_bound_more_than_a_face() {
        let (device, options) = (Device::cpu(1).expect("a device"), Options::default());
        let (mut told, mut contracted) = ([[0; 2]; 2], 0);
        for (seed, yields) in
            (0..8).flat_map(|seed| [Yields::Nothing, Yields::Corners, Yields::Seams].map(|yields| (seed, yields)))
        {
            let (mesh, chart) = charted(seed);
            let mut prepared = begin(&mesh, &options).expect("a valid mesh");
            let seams = prepared.seam_flags(&mesh, yields, &options);
            prepared.flag_seams(&mesh, &seams, yields);
            let chart: Vec<u32> = prepared.carried.face_origin.iter().map(|&f| chart[f as usize]).collect();
            let start = prepared.take_start();
            let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
            let mut add = |which: usize, [held, allowed]: [usize; 2]| {
                told[which][0] += held;
                told[which][1] += allowed;
            };
            add(0, compare(&Patch::whole(&mut surface, &mut prepared.carried), &chart, yields));
            // And again where some were contracted in the same round.
            let half_edges = (0..3 * surface.face_count as u32).step_by(7);
            let mut candidates: Vec<Candidate> = half_edges.map(|half_edge| Candidate { key: 0, half_edge }).collect();
            let mut committer =
                Committer::new(Rules::new(&options, false, f64::INFINITY), surface.vertex_count, (0, 0.0));
            let quota = Quota { faces: 60, of: Candidates::Pairs, may_overshoot: false };
            let carried = &mut prepared.carried;
            contracted += committer.commit(&mut surface, carried, &mut candidates, &[], quota, false).0.contracted;
            add(1, compare(&Patch::whole(&mut surface, carried), &chart, yields));
        }
        assert!(told.as_flattened().iter().all(|&count| count > 100) && contracted > 100, "{told:?}, {contracted}");
    }
}
