//! A triangulation of a plane outline that knows which points lie in each triangle: vertices are put in, where a triangle or an
//! edge is split and edges flip toward Delaunay, and taken out.

use rustc_hash::FxHashMap;

use super::super::triangulate::sides::turn;
use super::KeptEdges;
use crate::math::DVec2;
use crate::mesh::dual::NONE;

/// A point nearer to an edge than this share of the edge's length is on it.
const ON_EDGE: f64 = 1e-9;
/// A point inside a circle by less than this share of what decides it is on the circle.
const IN_CIRCLE: f64 = 1e-12;
/// A vertex of more neighbors stays.
const MOST_NEIGHBORS: usize = 24;

/// Counter-clockwise triangles with those across their edges.
#[derive(Debug)]
pub struct Drawing<'a> {
    points: &'a [DVec2],
    triangles: Vec<[u32; 3]>,
    /// Across the edge `k` from corner `k` to the corner after it; [`NONE`] on the outline.
    across: Vec<[u32; 3]>,
    /// The points in each triangle that are no corner.
    members: Vec<Vec<u32>>,
    kept: &'a KeptEdges,
    /// Edges that stay have no vertex from this on.
    kept_end: u32,
}

/// A vertex inside and what is around it.
#[derive(Debug, Default)]
pub struct Star {
    /// Its neighbors, counter-clockwise.
    pub ring: Vec<u32>,
    /// The triangle on each of them and the one after.
    pub triangles: Vec<u32>,
}

/// Where in a triangle a point is.
enum Place {
    Inside,
    /// On the edge `k`.
    Edge(usize),
    Corner,
}

impl<'a> Drawing<'a> {
    /// Triangles of `points` that keep the edges `kept`.
    pub fn new(points: &'a [DVec2], triangles: Vec<[u32; 3]>, kept: &'a KeptEdges) -> Self {
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
        let kept_end = kept.iter().flatten().max().map_or(0, |&v| v + 1);
        Self { points, members: vec![Vec::new(); triangles.len()], triangles, across, kept, kept_end }
    }

    /// Puts in a vertex that lies in a triangle; returns the triangles that changed, some more than once. None for one at a
    /// corner, or on an edge that stays.
    pub fn insert(&mut self, vertex: u32, t: u32) -> Option<Vec<u32>> {
        let mut suspects = match self.place_in(vertex, t) {
            Place::Inside => self.split_triangle(vertex, t),
            Place::Edge(k) if !self.is_kept(t, k) => self.split_edge(vertex, t, k)?,
            Place::Edge(_) | Place::Corner => return None,
        };
        let mut changed = suspects.clone();
        // Edges across from the vertex; a flip gives it two more. Its degree grows with each: they end.
        while let Some(t) = suspects.pop() {
            let Some(k) = (0..3).find(|&k| self.triangles[t as usize][(k + 2) % 3] == vertex) else { continue };
            if self.should_flip(t, k) {
                let both = self.flip(t, k);
                suspects.extend(both);
                changed.extend(both);
            }
        }
        Some(changed)
    }

    /// How many triangles there are, those included that were taken out.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The corners of a triangle; three times the same of one that was taken out.
    pub fn corners(&self, t: u32) -> [u32; 3] {
        self.triangles[t as usize]
    }

    /// The points in a triangle.
    pub fn members(&self, t: u32) -> &[u32] {
        &self.members[t as usize]
    }

    /// Adds a point to those of a triangle.
    pub fn add(&mut self, t: u32, point: u32) {
        self.members[t as usize].push(point);
    }

    /// The triangles that are left, and the points in each.
    pub fn into_parts(self) -> (Vec<[u32; 3]>, Vec<Vec<u32>>) {
        self.triangles.into_iter().zip(self.members).filter(|(corners, _)| corners[0] != corners[1]).unzip()
    }

    /// Deals points to those of these triangles that hold them; to the nearest where rounding leaves one out.
    fn deal(&mut self, members: Vec<u32>, triangles: &[u32]) {
        for point in members {
            let side = |t: u32, k: usize| self.side(self.edge(t, k), point);
            let holds = |t: &u32| (0..3).all(|k| side(*t, k) >= 0.0);
            let depth = |t: u32| (0..3).map(|k| side(t, k)).fold(f64::INFINITY, f64::min);
            let nearest = || triangles.iter().copied().max_by(|&a, &b| depth(a).total_cmp(&depth(b)));
            if let Some(t) = triangles.iter().copied().find(holds).or_else(nearest) {
                self.members[t as usize].push(point);
            }
        }
    }

    /// Deals points to the triangles of a fan that goes round its first corner by less than a half turn: all lie in it.
    fn deal_to_fan(&mut self, members: Vec<u32>, fan: &[u32]) {
        let Some((&last, others)) = fan.split_last() else { return };
        let ray = |t: &u32| [self.triangles[*t as usize][0], self.triangles[*t as usize][2]];
        let rays: Vec<[u32; 2]> = others.iter().map(ray).collect();
        for point in members {
            let holder = rays.iter().position(|&ray| self.side(ray, point) <= 0.0).map_or(last, |i| fan[i]);
            self.members[holder as usize].push(point);
        }
    }

    /// Takes the points out of two triangles.
    fn gather(&mut self, [t, o]: [u32; 2]) -> Vec<u32> {
        let mut members = std::mem::take(&mut self.members[t as usize]);
        members.append(&mut self.members[o as usize]);
        members
    }

    /// What is around a vertex, from one of its triangles; false on the outline or an edge that stays.
    pub fn star(&self, vertex: u32, first: u32, star: &mut Star) -> bool {
        star.ring.clear();
        star.triangles.clear();
        let mut t = first;
        loop {
            let Some(k) = (0..3).find(|&k| self.triangles[t as usize][k] == vertex) else { return false };
            if self.is_kept(t, k) {
                return false;
            }
            star.ring.push(self.triangles[t as usize][(k + 1) % 3]);
            star.triangles.push(t);
            t = self.across[t as usize][(k + 2) % 3];
            if t == first {
                return true;
            }
            if t == NONE || star.ring.len() > MOST_NEIGHBORS {
                return false;
            }
        }
    }

    /// Takes a vertex out: a fan from the neighbor at `apex`, of less than a half turn, takes the place of its star, whose first
    /// triangles it reuses. Returns these; the vertex is a point in one of them.
    pub fn remove<'s>(&mut self, vertex: u32, star: &'s Star, apex: usize) -> &'s [u32] {
        let Star { ring, triangles } = star;
        let count = ring.len();
        let outside = |t: &u32| {
            let k = (0..3).find(|&k| self.triangles[*t as usize][k] == vertex).unwrap_or_default();
            self.across[*t as usize][(k + 1) % 3]
        };
        let outside: Vec<u32> = triangles.iter().map(outside).collect();
        let mut members = vec![vertex];
        triangles.iter().for_each(|&t| members.append(&mut self.members[t as usize]));
        let (fan, rest) = triangles.split_at(count - 2);
        let at = |i: usize| (apex + i) % count;
        for (i, &t) in (1..).zip(fan) {
            self.triangles[t as usize] = [ring[apex], ring[at(i)], ring[at(i + 1)]];
            let before = if i == 1 { outside[apex] } else { fan[i - 2] };
            let after = if i == count - 2 { outside[at(count - 1)] } else { fan[i] };
            self.across[t as usize] = [before, outside[at(i)], after];
        }
        for &t in rest {
            (self.triangles[t as usize], self.across[t as usize]) = ([vertex; 3], [NONE; 3]);
        }
        for i in 0..count {
            let (edge, other) = ([ring[at(i)], ring[at(i + 1)]], outside[at(i)]);
            let owner = fan[i.clamp(1, count - 2) - 1];
            if let Some(k) =
                (other != NONE).then(|| (0..3).find(|&k| self.edge(other, k) == [edge[1], edge[0]])).flatten()
            {
                self.across[other as usize][k] = owner;
            }
        }
        self.deal_to_fan(members, fan);
        fan
    }

    fn is_kept(&self, t: u32, k: usize) -> bool {
        let [a, b] = self.edge(t, k);
        let (low, high) = (a.min(b), a.max(b));
        self.across[t as usize][k] == NONE || (high < self.kept_end && self.kept.contains(&[low, high]))
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

    fn place_in(&self, vertex: u32, t: u32) -> Place {
        let is_near = |k: &usize| self.height(self.edge(t, *k), vertex) <= ON_EDGE;
        let mut near = (0..3).filter(is_near);
        match (near.next(), near.next()) {
            (None, _) => Place::Inside,
            (Some(k), None) => Place::Edge(k),
            _ => Place::Corner,
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
        let mut members = std::mem::take(&mut self.members[t as usize]);
        members.retain(|&point| point != p);
        self.members.extend([Vec::new(), Vec::new()]);
        self.deal(members, &[t, u, v]);
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
    fn split_edge(&mut self, p: u32, t: u32, k: usize) -> Option<Vec<u32>> {
        let o = self.across[t as usize][k];
        let ([a, b], c) = (self.edge(t, k), self.triangles[t as usize][(k + 2) % 3]);
        let [bc, ca] = [1, 2].map(|i| self.across[t as usize][(k + i) % 3]);
        let j = (0..3).find(|&j| self.edge(o, j) == [b, a])?;
        let d = self.triangles[o as usize][(j + 2) % 3];
        let [ad, db] = [1, 2].map(|i| self.across[o as usize][(j + i) % 3]);
        // Of the halves of an edge that has next to no area on one side, one may turn over.
        let halves = [[c, a], [b, c], [a, d], [d, b]];
        if halves.iter().any(|&edge| self.side(edge, p) <= 0.0) {
            return None;
        }
        let [u, v] = [self.triangles.len() as u32, self.triangles.len() as u32 + 1];
        (self.triangles[t as usize], self.across[t as usize]) = ([c, a, p], [ca, v, u]);
        (self.triangles[o as usize], self.across[o as usize]) = ([d, b, p], [db, u, v]);
        self.triangles.extend([[b, c, p], [a, d, p]]);
        self.across.extend([[bc, t, o], [ad, o, t]]);
        self.relink(bc, t, u);
        self.relink(ad, o, v);
        let mut members = self.gather([t, o]);
        members.retain(|&point| point != p);
        self.members.extend([Vec::new(), Vec::new()]);
        self.deal(members, &[t, o, u, v]);
        Some(vec![t, o, u, v])
    }

    /// The corners around an edge inside that may be turned: its ends, and those on its sides. The other diagonal lies inside
    /// both triangles.
    pub fn diamond(&self, t: u32, k: usize) -> Option<[u32; 4]> {
        if self.is_kept(t, k) {
            return None;
        }
        let o = self.across[t as usize][k];
        let ([a, b], c) = (self.edge(t, k), self.triangles[t as usize][(k + 2) % 3]);
        let j = (0..3).find(|&j| self.edge(o, j) == [b, a])?;
        let d = self.triangles[o as usize][(j + 2) % 3];
        (self.side([c, a], d) > 0.0 && self.side([b, c], d) > 0.0).then_some([a, b, c, d])
    }

    /// Whether the vertex across an edge lies in the circle of a triangle, and no rounding puts it there: what lies on a circle, as
    /// in any grid, may stay as it is.
    fn should_flip(&self, t: u32, k: usize) -> bool {
        self.diamond(t, k).is_some_and(|corners| {
            let [a, b, c, d] = corners.map(|v| self.points[v as usize]);
            let [a, b, c] = [a - d, b - d, c - d];
            let parts = [
                a.length_squared() * b.perp_dot(c),
                b.length_squared() * c.perp_dot(a),
                c.length_squared() * a.perp_dot(b),
            ];
            let most = parts.iter().fold(0.0, |most, part| f64::max(most, part.abs()));
            parts.iter().sum::<f64>() > IN_CIRCLE * most
        })
    }

    /// The triangle across an edge.
    pub fn across(&self, t: u32, k: usize) -> u32 {
        self.across[t as usize][k]
    }

    /// Turns the edge `k` of a triangle to the other diagonal; returns the two triangles.
    pub fn flip(&mut self, t: u32, k: usize) -> [u32; 2] {
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
        for point in self.gather([t, o]) {
            let holder = if self.side([d, c], point) >= 0.0 { t } else { o };
            self.members[holder as usize].push(point);
        }
        [t, o]
    }
}

#[cfg(test)]
mod tests;
