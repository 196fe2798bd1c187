//! The cell of every vertex, as a key. Twin: `shaders/cell_keys.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::Site;
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// Binary digits of a site's coordinate: what single precision holds, so that differences of sites are exact.
pub const SITE_BITS: u32 = 24;
/// Steps to the side of the smallest cell: coordinates of cells have three digits fewer, and three of them fill a key.
pub const LEAST_STEPS: u32 = 8;
/// The first coordinate of a vertex that no face uses; it lies in a cell of its own. No key of a cell has this as its
/// second word.
pub const UNUSED: u32 = u32::MAX;

/// One invocation a vertex.
pub struct CellKeys<'a> {
    /// V sites.
    pub sites: &'a Buffer<Site>,
    /// V.
    pub vertex_count: u32,
    /// Steps to the side of a cell, at least [`LEAST_STEPS`].
    pub steps: u32,
    /// Writes V keys.
    pub keys: &'a mut Buffer<[u32; 2]>,
}

params! {
    /// The uniform block.
    pub struct Params {
        steps: u32,
    }
}

#[inline(always)]
fn cell_key(site: Site, vertex: u32, steps: u32) -> [u32; 2] {
    if site.x == UNUSED {
        return [vertex, UNUSED];
    }
    let x = site.x / steps;
    let y = site.y / steps;
    let z = site.z / steps;
    [x | (y << 21), (y >> 11) | (z << 10)]
}

impl Kernel for CellKeys<'_> {
    const NAME: &'static str = "cell_keys";
    const SOURCE: &'static str = include_str!("../../shaders/cell_keys.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("UNUSED", Constant::U32(UNUSED))];

    fn params(&self) -> Params {
        Params { steps: self.steps }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("sites", Access::Read, self.sites), Binding::new("keys", Access::Write, self.keys)]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let steps = self.steps;
        let rows = self.keys.host_mut()[..self.vertex_count as usize].par_iter_mut().zip(self.sites.host());
        rows.enumerate().with_min_len(CHUNK).for_each(|(vertex, (key, &site))| {
            *key = cell_key(site, vertex as u32, steps);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coordinates_of_a_cell_fill_its_key() {
        let most = (1 << SITE_BITS) - 1;
        let site = Site { x: most, y: 0, z: 0 };
        assert_eq!(cell_key(site, 7, LEAST_STEPS), [(1 << 21) - 1, 0]);
        assert_eq!(cell_key(Site { x: 0, y: most, z: 0 }, 7, LEAST_STEPS), [0x7ff << 21, 0x3ff]);
        assert_eq!(cell_key(Site { x: 0, y: 0, z: most }, 7, LEAST_STEPS), [0, 0x1f_ffff << 10]);
        assert_eq!(cell_key(Site { x: UNUSED, ..site }, 7, LEAST_STEPS), [7, UNUSED]);
        assert_eq!(cell_key(Site { x: 29, y: 30, z: 31 }, 7, 10), [2 | 3 << 21, 3 << 10]);
    }
}
