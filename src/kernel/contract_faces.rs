//! Renames the corners of every face after a round's contractions and tells which faces still live. Twin:
//! `shaders/contract_faces.wgsl`, line for line.

use rayon::prelude::*;

use super::contract_vertices::{GONE, ROLES, VERTEX};
use super::rows::Face;
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// One invocation a face, and one that ends `live` with 0.
pub struct ContractFaces<'a> {
    /// V roles.
    pub roles: &'a Buffer<u32>,
    /// F faces, renamed in place.
    pub faces: &'a mut Buffer<Face>,
    /// F.
    pub face_count: u32,
    /// Writes F + 1: 1 for a face that lives, otherwise 0.
    pub live: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
    }
}

/// The vertex that `vertex` has become.
#[inline(always)]
pub fn renamed(vertex: u32, role: u32) -> u32 {
    if role & GONE != 0 { role & VERTEX } else { vertex }
}

impl Kernel for ContractFaces<'_> {
    const NAME: &'static str = "contract_faces";
    const SOURCE: &'static str = include_str!("../../shaders/contract_faces.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = ROLES;

    fn params(&self) -> Params {
        Params { count: self.face_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("roles", Access::Read, self.roles),
            Binding::new("faces", Access::Write, self.faces),
            Binding::new("live", Access::Write, self.live),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count + 1
    }

    fn run_cpu(&mut self) {
        let count = self.face_count as usize;
        let roles = self.roles.host();
        let faces = &mut self.faces.host_mut()[..count];
        let live = &mut self.live.host_mut()[..=count];
        live[count] = 0;
        faces.par_iter_mut().zip(&mut live[..count]).with_min_len(CHUNK).for_each(|(face, live)| {
            let [a, b, c] = face.corners().map(|corner| renamed(corner, roles[corner as usize]));
            *face = Face { a, b, c };
            *live = u32::from(face.is_live());
        });
    }
}
