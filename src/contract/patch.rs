//! A run of consecutive vertices whose rows one task may change, with the connectivity that nothing changes in a round.
//!
//! # Invariants
//! - Faces keep the corners that they had as the round began; a corner that vanished since is renamed on reading, by the
//!   roles. A vertex takes part in one contraction a round at most, so one renaming is enough, and the ring of a vertex
//!   without a role is that of the start.
//! - Patches that are worked on at the same time share no vertex. A contraction whose faces reach out of its patch is
//!   left for a larger one.

use std::ops::Range;

use crate::kernel::contract_faces::renamed;
use crate::kernel::contract_vertices::{GONE, KEEPS, VERTEX};
use crate::kernel::rows::{Contraction, Face, PlaneQuadric, Position};
use crate::kernel::warm::{faces_near, warm_up};
use crate::math::Vec3;

use super::carry::{Carried, CarriedRows, split};
use super::surface::Surface;
use super::wedges::WedgeRows;

/// Faces and rings as the round began.
#[derive(Debug, Clone, Copy)]
pub struct Connectivity<'a> {
    pub faces: &'a [Face],
    ring_starts: &'a [u32],
    ring_faces: &'a [u32],
}

impl<'a> Connectivity<'a> {
    /// The faces around a vertex, ascending.
    #[inline(always)]
    pub fn ring(&self, vertex: u32) -> &'a [u32] {
        let (start, end) = (self.ring_starts[vertex as usize], self.ring_starts[vertex as usize + 1]);
        &self.ring_faces[start as usize..end as usize]
    }
}

/// The rows of the vertices from `first` on.
#[derive(Debug)]
pub struct Patch<'a> {
    pub connectivity: Connectivity<'a>,
    first: u32,
    positions: &'a mut [Position],
    /// Empty where no planes are accumulated.
    quadrics: &'a mut [PlaneQuadric],
    roles: &'a mut [u32],
    carried: CarriedRows<'a>,
}

/// What tells how far the vertex of a contraction has come off the surface of the start.
#[derive(Debug, Clone, Copy)]
pub enum Accumulated {
    /// Of the metric `plane`: the planes that it stands for, about it.
    Planes(PlaneQuadric),
    /// Of the metric `volume`: the greater sum of steps of both ends and the last one, in the normalized frame. A step is the
    /// root of the weighted mean squared distance to the planes of the faces around the pair, and to border edges there; or to the
    /// faces that are left, where these tell less.
    /// Planes that a vertex once stood for tell less, since it may slide along a flat away from them.
    Drift(f32),
}

impl Accumulated {
    /// The estimated deviation, in the normalized frame.
    pub fn deviation(&self) -> f32 {
        match self {
            Self::Planes(PlaneQuadric { c, weight, .. }) if *weight > 0.0 => (c.max(0.0) / weight).sqrt(),
            Self::Planes(_) => 0.0,
            Self::Drift(drift) => *drift,
        }
    }
}

/// What a contraction writes.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    pub x: Vec3,
    /// Where x lies between the ends, for what vertices carry.
    pub t: f32,
    pub accumulated: Accumulated,
    /// Flags of the new vertex beside those of the ends.
    pub flags: u32,
}

impl<'a> Patch<'a> {
    /// All vertices of a surface on the host.
    pub fn whole(surface: &'a mut Surface, carried: &'a mut Carried) -> Self {
        let vertices = surface.vertex_count;
        Self {
            connectivity: Connectivity {
                faces: &surface.faces.host()[..surface.face_count],
                ring_starts: surface.ring_starts.host(),
                ring_faces: surface.ring_faces.host(),
            },
            first: 0,
            positions: &mut surface.positions.host_mut()[..vertices],
            quadrics: surface.quadrics.as_mut().map_or(&mut [], |quadrics| &mut quadrics.host_mut()[..vertices]),
            roles: &mut surface.roles.host_mut()[..vertices],
            carried: carried.rows(),
        }
    }

    /// Patches of `size` vertices each, the last may have fewer.
    pub fn split(self, size: usize) -> Vec<Self> {
        let mut patches = Vec::with_capacity(self.len().div_ceil(size));
        let mut rest = self;
        while rest.len() > size {
            let (patch, others) = rest.split_at(size);
            patches.push(patch);
            rest = others;
        }
        patches.push(rest);
        patches
    }

    fn split_at(self, size: usize) -> (Self, Self) {
        let Self { connectivity, first, positions, quadrics, roles, carried } = self;
        let (positions, other_positions) = positions.split_at_mut(size);
        let (quadrics, other_quadrics) = split(quadrics, size);
        let (roles, other_roles) = roles.split_at_mut(size);
        let (carried, other_carried) = carried.split_at(size);
        let others = Self {
            connectivity,
            first: first + size as u32,
            positions: other_positions,
            quadrics: other_quadrics,
            roles: other_roles,
            carried: other_carried,
        };
        (Self { connectivity, first, positions, quadrics, roles, carried }, others)
    }

    /// Reads all of it once, before it is read in the order of cost.
    pub fn warm_up(&self) {
        let Connectivity { faces, ring_starts, ring_faces } = self.connectivity;
        let (first, last) = (self.first as usize, self.first as usize + self.len());
        let starts = &ring_starts[first..=last];
        let rings = &ring_faces[starts[0] as usize..starts[self.len()] as usize];
        let near = faces_near(first..last, ring_starts, ring_faces, faces.len());
        warm_up(starts);
        warm_up(rings);
        warm_up(&faces[near.clone()]);
        warm_up(self.positions);
        warm_up(self.quadrics);
        if let Some(wedges) = self.wedges() {
            wedges.warm_up(near);
        }
    }

    /// How many vertices it has.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// The numbers of its vertices.
    pub fn vertices(&self) -> Range<u32> {
        self.first..self.first + self.len() as u32
    }

    /// The number of a vertex within the patch; out of its range for any other.
    #[inline(always)]
    pub fn local(&self, vertex: u32) -> usize {
        vertex.wrapping_sub(self.first) as usize
    }

    /// What `vertex` is now, or `None` if one of both lies outside, as after the contraction of a larger patch, or of a smaller
    /// one that the border between halves cuts.
    #[inline(always)]
    pub fn current(&self, vertex: u32) -> Option<u32> {
        let now = renamed(vertex, *self.roles.get(self.local(vertex))?);
        (self.local(now) < self.len()).then_some(now)
    }

    /// [`Patch::current`] of two, or `None` if one of them has none: two branches for both.
    #[inline(always)]
    pub fn current_both(&self, vertices: [u32; 2]) -> Option<[u32; 2]> {
        let [first, second] = vertices.map(|vertex| self.local(vertex));
        if first.max(second) >= self.roles.len() {
            return None;
        }
        let now = [renamed(vertices[0], self.roles[first]), renamed(vertices[1], self.roles[second])];
        let [first, second] = now.map(|vertex| self.local(vertex));
        (first.max(second) < self.roles.len()).then_some(now)
    }

    /// What vanished into a vertex of the patch this round.
    #[inline(always)]
    pub fn absorbed(&self, vertex: u32) -> Option<u32> {
        let role = self.roles[self.local(vertex)];
        (role & KEEPS != 0).then_some(role & VERTEX)
    }

    /// Whether a vertex of the patch took part in no contraction of this round.
    #[inline(always)]
    pub fn is_free(&self, vertex: u32) -> bool {
        self.roles.get(self.local(vertex)).is_some_and(|&role| role == 0)
    }

    /// The position of a vertex of the patch.
    #[inline(always)]
    pub fn position(&self, vertex: u32) -> Position {
        self.positions[self.local(vertex)]
    }

    /// The accumulated quadric of a vertex of the patch, where the metric accumulates planes.
    #[inline(always)]
    pub fn quadric(&self, vertex: u32) -> &PlaneQuadric {
        &self.quadrics[self.local(vertex)]
    }

    /// The greater drift of two vertices of the patch.
    pub fn drift(&self, first: u32, second: u32) -> f32 {
        self.carried.drift(self.local(first), self.local(second))
    }

    /// The weights of two vertices of the patch, where they have any.
    pub fn weights(&self, pair: [u32; 2]) -> Option<[f32; 2]> {
        self.carried.weights(pair.map(|vertex| self.local(vertex)))
    }

    /// The wedges of the patch, where there are any.
    pub fn wedges(&self) -> Option<&WedgeRows<'a>> {
        self.carried.wedges.as_ref()
    }

    /// The wedges of the patch, to change.
    pub fn wedges_mut(&mut self) -> Option<&mut WedgeRows<'a>> {
        self.carried.wedges.as_mut()
    }

    /// Writes an accepted contraction.
    pub fn contract(&mut self, [u, w]: [u32; 2], placed: &Placed) -> Contraction {
        let (keep, gone) = (u.min(w), u.max(w));
        let flags = self.position(u).flags | self.position(w).flags | placed.flags;
        let Vec3 { x, y, z } = placed.x;
        let (kept, vanished) = (self.local(keep), self.local(gone));
        self.positions[kept] = Position { x, y, z, flags };
        self.carried.contract(kept, [self.local(u), self.local(w)], placed.t);
        match placed.accumulated {
            Accumulated::Planes(quadric) => self.quadrics[kept] = quadric,
            Accumulated::Drift(drift) => self.carried.set_drift(kept, drift),
        }
        self.roles[kept] = KEEPS | gone;
        self.roles[vanished] = GONE | keep;
        Contraction { keep, gone, x, y, z, flags }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deviation_is_the_root_of_a_mean_square_or_a_sum_of_steps() {
        let planes = |c, weight| Accumulated::Planes(PlaneQuadric { c, weight, ..PlaneQuadric::default() });
        let all = [planes(8.0, 2.0), planes(-1e-9, 2.0), planes(0.0, 0.0), Accumulated::Drift(0.3)];
        assert_eq!(all.map(|accumulated| accumulated.deviation()), [2.0, 0.0, 0.0, 0.3]);
    }
}
