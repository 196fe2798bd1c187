//! Edges that two have at once, each without knowing of the other: two regions with the same diagonal, a diagonal that is
//! another region's border, two chains with the same segment.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::site::{Answer, farthest, segments};
use super::{Filling, ROWS, Work};
use crate::partition::chains::Chains;
use crate::partition::triangulate::flip_away;

/// Edges that a region gives up before it keeps its faces, and is cut.
const MOST_CONFLICTS: u32 = 8;

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

/// The triangles of a filling that have no edge inside it, their corners ascending: where it is one, or hangs together at
/// a vertex only. `edges` is overwritten.
fn singles(filling: &Filling, edges: &mut Vec<u64>) -> Vec<[u32; 3]> {
    let triangles: Vec<[u32; 3]> = match filling {
        Filling::Flat(flat) => flat.vertices().collect(),
        Filling::Spatial(triangles) => triangles.clone(),
        Filling::Open | Filling::Least | Filling::Own => return Vec::new(),
    };
    inner_edges(triangles.iter().copied(), edges);
    let is_single =
        |&[a, b, c]: &[u32; 3]| [key(a, b), key(b, c), key(c, a)].iter().all(|edge| edges.binary_search(edge).is_err());
    let ascending = |[a, b, c]: [u32; 3]| {
        let mut corners = [a, b, c];
        corners.sort_unstable();
        corners
    };
    triangles.into_iter().filter(is_single).map(ascending).collect()
}

impl Work<'_> {
    /// Finds edges that two have and takes them from one; whether there were any.
    ///
    /// Edges of the input are each there once: only those that are new can meet another, or one of the input.
    pub(super) fn settle_conflicts(&mut self, chains: &mut Chains<'_>) -> bool {
        let edges = self.new_edges(chains);
        let groups: Vec<&[(u64, Owner)]> = edges.chunk_by(|a, b| a.0 == b.0).collect();
        let in_conflict = |group: &&[(u64, Owner)]| group.len() > 1 || self.is_in_input(group[0].0, Some(group[0].1));
        let groups: Vec<&[(u64, Owner)]> = groups.into_par_iter().filter(in_conflict).collect();
        let doubles = self.doubles();
        if groups.is_empty() && doubles.is_empty() {
            return false;
        }
        let mut taken: FxHashSet<u64> = edges.iter().map(|&(edge, _)| edge).collect();
        for group in groups {
            self.settle(group, &mut taken, chains);
        }
        for region in doubles {
            self.more_vertices(region, chains);
        }
        self.open.sort_unstable();
        self.open.dedup();
        for &region in &self.open {
            self.fillings[region as usize] = Filling::Open;
        }
        true
    }

    /// Regions with a triangle that another has the back of: their edges are both sides of the same segments.
    fn doubles(&self) -> Vec<u32> {
        let regions = (0..self.fillings.len() as u32).into_par_iter().with_min_len(ROWS);
        let mut singles: Vec<([u32; 3], u32)> = regions
            .map_init(Vec::new, |edges, region| {
                singles(&self.fillings[region as usize], edges).into_iter().map(move |corners| (corners, region))
            })
            .flatten_iter()
            .collect();
        singles.sort_unstable();
        let (surface, labels) = (self.surface, &self.partition.labels);
        let stays = |[a, b, c]: [u32; 3]| {
            surface.rings.faces_of_edge(&surface.faces, a, b).any(|f| {
                let is_own = matches!(self.fillings[labels[f as usize] as usize], Filling::Least | Filling::Own);
                is_own && surface.faces[f as usize].contains(&c)
            })
        };
        let behind = singles.windows(2).filter(|pair| pair[0].0 == pair[1].0).map(|pair| pair[1].1);
        let mut doubles: Vec<u32> =
            behind.chain(singles.iter().filter(|single| stays(single.0)).map(|single| single.1)).collect();
        doubles.sort_unstable();
        doubles.dedup();
        doubles
    }

    /// Every edge that the input does not have there, with those who have it, sorted: segments that leave vertices out, and
    /// what is inside regions drawn anew.
    fn new_edges(&self, chains: &Chains<'_>) -> Vec<(u64, Owner)> {
        let vertex = |place: usize| self.boundary.chain_vertices[place];
        let segments = |chain: usize| {
            let longer = chains.segments(chain).filter(|[a, b]| b - a > 1);
            longer.map(|[a, b]| (key(vertex(a), vertex(b)), Owner::Chain(a as u32)))
        };
        let mut edges: Vec<(u64, Owner)> = (0..self.boundary.chain_count())
            .into_par_iter()
            .with_min_len(ROWS)
            .filter(|&chain| !chains.is_whole(chain))
            .flat_map_iter(segments)
            .collect();
        let inside = |edges: &mut Vec<u64>, region: u32| {
            self.inner_edges_of(region, chains, edges);
            edges.iter().map(|&edge| (edge, Owner::Region(region))).collect::<Vec<_>>()
        };
        let regions = (0..self.fillings.len() as u32).into_par_iter().with_min_len(ROWS);
        edges.par_extend(
            regions
                .filter(|&region| matches!(self.fillings[region as usize], Filling::Flat(_) | Filling::Spatial(_)))
                .map_init(Vec::new, inside)
                .flatten_iter(),
        );
        edges.par_sort_unstable();
        edges
    }

    /// The edges inside a region that is drawn anew.
    fn inner_edges_of(&self, region: u32, chains: &Chains<'_>, edges: &mut Vec<u64>) {
        match &self.fillings[region as usize] {
            Filling::Flat(flat) => inner_edges(flat.vertices(), edges),
            Filling::Spatial(triangles) => inner_edges(triangles.iter().copied(), edges),
            Filling::Open | Filling::Least | Filling::Own => edges.clear(),
        }
        // A slit in the region: its segments run both ways and are the chain's.
        let mut passed: Vec<usize> = self.boundary.loops(region as usize).flatten().map(|leg| leg.chain()).collect();
        passed.sort_unstable();
        for slit in passed.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]) {
            let vertex = |place: usize| self.boundary.chain_vertices[place];
            let mut own: Vec<u64> = chains.segments(slit).map(|[a, b]| key(vertex(a), vertex(b))).collect();
            own.sort_unstable();
            edges.retain(|edge| own.binary_search(edge).is_err());
        }
    }

    /// Whether an edge between vertices of the result is an edge of the input that the result has too, from another than
    /// `but`.
    ///
    /// On the boundary it is: a vertex that stays is a junction, or within the one chain that has the edge. Inside a region
    /// it is where that keeps its faces; of a region drawn anew all edges are listed as its own.
    fn is_in_input(&self, edge: u64, but: Option<Owner>) -> bool {
        let [a, b] = ends(edge);
        let surface = self.surface;
        let mut faces = surface.rings.faces_of_edge(&surface.faces, a, b);
        let Some(first) = faces.next() else { return false };
        let region = self.partition.labels[first as usize];
        let other = faces.next();
        let is_inside = faces.next().is_none()
            && other.is_some_and(|other| {
                surface.neighbors[first as usize].contains(&other) && self.partition.labels[other as usize] == region
            });
        !is_inside
            || (but != Some(Owner::Region(region))
                && matches!(self.fillings[region as usize], Filling::Least | Filling::Own))
    }

    /// Takes an edge from all who have it but the first, or from all if the input has it.
    fn settle(&mut self, group: &[(u64, Owner)], taken: &mut FxHashSet<u64>, chains: &mut Chains<'_>) {
        let edge = group[0].0;
        let keeper = if self.is_in_input(edge, Some(group[0].1)) { usize::MAX } else { 0 };
        for (i, &(_, owner)) in group.iter().enumerate() {
            match owner {
                _ if i == keeper => {}
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
        self.conflicts[region as usize] += 1;
        if self.conflicts[region as usize] > MOST_CONFLICTS {
            return self.keep_own(region, chains);
        }
        let mut filling = std::mem::replace(&mut self.fillings[region as usize], Filling::Open);
        let is_taken =
            |a: u32, b: u32| taken.contains(&key(a, b)) || self.is_in_input(key(a, b), Some(Owner::Region(region)));
        let attempt = match &mut filling {
            // Its neighbor has changed since.
            Filling::Open => return,
            Filling::Least | Filling::Own => Answer::Hopeless,
            Filling::Flat(flat) => {
                if !flat.has_vertices_inside() && flip_away(&flat.outline, &mut flat.triangles, ends(edge), is_taken) {
                    let mut edges = Vec::new();
                    inner_edges(flat.vertices(), &mut edges);
                    taken.extend(edges);
                    // Between other triangles than these.
                    flat.samples.iter_mut().for_each(Vec::clear);
                    self.fillings[region as usize] = filling;
                    return;
                }
                return self.more_vertices(region, chains);
            }
            Filling::Spatial(_) => self.fill_in_space(region, chains, is_taken),
        };
        match attempt {
            Answer::Spatial(triangles) => {
                let mut edges = Vec::new();
                inner_edges(triangles.iter().copied(), &mut edges);
                taken.extend(edges);
                self.fillings[region as usize] = Filling::Spatial(triangles);
            }
            Answer::Split(places) => self.split(region, &places, chains),
            Answer::Least | Answer::Flat(_) | Answer::Hopeless => self.keep_own(region, chains),
        }
    }

    /// Gives the chains around a region one more vertex; without any left it keeps its faces.
    fn more_vertices(&mut self, region: u32, chains: &mut Chains<'_>) {
        let ring: Vec<_> = self.boundary.loops(region as usize).flat_map(|legs| segments(legs, chains)).collect();
        match farthest(&ring, chains) {
            Some(place) => self.split(region, &[place], chains),
            None => self.keep_own(region, chains),
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
