//! Points in a grid, to be found by triangles.

use crate::math::DVec2;

/// Points in square cells, about one a cell.
pub struct Grid {
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
    /// Of those in a list.
    pub fn new(points: &[DVec2], list: &[u32]) -> Self {
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
    pub fn for_each_in(&self, corners: [DVec2; 3], mut visit: impl FnMut(usize)) {
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
    use super::super::super::triangulate::sides::{triangle_holds, turn};
    use super::*;

    /// The grid finds what a look at every pair finds, whatever the shape of the triangles.
    #[test]
    fn no_point_is_missed() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        for stretch in [1.0, 1e-3, 1e-9, 0.0] {
            let mut points: Vec<DVec2> = (0..500).map(|_| DVec2::new(random(), stretch * random())).collect();
            // A fan of needles, and triangles of all kinds.
            points.extend((0..=40).map(|i| DVec2::new(f64::from(i) / 40.0, stretch * 1.5)));
            let mut triangles: Vec<[usize; 3]> = (500..540).map(|i| [0, i, i + 1]).collect();
            triangles.extend((0..60).map(|_| [(); 3].map(|()| (random() * 500.0) as usize)));
            let list: Vec<u32> = (0..500).collect();
            let grid = Grid::new(&points, &list);
            // A triangle without area has no inside.
            let has_area = |corners: &[DVec2; 3]| turn(corners[0], corners[1], corners[2]) != 0.0;
            for corners in triangles.into_iter().map(|t| t.map(|v| points[v])).filter(has_area) {
                let mut found = Vec::new();
                grid.for_each_in(corners, |at| found.push(at));
                found.retain(|&at| triangle_holds(corners, points[at]));
                found.sort_unstable();
                let expected: Vec<usize> = (0..500).filter(|&at| triangle_holds(corners, points[at])).collect();
                assert_eq!(found, expected, "{stretch}");
            }
        }
    }

    #[test]
    fn an_empty_grid_has_nothing() {
        Grid::new(&[], &[]).for_each_in([DVec2::ZERO, DVec2::X, DVec2::Y], |at| panic!("{at}"));
    }
}
