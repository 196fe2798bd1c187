//! A flat region of the result, and the light that it should show.

use super::super::fit::{AT_VERTICES, area};
use super::super::interior::{Color, Grid, Limits, Places, Shade, length, thin_again};
use super::super::plane::Plane;
use super::ground::Ground;
use super::step::Sums;
use crate::math::{DVec2, DVec3};
use crate::mesh::adjacency::group;

/// A region is flat whose vertices lie within this share of the diagonal of its plane.
const FLAT: f64 = 1e-6;
/// Twice the area over the longest side squared that triangles have at least, unless they had less.
const LEAST_HEIGHT: f64 = 0.02;
/// A spot outside a triangle by less than this share is inside.
const INSIDE: f64 = -1e-6;
/// Where a triangle takes the place of fewer faces than this, the light of each counts at three places inside it.
const FEW: usize = 8;
/// Middles of faces for each triangle that are enough, besides vertices.
const MIDDLES: usize = 32;

/// The light that there should be somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spot {
    at: DVec2,
    color: [f32; 3],
    /// The area that it stands for.
    area: f32,
    /// Whether the light may not be off by any amount.
    is_bound: bool,
}

impl Spot {
    fn color(&self) -> Color {
        self.color.map(f64::from)
    }
}

/// The triangles of a region in its plane.
#[derive(Debug)]
pub struct Sheet {
    pub region: u32,
    pub plane: Plane,
    /// The vertex of the surface that each of its own is, ascending.
    pub vertices: Vec<u32>,
    points: Vec<DVec2>,
    colors: Vec<Color>,
    triangles: Vec<[u32; 3]>,
    /// The triangles around every vertex, in compressed rows.
    star_starts: Vec<u32>,
    stars: Vec<u32>,
    /// The light in every triangle.
    spots: Vec<Vec<Spot>>,
}

/// A triangle around a vertex, as it would be.
struct Blade {
    triangle: u32,
    /// To the corners after the vertex.
    sides: [DVec2; 2],
    shade: Shade,
}

impl Sheet {
    /// A region's `triangles` in its plane, with these colors; none where it is not flat.
    pub fn new(
        ground: &Ground<'_>,
        region: u32,
        plane: &Plane,
        triangles: &[[u32; 3]],
        faces: &[u32],
        colors: &[[f32; 4]],
    ) -> Option<Self> {
        let surface = ground.surface;
        let most = FLAT * surface.diagonal;
        let is_flat = |&f: &u32| {
            let heights = surface.faces[f as usize].map(|v| plane.height(surface.points[v as usize]).abs());
            heights.into_iter().all(|height| height <= most)
        };
        if !faces.iter().all(is_flat) {
            return None;
        }
        let mut vertices = triangles.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let local = |v: u32| vertices.partition_point(|&other| other < v) as u32;
        let triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(local)).collect();
        let points: Vec<DVec2> = vertices.iter().map(|&v| plane.project(surface.points[v as usize])).collect();
        if triangles.iter().any(|t| height(t.map(|v| points[v as usize])) <= 0.0) {
            return None;
        }
        let (star_starts, stars) = group(triangles.len(), vertices.len(), |t| triangles[t]);
        let color = |&v: &u32| {
            let [red, green, blue, _] = colors[v as usize];
            [red, green, blue].map(f64::from)
        };
        let colors = vertices.iter().map(color).collect();
        let spots = vec![Vec::new(); triangles.len()];
        let mut sheet = Self { region, plane: *plane, vertices, points, colors, triangles, star_starts, stars, spots };
        sheet.deal(spots_of(ground, plane, faces, sheet.triangles.len()));
        Some(sheet)
    }

    /// Finds the first triangle that holds each spot.
    fn deal(&mut self, spots: Vec<Spot>) {
        let points: Vec<DVec2> = spots.iter().map(|spot| spot.at).collect();
        let list: Vec<u32> = (0..points.len() as u32).collect();
        let grid = Grid::new(&points, &list);
        let mut is_dealt = vec![false; spots.len()];
        for (t, held) in self.spots.iter_mut().enumerate() {
            let corners = self.triangles[t].map(|v| self.points[v as usize]);
            grid.for_each_in(corners, |at| {
                if !is_dealt[at] && shares(corners, spots[at].at).into_iter().all(|share| share >= INSIDE) {
                    is_dealt[at] = true;
                    held.push(spots[at]);
                }
            });
        }
    }

    /// Its triangles, of the surface's vertices.
    pub fn faces(&self) -> Vec<[u32; 3]> {
        self.triangles.iter().map(|t| t.map(|v| self.vertices[v as usize])).collect()
    }

    /// Takes out vertices inside that are worth less than this, if no light at a vertex of the input is then off by more than
    /// `bound`, and turns edges toward the light. No new edge joins two outer vertices: they may be joined elsewhere.
    pub fn thin(&mut self, is_outer: impl Fn(u32) -> bool, worth: f64, bound: f64) {
        let is_outer: Vec<bool> = self.vertices.iter().map(|&v| is_outer(v)).collect();
        let corner_count = self.points.len() as u32;
        let mut spots: Vec<(u32, Spot)> = Vec::new();
        for is_bound in [true, false] {
            let held = (0..).zip(&self.spots).flat_map(|(t, list)| list.iter().map(move |spot| (t, *spot)));
            spots.extend(held.filter(|(_, spot)| spot.is_bound == is_bound));
        }
        let bound_count = corner_count + spots.iter().filter(|(_, spot)| spot.is_bound).count() as u32;
        let points: Vec<DVec2> = self.points.iter().copied().chain(spots.iter().map(|(_, spot)| spot.at)).collect();
        let colors: Vec<Color> =
            self.colors.iter().copied().chain(spots.iter().map(|(_, spot)| spot.color())).collect();
        // A vertex stands for nothing by itself: there is light around it.
        let of_corners = self.points.iter().map(|_| 0.0);
        let areas: Vec<f64> = of_corners.chain(spots.iter().map(|(_, spot)| f64::from(spot.area))).collect();
        let places = Places {
            points: &points,
            colors: &colors,
            areas: &areas,
            vertex_count: corner_count,
            bound_count,
            is_outer: &is_outer,
        };
        let members = (corner_count..).zip(&spots).map(|(point, &(t, _))| (t, point));
        let (triangles, members) =
            thin_again(places, std::mem::take(&mut self.triangles), members, Limits { most: bound, worth });
        let spot = |point: u32| point.checked_sub(corner_count).map(|at| spots[at as usize].1);
        self.spots = members.into_iter().map(|list| list.into_iter().filter_map(spot).collect()).collect();
        (self.star_starts, self.stars) = group(triangles.len(), self.points.len(), |t| triangles[t]);
        self.triangles = triangles;
    }

    fn star(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.stars[self.star_starts[v] as usize..self.star_starts[v + 1] as usize]
    }

    /// A triangle's corners from one of them on.
    fn turned_to(&self, triangle: u32, vertex: u32) -> [u32; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        if a == vertex {
            [a, b, c]
        } else if b == vertex {
            [b, c, a]
        } else {
            [c, a, b]
        }
    }

    /// How many triangles have a vertex.
    pub fn valence(&self, vertex: u32) -> u32 {
        self.star(vertex).len() as u32
    }

    pub fn point(&self, vertex: u32) -> DVec2 {
        self.points[vertex as usize]
    }

    pub fn color(&self, vertex: u32) -> Color {
        self.colors[vertex as usize]
    }

    /// The square of the shortest edge at a vertex.
    pub fn shortest_sq(&self, vertex: u32) -> f64 {
        let own = self.points[vertex as usize];
        let corners = self.star(vertex).iter().flat_map(|&t| self.triangles[t as usize]).filter(|&v| v != vertex);
        corners.map(|v| (self.points[v as usize] - own).length_squared()).fold(f64::INFINITY, f64::min)
    }

    /// Adds the light around a vertex that may go along two directions of the plane; below `floor` all that is off counts alike.
    pub fn add_to(&self, sums: &mut Sums, vertex: u32, ways: [DVec2; 2], floor: f64) {
        for &t in self.star(vertex) {
            let spots = &self.spots[t as usize];
            if spots.is_empty() {
                continue;
            }
            let corners = self.turned_to(t, vertex);
            let points = corners.map(|v| self.points[v as usize]);
            let shade = Shade::new(points, corners.map(|v| self.colors[v as usize]));
            let slopes = shade.slopes().map(|slope| DVec2::new(slope.dot(ways[0]), slope.dot(ways[1])));
            let across = points[2] - points[1];
            let area = (points[1] - points[0]).perp_dot(points[2] - points[0]);
            for spot in spots {
                let share = across.perp_dot(spot.at - points[1]) / area;
                sums.add([f64::from(spot.area), floor], shade.difference(spot.at, spot.color()), share, slopes);
            }
        }
    }

    /// What is around a vertex that stands there with this color; none where a triangle turns over or becomes a needle.
    fn blades(&self, vertex: u32, at: DVec2, color: Color) -> Option<Vec<Blade>> {
        let is_here = at == self.points[vertex as usize];
        let blade = |&triangle: &u32| {
            let corners = self.turned_to(triangle, vertex);
            let before = corners.map(|v| self.points[v as usize]);
            let points = [at, before[1], before[2]];
            if !is_here && height(points) < LEAST_HEIGHT.min(height(before)) {
                return None;
            }
            let colors = [color, self.colors[corners[1] as usize], self.colors[corners[2] as usize]];
            Some(Blade { triangle, sides: [points[1] - at, points[2] - at], shade: Shade::new(points, colors) })
        };
        self.star(vertex).iter().map(blade).collect()
    }

    /// By how much the light around a vertex is off with it there, in this color, if by less than `most` in all and by no more
    /// than `bound` in any channel at a vertex of the input.
    pub fn off_with(&self, vertex: u32, at: DVec2, color: Color, [most, bound]: [f64; 2]) -> Option<f64> {
        let blades = self.blades(vertex, at, color)?;
        let mut off = 0.0;
        for (own, blade) in blades.iter().enumerate() {
            for spot in &self.spots[blade.triangle as usize] {
                let difference = holder(&blades, own, spot.at - at).shade.difference(spot.at, spot.color());
                off += length(difference) * f64::from(spot.area);
                if off >= most || spot.is_bound && difference.into_iter().any(|channel| channel.abs() > bound) {
                    return None;
                }
            }
        }
        Some(off)
    }

    /// Puts a vertex there, in this color.
    pub fn put(&mut self, vertex: u32, at: DVec2, color: Color) {
        self.colors[vertex as usize] = color;
        if at == self.points[vertex as usize] {
            return;
        }
        let Some(blades) = self.blades(vertex, at, color) else { return };
        self.points[vertex as usize] = at;
        let lists: Vec<Vec<Spot>> =
            blades.iter().map(|blade| std::mem::take(&mut self.spots[blade.triangle as usize])).collect();
        for (own, list) in lists.into_iter().enumerate() {
            for spot in list {
                self.spots[holder(&blades, own, spot.at - at).triangle as usize].push(spot);
            }
        }
    }
}

/// The blade around a vertex that holds what is so far from it: its own, unless another does.
fn holder(blades: &[Blade], own: usize, away: DVec2) -> &Blade {
    let holds = |blade: &&Blade| blade.sides[0].perp_dot(away) >= 0.0 && away.perp_dot(blade.sides[1]) >= 0.0;
    let first = &blades[own];
    if holds(&first) { first } else { blades.iter().find(holds).unwrap_or(first) }
}

/// Twice the area of a triangle over its longest side squared.
fn height([a, b, c]: [DVec2; 3]) -> f64 {
    let longest_sq = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).perp_dot(c - a) / longest_sq
}

/// What each corner of a triangle has of a point.
fn shares([a, b, c]: [DVec2; 3], p: DVec2) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    let (of_b, of_c) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
    [1.0 - of_b - of_c, of_b, of_c]
}

/// The light of a region: at its vertices, and inside its faces.
fn spots_of(ground: &Ground<'_>, plane: &Plane, faces: &[u32], triangle_count: usize) -> Vec<Spot> {
    let surface = ground.surface;
    let single = |color: [f64; 3]| color.map(|channel| channel as f32);
    let mut spots = Vec::new();
    let thirds: &[[f64; 3]] = if faces.len() < FEW * triangle_count {
        &[[4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0], [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0]]
    } else {
        &[[1.0 / 3.0; 3]]
    };
    // Faces stand in the order of a curve through space: every so many of them are evenly spread.
    let stride = (faces.len() / (MIDDLES * triangle_count)).max(1);
    let part = (1.0 - AT_VERTICES) * stride as f64 / thirds.len() as f64;
    for &f in faces.iter().step_by(stride) {
        let corners = surface.faces[f as usize];
        let [a, b, c] = corners.map(|v| plane.project(surface.points[v as usize]));
        let colors = corners.map(|v| DVec3::from(ground.color(v)));
        let area = (area(surface, f) * part) as f32;
        spots.extend(thirds.iter().map(|[of_a, of_b, of_c]| Spot {
            at: a * *of_a + b * *of_b + c * *of_c,
            color: single((colors[0] * *of_a + colors[1] * *of_b + colors[2] * *of_c).to_array()),
            area,
            is_bound: false,
        }));
    }
    for &f in faces {
        let region = ground.labels[f as usize];
        for v in surface.faces[f as usize] {
            let mut around = surface.rings.ring(v).iter().filter(|&&g| ground.labels[g as usize] == region).peekable();
            // Each once, by the first of its faces.
            if around.peek() == Some(&&f) {
                let around = around.map(|&g| area(surface, g)).sum::<f64>();
                let at = plane.project(surface.points[v as usize]);
                let area = (around * AT_VERTICES / 3.0) as f32;
                spots.push(Spot { at, color: single(ground.color(v)), area, is_bound: true });
            }
        }
    }
    spots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::partition::Partition;
    use crate::partition::boundary::Boundary;
    use crate::partition::surface::Surface;

    /// A square of 8 × 8 cells as four triangles about the vertex in its middle, under light that bends along a line beside it.
    fn with_sheet(check: impl Fn(Sheet, u32)) {
        let mut mesh = shapes::plane(8, 8);
        let (low, high) = mesh.bounds();
        let across = |p: DVec3| (p.x - low.x) / (high.x - low.x);
        let light = |p: &DVec3| [0.2 + 0.5 * (across(*p) - 0.6).max(0.0) as f32, 0.3, 0.3, 1.0];
        mesh.colors = Some(mesh.positions.iter().map(light).collect());
        let surface = Surface::new(&mesh, Some(0.0)).expect("a valid mesh");
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let labels = vec![0; faces.len()];
        let boundary = Boundary::new(&surface, &Partition { labels: labels.clone(), region_count: 1 });
        let colors: Vec<[f32; 4]> = surface.vertex_source.iter().map(|&v| light(&mesh.positions[v as usize])).collect();
        let ground = Ground { surface: &surface, labels: &labels, boundary: &boundary, colors: &colors };
        let plane = Plane::of(&surface, &faces).expect("a plane");
        let at = |i: usize, j: usize| {
            let source = mesh
                .positions
                .iter()
                .position(|p| *p == low + (high - low) * DVec3::new(i as f64, j as f64, 0.0) / 8.0);
            surface.vertex_source.iter().position(|&v| Some(v as usize) == source).expect("a vertex") as u32
        };
        let [a, b, c, d, middle] = [at(0, 0), at(8, 0), at(8, 8), at(0, 8), at(4, 4)];
        let triangles = [[a, b, middle], [b, c, middle], [c, d, middle], [d, a, middle]];
        let sheet = Sheet::new(&ground, 0, &plane, &triangles, &faces, &colors).expect("it is flat");
        let own = sheet.vertices.binary_search(&middle).expect("a corner") as u32;
        check(sheet, own);
    }

    #[test]
    fn every_spot_is_held_wherever_the_vertex_goes() {
        with_sheet(|mut sheet, own| {
            let held = |sheet: &Sheet| {
                let corners = |t: usize| sheet.triangles[t].map(|v| sheet.points[v as usize]);
                let spots =
                    sheet.spots.iter().enumerate().flat_map(|(t, spots)| spots.iter().map(move |spot| (t, spot.at)));
                assert!(spots.clone().all(|(t, at)| shares(corners(t), at).into_iter().all(|share| share > -1e-5)));
                (spots.count(), sheet.spots.iter().flatten().map(|spot| f64::from(spot.area)).sum::<f64>())
            };
            let (count, area) = held(&sheet);
            assert_eq!(count, 81 + 128, "every vertex, and the middle of every face");
            let reach = sheet.shortest_sq(own).sqrt();
            for away in [DVec2::new(0.3, 0.1), DVec2::new(-0.2, 0.4), DVec2::ZERO] {
                sheet.put(own, sheet.point(own) + away * reach, [0.2, 0.3, 0.3]);
                let (count_now, area_now) = held(&sheet);
                assert!(count_now == count && (area_now - area).abs() < 1e-6 * area);
            }
        });
    }

    #[test]
    fn vertices_go_that_are_not_missed() {
        with_sheet(|mut sheet, own| {
            let count = |sheet: &Sheet| (sheet.faces().len(), sheet.spots.iter().map(Vec::len).sum::<usize>());
            // Its absence costs more light than that, or leaves a vertex too far off.
            for (worth, bound) in [(0.0, 1.0), (1e30, 1e-3)] {
                sheet.thin(|_| false, worth, bound);
                assert_eq!((count(&sheet), sheet.valence(own)), ((4, 81 + 128), 4), "{worth}, {bound}");
            }
            // All others are on the outline: the diagonal in its place would join two of them.
            sheet.thin(|_| true, 1e30, 1.0);
            assert_eq!(count(&sheet), (4, 81 + 128));
            sheet.thin(|_| false, 1e30, 1.0);
            assert_eq!((count(&sheet), sheet.valence(own)), ((2, 81 + 128), 0));
        });
    }

    #[test]
    fn light_is_nearer_where_it_bends_and_nothing_turns_over() {
        with_sheet(|sheet, own| {
            let (at, side) = (sheet.point(own), sheet.shortest_sq(own).sqrt() * std::f64::consts::SQRT_2);
            let color = sheet.color(own);
            let off = |away: DVec2| sheet.off_with(own, at + away * side, color, [f64::INFINITY; 2]);
            let here = off(DVec2::ZERO).expect("it may stay");
            let nearest = [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y].into_iter().filter_map(|way| off(way * 0.1));
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.9 * here, "{nearest} of {here}");
            assert_eq!(
                sheet.off_with(own, at, color, [here * 0.99, f64::INFINITY]),
                None,
                "not below what it should be"
            );
            assert_eq!(sheet.off_with(own, at, color, [f64::INFINITY, 1e-3]), None, "a vertex is off by more");
            // Past a side, onto it, and so near to it that a needle is left.
            assert!([0.6, 0.5, 0.495].map(|x| off(DVec2::X * x)) == [None; 3]);
        });
    }
}
