//! Vertices slide to where the light bends: in the plane of a flat region, and along straight borders, nothing changes but the
//! light. What each vertex then shows better lets others go.
//!
//! # Reference
//! Not in \[Liu99\], whose vertices are the input's. Free knots of a piecewise linear function, by Gauss and Newton's method for
//! one vertex after the other, its place and its color at once, with weights that make it the sum of differences and not of
//! their squares.
//!
//! # Invariants
//! - A vertex stays on the surface of the input, inside its region or on its straight stretch of a chain: the shape stays, and both
//!   sides of a border have the same vertices.
//! - No triangle turns over in its plane, and none becomes a needle that was none. New edges have an end inside their region: no
//!   other has them.
//! - The sum of differences of light over areas around a vertex falls with every step. A color is no farther from the light at
//!   its place than `most_moved`, and the light at the vertices of the input inside regions no more than that past its limit.
//! - Inside regions in parallel, between borders that stay; then along borders, in the order of vertices: the same bytes for any
//!   number of threads.

mod ground;
mod sheet;
mod step;

use rayon::prelude::*;

use super::boundary::Boundary;
use super::chains::Chains;
use super::interior::Color;
use super::plane::Plane;
use super::rebuild::{Rebuilt, Refilled};
use super::surface::Surface;
use super::{Partition, fit};
use crate::math::{DVec2, DVec3};
pub use ground::Stand;
use ground::{Ground, Way};
use sheet::Sheet;
use step::Sums;

/// How often every vertex is asked.
const ROUNDS: usize = 8;
/// The round before which vertices go that are not missed any more.
const THINNED_AT: usize = 4;
/// A vertex goes no farther at once than this share of its shortest edge.
const REACH: f64 = 0.5;
/// Shares of a step that are tried, for places and for colors.
const SHARES: [f64; 2] = [1.0, 0.3];
/// The difference has to fall by more than this share.
const GAIN: f64 = 1e-9;
/// A chain is straight where its vertices are off by less than this share of the diagonal.
const STRAIGHT: f64 = 1e-6;

/// The surface, and what was made of it.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    pub surface: &'a Surface,
    pub partition: &'a Partition,
    pub boundary: &'a Boundary,
    pub chains: &'a Chains<'a>,
    pub planes: &'a [Option<Plane>],
    pub rebuilt: &'a Rebuilt,
    /// The light of the surface's vertices.
    pub light: &'a [[f32; 4]],
}

impl Scene<'_> {
    /// Of every vertex of the surface, whether a region around it lost others: around all that have none, light is as it was.
    pub fn beside_losses(&self) -> Vec<bool> {
        let Self { surface, partition, rebuilt, .. } = *self;
        let mut sizes = vec![0_usize; partition.region_count];
        partition.labels.iter().for_each(|&region| sizes[region as usize] += 1);
        let mut beside = vec![false; surface.points.len()];
        for (ends, size) in rebuilt.region_starts.windows(2).zip(sizes) {
            let faces = &rebuilt.faces[ends[0] as usize..ends[1] as usize];
            if faces.len() < size {
                faces.iter().flatten().for_each(|&v| beside[v as usize] = true);
            }
        }
        beside
    }
}

/// What light may be lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// How far a color may be from the light at its place.
    pub most_moved: f64,
    /// How far the light at a vertex of the input may be off.
    pub most: f64,
    /// What a vertex inside is worth.
    pub worth: f64,
}

/// A vertex of the result as a corner of a sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    /// Its vertex of the surface.
    vertex: u32,
    sheet: u32,
    /// Its number there.
    corner: u32,
}

/// A vertex that may change.
#[derive(Debug)]
struct Slider {
    way: Way,
    stand: Stand,
    uses: Vec<Use>,
}

/// Slides the vertices of `scene` in regions [beside losses](Scene::beside_losses), whose `colors` change with them, and takes out
/// those that are not missed any more.
pub fn slide(scene: Scene<'_>, beside: &[bool], colors: &mut [[f32; 4]], bounds: Bounds) -> Slid {
    let Scene { surface, partition, boundary, rebuilt, light, .. } = scene;
    let ground = Ground { surface, labels: &partition.labels, boundary, colors: light };
    let mut sheets = sheets(&scene, &ground, beside, colors);
    let on_chain = on_chain(&scene);
    let (mut inside, mut shared) = sliders(&scene, &sheets, &on_chain);
    // What is not drawn anew keeps its faces.
    let is_drawn = |sheet: &Sheet| rebuilt.undrawn.binary_search(&sheet.region).is_err();
    let limits = Limits::new(light, bounds);
    for round in 0..ROUNDS {
        if round == THINNED_AT {
            let drawn = sheets.par_iter_mut().with_max_len(1).filter(|sheet| is_drawn(sheet));
            drawn.for_each(|sheet| sheet.thin(|v| on_chain[v as usize], bounds.worth, limits.bound));
        }
        sheets.par_iter_mut().zip(&mut inside).with_max_len(1).for_each(|(sheet, sliders)| {
            let sheet = std::slice::from_mut(sheet);
            sliders.iter_mut().for_each(|slider| slider.slide(&ground, sheet, limits));
        });
        shared.iter_mut().for_each(|slider| slider.slide(&ground, &mut sheets, limits));
    }
    let mut moved = Vec::new();
    let all = inside.iter().zip(&sheets).flat_map(|(list, sheet)| list.iter().map(move |slider| (slider, sheet)));
    for (slider, sheet) in all.chain(shared.iter().map(|slider| (slider, &sheets[slider.uses[0].sheet as usize]))) {
        let Use { vertex, corner, .. } = slider.uses[0];
        let [red, green, blue] = sheet.color(corner).map(|channel| channel as f32);
        let row = &mut colors[vertex as usize];
        *row = [red, green, blue, row[3]];
        if sheet.valence(corner) > 0 && slider.stand != Stand::at(vertex) {
            moved.push((vertex, slider.stand));
        }
    }
    moved.sort_unstable_by_key(|&(vertex, _)| vertex);
    let regions = sheets.iter().filter(|sheet| is_drawn(sheet)).map(|sheet| {
        let faces = sheet.faces();
        let is_whole = faces.iter().flatten().all(|&v| on_chain[v as usize]);
        Refilled { region: sheet.region, faces, is_whole }
    });
    Slid { moved, regions: regions.collect() }
}

/// What came of it.
#[derive(Debug, Default)]
pub struct Slid {
    /// Vertices of the surface that are elsewhere on it now, ascending.
    pub moved: Vec<(u32, Stand)>,
    /// The triangles of regions, ascending.
    pub regions: Vec<Refilled>,
}

/// Whether chains have a vertex.
fn on_chain(scene: &Scene<'_>) -> Vec<bool> {
    let mut on_chain = vec![false; scene.surface.points.len()];
    scene.boundary.chain_vertices.iter().for_each(|&v| on_chain[v as usize] = true);
    on_chain
}

/// The flat regions that have one of the vertices `beside` losses.
fn sheets(scene: &Scene<'_>, ground: &Ground<'_>, beside: &[bool], colors: &[[f32; 4]]) -> Vec<Sheet> {
    let (starts, faces) = scene.partition.faces_by_region();
    let sheet = |region: usize| {
        let of = |starts: &[u32]| starts[region] as usize..starts[region + 1] as usize;
        let triangles = &scene.rebuilt.faces[of(&scene.rebuilt.region_starts)];
        if !triangles.iter().flatten().any(|&v| beside[v as usize]) {
            return None;
        }
        Sheet::new(ground, region as u32, scene.planes[region].as_ref()?, triangles, &faces[of(&starts)], colors)
    };
    (0..scene.partition.region_count).into_par_iter().with_max_len(1).filter_map(sheet).collect()
}

/// The vertices inside every sheet, and those that sheets share, each in the order of vertices.
fn sliders(scene: &Scene<'_>, sheets: &[Sheet], on_chain: &[bool]) -> (Vec<Vec<Slider>>, Vec<Slider>) {
    let Scene { surface, rebuilt, .. } = *scene;
    let mut uses: Vec<Use> = Vec::new();
    let mut open = vec![0_u32; surface.points.len()];
    rebuilt.faces.iter().flatten().for_each(|&v| open[v as usize] += 1);
    for (number, sheet) in (0..).zip(sheets) {
        for (corner, &vertex) in (0..).zip(&sheet.vertices) {
            open[vertex as usize] -= sheet.valence(corner);
            uses.push(Use { vertex, sheet: number, corner });
        }
    }
    uses.par_sort_unstable();
    let lines = lines(scene);
    let (mut inside, mut shared): (Vec<Vec<Slider>>, Vec<Slider>) =
        (sheets.iter().map(|_| Vec::new()).collect(), Vec::new());
    for uses in uses.chunk_by(|a, b| a.vertex == b.vertex) {
        let Use { vertex, sheet, corner } = uses[0];
        // What is not flat keeps its corners.
        if open[vertex as usize] > 0 {
            continue;
        }
        let stand = Stand::at(vertex);
        if on_chain[vertex as usize] || uses.len() > 1 {
            let way = match lines.binary_search_by_key(&vertex, |&(v, _)| v) {
                Ok(at) => lines[at].1,
                Err(_) => Way::Nowhere,
            };
            shared.push(Slider { way, stand, uses: uses.to_vec() });
        } else {
            let way = surface.rings.ring(vertex).first().map_or(Way::Nowhere, |&face| Way::Plane(face));
            let uses = vec![Use { vertex, sheet: 0, corner }];
            inside[sheet as usize].push(Slider { way, stand, uses });
        }
    }
    (inside, shared)
}

/// The vertices of chains between whose neighbors these are straight, with the way along them, ascending.
fn lines(scene: &Scene<'_>) -> Vec<(u32, Way)> {
    let Scene { surface, boundary, chains, .. } = *scene;
    let point = |place: usize| surface.points[boundary.chain_vertices[place] as usize];
    let most = STRAIGHT * surface.diagonal;
    let mut lines = Vec::new();
    for chain in 0..boundary.chain_count() {
        let kept: Vec<usize> = chains.kept(chain).collect();
        for ends in kept.windows(3) {
            let &[first, middle, last] = ends else { continue };
            let chord = point(last) - point(first);
            let direction = chord / chord.length();
            let is_straight = (first..last).all(|place| {
                let away = point(place + 1) - point(first);
                (point(place + 1) - point(place)).dot(direction) > 0.0
                    && (away - direction * away.dot(direction)).length() <= most
            });
            if is_straight {
                lines.push((boundary.chain_vertices[middle], Way::Line { place: middle, direction }));
            }
        }
    }
    lines.sort_unstable_by_key(|&(vertex, _)| vertex);
    lines
}

/// [`Bounds`] as steps ask for them.
#[derive(Debug, Clone, Copy)]
struct Limits {
    most_moved: f64,
    greatest: f64,
    bound: f64,
    floor: f64,
}

impl Limits {
    fn new(light: &[[f32; 4]], Bounds { most_moved, most, .. }: Bounds) -> Self {
        let greatest = light.iter().flat_map(|row| &row[..3]).fold(0.0, |greatest, &x| f32::max(greatest, x));
        Self { most_moved, greatest: f64::from(greatest), bound: most + most_moved, floor: fit::FLOOR * most_moved }
    }

    /// The color nearest to this that a vertex may have where the light is that.
    fn cut(&self, color: Color, light: Color) -> Color {
        [0, 1, 2]
            .map(|k| color[k].clamp(light[k] - self.most_moved, light[k] + self.most_moved).clamp(0.0, self.greatest))
    }
}

impl Slider {
    /// One step, if there is one that brings the light nearer.
    fn slide(&mut self, ground: &Ground<'_>, sheets: &mut [Sheet], limits: Limits) {
        let mut sums = Sums::default();
        for &Use { sheet, corner, .. } in &self.uses {
            let sheet = &sheets[sheet as usize];
            let ways = match self.way {
                Way::Nowhere => [DVec2::ZERO; 2],
                Way::Plane(_) => [DVec2::X, DVec2::Y],
                Way::Line { direction, .. } => {
                    [DVec2::new(direction.dot(sheet.plane.u), direction.dot(sheet.plane.v)), DVec2::ZERO]
                }
            };
            sheet.add_to(&mut sums, corner, ways, limits.floor);
        }
        if sums.off <= 0.0 {
            return;
        }
        let most = sums.off * (1.0 - GAIN);
        let step = self.within_reach(sums.step(), sheets);
        let own = self.uses.first().map_or([0.0; 3], |first| sheets[first.sheet as usize].color(first.corner));
        let recolored = |gone: DVec2, share: f64| {
            let change = sums.recolor(gone);
            [0, 1, 2].map(|k| own[k] + share * change[k])
        };
        if step != DVec2::ZERO {
            for share in SHARES {
                let gone = step * share;
                let Some((way, stand)) = self.place_after(gone, ground, sheets) else { continue };
                let color = limits.cut(recolored(gone, 1.0), ground.color_at(&stand));
                if self.put_if(ground, sheets, (way, stand), color, [most, limits.bound]) {
                    return;
                }
            }
        }
        let light = ground.color_at(&self.stand);
        for share in SHARES {
            let color = limits.cut(recolored(DVec2::ZERO, share), light);
            if self.put_if(ground, sheets, (self.way, self.stand), color, [most, limits.bound]) {
                return;
            }
        }
    }

    /// A step cut to a share of the shortest edge.
    fn within_reach(&self, step: DVec2, sheets: &[Sheet]) -> DVec2 {
        if step == DVec2::ZERO || self.way == Way::Nowhere {
            return DVec2::ZERO;
        }
        let shortest = |u: &Use| sheets[u.sheet as usize].shortest_sq(u.corner);
        let most = REACH * self.uses.iter().map(shortest).fold(f64::INFINITY, f64::min).sqrt();
        step * (most / step.length()).min(1.0)
    }

    /// Where the vertex is after a step.
    fn place_after(&self, gone: DVec2, ground: &Ground<'_>, sheets: &[Sheet]) -> Option<(Way, Stand)> {
        match self.way {
            Way::Nowhere => None,
            Way::Plane(face) => {
                let &Use { sheet, corner, .. } = self.uses.first()?;
                let sheet = &sheets[sheet as usize];
                ground.over(&sheet.plane, face, sheet.point(corner) + gone)
            }
            Way::Line { place, direction } => {
                ground.along(place, direction, ground.point_at(&self.stand).dot(direction) + gone.x)
            }
        }
    }

    /// Puts it there in all sheets if the light is nearer then; whether it is.
    fn put_if(
        &mut self,
        ground: &Ground<'_>,
        sheets: &mut [Sheet],
        (way, stand): (Way, Stand),
        color: Color,
        [most, bound]: [f64; 2],
    ) -> bool {
        let point: DVec3 = ground.point_at(&stand);
        let is_here = stand == self.stand;
        let place = |sheet: &Sheet, corner: u32| if is_here { sheet.point(corner) } else { sheet.plane.project(point) };
        let mut off = 0.0;
        for &Use { sheet, corner, .. } in &self.uses {
            let sheet = &sheets[sheet as usize];
            match sheet.off_with(corner, place(sheet, corner), color, [most - off, bound]) {
                Some(more) => off += more,
                None => return false,
            }
        }
        for &Use { sheet, corner, .. } in &self.uses {
            let sheet = &mut sheets[sheet as usize];
            let at = place(sheet, corner);
            sheet.put(corner, at, color);
        }
        (self.way, self.stand) = (way, stand);
        true
    }
}
