//! Rooms of axis-aligned boxes: their sides, and the grid of squares over them.

use super::super::shapes::halves;
use super::super::{Mesh, weld};
use crate::math::DVec3;

/// A box, or, seen from inside, a room.
#[derive(Debug, Clone, Copy)]
pub struct Cuboid {
    pub low: DVec3,
    pub high: DVec3,
    /// The share of each color that each side gives back: those of low x and high x, of y, of z.
    pub reflectance: [DVec3; 6],
    /// What its lower side shines with by itself.
    pub light: DVec3,
    pub is_room: bool,
}

/// A side of a box.
#[derive(Debug, Clone, Copy)]
pub struct Panel {
    low: DVec3,
    high: DVec3,
    /// The axis it is perpendicular to.
    axis: usize,
    /// Where on it: 0 for the low side.
    side: usize,
    pub normal: DVec3,
    pub reflectance: DVec3,
    pub light: DVec3,
}

impl Cuboid {
    /// A box that reflects alike on all sides.
    pub fn new(low: [f64; 3], high: [f64; 3], reflectance: [f64; 3]) -> Self {
        Self {
            low: low.into(),
            high: high.into(),
            reflectance: [reflectance.into(); 6],
            light: DVec3::ZERO,
            is_room: false,
        }
    }

    /// Its sides, in the order of their reflectances.
    pub fn panels(&self) -> [Panel; 6] {
        std::array::from_fn(|i| {
            let (axis, side) = (i / 2, i % 2);
            let out = if (side == 1) != self.is_room { 1.0 } else { -1.0 };
            Panel {
                low: self.low,
                high: self.high,
                axis,
                side,
                normal: DVec3::AXES[axis] * out,
                reflectance: self.reflectance[i],
                light: if (axis, side) == (2, 0) { self.light } else { DVec3::ZERO },
            }
        })
    }

    /// How many squares of about `step` fit along each axis.
    fn counts(&self, step: f64) -> [usize; 3] {
        (self.high - self.low).to_array().map(|length| ((length / step).round() as usize).max(1))
    }
}

impl Panel {
    fn axes(&self) -> [usize; 2] {
        [(self.axis + 1) % 3, (self.axis + 2) % 3]
    }

    /// Its lengths along the two axes it spans.
    pub fn size(&self) -> [f64; 2] {
        self.axes().map(|k| self.high[k] - self.low[k])
    }

    pub fn area(&self) -> f64 {
        let [u, v] = self.size();
        u * v
    }

    /// The point at these fractions of its lengths. Panels that meet agree in every bit.
    pub fn at(&self, [s, t]: [f64; 2]) -> DVec3 {
        let [u, v] = self.axes();
        let between =
            |k: usize, s: f64| if s < 1.0 { self.low[k] + (self.high[k] - self.low[k]) * s } else { self.high[k] };
        let mut point = if self.side == 0 { self.low } else { self.high };
        (point[u], point[v]) = (between(u, s), between(v, t));
        point
    }

    /// How many squares of about `step` fit along its two axes.
    pub fn counts(&self, step: f64) -> [usize; 2] {
        self.size().map(|length| ((length / step).round() as usize).max(1))
    }
}

/// The middles of the cells that cut the unit square `counts` times, row by row.
pub fn middles([columns, rows]: [usize; 2]) -> impl Iterator<Item = [f64; 2]> {
    let middle = |i: usize, count: usize| (i as f64 + 0.5) / count as f64;
    (0..rows).flat_map(move |row| (0..columns).map(move |column| [middle(column, columns), middle(row, rows)]))
}

/// How often the sides of every box are cut along each axis.
pub fn grids(boxes: &[Cuboid], faces: usize) -> Vec<[usize; 3]> {
    let count = |grids: &[[usize; 3]]| grids.iter().map(|&[x, y, z]| 4 * (x * y + y * z + z * x)).sum::<usize>();
    let at = |step: f64| boxes.iter().map(|cuboid| cuboid.counts(step)).collect::<Vec<_>>();
    // The least step with no more faces than asked for; other cuts of the room, which comes first, make up for the rest.
    let (mut low, mut high) = (1e-6, 1e3);
    for _ in 0..80 {
        let middle = (low + high) / 2.0;
        *(if count(&at(middle)) <= faces { &mut high } else { &mut low }) = middle;
    }
    let grids = at(high);
    let changes = (0..343).map(|i| [i / 49, i / 7 % 7, i % 7]);
    let changed = |change: [usize; 3]| {
        let mut changed = grids.clone();
        (0..3).for_each(|k| changed[0][k] = (changed[0][k] + change[k]).saturating_sub(2).max(1));
        changed
    };
    changes.map(changed).min_by_key(|grids| count(grids).abs_diff(faces)).unwrap_or(grids)
}

/// The mesh of the boxes, each cut by its grid. `shade` colors the squares of a panel, row by row; it is told the place of the
/// panel among those of all boxes.
pub fn mesh(
    boxes: &[Cuboid],
    grids: &[[usize; 3]],
    shade: impl Fn(usize, &Panel, [usize; 2]) -> Vec<[f32; 4]>,
) -> Mesh {
    let mut soup = Mesh::default();
    let mut colors = Vec::new();
    for (i, (cuboid, grid)) in boxes.iter().zip(grids).enumerate() {
        for (side, panel) in cuboid.panels().into_iter().enumerate() {
            let counts = panel.axes().map(|k| grid[k]);
            add_grid(&mut soup, &panel, counts);
            colors.extend(shade(6 * i + side, &panel, counts).into_iter().flat_map(|color| [color; 2]));
        }
    }
    soup.face_colors = Some(colors);
    let mut mesh = weld(&soup, 0.0).mesh;
    mesh.colors = Some(averages(&mesh));
    mesh
}

fn add_grid(soup: &mut Mesh, panel: &Panel, [columns, rows]: [usize; 2]) {
    let first = soup.positions.len() as u32;
    let row_len = columns as u32 + 1;
    let fraction = |i: usize, count: usize| i as f64 / count as f64;
    let points = (0..=rows).flat_map(|row| (0..=columns).map(move |column| [column, row]));
    soup.positions.extend(points.map(|[column, row]| panel.at([fraction(column, columns), fraction(row, rows)])));
    let turned = panel.normal[panel.axis] < 0.0;
    for row in 0..rows as u32 {
        for column in 0..columns as u32 {
            let low = first + row * row_len + column;
            let [a, b, c, d] = [low, low + 1, low + row_len + 1, low + row_len];
            // Diagonals run one way: where they alternate, so do the means at the vertices of an edge.
            soup.faces.extend(halves(if turned { [a, d, c, b] } else { [a, b, c, d] }));
        }
    }
}

/// The mean color of the faces around every vertex by their areas \[Liu99\].
fn averages(mesh: &Mesh) -> Vec<[f32; 4]> {
    let mut sums = vec![[0.0; 5]; mesh.positions.len()];
    for (&face, color) in mesh.faces.iter().zip(mesh.face_colors.iter().flatten()) {
        let area = mesh.cross(face).length();
        for v in face {
            let sum = &mut sums[v as usize];
            (0..4).for_each(|i| sum[i] += area * f64::from(color[i]));
            sum[4] += area;
        }
    }
    sums.into_iter().map(|sum| std::array::from_fn(|i| (sum[i] / sum[4]) as f32)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room with a box of half its size inside.
    fn boxes() -> [Cuboid; 2] {
        let room = Cuboid { is_room: true, ..Cuboid::new([0.0; 3], [4.0, 3.0, 2.0], [0.5; 3]) };
        [room, Cuboid::new([1.0, 0.75, 0.5], [3.0, 2.25, 1.5], [0.5; 3])]
    }

    #[test]
    fn a_room_is_seen_from_inside() {
        let grey = |_: usize, _: &Panel, [columns, rows]: [usize; 2]| vec![[0.5, 0.25, 1.0, 1.0]; columns * rows];
        let mesh = mesh(&boxes(), &[[4, 3, 2], [1, 1, 1]], grey);
        assert_eq!(mesh.faces.len(), 4 * (12 + 6 + 8) + 12);
        assert!((mesh.volume() + 24.0 - 3.0).abs() < 1e-12);
        assert!((mesh.area() - 52.0 - 13.0).abs() < 1e-12);
        assert_eq!(mesh.colors, Some(vec![[0.5, 0.25, 1.0, 1.0]; mesh.positions.len()]));
    }

    #[test]
    fn corners_have_the_mean_of_their_faces_by_area() {
        let shade =
            |_: usize, panel: &Panel, _: [usize; 2]| vec![if panel.normal.z > 0.0 { [1.0; 4] } else { [0.0; 4] }];
        let mesh = mesh(&[Cuboid::new([0.0; 3], [1.0, 1.0, 2.0], [0.5; 3])], &[[1; 3]], shade);
        // Around a corner of the lid: one or both halves of it, and of two sides of twice the area.
        for (position, color) in mesh.positions.iter().zip(mesh.colors.iter().flatten()) {
            let around = mesh.faces.iter().filter(|face| face.iter().any(|&v| mesh.positions[v as usize] == *position));
            let areas = around.map(|&face| (mesh.cross(face).length(), mesh.cross(face).z > 0.0));
            let (lid, all) =
                areas.fold((0.0, 0.0), |(lid, all), (area, up)| (lid + if up { area } else { 0.0 }, all + area));
            assert!((f64::from(color[0]) - lid / all).abs() < 1e-6);
            assert_eq!(color[0] > 0.0, position.z == 2.0);
        }
    }

    #[test]
    fn grids_have_as_many_faces_as_asked() {
        for faces in [1000, 5000, 54_321] {
            let grids = grids(&boxes(), faces);
            let count: usize = grids.iter().map(|&[x, y, z]| 4 * (x * y + y * z + z * x)).sum();
            assert!(count.abs_diff(faces) * 50 <= faces, "{count} of {faces}");
        }
    }
}
