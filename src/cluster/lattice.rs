//! The frame of the grids: a lattice of integer steps, of which the cells of every grid are whole cubes.
//!
//! A site is the step that a vertex lies in, rounded down. Cells therefore divide sites as they divide the vertices
//! themselves, in integers, and differences of sites are exact in single precision.

use rayon::prelude::*;

use crate::kernel::cell_keys::{LEAST_STEPS, SITE_BITS, UNUSED};
use crate::kernel::rows::Site;
use crate::math::DVec3;

/// Vertices that a thread takes at a time.
const ROWS: usize = 1 << 12;
const LAST_STEP: f64 = ((1_u32 << SITE_BITS) - 1) as f64;

/// Between model units and steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// The lowest corner of the box around the vertices that faces use.
    low: DVec3,
    /// Steps a model unit: a power of two.
    scale: f64,
    /// Steps along the longest side of the box: 2²³ to 2²⁴.
    pub extent: u32,
}

impl Lattice {
    /// The lattice of the vertices that are `used`; `None` when they all lie at one point.
    pub fn new(positions: &[DVec3], used: &[bool]) -> Option<Self> {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let joined = |(low, high): (DVec3, DVec3), (l, h): (DVec3, DVec3)| (low.min(l), high.max(h));
        let bounds = |(positions, used): (&[DVec3], &[bool])| {
            let corners = positions.iter().zip(used).filter(|&(_, &used)| used);
            corners.fold(none, |bounds, (&p, _)| joined(bounds, (p, p)))
        };
        let (low, high) = positions.par_chunks(ROWS).zip(used.par_chunks(ROWS)).map(bounds).reduce(|| none, joined);
        // Halves: the difference of two finite numbers may not be.
        let half = (high * 0.5 - low * 0.5).max_element();
        if !(half > 0.0 && half.is_finite()) {
            return None;
        }
        // From the bits: no logarithm, whose last digit differs between platforms.
        let exponent = (half.to_bits() >> 52) as i64 - 1023;
        let shift = (i64::from(SITE_BITS) - 2 - exponent).clamp(-1022, 1022);
        let lattice = Self { low, scale: f64::from_bits(((1023 + shift) as u64) << 52), extent: 0 };
        let Site { x, y, z } = lattice.site(high);
        Some(Self { extent: x.max(y).max(z) + 1, ..lattice })
    }

    /// The site of a position in the box.
    pub fn site(&self, p: DVec3) -> Site {
        let [x, y, z] = ((p * 0.5 - self.low * 0.5) * (2.0 * self.scale)).to_array().map(|at| at.min(LAST_STEP) as u32);
        Site { x, y, z }
    }

    /// The sites of all vertices.
    pub fn sites(&self, positions: &[DVec3], used: &[bool]) -> Vec<Site> {
        let site = |(&p, &used): (&DVec3, &bool)| if used { self.site(p) } else { Site { x: UNUSED, y: 0, z: 0 } };
        positions.par_iter().zip(used).with_min_len(ROWS).map(site).collect()
    }

    /// A length in steps in model units.
    pub fn length(&self, steps: f64) -> f64 {
        steps / self.scale
    }

    /// The steps of a grid of at most `cells` cells along the longest side: exactly as many up to 2,896.
    pub fn steps_of(&self, cells: u32) -> u32 {
        self.extent.div_ceil(cells.max(1)).max(LEAST_STEPS)
    }

    /// The steps of the greatest cell whose diagonal is at most this long; possibly fewer than any grid has.
    pub fn steps_within(&self, diagonal: f64) -> u32 {
        (diagonal * self.scale / 3_f64.sqrt()).min(f64::from(self.extent)) as u32
    }

    /// A position moved by an offset in steps, held to the cell that it lies in.
    pub fn moved(&self, p: DVec3, offset: DVec3, steps: u32) -> DVec3 {
        let site = self.site(p);
        let half = 0.5 / self.scale;
        let coordinate = |p: f64, offset: f64, low: f64, site: u32| {
            if offset == 0.0 {
                return p;
            }
            let cell = f64::from(site / steps * steps);
            let [cell_low, cell_high] = [cell, cell + f64::from(steps)].map(|steps| low * 0.5 + steps * half);
            // The box may end at the greatest number and the cell beyond.
            ((p * 0.5 + offset * half).clamp(cell_low, cell_high) * 2.0).clamp(f64::MIN, f64::MAX)
        };
        DVec3::new(
            coordinate(p.x, offset.x, self.low.x, site.x),
            coordinate(p.y, offset.y, self.low.y, site.y),
            coordinate(p.z, offset.z, self.low.z, site.z),
        )
    }
}

/// Units a step in which the side of a cell is above a half and at most 1: a power of two.
pub fn unit(steps: u32) -> f32 {
    1.0 / steps.next_power_of_two() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(points: &[DVec3]) -> Option<Lattice> {
        Lattice::new(points, &vec![true; points.len()])
    }

    #[test]
    fn the_longest_side_has_half_the_steps_or_more_at_any_scale() {
        for scale in [1e-290, 1e-9, 1.0, 3.7, 1e9, 1e300, f64::MAX] {
            let lattice = lattice(&[DVec3::splat(-scale), DVec3::new(scale, 0.0, 0.0)]).expect("an extent");
            assert!((1 << 22..=1 << 24).contains(&lattice.extent), "{scale}: {}", lattice.extent);
            assert_eq!(lattice.site(DVec3::splat(-scale)), Site::default());
            assert_eq!(lattice.site(DVec3::new(scale, -scale, -scale)), Site { x: lattice.extent - 1, y: 0, z: 0 });
        }
        assert_eq!(lattice(&[DVec3::ONE; 3]), None);
        assert_eq!(lattice(&[]), None);
    }

    #[test]
    fn unused_vertices_do_not_count() {
        let points = [DVec3::ZERO, DVec3::splat(1e9), DVec3::ONE];
        let used = [true, false, true];
        let found = Lattice::new(&points, &used).expect("an extent");
        assert_eq!(Some(found), lattice(&[DVec3::ZERO, DVec3::ONE]));
        assert_eq!(found.sites(&points, &used)[1].x, UNUSED);
    }

    #[test]
    fn a_grid_has_as_many_cells_as_asked_for() {
        let lattice = lattice(&[DVec3::ZERO, DVec3::new(3.0, 1.0, 0.1)]).expect("an extent");
        for cells in [1, 2, 3, 7, 100, 999, 2896] {
            assert_eq!(lattice.extent.div_ceil(lattice.steps_of(cells)), cells);
        }
        assert_eq!(lattice.steps_of(u32::MAX), LEAST_STEPS);
        let steps = lattice.steps_within(0.01);
        assert!(lattice.length(f64::from(steps) * 3_f64.sqrt()) <= 0.01);
        assert!(lattice.length(f64::from(steps + 1) * 3_f64.sqrt()) > 0.01);
    }

    #[test]
    fn what_moves_stays_in_its_cell() {
        let lattice = lattice(&[DVec3::ZERO, DVec3::splat(4.0)]).expect("an extent");
        let steps = lattice.steps_of(4);
        let p = DVec3::new(1.5, 2.5, 0.1);
        let one = 1.0 / lattice.length(1.0);
        assert_eq!(lattice.moved(p, DVec3::ZERO, steps), p);
        let near = lattice.moved(p, DVec3::new(one, 0.25 * one, -one), steps);
        assert!(near.abs_diff_eq(DVec3::new(2.0, 2.75, 0.0), 1e-6), "{near}");
        assert!((1.0..2.0).contains(&lattice.moved(p, DVec3::NEG_X * 10.0 * one, steps).x));
        assert_eq!((unit(8), unit(9), unit(1 << 24)), (0.125, 0.0625, 2_f32.powi(-24)));
    }
}
