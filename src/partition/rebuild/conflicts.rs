//! Edges that two have at once, each without knowing of the other: two regions with the same diagonal, a diagonal that is
//! another region's border, two chains with the same segment.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::attempt::{Attempt, Flat, farthest};
use super::{Filling, Work};
use crate::mesh::dual::NONE;
use crate::partition::chains::Chains;
use crate::partition::triangulate::flip_away;

/// Who has an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Owner {
    /// A chain, as a segment that begins at this place.
    Chain(u32),
    /// A region, inside.
    Region(u32),
}

/// An edge by its ends, the lower vertex in the high word.
fn key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

fn ends(key: u64) -> [u32; 2] {
    [(key >> 32) as u32, key as u32]
}

impl Flat {
    /// Its triangles as vertices of the surface.
    pub fn vertices(&self) -> impl Iterator<Item = [u32; 3]> {
        self.triangles.iter().map(|triangle| triangle.map(|i| self.outline.vertices[i as usize]))
    }
}

/// The edges inside a filling: sides that run both ways.
fn inner_edges(triangles: impl Iterator<Item = [u32; 3]>, edges: &mut Vec<u64>) {
    edges.clear();
    edges.extend(triangles.flat_map(|[a, b, c]| [key(a, b), key(b, c), key(c, a)]));
    edges.sort_unstable();
    let mut kept = 0;
    let mut at = 0;
    while at < edges.len() {
        let run = edges[at..].iter().take_while(|&&edge| edge == edges[at]).count();
        if run > 1 {
            edges[kept] = edges[at];
            kept += 1;
        }
        at += run;
    }
    edges.truncate(kept);
}

impl Work<'_> {
    /// Finds edges that two have and takes them from one; whether there were any.
    pub(super) fn settle_conflicts(&mut self, chains: &mut Chains<'_>) -> bool {
        let edges = self.edges(chains);
        let groups: Vec<&[(u64, Owner)]> = edges.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1).collect();
        if groups.is_empty() {
            return false;
        }
        let mut taken: FxHashSet<u64> = edges.iter().map(|&(edge, _)| edge).collect();
        for group in groups {
            self.settle(group, &mut taken, chains);
        }
        self.open.sort_unstable();
        self.open.dedup();
        for &region in &self.open {
            self.fillings[region as usize] = Filling::Open;
        }
        true
    }

    /// Every edge of the result with those who have it, sorted.
    fn edges(&self, chains: &Chains<'_>) -> Vec<(u64, Owner)> {
        let vertex = |place: usize| self.boundary.chain_vertices[place];
        let mut edges: Vec<(u64, Owner)> = (0..self.boundary.chain_count())
            .into_par_iter()
            .flat_map_iter(|chain| {
                chains.segments(chain).map(|[a, b]| (key(vertex(a), vertex(b)), Owner::Chain(a as u32)))
            })
            .collect();
        let inside: Vec<(u64, Owner)> = (0..self.fillings.len() as u32)
            .into_par_iter()
            .map_init(Vec::new, |edges, region| {
                self.inner_edges_of(region, chains, edges);
                edges.iter().map(|&edge| (edge, Owner::Region(region))).collect::<Vec<_>>()
            })
            .flatten_iter()
            .collect();
        edges.extend(inside);
        edges.par_sort_unstable();
        edges
    }

    fn inner_edges_of(&self, region: u32, chains: &Chains<'_>, edges: &mut Vec<u64>) {
        match &self.fillings[region as usize] {
            Filling::Flat(flat) => inner_edges(flat.vertices(), edges),
            Filling::Spatial(triangles) => inner_edges(triangles.iter().copied(), edges),
            Filling::Open | Filling::Own => {
                let surface = self.surface;
                let inside = self.faces_of(region).iter().flat_map(|&f| {
                    let face = surface.faces[f as usize];
                    let inside = move |k: &usize| {
                        let other = surface.neighbors[f as usize][*k];
                        other != NONE && f < other && self.partition.labels[other as usize] == region
                    };
                    (0..3).filter(inside).map(move |k| key(face[k], face[(k + 1) % 3]))
                });
                edges.clear();
                edges.extend(inside);
                return;
            }
        }
        // A slit in the region: its segments run both ways and are the chain's.
        let mut passed: Vec<usize> = self.boundary.loops(region as usize).flatten().map(|pass| pass.chain()).collect();
        passed.sort_unstable();
        for slit in passed.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]) {
            let vertex = |place: usize| self.boundary.chain_vertices[place];
            let own: Vec<u64> = chains.segments(slit).map(|[a, b]| key(vertex(a), vertex(b))).collect();
            edges.retain(|edge| !own.contains(edge));
        }
    }

    /// Takes an edge from all who have it but one: what cannot change keeps it, then a chain, then the first region.
    fn settle(&mut self, group: &[(u64, Owner)], taken: &mut FxHashSet<u64>, chains: &mut Chains<'_>) {
        let edge = group[0].0;
        let is_fixed = |work: &Self, chains: &Chains<'_>, owner: Owner| match owner {
            Owner::Region(region) => matches!(work.fillings[region as usize], Filling::Own),
            Owner::Chain(place) => chains.farthest(work.segment_at(place as usize, chains)).is_none(),
        };
        let keeper = group.iter().position(|&(_, owner)| is_fixed(self, chains, owner)).unwrap_or(0);
        for (i, &(_, owner)) in group.iter().enumerate() {
            if i == keeper {
                continue;
            }
            match owner {
                Owner::Chain(place) => {
                    let segment = self.segment_at(place as usize, chains);
                    if let Some((place, _)) = chains.farthest(segment) {
                        chains.keep(place);
                        self.open_beside(self.boundary.chain_at(place));
                    }
                }
                Owner::Region(region) => self.take_from(region, edge, taken, chains),
            }
        }
    }

    /// The segment that begins at a place.
    fn segment_at(&self, place: usize, chains: &Chains<'_>) -> [usize; 2] {
        let chain = self.boundary.chain_at(place);
        chains.segments(chain).find(|segment| segment[0] == place).unwrap_or([place, place])
    }

    /// Has a region do without an edge: by turning it, by other triangles in space, by more vertices on its chains.
    fn take_from(&mut self, region: u32, edge: u64, taken: &mut FxHashSet<u64>, chains: &mut Chains<'_>) {
        let is_taken = |a: u32, b: u32| taken.contains(&key(a, b));
        let attempt = match &mut self.fillings[region as usize] {
            // Its neighbor has changed since, or it cannot change.
            Filling::Open | Filling::Own => return,
            Filling::Flat(flat) => {
                if flip_away(&flat.outline, &mut flat.triangles, ends(edge), is_taken) {
                    let mut edges = Vec::new();
                    inner_edges(flat.vertices(), &mut edges);
                    taken.extend(edges);
                    return;
                }
                let ring: Vec<_> =
                    self.boundary.loops(region as usize).flat_map(|l| super::segments(l, chains)).collect();
                farthest(&ring, chains).map_or(Attempt::Hopeless, |place| Attempt::Split(vec![place]))
            }
            Filling::Spatial(_) => self.fill_in_space(region, chains, is_taken),
        };
        match attempt {
            Attempt::Spatial(triangles) => {
                let mut edges = Vec::new();
                inner_edges(triangles.iter().copied(), &mut edges);
                taken.extend(edges);
                self.fillings[region as usize] = Filling::Spatial(triangles);
            }
            Attempt::Split(places) => self.split(region, &places, chains),
            Attempt::Flat(_) | Attempt::Hopeless => self.keep_own(region, chains),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inner_edges_run_both_ways() {
        let mut edges = Vec::new();
        inner_edges([[0, 1, 2], [2, 1, 3], [2, 3, 4]].into_iter(), &mut edges);
        assert_eq!(edges, [key(1, 2), key(2, 3)]);
        assert_eq!(ends(key(7, 3)), [3, 7]);
    }
}
