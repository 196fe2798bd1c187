//! Where an outline crosses itself: a sweep from the top, in the manner of Shamos and Hoey.
//!
//! The line of the sweep leans by an infinitely small angle, so that it meets the points in the order of
//! [`compare`] and no edge is parallel to it. Predicates are exact. Its work is n log n whatever the
//! outline looks like.

use super::Outline;
use super::line::{Gap, Line};
use super::sides::{by_sign, compare, is_above, turn};
use crate::math::DVec2;

/// No edge.
pub(super) const NONE: u32 = u32::MAX;

/// Why an outline has no inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flaw {
    /// Two edges, by their first points, cross or touch other than at a mesh vertex that they share. That is also a point on an
    /// edge, edges over each other, different vertices at one place, an edge without length, a vertex at two places, and
    /// passages through one vertex that cross.
    Crossing([usize; 2]),
    /// A ring lies where it may not: a hole outside the outer ring or inside another hole.
    Misplaced(usize),
}

impl Outline {
    /// What keeps an outline from having an inside to the left of all its edges: the first crossing found, else the first ring
    /// that lies where it may not. One whose parts do not fit together crosses at its first point.
    pub fn fault(&self) -> Option<Flaw> {
        if self.is_sound() { sweep(self, &self.scaled()).err() } else { Some(Flaw::Crossing([0, 0])) }
    }
}

/// Edges by their first points.
struct Edges<'a> {
    points: &'a [DVec2],
    next: Vec<u32>,
    /// Whether an edge leads down.
    is_down: Vec<bool>,
}

impl Edges<'_> {
    fn ends(&self, edge: u32) -> [DVec2; 2] {
        let [a, b] = [edge, self.next[edge as usize]].map(|i| self.points[i as usize]);
        if self.is_down[edge as usize] { [a, b] } else { [b, a] }
    }

    fn high(&self, edge: u32) -> DVec2 {
        self.ends(edge)[0]
    }

    fn low(&self, edge: u32) -> DVec2 {
        self.ends(edge)[1]
    }

    /// Above zero where a point lies east of an edge.
    fn side(&self, edge: u32, p: DVec2) -> f64 {
        let [high, low] = self.ends(edge);
        turn(high, low, p)
    }

    /// Whether neighbors on the line meet farther down other than at a common end.
    fn clash(&self, west: u32, east: u32) -> bool {
        let [west_low, east_low] = [self.low(west), self.low(east)];
        if west_low == east_low {
            self.side(west, self.high(east)) == 0.0
        } else if is_above(west_low, east_low) {
            self.side(east, west_low) >= 0.0
        } else {
            self.side(west, east_low) <= 0.0
        }
    }
}

/// The edge west of every point that no edge ends at from above, [`NONE`] where there is none; or a fault.
///
/// `points` are the outline's, [scaled](Outline::scaled); the outline is sound.
pub(super) fn sweep(outline: &Outline, points: &[DVec2]) -> Result<Vec<u32>, Flaw> {
    one_place_each(outline, points)?;
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by(|&a, &b| compare(points[b as usize], points[a as usize]).then(a.cmp(&b)));
    let mut sweep = Sweep::new(outline, points);
    for places in order.chunk_by(|&a, &b| points[a as usize] == points[b as usize]) {
        sweep.pass(places)?;
    }
    match sweep.misplaced {
        Some(start) => Err(Flaw::Misplaced(outline.ring_starts.partition_point(|&first| first <= start) - 1)),
        None => Ok(sweep.west_of),
    }
}

/// The line of the sweep, and what it passed.
struct Sweep<'a> {
    outline: &'a Outline,
    edges: Edges<'a>,
    prev: Vec<u32>,
    line: Line,
    /// At the point that it passes: the edges that end there and those that start, from west to east.
    ended: Vec<u32>,
    started: Vec<u32>,
    west_of: Vec<u32>,
    /// The first edge, from the top, with the inside on its wrong side.
    misplaced: Option<u32>,
}

/// Two edges that cross or touch.
fn crossing(a: u32, b: u32) -> Flaw {
    Flaw::Crossing([a as usize, b as usize])
}

impl<'a> Sweep<'a> {
    fn new(outline: &'a Outline, points: &'a [DVec2]) -> Self {
        let next = outline.successors();
        let mut prev = vec![0; next.len()];
        (0..).zip(&next).for_each(|(i, &after): (u32, _)| prev[after as usize] = i);
        let is_down = (0..next.len()).map(|i| is_above(points[i], points[next[i] as usize])).collect();
        Self {
            outline,
            edges: Edges { points, next, is_down },
            prev,
            line: Line::new(),
            ended: Vec::new(),
            started: Vec::new(),
            west_of: vec![NONE; points.len()],
            misplaced: None,
        }
    }

    /// Passes these points, which lie at one place.
    fn pass(&mut self, places: &[u32]) -> Result<(), Flaw> {
        let (first, p) = (places[0], self.edges.points[places[0] as usize]);
        let vertex = |i: u32| self.outline.vertices[i as usize];
        if let Some(&other) = places.iter().find(|&&other| vertex(other) != vertex(first)) {
            return Err(crossing(first, other));
        }
        let edges = &self.edges;
        let gap = self.line.find(|edge| edges.side(edge, p) > 0.0);
        self.end_edges(gap, first)?;
        self.start_edges(places)?;
        self.check_turns(first)?;
        let west = self.line.west(gap);
        if let ([], Some(&start)) = (self.ended.as_slice(), self.started.first()) {
            // The inside lies east of edges that lead down.
            let is_inside = west.is_some_and(|west| self.edges.is_down[west as usize]);
            if is_inside == self.edges.is_down[start as usize] {
                self.misplaced.get_or_insert(start);
            }
            places.iter().for_each(|&place| self.west_of[place as usize] = west.unwrap_or(NONE));
        }
        self.check_neighbors(west, self.line.east(gap))?;
        self.line.insert(gap, &self.started);
        Ok(())
    }

    /// Takes the edges that end at a point off the line.
    fn end_edges(&mut self, gap: Gap, point: u32) -> Result<(), Flaw> {
        let p = self.edges.points[point as usize];
        self.ended.clear();
        while let Some(edge) = self.line.east(gap).filter(|&edge| self.edges.side(edge, p) == 0.0) {
            if self.edges.low(edge) != p {
                return Err(crossing(edge, point));
            }
            self.ended.push(edge);
            self.line.remove_east(gap);
        }
        Ok(())
    }

    /// Finds the edges that start at these points; with those that end there they are two a point.
    fn start_edges(&mut self, places: &[u32]) -> Result<(), Flaw> {
        let Self { edges, prev, started, .. } = self;
        let p = edges.points[places[0] as usize];
        started.clear();
        for &place in places {
            let [before, after] = [prev[place as usize], edges.next[place as usize]];
            if edges.points[after as usize] == p {
                return Err(crossing(place, after));
            }
            started.extend([place, before].into_iter().filter(|&edge| edges.high(edge) == p));
        }
        if self.ended.len() + started.len() != 2 * places.len() {
            return Err(crossing(places[0], prev[places[0] as usize]));
        }
        started.sort_unstable_by(|&a, &b| by_sign(turn(p, edges.low(b), edges.low(a))));
        let are_one = |pair: &&[u32]| turn(p, edges.low(pair[0]), edges.low(pair[1])) == 0.0;
        started.windows(2).find(are_one).map_or(Ok(()), |pair| Err(crossing(pair[0], pair[1])))
    }

    /// Around a point the edges away from it and to it take turns, or the inside would overlap.
    fn check_turns(&self, point: u32) -> Result<(), Flaw> {
        let points = self.edges.points;
        let leads_away = |edge: u32| points[edge as usize] == points[point as usize];
        let around = || self.started.iter().chain(self.ended.iter().rev()).copied();
        let mut pairs = around().zip(around().cycle().skip(1));
        let alike = pairs.find(|&(a, b)| leads_away(a) == leads_away(b));
        alike.map_or(Ok(()), |(a, b)| Err(crossing(a, b)))
    }

    /// What has become neighbors on the line must not meet.
    fn check_neighbors(&self, west: Option<u32>, east: Option<u32>) -> Result<(), Flaw> {
        let neighbors = match (self.started.first(), self.started.last()) {
            (Some(&first), Some(&last)) => [(west, Some(first)), (Some(last), east)],
            _ => [(west, east), (None, None)],
        };
        let mut pairs = neighbors.into_iter().filter_map(|(west, east)| west.zip(east));
        let clash = pairs.find(|&(west, east)| self.edges.clash(west, east));
        clash.map_or(Ok(()), |(west, east)| Err(crossing(west, east)))
    }
}

/// Refuses a mesh vertex that is at two places.
fn one_place_each(outline: &Outline, points: &[DVec2]) -> Result<(), Flaw> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (outline.vertices[i as usize], i));
    let is_torn = |&[a, b]: &[usize; 2]| outline.vertices[a] == outline.vertices[b] && points[a] != points[b];
    let pairs = order.windows(2).map(|pair| [pair[0] as usize, pair[1] as usize]);
    pairs.into_iter().find(is_torn).map_or(Ok(()), |pair| Err(Flaw::Crossing(pair)))
}

#[cfg(test)]
mod tests {
    use super::super::cases::{BOTH, checked, outline};
    use super::super::sides::segments_meet;
    use super::super::triangulate;
    use super::*;
    use crate::math::tie_hash;

    /// Against what a look at all pairs of edges and at the winding number beside every edge says; with small whole coordinates most
    /// rings touch themselves or each other somewhere.
    #[test]
    fn faults_are_those_of_all_pairs() {
        let (mut sound, mut pinched) = (0, 0);
        for seed in 0..30_000 {
            let number = |i: u32, most: u32| (tie_hash(i, seed) >> 8) % most;
            let mut rings: Vec<Vec<[f64; 2]>> = Vec::new();
            for ring in 0..1 + number(0, 3) {
                let count = 3 + number(1 + ring, 4);
                let grid = if ring == 0 { 6 } else { 5 };
                let at = |i: u32, axis: u32| f64::from(number(100 * ring + 10 * i + axis, grid));
                let mut points: Vec<[f64; 2]> = (2..2 + count).map(|i| [at(i, 0), at(i, 1)]).collect();
                if ring == 0 {
                    points = vec![[-1., -1.], [6., -1.], [6., 6.], [-1., 6.]];
                    points.splice(2..2, (2..2 + count / 2).map(|i| [at(i, 0), at(i, 1)]));
                }
                rings.push(points);
            }
            let outline = outline(&rings);
            let expected = is_sound_by_pairs(&outline);
            let fault = outline.fault();
            assert_eq!(fault.is_none(), expected, "{seed}: {fault:?} {rings:?}");
            if expected {
                sound += 1;
                let mut vertices = outline.vertices.clone();
                vertices.sort_unstable();
                vertices.dedup();
                pinched += usize::from(vertices.len() < outline.vertices.len());
                BOTH.into_iter().for_each(|by| drop(checked(&outline, by)));
            } else {
                BOTH.into_iter().for_each(|by| assert_eq!(triangulate(&outline, by), None));
            }
        }
        assert!(sound > 1000 && pinched > 100, "{sound} {pinched}");
    }

    fn is_sound_by_pairs(outline: &Outline) -> bool {
        let n = outline.points.len();
        let edge = |i: usize| [i as u32, outline.successor(i as u32)].map(|i| outline.points[i as usize]);
        for i in 0..n {
            let [a, b] = edge(i);
            if a == b {
                return false;
            }
            for j in 0..i {
                let [c, d] = edge(j);
                let shared = [a, b].into_iter().find(|&p| p == c || p == d);
                let fits = match shared {
                    None => !segments_meet([a, b], [c, d]),
                    Some(p) => {
                        let [q, r] = [if p == a { b } else { a }, if p == c { d } else { c }];
                        turn(p, q, r) != 0.0 || (q - p).dot(r - p) < 0.0
                    }
                };
                if !fits {
                    return false;
                }
            }
        }
        let winding = |p: DVec2| -> i32 {
            let passes = (0..n).map(edge).map(|[a, b]| match ((a.y > p.y), (b.y > p.y)) {
                (false, true) if turn(a, b, p) > 0.0 => 1,
                (true, false) if turn(a, b, p) < 0.0 => -1,
                _ => 0,
            });
            passes.sum()
        };
        (0..n).map(edge).all(|[a, b]| {
            let aside = (b - a).perp() * 1e-4;
            let middle = a + (b - a) * 0.4987;
            winding(middle + aside) == 1 && winding(middle - aside) == 0
        })
    }

    #[test]
    fn crossings_are_found() {
        let square = || vec![[0., 0.], [4., 0.], [4., 4.], [0., 4.]];
        let hole = |x: f64, y: f64| vec![[x, y], [x, y + 1.], [x + 1., y + 1.], [x + 1., y]];
        let crossing = |rings: &[Vec<[f64; 2]>]| crossed(&outline(rings));
        assert_eq!(crossing(&[square(), hole(1., 1.)]), None);
        // The two sides of a bow tie.
        assert_eq!(crossing(&[vec![[0., 0.], [4., 4.], [4., 0.], [0., 4.]]]).map(sorted), Some([0, 2]));
        // A corner of a hole on a side, and one across it.
        assert_eq!(
            crossing(&[square(), vec![[4., 2.], [3., 1.], [3., 3.]]]).map(|edges| edges.contains(&1)),
            Some(true)
        );
        assert_eq!(crossing(&[square(), hole(3.5, 1.)]).map(|edges| edges.contains(&1)), Some(true));
        // Two vertices at one place.
        let mut pinched = outline(&[square(), vec![[0., 0.], [1., 2.], [2., 1.]]]);
        assert_eq!(crossed(&pinched), None);
        pinched.vertices[4] = 99;
        assert_eq!(crossed(&pinched).map(sorted), Some([0, 4]));
        // One vertex at two places.
        let mut torn = outline(&[square(), hole(1., 1.)]);
        torn.vertices[6] = 0;
        assert_eq!(crossed(&torn), Some([0, 6]));
        // A hole outside and one in another: no edges cross.
        assert_eq!(outline(&[square(), hole(1., 1.), hole(7., 7.)]).fault(), Some(Flaw::Misplaced(2)));
        let inner = vec![[1.2, 1.2], [1.2, 1.8], [1.8, 1.8], [1.8, 1.2]];
        assert_eq!(outline(&[square(), hole(1., 1.), inner.clone()]).fault(), Some(Flaw::Misplaced(2)));
        assert_eq!(crossed(&outline(&[square(), inner, hole(1., 1.)])), None);
    }

    fn crossed(outline: &Outline) -> Option<[usize; 2]> {
        match outline.fault() {
            Some(Flaw::Crossing(edges)) => Some(edges),
            _ => None,
        }
    }

    fn sorted(mut edges: [usize; 2]) -> [usize; 2] {
        edges.sort_unstable();
        edges
    }
}
