//! Vertices put back into an outline, and taken out again, the least missed first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

use multiversion::multiversion;

use super::super::triangulate::sides::{triangle_holds, turn};
use super::drawing::{Drawing, Star};
use super::grid::Grid;
use super::{Color, KeptEdges, Limits, Places, Shade, length};
use crate::math::{DVec2, tie_hash};
use crate::mesh::dual::NONE;

/// Twice the area over the longest side squared that triangles of a fan have at least.
const LEAST_HEIGHT: f64 = 1e-3;
/// An edge turns where that saves more than this share of the difference.
const GAIN: f64 = 1e-9;
/// How often edges turn and all vertices that are left are asked.
const MOST_PASSES: usize = 4;
/// Edges turned toward the light, for each triangle: a limit that rounding cannot reach.
const MOST_TURNS: usize = 16;

/// Puts the vertices of `places` that lie in triangles in, all at first, and takes out those that `limits` let go: in the order of
/// what they are worth, which is by how much the light of the best fan in their place is off. `triangles` are counter-clockwise
/// and keep the edges `kept`, their outline among them. Returns triangles, and the places in each that are no corner.
///
/// Edges turn between passes, to the diagonals that light runs along. What a vertex is worth is found anew when it comes up; it
/// goes if no other is worth less by then. With N places and M vertices that stay O(N log (N / M)) differences of color.
pub fn thin(
    places: Places<'_>,
    triangles: Vec<[u32; 3]>,
    kept: &KeptEdges,
    limits: Limits,
) -> (Vec<[u32; 3]>, Vec<Vec<u32>>) {
    let mut thinning = Thinning::new(places, Drawing::new(places.points, triangles, kept), limits);
    thinning.place(0..places.vertex_count);
    thinning.fill();
    // What only shows light is dealt once, when all triangles are small.
    thinning.place(places.vertex_count..places.points.len() as u32);
    thinning.take_out()
}

/// The same of triangles that have their vertices: those inside that `limits` let go now go, and edges turn. The places in each
/// triangle are given.
pub fn thin_again(
    places: Places<'_>,
    triangles: Vec<[u32; 3]>,
    members: impl Iterator<Item = (u32, u32)>,
    limits: Limits,
) -> (Vec<[u32; 3]>, Vec<Vec<u32>>) {
    let kept = KeptEdges::default();
    let mut drawing = Drawing::new(places.points, triangles, &kept);
    members.for_each(|(t, point)| drawing.add(t, point));
    Thinning::new(places, drawing, limits).take_out()
}

struct Thinning<'a> {
    drawing: Drawing<'a>,
    places: Places<'a>,
    limits: Limits,
    /// By how much the light of each triangle is off, over its area.
    losses: Vec<f64>,
    /// A triangle of every vertex; none for those that are no corner.
    triangle_of: Vec<u32>,
    /// What was found of every vertex, unless a triangle around it has changed since.
    answers: Vec<Option<Answer>>,
    star: Star,
    /// What the triangles of the star hold.
    spots: Vec<Spot>,
    fan: Fan,
}

/// By how much more the light is off without a vertex, and the neighbor whose fan is best in its place; nothing where it stays.
type Answer = Option<(f64, usize)>;

/// Triangles from one neighbor of a vertex to all others.
#[derive(Debug, Default)]
struct Fan {
    shades: Vec<Shade>,
    /// To the corners that two of them have.
    rays: Vec<DVec2>,
}

/// The light that a place should have. Those around a vertex lie together in memory: every fan in its place asks for all of them.
#[derive(Debug, Clone, Copy)]
struct Spot {
    at: DVec2,
    color: Color,
    area: f64,
    /// Greatest difference of a channel.
    most: f64,
}

impl Spot {
    /// By how much the light is off, over the area that it stands for.
    fn off(&self, shade: &Shade) -> f64 {
        length(shade.difference(self.at, self.color)) * self.area
    }

    fn may_have(&self, shade: &Shade) -> bool {
        shade.difference(self.at, self.color).into_iter().all(|channel| channel.abs() <= self.most)
    }
}

impl<'a> Thinning<'a> {
    fn new(places: Places<'a>, drawing: Drawing<'a>, limits: Limits) -> Self {
        Self {
            drawing,
            places,
            limits,
            losses: Vec::new(),
            triangle_of: vec![NONE; places.vertex_count as usize],
            answers: vec![None; places.vertex_count as usize],
            star: Star::default(),
            spots: Vec::new(),
            fan: Fan::default(),
        }
    }

    /// Takes out what is not missed.
    fn take_out(mut self) -> (Vec<[u32; 3]>, Vec<Vec<u32>>) {
        self.measure();
        // What could not go may be able to once others have gone, or edges have turned.
        for _ in 0..MOST_PASSES {
            self.turn_edges();
            if !self.pass() {
                break;
            }
        }
        self.drawing.into_parts()
    }

    /// Whether a new edge may join two vertices.
    fn may_join(&self, a: u32, b: u32) -> bool {
        let is_outer = |v: u32| self.places.is_outer.get(v as usize).copied().unwrap_or(false);
        !(is_outer(a) && is_outer(b))
    }

    /// Finds the first triangle that holds each of these points that is no corner.
    fn place(&mut self, points: Range<u32>) {
        let mut is_known = vec![false; self.places.points.len()];
        for t in 0..self.drawing.len() as u32 {
            self.drawing.corners(t).iter().for_each(|&v| is_known[v as usize] = true);
        }
        let list: Vec<u32> = points.filter(|&point| !is_known[point as usize]).collect();
        let grid = Grid::new(self.places.points, &list);
        for t in 0..self.drawing.len() as u32 {
            let corners = self.drawing.corners(t).map(|v| self.places.points[v as usize]);
            grid.for_each_in(corners, |at| {
                let point = list[at] as usize;
                if !is_known[point] && triangle_holds(corners, self.places.points[point]) {
                    is_known[point] = true;
                    self.drawing.add(t, list[at]);
                }
            });
        }
    }

    /// Puts in all vertices, of every triangle the middle one of its list first, so that lists halve.
    fn fill(&mut self) {
        let mut is_stuck = vec![false; self.places.vertex_count as usize];
        let mut open: Vec<u32> = (0..self.drawing.len() as u32).rev().collect();
        while let Some(t) = open.pop() {
            let members = self.drawing.members(t);
            let can_be = |v: &u32| !is_stuck[*v as usize];
            let count = members.iter().copied().filter(can_be).count();
            let Some(vertex) = members.iter().copied().filter(can_be).nth(count / 2) else { continue };
            match self.drawing.insert(vertex, t) {
                Some(changed) => open.extend(changed),
                None => {
                    is_stuck[vertex as usize] = true;
                    open.push(t);
                }
            }
        }
    }

    /// Finds what every triangle loses, and a triangle of every vertex.
    fn measure(&mut self) {
        self.losses = vec![0.0; self.drawing.len()];
        (0..self.drawing.len() as u32).for_each(|t| self.measure_one(t));
    }

    /// Finds anew what a triangle loses that changed.
    fn measure_one(&mut self, t: u32) {
        self.losses[t as usize] = self.loss(t);
        for v in self.drawing.corners(t) {
            self.triangle_of[v as usize] = t;
            self.answers[v as usize] = None;
        }
    }

    /// Turns edges where that brings the light nearer: at first, of the two diagonals of a square the one that the input had.
    fn turn_edges(&mut self) {
        let mut turns = MOST_TURNS * self.drawing.len();
        let mut open: Vec<u32> = (0..self.drawing.len() as u32).rev().collect();
        while let Some(t) = open.pop() {
            let Some(k) = (0..3).find(|&k| self.should_turn(t, k)) else { continue };
            if turns == 0 {
                break;
            }
            turns -= 1;
            for t in self.drawing.flip(t, k) {
                self.measure_one(t);
                open.push(t);
            }
        }
    }

    fn should_turn(&self, t: u32, k: usize) -> bool {
        let o = self.drawing.across(t, k);
        let now = self.losses[t as usize] + self.losses.get(o as usize).copied().unwrap_or(0.0);
        if now <= 0.0 {
            return false;
        }
        let Some([a, b, c, d]) = self.drawing.diamond(t, k) else { return false };
        let sides = [[a, d, c], [d, b, c]];
        if !self.may_join(c, d) || sides.iter().any(|&side| !self.is_round(side)) {
            return false;
        }
        let shades = sides.map(|side| self.shade(side));
        let [from, to] = [d, c].map(|v| self.places.points[v as usize]);
        let mut turned = 0.0;
        for &point in self.drawing.members(t).iter().chain(self.drawing.members(o)) {
            let spot = self.spot(point);
            let is_left = (to - from).perp_dot(spot.at - from) >= 0.0;
            let shade = &shades[usize::from(!is_left)];
            turned += spot.off(shade);
            if turned >= now * (1.0 - GAIN) || !spot.may_have(shade) {
                return false;
            }
        }
        true
    }

    /// Takes out what is worth least: asks every vertex once, and again where what is around it has changed; whether any went.
    fn pass(&mut self) -> bool {
        let corners: Vec<u32> =
            (0..self.places.vertex_count).filter(|&v| self.triangle_of[v as usize] != NONE).collect();
        // Of equals not one after its neighbor: the triangles of a flat would be few and large from the start.
        let rank = |worth: f64, v: u32| (order(worth), tie_hash(v, 0), v);
        let worth = |v: u32| Some(Reverse(rank(self.worth(v)?.0, v)));
        let mut queue: BinaryHeap<Reverse<(u64, u32, u32)>> = corners.into_iter().filter_map(worth).collect();
        let mut is_any = false;
        while let Some(Reverse((before, _, vertex))) = queue.pop() {
            let Some((worth, apex)) = self.worth(vertex) else { continue };
            let now = Reverse(rank(worth, vertex));
            if now.0.0 > before && queue.peek().is_some_and(|next| *next > now) {
                queue.push(now);
                continue;
            }
            is_any = true;
            let mut star = std::mem::take(&mut self.star);
            self.drawing.star(vertex, self.triangle_of[vertex as usize], &mut star);
            self.drawing.remove(vertex, &star, apex).iter().for_each(|&t| self.measure_one(t));
            self.star = star;
            self.triangle_of[vertex as usize] = NONE;
        }
        is_any
    }

    /// What is to be found of a vertex: as it was found, unless something around it has changed.
    fn worth(&mut self, vertex: u32) -> Answer {
        if let Some(answer) = self.answers[vertex as usize] {
            return answer;
        }
        let answer = self.ask(vertex);
        self.answers[vertex as usize] = Some(answer);
        answer
    }

    fn ask(&mut self, vertex: u32) -> Answer {
        let mut star = std::mem::take(&mut self.star);
        let is_inside = self.drawing.star(vertex, self.triangle_of[vertex as usize], &mut star);
        self.star = star;
        if !is_inside {
            return None;
        }
        let mut spots = std::mem::take(&mut self.spots);
        spots.clear();
        let lists = self.star.triangles.iter().map(|&t| self.drawing.members(t));
        spots.extend(std::iter::once(&[vertex][..]).chain(lists).flatten().map(|&point| self.spot(point)));
        self.spots = spots;
        let now: f64 = self.star.triangles.iter().map(|&t| self.losses[t as usize]).sum();
        let mut best = None;
        let mut most = now + self.limits.worth;
        for apex in 0..self.star.ring.len() {
            if let Some(loss) = self.loss_of_fan(apex, most) {
                (best, most) = (Some((loss - now, apex)), loss);
            }
        }
        best
    }

    /// By how much the light is off with a fan from a neighbor, if by less than `most`.
    fn loss_of_fan(&mut self, apex: usize, most: f64) -> Option<f64> {
        let (after, before) = (&self.star.ring[apex..], &self.star.ring[..apex]);
        let others = || after[1..].iter().chain(before).copied();
        let count = (after.len() + before.len()).checked_sub(2)?;
        let from = after[0];
        let corners = || others().zip(others().skip(1)).map(|(a, b)| [from, a, b]);
        // Past a half turn around the neighbor, points could not be told by the sides of its edges.
        let at = |v: u32| self.places.points[v as usize];
        let (first, last) = (others().next()?, others().last()?);
        if turn(at(from), at(first), at(last)) < 0.0 || !corners().all(|corners| self.is_round(corners)) {
            return None;
        }
        if !others().take(count).skip(1).all(|v| self.may_join(from, v)) {
            return None;
        }
        let mut fan = std::mem::take(&mut self.fan);
        let from = at(from);
        fan.shades.clear();
        fan.shades.extend(corners().map(|corners| self.shade(corners)));
        fan.rays.clear();
        fan.rays.extend(others().take(count).skip(1).map(|v| at(v) - from));
        let loss = fan_loss(&self.spots, from, &fan, most);
        self.fan = fan;
        loss
    }

    /// Whether a triangle is the right way round and no needle.
    fn is_round(&self, corners: [u32; 3]) -> bool {
        let [a, b, c] = corners.map(|v| self.places.points[v as usize]);
        let longest_sq = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        (b - a).perp_dot(c - a) > LEAST_HEIGHT * longest_sq
    }

    fn shade(&self, corners: [u32; 3]) -> Shade {
        Shade::new(corners.map(|v| self.places.points[v as usize]), corners.map(|v| self.places.colors[v as usize]))
    }

    /// A place; only at a vertex light may not be off by any amount.
    fn spot(&self, point: u32) -> Spot {
        let Places { points, colors, areas, bound_count, .. } = self.places;
        let at = point as usize;
        let most = if point < bound_count { self.limits.most } else { f64::INFINITY };
        Spot { at: points[at], color: colors[at], area: areas[at], most }
    }

    fn loss(&self, t: u32) -> f64 {
        let members = self.drawing.members(t);
        if members.is_empty() {
            return 0.0;
        }
        let shade = self.shade(self.drawing.corners(t));
        members.iter().map(|&point| self.spot(point).off(&shade)).sum()
    }
}

/// By how much the light of places is off with a fan from a point, if by less than `most` and by no more than each may have.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn fan_loss(spots: &[Spot], from: DVec2, Fan { shades, rays }: &Fan, most: f64) -> Option<f64> {
    let mut loss = 0.0;
    for spot in spots {
        let away = spot.at - from;
        let wedge = rays.iter().take_while(|ray| ray.perp_dot(away) > 0.0).count();
        let shade = &shades[wedge];
        loss += spot.off(shade);
        if loss >= most || !spot.may_have(shade) {
            return None;
        }
    }
    Some(loss)
}

/// Bits that order as numbers do.
fn order(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of n × n vertices over a square that is cut in two, with this light; what `thin` makes of it.
    fn thinned(n: u32, light: impl Fn(DVec2) -> f64, limits: Limits) -> Vec<[u32; 3]> {
        // The corners first.
        let corner = n - 1;
        let at = |i: u32| DVec2::new(f64::from(i % n), f64::from(i / n));
        let corners = [0, corner, n * n - 1, n * corner];
        let inside = (0..n * n).filter(|i| (1..corner).contains(&(i % n)) && (1..corner).contains(&(i / n)));
        let points: Vec<DVec2> = corners.into_iter().chain(inside).map(at).collect();
        let colors: Vec<[f64; 3]> = points.iter().map(|&p| [light(p); 3]).collect();
        let kept = KeptEdges::from_iter([[0, 1], [1, 2], [2, 3], [0, 3]]);
        let areas = vec![1.0; points.len()];
        let places = Places {
            points: &points,
            colors: &colors,
            areas: &areas,
            vertex_count: points.len() as u32,
            bound_count: points.len() as u32,
            is_outer: &[],
        };
        let (triangles, members) = thin(places, vec![[0, 1, 2], [0, 2, 3]], &kept, limits);
        let area: f64 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| points[v as usize]);
                assert!(turn(a, b, c) > 0.0);
                turn(a, b, c) / 2.0
            })
            .sum();
        assert!((area - f64::from(corner * corner)).abs() < 1e-9);
        let mut corners: Vec<u32> = triangles.as_flattened().to_vec();
        corners.sort_unstable();
        corners.dedup();
        // Every point is a corner or in a triangle, once, and lit as well as asked for.
        assert_eq!(corners.len() + members.iter().map(Vec::len).sum::<usize>(), points.len());
        for (t, list) in triangles.iter().zip(&members) {
            let at = t.map(|v| points[v as usize]);
            let shade = Shade::new(at, t.map(|v| colors[v as usize]));
            for &point in list {
                assert!(triangle_holds(at, points[point as usize]));
                let [off, ..] = shade.difference(points[point as usize], colors[point as usize]);
                assert!(off.abs() <= limits.most + 1e-12, "{off}");
            }
        }
        triangles
    }

    const ANY: Limits = Limits { most: 1e-9, worth: 1e-6 };

    #[test]
    fn what_light_runs_evenly_over_goes() {
        assert_eq!(thinned(9, |_| 0.3, ANY).len(), 2);
        assert_eq!(thinned(9, |p| 0.01 * p.x - 0.02 * p.y, ANY).len(), 2);
    }

    #[test]
    fn a_bright_spot_stays() {
        let spot = DVec2::new(5.0, 4.0);
        let light = |p: DVec2| if p == spot { 0.9 } else { 0.2 };
        // The spot and its neighbors: of eight around it the light needs no more.
        let triangles = thinned(9, light, Limits { most: 0.01, worth: 100.0 });
        assert!((8..40).contains(&triangles.len()), "{}", triangles.len());
        // One that is worth little may go, if the difference may be that great.
        assert_eq!(thinned(9, light, Limits { most: 1.0, worth: 1.0 }).len(), 2);
    }

    #[test]
    fn all_stay_where_nothing_may_be_lost() {
        let light = |p: DVec2| 0.01 * (p.x * p.x + p.y * p.x * 0.7 + p.y * p.y);
        assert_eq!(thinned(7, light, Limits { most: 0.0, worth: 0.0 }).len(), 2 + 2 * 25);
        let some = thinned(12, light, Limits { most: 0.05, worth: 0.5 }).len();
        let fewer = thinned(12, light, Limits { most: 0.2, worth: 5.0 }).len();
        assert!(fewer < some && some < 200, "{some}, {fewer}");
    }

    #[test]
    fn numbers_order_as_their_bits() {
        let list = [-1e9, -1.0, -1e-300, 0.0, 1e-300, 2.0, 1e9];
        assert!(list.windows(2).all(|pair| order(pair[0]) < order(pair[1])));
    }
}
