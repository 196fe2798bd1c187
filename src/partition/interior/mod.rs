//! The light inside a region: all of its vertices are put back into the new outline, and those that are not missed go again.
//!
//! # Reference
//! Not in \[Liu99\], where a bright spot inside a superface vanishes with its vertices. Here what light is lost decides: that at the
//! vertices of the region and in the middles of its faces, where the new triangles have another than the old ones had.

use rustc_hash::FxHashSet;

use crate::math::DVec2;

mod drawing;
mod grid;
mod thin;

pub use grid::Grid;
pub use thin::{thin, thin_again};

/// Edges that stay, the lower end first.
pub type KeptEdges = FxHashSet<[u32; 2]>;

/// Red, green and blue.
pub type Color = [f64; 3];

/// The points of a region in its plane: the vertices of its outline, those inside, and places that only show light.
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    pub points: &'a [DVec2],
    pub colors: &'a [Color],
    /// The area that each stands for.
    pub areas: &'a [f64],
    /// How many of the first may be corners.
    pub vertex_count: u32,
    /// How many of the first may not be off by any amount.
    pub bound_count: u32,
    /// Whether vertices lie on the outline, where no new edge may join two of them; of none it is not asked.
    pub is_outer: &'a [bool],
}

/// What may be lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Greatest difference of a channel at a vertex.
    pub most: f64,
    /// Greatest difference of color times area that one vertex is worth.
    pub worth: f64,
}

/// Color between three corners, continued over the plane.
#[derive(Debug, Clone, Copy)]
pub struct Shade {
    origin: DVec2,
    color: Color,
    slopes: [DVec2; 3],
}

impl Shade {
    /// Between corners that are not on a line.
    pub fn new([a, b, c]: [DVec2; 3], [color, at_b, at_c]: [Color; 3]) -> Self {
        let (ab, ac) = (b - a, c - a);
        let area = ab.perp_dot(ac);
        let slope = |k: usize| {
            let (along, across) = (at_b[k] - color[k], at_c[k] - color[k]);
            DVec2::new(along * ac.y - across * ab.y, across * ab.x - along * ac.x) / area
        };
        Self { origin: a, color, slopes: [0, 1, 2].map(slope) }
    }

    /// How each channel rises over the plane.
    pub fn slopes(&self) -> [DVec2; 3] {
        self.slopes
    }

    /// The difference to a color at a point, by channel.
    pub fn difference(&self, point: DVec2, color: Color) -> Color {
        let away = point - self.origin;
        [0, 1, 2].map(|k| self.color[k] + self.slopes[k].dot(away) - color[k])
    }
}

/// The length of a difference.
pub fn length([red, green, blue]: Color) -> f64 {
    (red * red + green * green + blue * blue).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shades_run_between_their_corners() {
        let corners = [DVec2::new(1.0, 1.0), DVec2::new(5.0, 1.0), DVec2::new(1.0, 3.0)];
        let shade = Shade::new(corners, [[0.0, 0.5, 1.0], [1.0, 0.5, 0.0], [0.0, 0.0, 0.0]]);
        assert_eq!(shade.difference(corners[1], [0.0; 3]), [1.0, 0.5, 0.0]);
        assert_eq!(shade.difference(DVec2::new(3.0, 1.0), [0.0, 0.5, 0.25]), [0.5, 0.0, 0.25]);
        assert_eq!(shade.difference(DVec2::new(3.0, 2.0), [0.5, 0.25, 0.0]), [0.0, 0.0, 0.0]);
        assert_eq!(length([2.0, -3.0, 6.0]), 7.0);
    }
}
