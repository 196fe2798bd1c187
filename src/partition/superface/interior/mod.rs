//! Light that went with the vertices inside a region: found again, and the worst of it put back.
//!
//! # Reference
//! Not in \[Liu99\], where a bright spot inside a superface vanishes with its vertices. Every vertex that went is compared with
//! the color that the new triangles have in its place; where they differ too much, the vertex comes back.

use rustc_hash::FxHashSet;

use super::super::triangulate::sides::turn;
use crate::math::DVec2;

mod insert;

pub use insert::Drawing;

/// Sweeps at most. Each may double what comes back, so that more only follow an outline of light that is all spikes.
const MOST_SWEEPS: usize = 48;

/// Edges that stay, the lower end first.
pub type Edges = FxHashSet<[u32; 2]>;

/// A removed vertex, and how the color in its place differs from its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lost {
    pub vertex: u32,
    /// The triangle that it lies in.
    pub triangle: u32,
    /// In 255ths, of the channel that differs most.
    pub difference: f64,
}

/// For each of the vertices `removed` that lies in a triangle, the lowest such and the difference of colors there.
///
/// Vertices are put into the cells of a grid, and every triangle looks at the cells that it covers, row by row: with N
/// triangles and M vertices O(N √M + M) cells, if triangles do not overlap.
pub fn lost(points: &[DVec2], colors: &[[f32; 4]], triangles: &[[u32; 3]], removed: &[u32]) -> Vec<Lost> {
    let grid = Grid::new(points, removed);
    let mut found: Vec<Option<Lost>> = vec![None; removed.len()];
    for (triangle, &corners) in (0..).zip(triangles) {
        let [a, b, c] = corners.map(|v| points[v as usize]);
        grid.for_each_in([a, b, c], |at| {
            let vertex = removed[at];
            if found[at].is_none()
                && let Some(weights) = weights([a, b, c], points[vertex as usize])
            {
                let difference = difference(colors[vertex as usize], corners.map(|v| colors[v as usize]), weights);
                found[at] = Some(Lost { vertex, triangle, difference });
            }
        });
    }
    found.into_iter().flatten().collect()
}

/// The vertices to put back: of every triangle the one that differs most, if by more than `tolerance`; ties to the first.
pub fn worst(lost: &[Lost], triangle_count: usize, tolerance: f64) -> Vec<Lost> {
    let mut of_triangle: Vec<Option<Lost>> = vec![None; triangle_count];
    for &found in lost.iter().filter(|found| found.difference > tolerance) {
        let best = &mut of_triangle[found.triangle as usize];
        if best.is_none_or(|best| found.difference > best.difference) {
            *best = Some(found);
        }
    }
    of_triangle.into_iter().flatten().collect()
}

/// Puts vertices back until no other of `removed` that lies in a triangle differs by more than `tolerance` 255ths. `triangles`
/// are counter-clockwise and keep the edges `kept`, their outline among them. Returns what was put back, in order.
pub fn put_back(
    points: &[DVec2],
    colors: &[[f32; 4]],
    triangles: &mut Vec<[u32; 3]>,
    kept: &Edges,
    (removed, tolerance): (&[u32], f64),
) -> Vec<u32> {
    let mut left: Vec<u32> = removed.to_vec();
    let mut back = Vec::new();
    for _ in 0..MOST_SWEEPS {
        let worst = worst(&lost(points, colors, triangles, &left), triangles.len(), tolerance);
        if worst.is_empty() {
            break;
        }
        let mut drawing = Drawing::new(points, std::mem::take(triangles), kept);
        let tried: FxHashSet<u32> = worst.iter().map(|found| found.vertex).collect();
        back.extend(
            worst.iter().filter(|found| drawing.insert(found.vertex, found.triangle)).map(|found| found.vertex),
        );
        *triangles = drawing.into_triangles();
        // What could not be put back, on an edge that stays or too near to a corner, is not tried again.
        left.retain(|vertex| !tried.contains(vertex));
    }
    back
}

/// The barycentric weights of a point in a counter-clockwise triangle, its border included; none outside, or without an area.
fn weights([a, b, c]: [DVec2; 3], p: DVec2) -> Option<[f64; 3]> {
    // Signs are exact: what lies on an edge is in one of its triangles.
    let parts = [turn(b, c, p), turn(c, a, p), turn(a, b, p)];
    let area = turn(a, b, c);
    (area > 0.0 && parts.iter().all(|&part| part >= 0.0)).then(|| parts.map(|part| part / area))
}

/// How a color differs from one between three, in 255ths, of the channel that differs most; alpha does not count.
fn difference(own: [f32; 4], corners: [[f32; 4]; 3], weights: [f64; 3]) -> f64 {
    let channel = |k: usize| {
        let between: f64 = (0..3).map(|i| weights[i] * f64::from(corners[i][k])).sum();
        (f64::from(own[k]) - between).abs()
    };
    255.0 * (0..3).map(channel).fold(0.0, f64::max)
}

/// Points in square cells, about one a cell.
struct Grid {
    low: DVec2,
    /// Cells a unit of length.
    scale: f64,
    columns: usize,
    rows: usize,
    /// Where the points of each cell start, row by row, and the end.
    starts: Vec<u32>,
    /// Places in the list that the grid was made of.
    members: Vec<u32>,
    /// Of the members.
    points: Vec<DVec2>,
}

impl Grid {
    fn new(points: &[DVec2], list: &[u32]) -> Self {
        let at = |&v: &u32| points[v as usize];
        let first = list.first().map_or(DVec2::ZERO, at);
        let (low, high) = list.iter().map(at).fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        let size = high - low;
        let area = size.x * size.y;
        let longest = size.max_element();
        // On a line, cells along it.
        let scale = if area > 1e-12 * longest * longest {
            (list.len() as f64 / area).sqrt()
        } else if longest > 0.0 {
            list.len() as f64 / longest
        } else {
            0.0
        };
        let cells = |length: f64| ((length * scale) as usize).min(list.len()) + 1;
        let (columns, rows) = (cells(size.x), cells(size.y));
        let mut grid = Self {
            low,
            scale,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            members: Vec::new(),
            points: Vec::new(),
        };
        let cell = |v: &u32| grid.row(at(v).y) * columns + grid.column(at(v).x);
        let cells: Vec<usize> = list.iter().map(cell).collect();
        cells.iter().for_each(|&cell| grid.starts[cell + 1] += 1);
        (0..columns * rows).for_each(|cell| grid.starts[cell + 1] += grid.starts[cell]);
        let mut next = grid.starts.clone();
        grid.members = vec![0; list.len()];
        for (place, cell) in (0..).zip(cells) {
            grid.members[next[cell] as usize] = place;
            next[cell] += 1;
        }
        grid.points = grid.members.iter().map(|&place| at(&list[place as usize])).collect();
        grid
    }

    // The casts saturate.
    fn column(&self, x: f64) -> usize {
        (((x - self.low.x) * self.scale) as usize).min(self.columns - 1)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.low.y) * self.scale) as usize).min(self.rows - 1)
    }

    /// Calls `visit` with the places of the points in the cells that a triangle covers, and of some beside.
    fn for_each_in(&self, corners: [DVec2; 3], mut visit: impl FnMut(usize)) {
        let (low, high) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
        for row in self.row(low.y)..=self.row(high.y) {
            // The first and the last row reach on: what rounding put there lies there.
            let bottom = if row == 0 { f64::NEG_INFINITY } else { self.low.y + row as f64 / self.scale };
            let top = if row + 1 == self.rows { f64::INFINITY } else { self.low.y + (row + 1) as f64 / self.scale };
            let Some((left, right)) = extent(corners, bottom, top) else { continue };
            // A cell more on either side, for rounding.
            let (left, right) = (self.column(left).saturating_sub(1), (self.column(right) + 1).min(self.columns - 1));
            let cells = row * self.columns + left..=row * self.columns + right;
            let members = self.starts[*cells.start()] as usize..self.starts[cells.end() + 1] as usize;
            self.members[members].iter().for_each(|&place| visit(place as usize));
        }
    }
}

/// The least and the greatest x of a triangle between two heights.
fn extent(corners: [DVec2; 3], bottom: f64, top: f64) -> Option<(f64, f64)> {
    let mut extent: Option<(f64, f64)> = None;
    let mut add = |x: f64| extent = Some(extent.map_or((x, x), |(left, right)| (left.min(x), right.max(x))));
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        if (bottom..=top).contains(&a.y) {
            add(a.x);
        }
        for y in [bottom, top] {
            if (a.y < y) != (b.y < y) && y.is_finite() {
                add(a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)));
            }
        }
    }
    extent
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [DVec2; 4] = [DVec2::new(0.0, 0.0), DVec2::new(4.0, 0.0), DVec2::new(4.0, 4.0), DVec2::new(0.0, 4.0)];
    const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    fn gray(x: f64) -> [f32; 4] {
        [x as f32, x as f32, x as f32, 1.0]
    }

    fn outline(loops: &[u32]) -> Edges {
        (0..loops.len()).map(|i| [loops[i], loops[(i + 1) % loops.len()]]).map(|[a, b]| [a.min(b), a.max(b)]).collect()
    }

    #[test]
    fn colors_are_compared_with_those_between_the_corners() {
        let points =
            [&SQUARE[..], &[DVec2::new(3.0, 1.0), DVec2::new(1.0, 3.0), DVec2::new(9.0, 1.0), DVec2::new(2.0, 2.0)]]
                .concat();
        // Light rises with x: in the middle of things the new triangles have it right.
        let mut colors: Vec<[f32; 4]> = points.iter().map(|p| gray(p.x / 4.0)).collect();
        let [right, spot, outside, between] = [4, 5, 6, 7];
        colors[spot as usize] = [0.25, 0.75, 0.25, 0.0];
        let lost = lost(&points, &colors, &HALVES, &[right, spot, outside, between]);
        let expected = [(right, 0, 0.0), (spot, 1, 127.5), (between, 0, 0.0)];
        assert_eq!(lost.iter().map(|l| (l.vertex, l.triangle, l.difference)).collect::<Vec<_>>(), expected);
        assert_eq!(worst(&lost, 2, 127.0), [Lost { vertex: spot, triangle: 1, difference: 127.5 }]);
        assert_eq!(worst(&lost, 2, 127.5), []);
    }

    #[test]
    fn of_every_triangle_the_worst_comes_first() {
        let lost = |vertex, triangle, difference| Lost { vertex, triangle, difference };
        let all = [lost(4, 1, 5.0), lost(5, 0, 7.0), lost(6, 1, 9.0), lost(7, 1, 9.0), lost(8, 2, 1.0)];
        assert_eq!(worst(&all, 3, 2.0), [lost(5, 0, 7.0), lost(6, 1, 9.0)]);
    }

    /// The grid finds what a look at every pair finds, whatever the shape of the triangles.
    #[test]
    fn no_vertex_is_missed() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        for stretch in [1.0, 1e-3, 1e-9, 0.0] {
            let mut points: Vec<DVec2> = (0..500).map(|_| DVec2::new(random(), stretch * random())).collect();
            // A fan of needles, and triangles of all kinds.
            points.extend((0..=40).map(|i| DVec2::new(f64::from(i) / 40.0, stretch * 1.5)));
            let mut triangles: Vec<[u32; 3]> = (500..540).map(|i| [0, i, i + 1]).collect();
            triangles.extend((0..60).map(|_| [(); 3].map(|()| (random() * 500.0) as u32)));
            let removed: Vec<u32> = (0..500).collect();
            let colors = vec![gray(0.5); points.len()];
            let found = lost(&points, &colors, &triangles, &removed);
            let expected: Vec<(u32, u32)> = removed
                .iter()
                .filter_map(|&v| {
                    let holds = |t: &[u32; 3]| weights(t.map(|v| points[v as usize]), points[v as usize]).is_some();
                    triangles.iter().position(holds).map(|t| (v, t as u32))
                })
                .collect();
            assert_eq!(found.iter().map(|l| (l.vertex, l.triangle)).collect::<Vec<_>>(), expected, "{stretch}");
            assert_eq!(found.is_empty(), stretch == 0.0);
        }
    }

    /// A dim square with one bright vertex and its neighbors: the spot comes back, and with it what its slopes would lighten.
    #[test]
    fn a_bright_spot_comes_back() {
        let n = 9_u32;
        let grid = (0..n * n).map(|i| DVec2::new(f64::from(i % n), f64::from(i / n)));
        let points: Vec<DVec2> = grid.collect();
        let spot = 4 * n + 5;
        let colors: Vec<[f32; 4]> = (0..n * n).map(|i| gray(if i == spot { 0.9 } else { 0.2 })).collect();
        let corners = [0, n - 1, n * n - 1, n * n - n];
        let mut triangles = vec![[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]];
        let removed: Vec<u32> = (0..n * n).filter(|v| !corners.contains(v)).collect();
        let kept = outline(&corners);
        let back = put_back(&points, &colors, &mut triangles, &kept, (&removed, 4.0));
        assert_eq!(back[0], spot);
        let area: f64 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| points[v as usize]);
                (b - a).perp_dot(c - a) / 2.0
            })
            .sum();
        assert_eq!(area, 64.0);
        // On the outline nothing can come back, and nothing has to: it is dim there.
        let left: Vec<u32> = removed.iter().copied().filter(|v| !back.contains(v)).collect();
        assert!(lost(&points, &colors, &triangles, &left).iter().all(|found| found.difference <= 4.0));
        assert!(back.len() < 40, "{} of 77 came back", back.len());
        let even = vec![gray(0.2); points.len()];
        let mut halves = vec![[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]];
        assert!(put_back(&points, &even, &mut halves, &kept, (&removed, 4.0)).is_empty());
        assert_eq!(halves.len(), 2);
    }

    #[test]
    fn nothing_comes_of_nothing() {
        assert_eq!(lost(&[], &[], &[], &[]), []);
        let back = put_back(&SQUARE, &[gray(1.0); 4], &mut HALVES.to_vec(), &Edges::default(), (&[], 1.0));
        assert!(back.is_empty());
    }
}
