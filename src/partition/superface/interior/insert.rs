//! A point put into a triangulation of a plane outline: a triangle or an edge is split, and edges flip toward Delaunay.

use rustc_hash::FxHashMap;

use robust::{Coord, incircle};

use super::super::super::triangulate::sides::turn;
use super::Edges;
use crate::math::DVec2;
use crate::mesh::dual::NONE;

/// A point nearer to an edge than this share of the edge's length is on it.
const ON_EDGE: f64 = 1e-9;

/// Counter-clockwise triangles with those across their edges.
#[derive(Debug)]
pub struct Drawing<'a> {
    points: &'a [DVec2],
    triangles: Vec<[u32; 3]>,
    /// Across the edge `k` from corner `k` to the corner after it; [`NONE`] on the outline.
    across: Vec<[u32; 3]>,
    kept: &'a Edges,
}

/// Where a point is.
enum Place {
    Inside(u32),
    /// On the edge `k` of a triangle.
    Edge(u32, usize),
    /// At a corner, or outside.
    Nowhere,
}

impl<'a> Drawing<'a> {
    /// Triangles of `points` that keep the edges `kept`.
    pub fn new(points: &'a [DVec2], triangles: Vec<[u32; 3]>, kept: &'a Edges) -> Self {
        let mut across = vec![[NONE; 3]; triangles.len()];
        let mut open: FxHashMap<[u32; 2], (u32, usize)> = FxHashMap::default();
        for (t, corners) in (0..).zip(&triangles) {
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]];
                match open.remove(&[b, a]) {
                    Some((other, j)) => {
                        across[t as usize][k] = other;
                        across[other as usize][j] = t;
                    }
                    None => {
                        open.insert([a, b], (t, k));
                    }
                }
            }
        }
        Self { points, triangles, across, kept }
    }

    /// Puts in a vertex that lies in a triangle near `hint`. False for one that lies in none, at a corner, or on an edge that stays.
    pub fn insert(&mut self, vertex: u32, hint: u32) -> bool {
        let place = self.locate(vertex, hint);
        let mut suspects = match place {
            Place::Inside(t) => self.split_triangle(vertex, t),
            Place::Edge(t, k) if !self.is_kept(t, k) => self.split_edge(vertex, t, k),
            _ => return false,
        };
        // Edges across from the vertex; a flip gives it two more. Its degree grows with each: they end.
        while let Some(t) = suspects.pop() {
            let Some(k) = (0..3).find(|&k| self.triangles[t as usize][(k + 2) % 3] == vertex) else { continue };
            if !self.is_kept(t, k) && self.should_flip(t, k) {
                suspects.extend(self.flip(t, k));
            }
        }
        true
    }

    pub fn into_triangles(self) -> Vec<[u32; 3]> {
        self.triangles
    }

    fn is_kept(&self, t: u32, k: usize) -> bool {
        let [a, b] = self.edge(t, k);
        self.across[t as usize][k] == NONE || self.kept.contains(&[a.min(b), a.max(b)])
    }

    fn edge(&self, t: u32, k: usize) -> [u32; 2] {
        let corners = self.triangles[t as usize];
        [corners[k], corners[(k + 1) % 3]]
    }

    /// Twice the area of the triangle from an edge to a vertex: positive inside, and the sign is exact.
    fn side(&self, [a, b]: [u32; 2], vertex: u32) -> f64 {
        let [a, b, p] = [a, b, vertex].map(|v| self.points[v as usize]);
        turn(a, b, p)
    }

    /// How far off an edge a vertex is, in lengths of the edge.
    fn height(&self, edge: [u32; 2], vertex: u32) -> f64 {
        let [a, b] = edge.map(|v| self.points[v as usize]);
        self.side(edge, vertex) / (b - a).length_squared()
    }

    /// Walks from the hint towards the vertex; where a hole is in the way, looks everywhere.
    fn locate(&self, vertex: u32, hint: u32) -> Place {
        let mut t = hint;
        // A walk that goes round in circles is given up.
        for step in 0..self.triangles.len() {
            // Another edge first in every step, so that circles are rare.
            let out = (0..3).map(|i| (i + step) % 3).find(|&k| self.side(self.edge(t, k), vertex) < 0.0);
            match out.map(|k| self.across[t as usize][k]) {
                None => return self.place_in(vertex, t),
                Some(NONE) => break,
                Some(next) => t = next,
            }
        }
        let holds = |&t: &u32| (0..3).all(|k| self.side(self.edge(t, k), vertex) >= 0.0);
        (0..self.triangles.len() as u32).find(holds).map_or(Place::Nowhere, |t| self.place_in(vertex, t))
    }

    fn place_in(&self, vertex: u32, t: u32) -> Place {
        let is_near = |k: &usize| self.height(self.edge(t, *k), vertex) <= ON_EDGE;
        let mut near = (0..3).filter(is_near);
        match (near.next(), near.next()) {
            (None, _) => Place::Inside(t),
            (Some(k), None) => Place::Edge(t, k),
            _ => Place::Nowhere,
        }
    }

    /// Tells the triangle across that `now` is beside it where `before` was.
    fn relink(&mut self, across: u32, before: u32, now: u32) {
        if let Some(row) = self.across.get_mut(across as usize)
            && let Some(k) = (0..3).find(|&k| row[k] == before)
        {
            row[k] = now;
        }
    }

    /// Three where there was one; returns those that have the vertex.
    fn split_triangle(&mut self, p: u32, t: u32) -> Vec<u32> {
        let [a, b, c] = self.triangles[t as usize];
        let [ab, bc, ca] = self.across[t as usize];
        let [u, v] = [self.triangles.len() as u32, self.triangles.len() as u32 + 1];
        (self.triangles[t as usize], self.across[t as usize]) = ([a, b, p], [ab, u, v]);
        self.triangles.extend([[b, c, p], [c, a, p]]);
        self.across.extend([[bc, v, t], [ca, t, u]]);
        self.relink(bc, t, u);
        self.relink(ca, t, v);
        vec![t, u, v]
    }

    /// Four where there were two across an edge:
    /// ```text
    ///      c              c
    ///    / t \          / | \
    ///   a --- b   →    a--p--b
    ///    \ o /          \ | /
    ///      d              d
    /// ```
    fn split_edge(&mut self, p: u32, t: u32, k: usize) -> Vec<u32> {
        let o = self.across[t as usize][k];
        let ([a, b], c) = (self.edge(t, k), self.triangles[t as usize][(k + 2) % 3]);
        let [bc, ca] = [1, 2].map(|i| self.across[t as usize][(k + i) % 3]);
        let Some(j) = (0..3).find(|&j| self.edge(o, j) == [b, a]) else { return Vec::new() };
        let d = self.triangles[o as usize][(j + 2) % 3];
        let [ad, db] = [1, 2].map(|i| self.across[o as usize][(j + i) % 3]);
        // Of the halves of an edge that has next to no area on one side, one may turn over.
        let halves = [[c, a], [b, c], [a, d], [d, b]];
        if halves.iter().any(|&edge| self.side(edge, p) <= 0.0) {
            return Vec::new();
        }
        let [u, v] = [self.triangles.len() as u32, self.triangles.len() as u32 + 1];
        (self.triangles[t as usize], self.across[t as usize]) = ([c, a, p], [ca, v, u]);
        (self.triangles[o as usize], self.across[o as usize]) = ([d, b, p], [db, u, v]);
        self.triangles.extend([[b, c, p], [a, d, p]]);
        self.across.extend([[bc, t, o], [ad, o, t]]);
        self.relink(bc, t, u);
        self.relink(ad, o, v);
        vec![t, o, u, v]
    }

    /// Whether the vertex across an edge lies in the circle of a triangle, and the flipped edge would lie inside both.
    fn should_flip(&self, t: u32, k: usize) -> bool {
        let o = self.across[t as usize][k];
        let ([a, b], c) = (self.edge(t, k), self.triangles[t as usize][(k + 2) % 3]);
        let Some(j) = (0..3).find(|&j| self.edge(o, j) == [b, a]) else { return false };
        let d = self.triangles[o as usize][(j + 2) % 3];
        let is_convex = self.side([c, a], d) > 0.0 && self.side([b, c], d) > 0.0;
        let [a, b, c, d] = [a, b, c, d].map(|v| Coord { x: self.points[v as usize].x, y: self.points[v as usize].y });
        is_convex && incircle(a, b, c, d) > 0.0
    }

    /// Turns the edge `k` of a triangle to the other diagonal; returns the two triangles.
    fn flip(&mut self, t: u32, k: usize) -> [u32; 2] {
        let o = self.across[t as usize][k];
        let ([a, b], c) = (self.edge(t, k), self.triangles[t as usize][(k + 2) % 3]);
        let [bc, ca] = [1, 2].map(|i| self.across[t as usize][(k + i) % 3]);
        let j = (0..3).find(|&j| self.edge(o, j) == [b, a]).unwrap_or_default();
        let d = self.triangles[o as usize][(j + 2) % 3];
        let [ad, db] = [1, 2].map(|i| self.across[o as usize][(j + i) % 3]);
        (self.triangles[t as usize], self.across[t as usize]) = ([a, d, c], [ad, o, ca]);
        (self.triangles[o as usize], self.across[o as usize]) = ([d, b, c], [db, bc, t]);
        self.relink(ad, o, t);
        self.relink(bc, t, o);
        [t, o]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counter-clockwise from the least corner, sorted.
    fn sorted(drawing: Drawing<'_>) -> Vec<[u32; 3]> {
        let turned = |t: [u32; 3]| {
            let least = (0..3).min_by_key(|&k| t[k]).unwrap_or_default();
            [0, 1, 2].map(|i| t[(least + i) % 3])
        };
        let mut triangles: Vec<[u32; 3]> = drawing.into_triangles().into_iter().map(turned).collect();
        triangles.sort_unstable();
        triangles
    }

    /// Links go both ways, and every triangle is the right way round.
    fn check(drawing: &Drawing<'_>) {
        for t in 0..drawing.triangles.len() as u32 {
            for k in 0..3 {
                let other = drawing.across[t as usize][k];
                let [a, b] = drawing.edge(t, k);
                assert!(
                    other == NONE
                        || (0..3).any(|j| drawing.edge(other, j) == [b, a] && drawing.across[other as usize][j] == t)
                );
            }
            assert!(drawing.side(drawing.edge(t, 0), drawing.triangles[t as usize][2]) > 0.0);
        }
    }

    fn points(list: &[[f64; 2]]) -> Vec<DVec2> {
        list.iter().map(|&p| DVec2::from(p)).collect()
    }

    #[test]
    fn a_point_in_a_triangle_makes_three() {
        let points = points(&[[0.0, 0.0], [3.0, 0.0], [0.0, 3.0], [1.0, 1.0]]);
        let kept = Edges::default();
        let mut drawing = Drawing::new(&points, vec![[0, 1, 2]], &kept);
        assert!(drawing.insert(3, 0));
        check(&drawing);
        assert_eq!(sorted(drawing), [[0, 1, 3], [0, 3, 2], [1, 2, 3]]);
    }

    #[test]
    fn a_point_on_an_edge_makes_four_unless_the_edge_stays() {
        let points = points(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0], [1.0, 0.0], [5.0, 5.0]]);
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        let kept = Edges::default();
        let mut drawing = Drawing::new(&points, triangles.clone(), &kept);
        assert!(drawing.insert(4, 1));
        check(&drawing);
        assert!(!drawing.insert(5, 0), "on the outline");
        assert!(!drawing.insert(6, 0), "outside");
        assert!(!drawing.insert(4, 0), "at a corner");
        assert_eq!(sorted(drawing), [[0, 1, 4], [0, 4, 3], [1, 2, 4], [2, 3, 4]]);
        let kept = Edges::from_iter([[0, 2]]);
        let mut drawing = Drawing::new(&points, triangles.clone(), &kept);
        assert!(!drawing.insert(4, 0));
        assert_eq!(sorted(drawing), triangles);
    }

    /// The diagonal 0–2 of a flat diamond is longer than 1–3: a point below it flips it, unless it stays.
    #[test]
    fn edges_flip_toward_delaunay() {
        let points = points(&[[0.0, 0.0], [4.0, -1.0], [8.0, 0.0], [4.0, 1.0], [4.0, -0.5]]);
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        let kept = Edges::default();
        let mut drawing = Drawing::new(&points, triangles.clone(), &kept);
        assert!(drawing.insert(4, 0));
        check(&drawing);
        assert_eq!(sorted(drawing), [[0, 1, 4], [0, 4, 3], [1, 2, 4], [2, 3, 4]]);
        let kept = Edges::from_iter([[0, 2]]);
        let mut drawing = Drawing::new(&points, triangles, &kept);
        assert!(drawing.insert(4, 0));
        assert_eq!(sorted(drawing), [[0, 1, 4], [0, 2, 3], [0, 4, 2], [1, 2, 4]]);
    }

    /// Around a hole, with hints at the wrong end: a square ring of eight triangles, whose walk runs into the hole.
    #[test]
    fn many_points_keep_the_outline_and_the_area() {
        let mut list =
            vec![[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [3.0, 3.0], [6.0, 3.0], [6.0, 6.0], [3.0, 6.0]];
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        while list.len() < 600 {
            let p = [9.0 * random(), 9.0 * random()];
            // Every third on lines that others are on too.
            let p = if list.len() % 3 == 0 { [p[0].round(), p[1]] } else { p };
            if !p.iter().all(|x| (3.0..=6.0).contains(x)) {
                list.push(p);
            }
        }
        let points = points(&list);
        let ring = (0..4).flat_map(|i| {
            let (j, inner) = ((i + 1) % 4, i + 4);
            [[i, j, inner], [j, j + 4, inner]]
        });
        let kept: Edges = (0..4)
            .flat_map(|i| [[i, (i + 1) % 4], [i + 4, (i + 1) % 4 + 4]])
            .map(|[a, b]: [u32; 2]| [a.min(b), a.max(b)])
            .collect();
        let mut drawing = Drawing::new(&points, ring.collect(), &kept);
        let inserted = (8..600).filter(|&v| drawing.insert(v, 0)).count();
        check(&drawing);
        // Those that were put on the outline, and those at the place of another, stay out.
        assert!(inserted > 550, "{inserted}");
        let borders: Vec<[u32; 2]> = (0..drawing.triangles.len() as u32)
            .flat_map(|t| [0, 1, 2].map(|k| (t, k)))
            .filter(|&(t, k)| drawing.across[t as usize][k] == NONE)
            .map(|(t, k)| drawing.edge(t, k))
            .collect();
        assert_eq!(borders.len(), 8);
        assert!(borders.iter().all(|&[a, b]| kept.contains(&[a.min(b), a.max(b)])));
        assert_eq!(drawing.triangles.len(), 8 + 2 * inserted);
        // No edge but those of the outline can flip any more.
        for t in 0..drawing.triangles.len() as u32 {
            assert!((0..3).all(|k| drawing.is_kept(t, k) || !drawing.should_flip(t, k)));
        }
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).perp_dot(c - a) / 2.0
        };
        assert!((drawing.triangles.iter().map(area).sum::<f64>() - 72.0).abs() < 1e-9);
    }
}
