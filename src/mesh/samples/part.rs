//! A machined flange with a hub: flats, sharp edges, chamfers, a fillet, a bore and eight bolt holes.

use super::super::circle::unit_circle;
use super::super::shapes::halves;
use super::super::{Mesh, weld};
use crate::math::DVec3;

const SECTORS: u32 = 8;
const RIM: f64 = 5.0;
const THICKNESS: f64 = 1.0;
/// Where the flat of the flange meets the hub's fillet.
const INNER: f64 = 2.6;
const HOLE_CIRCLE: f64 = 4.0;
const HOLE: f64 = 0.45;

/// The turned part, as (radius, height) from the flat below through the bore, over the hub and down the fillet.
const TURNED: [(f64, f64); 8] =
    [(INNER, 0.0), (1.6, 0.0), (1.4, 0.2), (1.4, 3.8), (1.6, 4.0), (2.0, 4.0), (2.2, 3.8), (2.2, 1.4)];
/// The fillet's radius: a quarter circle from the end of the list to the flat above.
const FILLET: f64 = 0.4;

/// The part of about `faces` faces, 10 wide and 4 high. One closed component of genus 9: the bore and eight holes.
pub fn part(faces: usize) -> Mesh {
    // The greatest density with no more faces than asked for; the layers of single holes make up the rest.
    let (mut low, mut high) = (0.0, 1.0);
    while Grid::new(high).faces() <= faces && high < 1e6 {
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        *(if Grid::new(middle).faces() <= faces { &mut low } else { &mut high }) = middle;
    }
    let grid = Grid::new(low);
    let layer = 2 * grid.around_hole() as usize;
    let missing = (faces.saturating_sub(grid.faces()) + layer / 2) / layer;
    grid.mesh(missing as u32)
}

/// How many steps each piece is cut into.
struct Grid {
    /// Along a sector's inner arc, its outer arc, and its two straight sides.
    inner: u32,
    outer: u32,
    side: u32,
    /// From a hole to the sector's boundary.
    rays: u32,
    /// Through the thickness, at the rim and in the holes.
    layers: u32,
    /// Along each piece of the turned profile; the last is the fillet.
    turned: [u32; 8],
}

impl Grid {
    fn new(density: f64) -> Self {
        let steps = |length: f64, least: u32| ((length * density).round() as u32).max(least);
        let arc = std::f64::consts::TAU / f64::from(SECTORS);
        let length = |i: usize| {
            let [(r, z), (s, w)] = [TURNED[i], TURNED[i + 1]];
            ((r - s) * (r - s) + (z - w) * (z - w)).sqrt()
        };
        Self {
            inner: steps(INNER * arc, 2),
            outer: steps(RIM * arc, 3),
            side: steps(RIM - INNER, 2),
            rays: steps(0.9, 1),
            layers: steps(THICKNESS, 1),
            turned: std::array::from_fn(|i| if i < 7 { steps(length(i), 1) } else { steps(0.63, 3) }),
        }
    }

    fn around_hole(&self) -> u32 {
        self.inner + self.outer + 2 * self.side
    }

    fn faces(&self) -> usize {
        let [around, inner, outer] = [self.around_hole(), self.inner, self.outer].map(|n| n as usize);
        let [rays, layers] = [self.rays, self.layers].map(|n| n as usize);
        let turned: usize = self.turned.iter().map(|&n| n as usize).sum();
        2 * SECTORS as usize * (2 * around * rays + around * layers + outer * layers + inner * turned)
    }

    /// The pieces side by side, joined where they meet. `extra` more layers are spread over the holes.
    fn mesh(&self, extra: u32) -> Mesh {
        let mut soup = Mesh::default();
        self.add_turned(&mut soup);
        for sector in 0..SECTORS {
            let layers = self.layers + extra / SECTORS + u32::from(sector < extra % SECTORS);
            self.add_sector(&mut soup, sector, layers);
        }
        weld(&soup, 0.0).mesh
    }

    fn add_turned(&self, soup: &mut Mesh) {
        let count = SECTORS * self.inner;
        let mut profile = Vec::new();
        for (i, &steps) in self.turned.iter().enumerate() {
            for step in 0..steps {
                let t = f64::from(step) / f64::from(steps);
                profile.push(if i < 7 {
                    let [(r, z), (s, w)] = [TURNED[i], TURNED[i + 1]];
                    (r + (s - r) * t, z + (w - z) * t)
                } else {
                    let (cos, sin) = unit_circle(0.25 * t);
                    (INNER - FILLET * cos, THICKNESS + FILLET * (1.0 - sin))
                });
            }
        }
        profile.push((INNER, THICKNESS));
        // Sheets face out where their rows go up outside.
        profile.reverse();
        add_grid(soup, profile.len() as u32, count + 1, |row, i| {
            let (r, z) = profile[row as usize];
            polar(r, i, count, z)
        });
    }

    /// Flats above and below around one hole, the hole's wall, and the piece of the rim.
    fn add_sector(&self, soup: &mut Mesh, sector: u32, layers: u32) {
        let (x, y) = unit_circle((f64::from(sector) + 0.5) / f64::from(SECTORS));
        let center = DVec3::new(x, y, 0.0) * HOLE_CIRCLE;
        let boundary = self.boundary(sector);
        let around = boundary.len() as u32;
        let end = |i: u32| boundary[(i % around) as usize];
        let hole = |i: u32| center + (end(i) - center).normalize() * HOLE;
        let flat = |ray: u32, i: u32| match ray {
            0 => hole(i),
            _ if ray == self.rays => end(i),
            _ => hole(i).lerp(end(i), f64::from(ray) / f64::from(self.rays)),
        };
        let up = DVec3::Z * THICKNESS;
        add_grid(soup, self.rays + 1, around + 1, |ray, i| flat(self.rays - ray, i) + up);
        add_grid(soup, self.rays + 1, around + 1, flat);
        let height = |layer: u32, layers: u32| up * (f64::from(layer) / f64::from(layers));
        add_grid(soup, layers + 1, around + 1, |layer, i| hole(i) + height(layers - layer, layers));
        add_grid(soup, self.layers + 1, self.outer + 1, |layer, i| {
            polar(RIM, sector * self.outer + i, SECTORS * self.outer, 0.0) + height(layer, self.layers)
        });
    }

    /// Counter-clockwise from the end of the inner arc's first corner: out along one side, the rim, back in, the inner arc.
    fn boundary(&self, sector: u32) -> Vec<DVec3> {
        let radius =
            |i: u32| if i == self.side { RIM } else { INNER + (RIM - INNER) * (f64::from(i) / f64::from(self.side)) };
        let (inner, outer) = (SECTORS * self.inner, SECTORS * self.outer);
        let out = (0..self.side).map(|i| polar(radius(i), sector, SECTORS, 0.0));
        let rim = (0..self.outer).map(|i| polar(RIM, sector * self.outer + i, outer, 0.0));
        let back = (0..self.side).map(|i| polar(radius(self.side - i), sector + 1, SECTORS, 0.0));
        let arc = (0..self.inner).map(|i| polar(INNER, (sector + 1) * self.inner - i, inner, 0.0));
        out.chain(rim).chain(back).chain(arc).collect()
    }
}

/// The point at `i` of `count` around the axis. The same fraction of a turn gives the same bits, however it is written.
fn polar(radius: f64, i: u32, count: u32, z: f64) -> DVec3 {
    let (cos, sin) = unit_circle(f64::from(i % count) / f64::from(count));
    DVec3::new(radius * cos, radius * sin, z)
}

/// A sheet of rows of points, facing out where rows go up and points go counter-clockwise around.
fn add_grid(soup: &mut Mesh, rows: u32, columns: u32, at: impl Fn(u32, u32) -> DVec3) {
    let first = soup.positions.len() as u32;
    soup.positions.extend((0..rows).flat_map(|row| (0..columns).map(move |i| (row, i))).map(|(row, i)| at(row, i)));
    for row in 0..rows - 1 {
        for i in 0..columns - 1 {
            let low = first + row * columns + i;
            soup.faces.extend(halves([low, low + 1, low + columns + 1, low + columns]));
        }
    }
}
