//! A start of a run without the small parts of its mesh.

use crate::backend::Device;
use crate::error::Result;
use crate::kernel::contract_vertices::GONE;
use crate::mesh::Rings;
use crate::mesh::parts::Small;

use super::carry::MOVED_FROM;
use super::prepare::{Prepared, parts_dropped};
use super::surface::Surface;

impl Prepared {
    /// Whether each vertex is one of a small part.
    fn small_ones(&self, small: &Small) -> Vec<bool> {
        self.carried.origin.iter().map(|origin| small.vertices[(origin & !MOVED_FROM) as usize]).collect()
    }

    /// How many faces there are without small parts.
    pub(crate) fn faces_without(&self, small: &Small) -> usize {
        let is_small = self.small_ones(small);
        self.faces.iter().filter(|face| !is_small[face.a as usize]).count()
    }

    /// Leaves out small parts, but for all that there is.
    pub(crate) fn leave_out(&mut self, small: &Small, device: &Device) -> Result<()> {
        let (faces, is_small) = (self.faces_without(small), self.small_ones(small));
        let Some(stays) = is_small.iter().position(|&is_small| !is_small) else { return Ok(()) };
        let mut surface = Surface::new(&mut device.cpu_queue(), self.take_start(), false)?;
        let roles = surface.roles.host_mut();
        // As if they had been contracted into one that stays: their faces have no other corner then.
        for (role, _) in roles.iter_mut().zip(is_small).filter(|(_, is_small)| *is_small) {
            *role = GONE | stays as u32;
        }
        surface.compact_on_host(&mut self.carried, faces);
        let vertices = surface.vertex_count;
        self.positions = surface.positions.host()[..vertices].to_vec();
        self.faces = surface.faces.host()[..faces].to_vec();
        let (starts, rings) = (surface.ring_starts.host(), surface.ring_faces.host());
        self.rings = Rings { starts: starts[..=vertices].to_vec(), faces: rings[..3 * faces].to_vec() };
        self.earlier.pace = None;
        self.warnings.push(parts_dropped(small.parts));
        Ok(())
    }
}
