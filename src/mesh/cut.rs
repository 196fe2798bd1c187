//! Cuts a surface apart where it only touches itself: a vertex becomes one for each of the fans around it \[GTLH98\].
//!
//! ```text
//!    \ A /            A and B hang together at nothing but a vertex, or at an edge that A1, A2, B1 and B2 share. Faces are
//!     \ /    A1\ /B1  joined across such an edge in pairs that run along it in opposite directions, as flat as they can be:
//!      v     ---e---  no face is folded onto another unless all ways fold one. What is left around a vertex are fans, and
//!     / \    A2/ \B2  each but the first gets a copy of it.
//!    / B \
//! ```
//!
//! Nothing opens: an edge that borders nothing before borders nothing after. Faces on an edge that cannot be paired, an odd
//! number or two in one direction, stay together, and their vertices what they are.

use rayon::prelude::*;

use crate::math::DVec3;

use super::adjacency::{EdgeUse, Rings};
use super::copies::{Copies, hand_out};
use super::disjoint::DisjointSets;
use super::fan::{self, Fan, VERTICES_EACH};

/// Steps that flatness is compared in: what rounding makes of one angle is no difference.
const STEPS: f64 = 1024.0;

/// The cosine of the angle between two faces that lie on each other: of less than a degree.
const FOLDED: f64 = 0.9999;

/// Cuts `faces` at the vertices whose fan is complex: renames their corners, and puts rings and fans right. Returns the vertex
/// that each was, ascending, a copy after the vertex that it is of; `None` where there is nothing to cut.
pub(crate) fn cut(
    faces: &mut [[u32; 3]],
    rings: &mut Rings,
    fans: &mut Vec<Fan>,
    position: impl Fn(u32) -> DVec3 + Sync,
) -> Option<Vec<u32>> {
    let surface = Surface { faces, rings, position: &position };
    // A filter before it would move the scratch for every vertex.
    let copies = |scratch: &mut Scratch, (v, fan): (usize, &Fan)| {
        (*fan == Fan::Complex).then(|| surface.copies(v as u32, scratch)).flatten()
    };
    let vertices = fans.par_iter().enumerate().with_min_len(VERTICES_EACH);
    let all: Vec<Copies> = vertices.map_init(Scratch::default, copies).flatten_iter().collect();
    if all.is_empty() {
        return None;
    }
    let was = hand_out(faces, rings, &all);
    let surface = Surface { faces, rings, position: |v: u32| position(was[v as usize]) };
    let fan = |scratch: &mut Scratch, v: u32| match fans[was[v as usize] as usize] {
        Fan::Complex if surface.is_folded(v, scratch) => Fan::Complex,
        Fan::Complex => scratch.fans.fan(surface.faces, surface.rings.ring(v), v),
        // All faces at an edge of one fan go to one copy of its far end.
        simple => simple,
    };
    *fans = (0..was.len() as u32).into_par_iter().with_min_len(VERTICES_EACH).map_init(Scratch::default, fan).collect();
    Some(was)
}

/// Room that outlives a vertex.
#[derive(Default)]
struct Scratch {
    uses: Vec<EdgeUse>,
    fans: fan::Scratch,
}

/// What is cut.
struct Surface<'a, P> {
    faces: &'a [[u32; 3]],
    rings: &'a Rings,
    position: P,
}

impl<P: Fn(u32) -> DVec3> Surface<'_, P> {
    /// The copies that a vertex needs, if any.
    fn copies(&self, vertex: u32, scratch: &mut Scratch) -> Option<Copies> {
        let ring = self.rings.ring(vertex);
        let place = |used: EdgeUse| ring.partition_point(|&f| f < used.face()) as u32;
        let mut parts = DisjointSets::new(ring.len());
        for uses in self.rings.edges_at(self.faces, vertex, &mut scratch.uses) {
            let mut join = |a: EdgeUse, b: EdgeUse| parts.join(place(a), place(b));
            match self.pairs(vertex, uses) {
                Some(pairs) => pairs.into_iter().for_each(|[a, b]| {
                    join(a, b);
                }),
                // The two of an edge, and what cannot be told apart.
                None => uses.windows(2).for_each(|two| {
                    join(two[0], two[1]);
                }),
            }
        }
        Copies::of_parts(vertex, ring, &mut parts)
    }

    /// The two pairs in which the four faces on an edge go on; `None` for other numbers of faces, and where not two of them run
    /// either way.
    fn pairs(&self, vertex: u32, uses: &[EdgeUse]) -> Option<[[EdgeUse; 2]; 2]> {
        // Of more the flattest would pass through each other.
        let mut four: [EdgeUse; 4] = uses.try_into().ok()?;
        // Those that run outward first, in their order.
        four.sort_by_key(|used| !used.outward());
        let are_even = four[1].outward() && !four[2].outward();
        are_even.then(|| self.flattest(four, vertex).map(|pair| pair.map(|i| four[i])))
    }

    /// The flatter of the two ways to pair the first two uses of an edge with the others; where both are as flat that of bodies,
    /// not of the room between them.
    fn flattest(&self, uses: [EdgeUse; 4], vertex: u32) -> [[usize; 2]; 2] {
        let far = uses[0].far();
        // The same from either end.
        let ends = [vertex.min(far), vertex.max(far)];
        let wings = uses.map(|used| self.wing(used.face(), ends));
        let worth = |way: [[usize; 2]; 2]| {
            let steps =
                |of: fn(&Wing, &Wing) -> f64| way.map(|[a, b]| (of(&wings[a], &wings[b]) * STEPS).round() as i64);
            let flat = steps(|a, b| -a.away.dot(b.away));
            let bulging = steps(|a, b| -a.normal.dot(b.away) - b.normal.dot(a.away));
            (flat[0].min(flat[1]), flat[0] + flat[1], bulging[0] + bulging[1])
        };
        let [straight, crossed] = [[[0, 2], [1, 3]], [[0, 3], [1, 2]]];
        if worth(crossed) > worth(straight) { crossed } else { straight }
    }

    /// Whether two faces at a vertex lie on each other: nothing but they themselves shows where they end, and no quadric does.
    fn is_folded(&self, vertex: u32, scratch: &mut Scratch) -> bool {
        self.rings.edges_at(self.faces, vertex, &mut scratch.uses).any(|uses| {
            let &[a, b] = uses else { return false };
            let [a, b] = [a, b].map(|used| self.away(used.face(), [vertex, used.far()]));
            // Most faces bend by less than a right angle, which lengths are not needed for.
            a.dot(b) > 0.0 && a.normalize_or_zero().dot(b.normalize_or_zero()) > FOLDED
        })
    }

    /// A face seen along an edge of it.
    fn wing(&self, face: u32, edge: [u32; 2]) -> Wing {
        let [p, q, r] = self.faces[face as usize].map(&self.position);
        Wing { away: self.away(face, edge).normalize_or_zero(), normal: (q - p).cross(r - p).normalize_or_zero() }
    }

    /// The way from an edge of a face to its third corner, square to the edge.
    fn away(&self, face: u32, [a, b]: [u32; 2]) -> DVec3 {
        let corners = self.faces[face as usize];
        let tip = corners.into_iter().find(|&v| v != a && v != b).unwrap_or(corners[0]);
        let [at_a, at_b, tip] = [a, b, tip].map(&self.position);
        let (along, to_tip) = (at_b - at_a, tip - at_a);
        to_tip - along * (to_tip.dot(along) / along.length_squared())
    }
}

/// A face at an edge.
struct Wing {
    /// Where it lies from the edge, square to it, of length one; zero where it has no area.
    away: DVec3,
    /// The side it faces, of length one.
    normal: DVec3,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::fan::fans;
    use super::super::{Mesh, shapes, topology};
    use super::*;

    /// What each vertex of a mesh that was cut had been, and its fan.
    struct Cut {
        was: Vec<u32>,
        fans: Vec<Fan>,
    }

    /// A mesh that was cut; `None` where there was nothing to cut.
    fn cut_mesh(mesh: &Mesh) -> Option<(Mesh, Cut)> {
        let mut rings = Rings::new(&mesh.faces, mesh.positions.len());
        let mut faces = mesh.faces.clone();
        let mut found = fans(&faces, &rings);
        let was = cut(&mut faces, &mut rings, &mut found, |v| mesh.positions[v as usize])?;
        assert_eq!(rings, Rings::new(&faces, was.len()));
        for (fan, expected) in found.iter().zip(fans(&faces, &rings)) {
            // Folds are held.
            assert!(*fan == expected || *fan == Fan::Complex);
        }
        let positions = was.iter().map(|&v| mesh.positions[v as usize]).collect();
        Some((Mesh::new(positions, faces), Cut { was, fans: found }))
    }

    /// A square sheet and its back: both have the same vertices.
    fn doubled_sheet(n: u32) -> Mesh {
        let mut sheet = shapes::plane(n, n);
        sheet.faces.extend(sheet.faces.clone().into_iter().map(|[a, b, c]| [a, c, b]));
        sheet
    }

    #[test]
    fn what_touches_comes_apart() {
        // Cubes on one edge, on one corner; squares on one corner.
        let on_an_edge = |[x, y, _]: [i32; 3]| x == y;
        let on_a_corner = |[x, y, z]: [i32; 3]| x == y && y == z;
        for (name, mesh, parts, copies) in [
            ("on an edge", shapes::voxels([2, 2, 1], on_an_edge), 2, 2),
            ("on a corner", shapes::voxels([2, 2, 2], on_a_corner), 2, 1),
            ("squares", shapes::bow_tie(), 2, 1),
        ] {
            let (apart, Cut { was, fans }) = cut_mesh(&mesh).unwrap_or_else(|| panic!("{name}: not cut"));
            let found = topology(&apart);
            assert!(found.is_manifold() && !fans.contains(&Fan::Complex), "{name}: {found:?}");
            assert_eq!((found.components, was.len()), (parts, mesh.positions.len() + copies), "{name}");
            let volumes = [&mesh, &apart].map(Mesh::volume);
            assert_eq!((found.border_edges, volumes[0]), (topology(&mesh).border_edges, volumes[1]), "{name}");
        }
    }

    #[test]
    fn a_vertex_of_very_many_fans_is_no_trap() {
        let count = 100_000;
        let places = (0..1 + 2 * count).map(|i| DVec3::new(f64::from(i), f64::from(i % 2), 1.0));
        let mesh = Mesh::new(places.collect(), (0..count).map(|i| [0, 2 * i + 1, 2 * i + 2]).collect());
        let clock = std::time::Instant::now();
        let (apart, Cut { was, .. }) = cut_mesh(&mesh).expect("it touches itself");
        assert_eq!((topology(&apart).components, was.len()), (count as usize, 3 * count as usize));
        assert!(clock.elapsed().as_secs() < 10, "{:?}", clock.elapsed());
    }

    #[test]
    fn what_cannot_be_paired_stays() {
        assert!(cut_mesh(&shapes::fan3()).is_none() && cut_mesh(&shapes::moebius(9)).is_none());
        assert!(cut_mesh(&shapes::torus(5, 4)).is_none());
        // Two faces on either side, but both of one side run along the edge in one direction.
        let mut cross = shapes::fan3();
        cross.positions.push(DVec3::new(0.0, -1.0, 0.0));
        cross.faces.push([0, 1, 5]);
        assert!(cut_mesh(&cross).is_none());
    }

    #[test]
    fn sheets_back_to_back_go_on_as_flat_as_they_are() {
        [1.0, 1e-3, 1e3].into_iter().for_each(check_sheets);
    }

    /// Of a doubled sheet of such squares.
    fn check_sheets(side: f64) {
        let mut sheet = doubled_sheet(4);
        sheet.positions.iter_mut().for_each(|p| *p *= side);
        let (apart, Cut { was, fans, .. }) = cut_mesh(&sheet).expect("it touches itself");
        assert_eq!((topology(&apart).components, topology(&apart).border_edges, was.len()), (1, 0, 25 + 9));
        // Every vertex inside became one of the front and one of the back. Where these end on each other nothing moves.
        for (v, &before) in was.iter().enumerate() {
            let p = apart.positions[v];
            let is_inside = [p.x, p.y].iter().all(|&x| 0.0 < x && x < 4.0 * side);
            assert_eq!(was.iter().filter(|&&other| other == before).count(), if is_inside { 2 } else { 1 });
            let ring: Vec<_> = apart.faces.iter().filter(|face| face.contains(&(v as u32))).collect();
            let is_alone = ring.len() == 2;
            assert_eq!(fans[v] == Fan::Complex, !is_inside && !is_alone, "{p}");
        }
    }

    #[test]
    fn sharp_edges_are_no_folds() {
        // A tetrahedron and its image in one of its corners, with edges of 70°.
        let mut mesh = shapes::tetrahedron();
        mesh.positions.iter_mut().for_each(|p| *p *= 1e3);
        let corner = mesh.positions[0];
        let image: Vec<DVec3> = mesh.positions[1..].iter().map(|&p| 2.0 * corner - p).collect();
        let number = |v: u32| if v == 0 { 0 } else { v + 3 };
        let faces: Vec<[u32; 3]> = mesh.faces.iter().map(|&[a, b, c]| [a, c, b].map(number)).collect();
        mesh.positions.extend(image);
        mesh.faces.extend(faces);
        let (apart, Cut { fans, .. }) = cut_mesh(&mesh).expect("it touches itself");
        assert_eq!((topology(&apart).components, fans), (2, vec![Fan::Closed; 8]));
    }

    #[test]
    fn a_fin_stays_on_what_it_stands_on() {
        // A floor of four squares, and a doubled square of four faces a side that stands on the line between them.
        let mut mesh = shapes::plane(2, 2);
        let line: Vec<u32> = (0..9).filter(|&v| mesh.positions[v as usize].x == 1.0).collect();
        let [low, middle, high] = line[..] else { panic!("three on a line") };
        mesh.positions.extend([0.0, 1.0, 2.0].map(|y| DVec3::new(1.0, y, 1.0)));
        let front = [[low, middle, 10], [middle, high, 10], [low, 10, 9], [high, 11, 10]];
        mesh.faces.extend(front);
        mesh.faces.extend(front.map(|[a, b, c]| [a, c, b]));
        let (apart, Cut { was, .. }) = cut_mesh(&mesh).expect("it touches itself");
        let [before, after] = [&mesh, &apart].map(topology);
        assert_eq!((after.components, after.border_edges), (1, before.border_edges));
        // The floor goes up the fin on either side; where the fin's own rim meets the floor's these are one fan.
        let copies = |v: u32| was.iter().filter(|&&before| before == v).count();
        assert_eq!([low, middle, high].map(copies), [1, 2, 1]);
        assert!(after.nonmanifold_edges < before.nonmanifold_edges);
    }

    proptest! {
        /// Faces keep their corners, no border opens or closes, and nothing that was one fan is touched.
        #[test]
        fn nothing_opens(
            faces in prop::collection::vec([0u32..7, 0u32..7, 0u32..7], 0..16),
            places in prop::collection::vec([-3i8..4, -3i8..4, -3i8..4], 7),
        ) {
            let faces: Vec<_> = faces.into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect();
            let mesh = Mesh::new(places.into_iter().map(|p| DVec3::from(p.map(f64::from))).collect(), faces);
            let uses = |mesh: &Mesh, was: &dyn Fn(u32) -> u32| {
                let rings = Rings::new(&mesh.faces, mesh.positions.len());
                let (mut borders, mut most, mut scratch) = (Vec::new(), 0, Vec::new());
                for v in 0..mesh.positions.len() as u32 {
                    for uses in rings.edges_at(&mesh.faces, v, &mut scratch) {
                        most = most.max(uses.len());
                        if let [one] = uses {
                            borders.push([was(v), was(one.far()), one.face()]);
                        }
                    }
                }
                borders.sort_unstable();
                (borders, most)
            };
            let before = fans(&mesh.faces, &Rings::new(&mesh.faces, 7));
            let Some((apart, Cut { was, fans: after, .. })) = cut_mesh(&mesh) else {
                return Ok(());
            };
            let named: Vec<_> = apart.faces.iter().map(|face| face.map(|v| was[v as usize])).collect();
            prop_assert_eq!(&named, &mesh.faces);
            prop_assert!(was.is_sorted() && was.len() > 7);
            let (borders, most) = uses(&mesh, &|v| v);
            let (left, less) = uses(&apart, &|v| was[v as usize]);
            prop_assert_eq!(left, borders);
            prop_assert!(less <= most);
            let single = (0..7).filter(|&v| before[v as usize] != Fan::Complex);
            for v in single {
                let copies: Vec<_> = (0..was.len()).filter(|&copy| was[copy] == v).map(|copy| after[copy]).collect();
                prop_assert_eq!(copies, vec![before[v as usize]]);
            }
        }
    }
}
