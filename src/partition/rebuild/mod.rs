//! Regions to triangles: each drawn in its plane between the chains that it shares with its neighbors.
//!
//! A region whose outline crosses itself, or that chose an edge which another has too, gets more vertices on its chains, and its
//! neighbors are drawn again; one that no vertices help keeps its faces, to be cut in two, or is filled in space. Chains only
//! ever gain vertices, so that this ends, at the input's own faces at the latest.
//!
//! # Invariants
//! - Both sides of a chain have its segments as edges, each once: no cracks, no T-junctions.
//! - No edge inside a region is an edge anywhere else: manifold in, manifold out.
//! - A region drawn anew has the topology of the old one: as many loops, and no handle.

mod conflicts;
mod site;
mod topology;

use rayon::prelude::*;

use site::{Answer, Flat, Site, farthest, segments};
use topology::planar_regions;

use super::Partition;
use super::boundary::Boundary;
use super::chains::Chains;
use super::fit::{AT_VERTICES, Sample, area};
use super::interior::{Color, Limits};
use super::plane::Plane;
use super::surface::Surface;
use super::triangulate::{Triangulation, fill_in_space};
use crate::math::DVec3;
use crate::mesh::adjacency::group;
use crate::spatial::triangle::closest_point;

/// Attempts at a region before it keeps its faces: each gave its chains more vertices.
const MOST_ATTEMPTS: u32 = 64;

/// Regions or chains that a thread takes at a time.
const ROWS: usize = 1 << 8;

/// What takes the place of a region.
#[derive(Debug)]
enum Filling {
    /// Nothing yet, or not any more.
    Open,
    /// Triangles in its plane.
    Flat(Flat),
    /// Triangles of the surface's vertices on one loop, in space.
    Spatial(Vec<[u32; 3]>),
    /// Its own faces, which are as few as can be.
    Least,
    /// Its own faces, for nothing else can be.
    Own,
}

/// How regions are rebuilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recipe<'a> {
    /// The plane that each is drawn in, where it has one.
    pub planes: &'a [Option<Plane>],
    pub triangulation: Triangulation,
    /// Whether what no plane shows is filled in space: nearer to the surface is a region cut in two, where that is possible.
    pub fills_in_space: bool,
    /// Vertices inside regions come back where light is lost with them.
    pub light: Option<Light<'a>>,
}

/// The light of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light<'a> {
    /// Of every vertex of the surface.
    pub colors: &'a [[f32; 4]],
    /// What of it may be lost.
    pub limits: Limits,
}

impl Light<'_> {
    /// Red, green and blue of a vertex.
    fn color(&self, vertex: u32) -> Color {
        let [red, green, blue, _] = self.colors[vertex as usize];
        [red, green, blue].map(f64::from)
    }

    /// The light in the middle of the input's face `f`, which is `face` of the result.
    fn middle(&self, surface: &Surface, face: u32, f: u32) -> Sample {
        let corners = surface.faces[f as usize].map(|v| self.color(v));
        let color = [0, 1, 2].map(|k| corners.iter().map(|color| color[k]).sum::<f64>() / 3.0);
        Sample { face, shares: [1.0 / 3.0; 3], color, area: area(surface, f) * (1.0 - AT_VERTICES) }
    }
}

/// A partition rebuilt.
#[derive(Debug)]
pub struct Rebuilt {
    /// Triangles of the surface's vertices, region by region.
    pub faces: Vec<[u32; 3]>,
    /// R + 1 starts into `faces`.
    pub region_starts: Vec<u32>,
    /// For every region whether its faces are triangles of one polygon.
    pub is_whole: Vec<bool>,
    /// Regions that keep their faces for they cannot be drawn.
    pub undrawn: Vec<u32>,
    /// The greatest distance of a vertex from the plane that its region is drawn in, from the triangles that fill that in space,
    /// or from the segment in its place, in the frame.
    pub deviation: f64,
    /// Regions filled in space.
    pub spatial: usize,
    /// The light between the vertices of `faces`, where it was asked for.
    pub samples: Vec<Sample>,
}

impl Rebuilt {
    /// Gives regions other triangles, which are as many polygons; `faces` are ascending by region, and tell whether vertices lie
    /// inside.
    pub fn replace(&mut self, regions: Vec<Refilled>) {
        let mut regions = regions.into_iter().peekable();
        let (before, starts) = (std::mem::take(&mut self.faces), std::mem::replace(&mut self.region_starts, vec![0]));
        for (region, ends) in (0..).zip(starts.windows(2)) {
            match regions.next_if(|refilled| refilled.region == region) {
                Some(Refilled { faces, is_whole, .. }) => {
                    self.faces.extend(faces);
                    self.is_whole[region as usize] |= is_whole;
                }
                None => self.faces.extend_from_slice(&before[ends[0] as usize..ends[1] as usize]),
            }
            self.region_starts.push(self.faces.len() as u32);
        }
        // They were of other faces.
        self.samples.clear();
    }

    /// Every region as it is.
    pub fn nothing(surface: &Surface, partition: &Partition) -> Self {
        let (region_starts, faces) = partition.faces_by_region();
        Self {
            faces: faces.iter().map(|&f| surface.faces[f as usize]).collect(),
            region_starts,
            is_whole: vec![false; partition.region_count],
            undrawn: Vec::new(),
            deviation: 0.0,
            spatial: 0,
            samples: Vec::new(),
        }
    }
}

/// Other triangles of a region.
#[derive(Debug, Clone, PartialEq)]
pub struct Refilled {
    pub region: u32,
    /// Of the surface's vertices.
    pub faces: Vec<[u32; 3]>,
    /// Whether none of them lies inside.
    pub is_whole: bool,
}

/// Rebuilds every region of `partition` between `chains`, which get more vertices where needed.
pub fn rebuild(
    surface: &Surface,
    partition: &Partition,
    boundary: &Boundary,
    chains: &mut Chains<'_>,
    recipe: Recipe<'_>,
) -> Rebuilt {
    let mut work = Work::new(surface, partition, boundary, recipe);
    loop {
        work.draw(chains);
        if work.open.is_empty() && !work.settle_conflicts(chains) && !work.put_back() {
            return work.finish(chains);
        }
    }
}

struct Work<'a> {
    surface: &'a Surface,
    partition: &'a Partition,
    boundary: &'a Boundary,
    recipe: Recipe<'a>,
    /// The faces of every region, in compressed rows.
    face_starts: Vec<u32>,
    faces: Vec<u32>,
    /// Whether a chain has a vertex.
    on_boundary: Vec<bool>,
    /// The regions on either side of every chain, in compressed rows.
    side_starts: Vec<u32>,
    sides: Vec<u32>,
    planes: Vec<Option<Plane>>,
    is_planar: Vec<bool>,
    fillings: Vec<Filling>,
    /// How often each gave its chains more vertices because it could not be drawn.
    attempts: Vec<u32>,
    /// How many edges each region gave up.
    conflicts: Vec<u32>,
    /// Regions to draw, ascending.
    open: Vec<u32>,
}

impl<'a> Work<'a> {
    fn new(surface: &'a Surface, partition: &'a Partition, boundary: &'a Boundary, recipe: Recipe<'a>) -> Self {
        let (face_starts, faces) = partition.faces_by_region();
        let (side_starts, sides) = sides(boundary, partition.region_count);
        let mut on_boundary = vec![false; surface.points.len()];
        boundary.chain_vertices.iter().for_each(|&v| on_boundary[v as usize] = true);
        Self {
            planes: recipe.planes.to_vec(),
            is_planar: planar_regions(surface, partition, boundary),
            fillings: (0..partition.region_count).map(|_| Filling::Open).collect(),
            attempts: vec![0; partition.region_count],
            conflicts: vec![0; partition.region_count],
            open: (0..partition.region_count as u32).collect(),
            surface,
            partition,
            boundary,
            recipe,
            face_starts,
            faces,
            on_boundary,
            side_starts,
            sides,
        }
    }

    fn faces_of(&self, region: u32) -> &[u32] {
        &self.faces[self.face_starts[region as usize] as usize..self.face_starts[region as usize + 1] as usize]
    }

    /// The vertices of a region that no chain has, ascending.
    fn vertices_inside(&self, region: u32) -> Vec<u32> {
        let corners = self.faces_of(region).iter().flat_map(|&f| self.surface.faces[f as usize]);
        let mut inside: Vec<u32> = corners.filter(|&v| !self.on_boundary[v as usize]).collect();
        inside.sort_unstable();
        inside.dedup();
        inside
    }

    /// Draws the open regions, all on the chains as they are; what needs more vertices opens its neighbors.
    fn draw(&mut self, chains: &mut Chains<'_>) {
        let open = std::mem::take(&mut self.open);
        let shared = &*chains;
        let attempts: Vec<Answer> = open.par_iter().map(|&region| self.attempt(region, shared)).collect();
        for (region, attempt) in open.into_iter().zip(attempts) {
            match attempt {
                Answer::Least => self.fillings[region as usize] = Filling::Least,
                Answer::Flat(flat) => self.fillings[region as usize] = Filling::Flat(flat),
                Answer::Spatial(triangles) => {
                    // No plane shows it, whatever its neighbors do.
                    self.planes[region as usize] = None;
                    self.fillings[region as usize] = Filling::Spatial(triangles);
                }
                Answer::Split(places) => {
                    self.attempts[region as usize] += 1;
                    self.split(region, &places, chains);
                }
                Answer::Hopeless => self.keep_own(region, chains),
            }
        }
        self.open.sort_unstable();
        self.open.dedup();
        for &region in &self.open {
            self.fillings[region as usize] = Filling::Open;
        }
    }

    fn attempt(&self, region: u32, chains: &Chains<'_>) -> Answer {
        if self.attempts[region as usize] >= MOST_ATTEMPTS || !self.is_planar[region as usize] {
            return Answer::Hopeless;
        }
        if self.is_least(region, chains) {
            return Answer::Least;
        }
        let flat = match &self.planes[region as usize] {
            Some(plane) => {
                let (surface, boundary, attempts) = (self.surface, self.boundary, self.attempts[region as usize]);
                let site = Site { region: region as usize, plane, surface, boundary, chains, attempts };
                site.draw(self.recipe.triangulation)
            }
            None => Answer::Hopeless,
        };
        match flat {
            Answer::Hopeless if self.recipe.fills_in_space => self.fill_in_space(region, chains, |_, _| false),
            other => other,
        }
    }

    /// Puts vertices back inside the regions drawn that have not got theirs; whether there were any. What they connect may be
    /// in conflict again.
    fn put_back(&mut self) -> bool {
        let Some(light) = self.recipe.light else { return false };
        let mut fillings = std::mem::take(&mut self.fillings);
        let is_dark = |filling: &Filling| matches!(filling, Filling::Flat(flat) if flat.samples.is_none());
        let is_any = fillings.iter().any(is_dark);
        fillings.par_iter_mut().enumerate().with_max_len(1).for_each(|(region, filling)| {
            if let (Filling::Flat(flat), Some(plane)) = (filling, &self.planes[region])
                && flat.samples.is_none()
            {
                let region = region as u32;
                flat.put_back(self.surface, self.faces_of(region), self.vertices_inside(region), plane, light);
            }
        });
        self.fillings = fillings;
        is_any
    }

    /// Whether its faces are the fewest that there can be: its chains are whole, and none of its vertices is inside.
    fn is_least(&self, region: u32, chains: &Chains<'_>) -> bool {
        let (mut loops, mut vertices) = (0, 0);
        for legs in self.boundary.loops(region as usize) {
            loops += 1;
            for leg in legs {
                if !chains.is_whole(leg.chain()) {
                    return false;
                }
                vertices += self.boundary.places(leg.chain()).len() - 1;
            }
        }
        self.faces_of(region).len() + 4 == vertices + 2 * loops
    }

    /// Fills a region with one loop in space, between diagonals that are not taken.
    fn fill_in_space(&self, region: u32, chains: &Chains<'_>, is_taken: impl FnMut(u32, u32) -> bool) -> Answer {
        let mut loops = self.boundary.loops(region as usize);
        let (Some(only), None) = (loops.next(), loops.next()) else { return Answer::Hopeless };
        let ring = segments(only, chains);
        if ring.len() < 3 {
            return farthest(&ring, chains).map_or(Answer::Hopeless, |place| Answer::Split(vec![place]));
        }
        let vertices: Vec<u32> = ring.iter().map(|&[from, _]| self.boundary.chain_vertices[from]).collect();
        let points: Vec<_> = vertices.iter().map(|&v| self.surface.points[v as usize]).collect();
        match fill_in_space(&points, &vertices, is_taken) {
            Some(triangles) => {
                Answer::Spatial(triangles.into_iter().map(|t| t.map(|i| vertices[i as usize])).collect())
            }
            None => Answer::Hopeless,
        }
    }

    /// Keeps the vertices at these places, and opens the regions beside their chains.
    fn split(&mut self, region: u32, places: &[usize], chains: &mut Chains<'_>) {
        self.open.push(region);
        for &place in places {
            chains.keep(place);
            self.open_beside(self.boundary.chain_at(place));
        }
    }

    /// Leaves a region as it is, with all vertices of its chains.
    fn keep_own(&mut self, region: u32, chains: &mut Chains<'_>) {
        self.fillings[region as usize] = Filling::Own;
        let boundary = self.boundary;
        for leg in boundary.loops(region as usize).flatten() {
            if chains.keep_all(leg.chain()) {
                self.open_beside(leg.chain());
            }
        }
    }

    /// Opens the regions beside a chain but for those that keep their faces.
    fn open_beside(&mut self, chain: usize) {
        let sides = self.side_starts[chain] as usize..self.side_starts[chain + 1] as usize;
        let open = self.sides[sides].iter().filter(|&&side| !matches!(self.fillings[side as usize], Filling::Own));
        self.open.extend(open);
    }

    /// The greatest distance of a vertex from the plane of its region, or from the triangles that fill that in space, where it
    /// is drawn anew, or of a chain's vertex from the segment that takes its place.
    fn deviation(&self, chains: &Chains<'_>) -> f64 {
        let point = |v: u32| self.surface.points[v as usize];
        let corners = |region: usize| self.faces_of(region as u32).iter().flat_map(|&f| self.surface.faces[f as usize]);
        let off = |(region, filling): (usize, &Filling)| match (filling, &self.planes[region]) {
            (Filling::Flat(_), Some(plane)) => {
                corners(region).map(|v| plane.height(point(v)).abs()).fold(0.0, f64::max)
            }
            (Filling::Spatial(triangles), _) => {
                let to = |p: DVec3| triangles.iter().map(move |t| closest_point(p, t.map(point)).distance_sq);
                let nearest = |v: u32| to(point(v)).fold(f64::INFINITY, f64::min);
                corners(region).map(nearest).fold(0.0, f64::max).sqrt()
            }
            _ => 0.0,
        };
        let along = |chain: usize| {
            chains
                .segments(chain)
                .filter_map(|segment| chains.farthest(segment))
                .map(|(_, off)| off)
                .fold(0.0, f64::max)
        };
        let regions = self.fillings.par_iter().enumerate().map(off).reduce(|| 0.0, f64::max);
        let all = (0..self.boundary.chain_count()).into_par_iter().with_min_len(ROWS);
        all.filter(|&chain| !chains.is_whole(chain)).map(along).reduce(|| regions, f64::max)
    }

    fn finish(self, chains: &Chains<'_>) -> Rebuilt {
        let mut rebuilt = Rebuilt {
            deviation: self.deviation(chains),
            faces: Vec::new(),
            region_starts: vec![0],
            is_whole: Vec::with_capacity(self.fillings.len()),
            undrawn: Vec::new(),
            spatial: 0,
            samples: Vec::new(),
        };
        for (region, filling) in (0..).zip(&self.fillings) {
            let first = rebuilt.faces.len() as u32;
            match filling {
                Filling::Flat(flat) => {
                    rebuilt.faces.extend(flat.vertices());
                    let samples = flat.samples.iter().flatten();
                    rebuilt.samples.extend(samples.map(|sample| Sample { face: first + sample.face, ..*sample }));
                }
                Filling::Spatial(triangles) => {
                    rebuilt.spatial += 1;
                    rebuilt.faces.extend_from_slice(triangles);
                }
                Filling::Open | Filling::Own | Filling::Least => {
                    if !matches!(filling, Filling::Least) {
                        rebuilt.undrawn.push(region);
                    }
                    rebuilt.faces.extend(self.faces_of(region).iter().map(|&f| self.surface.faces[f as usize]));
                    if let Some(light) = self.recipe.light {
                        let middles = (first..).zip(self.faces_of(region));
                        rebuilt.samples.extend(middles.map(|(face, &f)| light.middle(self.surface, face, f)));
                    }
                }
            }
            rebuilt.region_starts.push(rebuilt.faces.len() as u32);
            rebuilt.is_whole.push(match filling {
                Filling::Flat(flat) => !flat.has_vertices_inside(),
                Filling::Spatial(_) | Filling::Least => true,
                Filling::Open | Filling::Own => false,
            });
        }
        rebuilt
    }
}

/// The regions beside every chain, once for every leg, in compressed rows.
fn sides(boundary: &Boundary, region_count: usize) -> (Vec<u32>, Vec<u32>) {
    let passing = |region: usize| boundary.loops(region).flatten().map(move |_| region as u32);
    let regions: Vec<u32> = (0..region_count).flat_map(passing).collect();
    let legs = &boundary.legs;
    let (starts, order) = group(legs.len(), boundary.chain_count(), |leg| [legs[leg].chain() as u32]);
    (starts, order.into_iter().map(|leg| regions[leg as usize]).collect())
}
