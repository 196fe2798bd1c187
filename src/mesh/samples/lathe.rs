//! Solids with a cross-section that changes along an axis: bolts, nuts, washers, boxes, pipes.

use super::super::Mesh;
use super::super::circle::unit_circle;
use super::super::shapes::halves;
use crate::math::DVec3;

/// The outline at one height.
#[derive(Clone, Copy)]
pub enum Outline {
    /// A circle of this radius.
    Round(f64),
    /// A regular polygon of so many sides; the radius is that of its inscribed circle.
    Regular(u32, f64),
}

/// A profile: heights with their outlines, from the lowest up along the outside.
pub struct Profile {
    /// At least two rows.
    pub rows: Vec<(f64, Outline)>,
    /// Whether the last row meets the first, which makes a ring of genus 1; else both ends are closed by a middle vertex.
    pub is_ring: bool,
}

impl Outline {
    /// The point at `i` of `count` steps around; the sides of a polygon must divide `count`.
    fn at(self, i: u32, count: u32) -> (f64, f64) {
        match self {
            Self::Round(radius) => {
                let (cos, sin) = unit_circle(f64::from(i) / f64::from(count));
                (radius * cos, radius * sin)
            }
            Self::Regular(sides, radius) => {
                let per_side = count / sides;
                let (side, along) = (i / per_side, f64::from(i % per_side) / f64::from(per_side));
                let (inscribed, _) = unit_circle(0.5 / f64::from(sides));
                let ((ax, ay), (bx, by)) = (
                    unit_circle(f64::from(side) / f64::from(sides)),
                    unit_circle(f64::from(side + 1) / f64::from(sides)),
                );
                let around = radius / inscribed;
                (around * (ax + (bx - ax) * along), around * (ay + (by - ay) * along))
            }
        }
    }
}

impl Profile {
    fn segments(&self) -> usize {
        self.rows.len() - usize::from(!self.is_ring)
    }

    /// Bands of 2·count faces, at least one a segment. The two end caps of a solid have the faces of one band.
    fn bands(&self, count: u32, faces: usize) -> usize {
        let bands = (faces as f64 / f64::from(2 * count)).round() as usize;
        bands.saturating_sub(usize::from(!self.is_ring)).max(self.segments())
    }

    /// The faces that [`Profile::turn`] will make.
    pub fn faces(&self, count: u32, faces: usize) -> usize {
        2 * count as usize * (self.bands(count, faces) + usize::from(!self.is_ring))
    }

    /// The mesh with `count` steps around and about `faces` faces: F is a multiple of 2·count.
    pub fn turn(&self, count: u32, faces: usize) -> Mesh {
        let divisions = self.divisions(self.bands(count, faces));
        let mut mesh = Mesh::default();
        for (segment, &parts) in divisions.iter().enumerate() {
            let (below, above) = (self.rows[segment], self.rows[(segment + 1) % self.rows.len()]);
            for part in 0..parts {
                let t = f64::from(part) / f64::from(parts);
                mesh.positions.extend((0..count).map(|i| point(below, i, count).lerp(point(above, i, count), t)));
            }
        }
        if !self.is_ring {
            mesh.positions.extend((0..count).map(|i| point(self.rows[self.rows.len() - 1], i, count)));
        }
        let row_count = mesh.positions.len() as u32 / count;
        for row in 0..row_count - u32::from(!self.is_ring) {
            mesh.faces.extend(band(row, (row + 1) % row_count, count));
        }
        if !self.is_ring {
            let low = mesh.positions.len() as u32;
            let top_row = (row_count - 1) * count;
            mesh.positions.extend([0, self.rows.len() - 1].map(|row| DVec3::new(0.0, 0.0, self.rows[row].0)));
            for i in 0..count {
                let next = (i + 1) % count;
                mesh.faces.extend([[low, next, i], [low + 1, top_row + i, top_row + next]]);
            }
        }
        mesh
    }

    /// Parts for each segment, `bands` in all if that is enough for one each, by length.
    fn divisions(&self, bands: usize) -> Vec<u32> {
        let lengths: Vec<f64> = (0..self.segments())
            .map(|s| point(self.rows[s], 0, 12).distance(point(self.rows[(s + 1) % self.rows.len()], 0, 12)))
            .collect();
        let total: f64 = lengths.iter().sum();
        let spare = bands.saturating_sub(lengths.len());
        let mut divisions: Vec<u32> =
            lengths.iter().map(|length| 1 + (spare as f64 * length / total).floor() as u32).collect();
        let mut left = bands.saturating_sub(divisions.iter().sum::<u32>() as usize);
        for parts in &mut divisions {
            if left > 0 {
                *parts += 1;
                left -= 1;
            }
        }
        divisions
    }
}

fn point((z, outline): (f64, Outline), i: u32, count: u32) -> DVec3 {
    let (x, y) = outline.at(i, count);
    DVec3::new(x, y, z)
}

fn band(low: u32, high: u32, count: u32) -> impl Iterator<Item = [u32; 3]> {
    (0..count).flat_map(move |i| {
        let next = (i + 1) % count;
        halves([low * count + i, low * count + next, high * count + next, high * count + i])
    })
}

#[cfg(test)]
mod tests {
    use super::super::super::{topology, validate};
    use super::*;

    #[test]
    fn a_box_has_its_volume() {
        let square = Outline::Regular(4, 1.0);
        let profile = Profile { rows: vec![(0.0, square), (1.0, square), (3.0, square)], is_ring: false };
        let mesh = profile.turn(12, 120);
        assert_eq!(mesh.faces.len(), 120);
        assert!((mesh.volume() - 12.0).abs() < 1e-12, "{}", mesh.volume());
        assert_eq!(validate(&mesh), []);
    }

    #[test]
    fn a_nut_has_a_hole() {
        let (hexagon, bore) = (Outline::Regular(6, 2.0), Outline::Round(1.0));
        let rows = vec![(0.0, bore), (0.0, hexagon), (1.0, hexagon), (1.0, bore)];
        let mesh = Profile { rows, is_ring: true }.turn(24, 480);
        assert_eq!(mesh.faces.len(), 480);
        assert_eq!(topology(&mesh).genus, Some(1));
        assert!(mesh.volume() > 0.0);
        assert_eq!(validate(&mesh), []);
    }
}
