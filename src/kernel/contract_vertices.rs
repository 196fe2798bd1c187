//! Moves kept vertices and marks the roles of both ends of every accepted contraction. Twin:
//! `shaders/contract_vertices.wgsl`, line for line.

use super::rows::{Contraction, Position};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};

/// A vertex that vanished this round: the rest of the word is the vertex it became.
pub const GONE: u32 = 1 << 30;
/// A vertex that took in another this round: the rest of the word is that vertex.
pub const KEEPS: u32 = 1 << 31;
/// The vertex in a role. A role of 0 is a vertex no contraction touched.
pub const VERTEX: u32 = GONE - 1;
/// The role bits under their names in WGSL.
pub const ROLES: &[(&str, Constant)] =
    &[("GONE", Constant::U32(GONE)), ("KEEPS", Constant::U32(KEEPS)), ("VERTEX", Constant::U32(VERTEX))];

/// One invocation a contraction.
pub struct ContractVertices<'a> {
    /// Accepted contractions; no vertex occurs twice.
    pub contractions: &'a Buffer<Contraction>,
    /// How many.
    pub contraction_count: u32,
    /// V positions, changed in place.
    pub positions: &'a mut Buffer<Position>,
    /// V roles, zero before.
    pub roles: &'a mut Buffer<u32>,
}

impl Kernel for ContractVertices<'_> {
    const NAME: &'static str = "contract_vertices";
    const SOURCE: &'static str = include_str!("../../shaders/contract_vertices.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = ROLES;

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("contractions", Access::Read, self.contractions),
            Binding::new("positions", Access::Write, self.positions),
            Binding::new("roles", Access::Write, self.roles),
        ]
    }

    fn invocations(&self) -> u32 {
        self.contraction_count
    }

    fn run_cpu(&mut self) {
        let (positions, roles) = (self.positions.host_mut(), self.roles.host_mut());
        for &c in &self.contractions.host()[..self.contraction_count as usize] {
            positions[c.keep as usize] = Position { x: c.x, y: c.y, z: c.z, flags: c.flags };
            roles[c.keep as usize] = KEEPS | c.gone;
            roles[c.gone as usize] = GONE | c.keep;
        }
    }
}
