//! The borders of regions: loops around each, cut into chains that both sides share.
//!
//! A half-edge is numbered `3 f + k`, the edge `k` of face `f`; it is on the boundary where what lies across is another region
//! or a wall. A loop follows its region's half-edges, turning inside the region at every vertex, so that a region pinched at a
//! vertex passes it twice and never crosses itself:
//! ```text
//!        ╲ A ╱              the loop of A comes down on the left and goes up on the right;
//!     B   ╲ ╱   B           that of the lower part of A, where the two hang together elsewhere,
//!         ╱ ╲               passes the vertex a second time
//!        ╱ A ╲
//! ```

use rayon::prelude::*;

use super::Partition;
use super::surface::Surface;
use crate::mesh::adjacency::group;
use crate::mesh::dual::edge_of;

/// Half-edges that a thread takes at a time.
const ROWS: usize = 1 << 12;
/// No place: a half-edge inside a region, an edge without a chain yet.
const NONE: u32 = u32::MAX;

/// A chain as a loop passes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leg(u32);

impl Leg {
    fn new(chain: u32, reversed: bool) -> Self {
        Self(chain << 1 | u32::from(reversed))
    }

    /// The chain.
    pub fn chain(self) -> usize {
        (self.0 >> 1) as usize
    }

    /// Whether it is passed from its end to its start.
    pub fn is_reversed(self) -> bool {
        self.0 & 1 == 1
    }
}

/// Loops and chains of a partition, in compressed rows.
///
/// # Invariants
/// - Every boundary edge of the surface is in one chain, once; the ends of a chain are junctions, or the same vertex where a
///   loop meets none.
/// - Every boundary half-edge is in one leg of one loop of its region, and a leg is a whole chain.
#[derive(Debug, Default)]
pub struct Boundary {
    /// C + 1 starts into `chain_vertices`.
    pub chain_starts: Vec<u32>,
    /// The vertices of every chain from end to end; one without a junction ends where it starts.
    pub chain_vertices: Vec<u32>,
    /// R + 1 starts into `loop_starts`.
    pub region_starts: Vec<u32>,
    /// L + 1 starts into `legs`.
    pub loop_starts: Vec<u32>,
    /// The chains of every loop in order.
    pub legs: Vec<Leg>,
}

impl Boundary {
    /// The boundary of `partition`.
    pub fn new(surface: &Surface, partition: &Partition) -> Self {
        Graph::new(surface, partition).follow(partition)
    }

    /// How many chains there are.
    pub fn chain_count(&self) -> usize {
        self.chain_starts.len() - 1
    }

    /// The places of a chain's vertices in `chain_vertices`.
    pub fn places(&self, chain: usize) -> std::ops::Range<usize> {
        self.chain_starts[chain] as usize..self.chain_starts[chain + 1] as usize
    }

    /// The chain that has a place.
    pub fn chain_at(&self, place: usize) -> usize {
        self.chain_starts.partition_point(|&start| start as usize <= place) - 1
    }

    /// The vertices of a chain.
    pub fn chain(&self, chain: usize) -> &[u32] {
        &self.chain_vertices[self.places(chain)]
    }

    /// The loops of a region, each the chains it passes.
    pub fn loops(&self, region: usize) -> impl Iterator<Item = &[Leg]> {
        let loops = self.region_starts[region] as usize..self.region_starts[region + 1] as usize;
        loops.map(|l| &self.legs[self.loop_starts[l] as usize..self.loop_starts[l + 1] as usize])
    }
}

/// The boundary half-edges and what follows each inside its region.
struct Graph<'a> {
    surface: &'a Surface,
    /// Boundary half-edges, ascending.
    half_edges: Vec<u32>,
    /// The place in `half_edges` of the one that follows each.
    next: Vec<u32>,
    /// The edge of each: the place of the least half-edge along it.
    edges: Vec<u32>,
    /// Whether chains end at a vertex.
    is_junction: Vec<bool>,
}

/// The ends of a half-edge, from and to.
fn ends(surface: &Surface, half_edge: u32) -> [u32; 2] {
    let (face, k) = (surface.faces[half_edge as usize / 3], half_edge as usize % 3);
    [face[k], face[(k + 1) % 3]]
}

impl<'a> Graph<'a> {
    fn new(surface: &'a Surface, partition: &Partition) -> Self {
        let labels = &partition.labels;
        let on_boundary = |h: u32| {
            let across = surface.across(h / 3, h as usize % 3);
            across.is_none_or(|other| labels[other as usize] != labels[h as usize / 3])
        };
        let count = 3 * surface.faces.len() as u32;
        let half_edges: Vec<u32> = (0..count).into_par_iter().with_min_len(ROWS).filter(|&h| on_boundary(h)).collect();
        let mut places = vec![NONE; count as usize];
        (0..).zip(&half_edges).for_each(|(place, &h)| places[h as usize] = place);

        let following = |&h: &u32| {
            let pivot = ends(surface, h)[1];
            let mut at = turned(h);
            while places[at as usize] == NONE {
                // Not on the boundary: a face lies across, and the edge runs back there.
                let other = surface.across(at / 3, at as usize % 3).unwrap_or(at / 3);
                let back = edge_of(surface.faces[other as usize], ends(surface, at)[1], pivot).unwrap_or(0);
                at = turned(3 * other + back as u32);
            }
            places[at as usize]
        };
        let edge = |(place, &h): (usize, &u32)| {
            let [a, b] = ends(surface, h);
            let along = |f: u32| {
                let face = surface.faces[f as usize];
                edge_of(face, a, b).or_else(|| edge_of(face, b, a)).map_or(NONE, |k| places[3 * f as usize + k])
            };
            // Of two faces the one across; of a wall all that have the edge.
            match surface.across(h / 3, h as usize % 3) {
                Some(other) => along(other).min(place as u32),
                None => surface.rings.faces_of_edge(&surface.faces, a, b).map(along).min().unwrap_or(place as u32),
            }
        };
        let next: Vec<u32> = half_edges.par_iter().with_min_len(ROWS).map(following).collect();
        let edges: Vec<u32> = half_edges.par_iter().enumerate().with_min_len(ROWS).map(edge).collect();
        let mut graph = Self { surface, half_edges, next, edges, is_junction: Vec::new() };
        graph.is_junction = graph.junctions();
        graph
    }

    /// Vertices where other than two boundary edges meet, or where a loop turns back on itself.
    ///
    /// Everywhere else each loop that comes along one of the two edges leaves along the other.
    fn junctions(&self) -> Vec<bool> {
        let mut degrees = vec![0_u32; self.surface.points.len()];
        let mut is_junction = vec![false; degrees.len()];
        for (place, &h) in self.half_edges.iter().enumerate() {
            let [a, b] = ends(self.surface, h);
            if self.edges[place] as usize == place {
                degrees[a as usize] += 1;
                degrees[b as usize] += 1;
            }
            if self.edges[place] == self.edges[self.next[place] as usize] {
                is_junction[b as usize] = true;
            }
        }
        is_junction.iter_mut().zip(degrees).for_each(|(is_junction, degree)| *is_junction |= degree != 2);
        is_junction
    }

    /// Follows every loop, and names a chain where the first loop passes it.
    fn follow(&self, partition: &Partition) -> Boundary {
        let mut boundary = Boundary { chain_starts: vec![0], loop_starts: vec![0], ..Boundary::default() };
        // For every edge, by its place, its chain and which of its edges it is.
        let mut chained = vec![(NONE, 0); self.half_edges.len()];
        let mut seen = vec![false; self.half_edges.len()];
        let mut regions = Vec::new();
        let mut turns = Vec::new();
        for first in 0..self.half_edges.len() {
            if seen[first] {
                continue;
            }
            turns.clear();
            let mut at = first;
            while !std::mem::replace(&mut seen[at], true) {
                turns.push(at);
                at = self.next[at] as usize;
            }
            self.turn_to_start(&mut turns);
            for run in self.runs(&turns) {
                boundary.legs.push(self.leg(
                    run,
                    &mut chained,
                    &mut boundary.chain_starts,
                    &mut boundary.chain_vertices,
                ));
            }
            boundary.loop_starts.push(boundary.legs.len() as u32);
            regions.push(partition.labels[self.half_edges[first] as usize / 3]);
        }
        boundary.sort_loops(&regions, partition.region_count);
        boundary
    }

    /// Rotates a loop so that it starts at a junction; at its greatest vertex where there is none.
    fn turn_to_start(&self, turns: &mut [usize]) {
        let origin = |&place: &usize| ends(self.surface, self.half_edges[place])[0];
        let start = turns.iter().position(|turn| self.is_junction[origin(turn) as usize]).or_else(|| {
            let key = |&i: &usize| {
                let p = self.surface.points[origin(&turns[i]) as usize];
                (p.x, p.y, p.z, origin(&turns[i]))
            };
            (0..turns.len()).max_by(|a, b| {
                let (a, b) = (key(a), key(b));
                a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2)).then(a.3.cmp(&b.3))
            })
        });
        turns.rotate_left(start.unwrap_or(0));
    }

    /// The parts of a loop between junctions.
    fn runs<'t>(&self, turns: &'t [usize]) -> impl Iterator<Item = &'t [usize]> {
        turns.chunk_by(|_, &to| !self.is_junction[ends(self.surface, self.half_edges[to])[0] as usize])
    }

    /// The chain along a run, new or known.
    fn leg(&self, run: &[usize], chained: &mut [(u32, u32)], starts: &mut Vec<u32>, vertices: &mut Vec<u32>) -> Leg {
        let edge = self.edges[run[0]] as usize;
        let [a, b] = ends(self.surface, self.half_edges[run[0]]);
        let (chain, index) = chained[edge];
        if chain != NONE {
            let at = (starts[chain as usize] + index) as usize;
            return Leg::new(chain, [vertices[at], vertices[at + 1]] != [a, b]);
        }
        let chain = starts.len() as u32 - 1;
        for (index, &place) in (0..).zip(run) {
            chained[self.edges[place] as usize] = (chain, index);
            vertices.push(ends(self.surface, self.half_edges[place])[0]);
        }
        vertices.push(ends(self.surface, self.half_edges[run[run.len() - 1]])[1]);
        starts.push(vertices.len() as u32);
        Leg::new(chain, false)
    }
}

impl Boundary {
    /// Brings loops into the order of their regions; `regions` has that of each.
    fn sort_loops(&mut self, regions: &[u32], region_count: usize) {
        let (region_starts, order) = group(regions.len(), region_count, |l| [regions[l]]);
        let (starts, legs) = (std::mem::take(&mut self.loop_starts), std::mem::take(&mut self.legs));
        self.region_starts = region_starts;
        self.loop_starts = vec![0];
        for l in order {
            let ends = [l as usize, l as usize + 1].map(|l| starts[l] as usize);
            self.legs.extend_from_slice(&legs[ends[0]..ends[1]]);
            self.loop_starts.push(self.legs.len() as u32);
        }
    }
}

/// The half-edge after one in its face.
fn turned(half_edge: u32) -> u32 {
    half_edge - half_edge % 3 + (half_edge + 1) % 3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::mesh::{Mesh, shapes};

    fn surface(mesh: &Mesh) -> Surface {
        Surface::new(mesh, Some(0.0)).expect("a valid mesh")
    }

    /// Labels by the middle of each face, in model units.
    fn partition(surface: &Surface, label: impl Fn(DVec3) -> u32) -> Partition {
        let middle = |&face: &[u32; 3]| {
            face.map(|v| surface.frame.to_model(surface.points[v as usize].as_vec3())).iter().sum::<DVec3>() / 3.0
        };
        let labels: Vec<u32> = surface.faces.iter().map(|face| label(middle(face))).collect();
        let region_count = labels.iter().max().map_or(0, |&most| most as usize + 1);
        Partition { labels, region_count }
    }

    #[test]
    fn a_halved_plane_has_three_chains_between_two_junctions() {
        let surface = surface(&shapes::plane(4, 2));
        let [low, high] = [0, 1].map(|k| {
            surface.points.iter().fold([f64::MAX, f64::MIN][k], |m, p| if k == 0 { m.min(p.x) } else { m.max(p.x) })
        });
        let middle = surface.frame.to_model(DVec3::new((low + high) / 2.0, 0.0, 0.0).as_vec3()).x;
        let boundary = Boundary::new(&surface, &partition(&surface, |p| u32::from(p.x > middle)));
        let mut lengths: Vec<usize> = (0..boundary.chain_count()).map(|c| boundary.chain(c).len()).collect();
        lengths.sort_unstable();
        assert_eq!(lengths, [3, 7, 7]);
        for region in 0..2 {
            let loops: Vec<&[Leg]> = boundary.loops(region).collect();
            assert_eq!((loops.len(), loops[0].len()), (1, 2));
        }
        let shared = |region: usize| {
            boundary.loops(region).flatten().copied().find(|leg| boundary.chain(leg.chain()).len() == 3)
        };
        assert_ne!(
            shared(0).map(Leg::is_reversed),
            shared(1).map(Leg::is_reversed),
            "the sides pass it in opposite senses"
        );
    }

    #[test]
    fn one_region_of_a_closed_surface_has_no_loop() {
        let surface = surface(&shapes::icosphere(1));
        let boundary = Boundary::new(&surface, &partition(&surface, |_| 0));
        assert_eq!((boundary.chain_count(), boundary.loops(0).count()), (0, 0));
    }

    #[test]
    fn an_island_is_one_closed_chain_with_the_greatest_vertex_first() {
        let surface = surface(&shapes::icosphere(3));
        let boundary = Boundary::new(&surface, &partition(&surface, |p| u32::from(p.z > 0.8)));
        assert_eq!(boundary.chain_count(), 1);
        let chain = boundary.chain(0);
        assert_eq!(chain.first(), chain.last());
        let first = surface.points[chain[0] as usize].x;
        assert!(chain.iter().all(|&v| surface.points[v as usize].x <= first));
        assert_ne!(boundary.legs[0].is_reversed(), boundary.legs[1].is_reversed());
    }

    /// Three regions in crumbs, with an edge of three faces among them.
    #[test]
    fn every_half_edge_is_passed_once_whatever_the_labels() {
        for seed in 0..20_u32 {
            let mut mesh = shapes::torus(9, 6);
            // A third face on an edge, and a slit's end.
            mesh.positions.push(DVec3::new(5.0, 5.0, 5.0));
            mesh.faces.push([mesh.faces[0][0], mesh.faces[0][1], mesh.positions.len() as u32 - 1]);
            let surface = surface(&mesh);
            let labels =
                (0..surface.faces.len() as u32).map(|f| f.wrapping_mul(2_654_435_761).rotate_left(seed) % 3).collect();
            let partition = Partition { labels, region_count: 3 };
            let boundary = Boundary::new(&surface, &partition);
            let on_boundary = |f: usize, k: usize| {
                surface.across(f as u32, k).is_none_or(|other| partition.labels[other as usize] != partition.labels[f])
            };
            for region in 0..3 {
                let mut expected: Vec<[u32; 2]> = (0..surface.faces.len())
                    .filter(|&f| partition.labels[f] as usize == region)
                    .flat_map(|f| (0..3).filter(move |&k| on_boundary(f, k)).map(move |k| (f, k)))
                    .map(|(f, k)| ends(&surface, (3 * f + k) as u32))
                    .collect();
                let mut passed = Vec::new();
                for leg in boundary.loops(region).flatten() {
                    let mut chain = boundary.chain(leg.chain()).to_vec();
                    if leg.is_reversed() {
                        chain.reverse();
                    }
                    passed.extend(chain.windows(2).map(|pair| [pair[0], pair[1]]));
                }
                expected.sort_unstable();
                passed.sort_unstable();
                assert_eq!(passed, expected, "seed {seed}, region {region}");
            }
        }
    }
}
