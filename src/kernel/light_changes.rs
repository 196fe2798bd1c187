//! How much the light changes from a face to those around it, by channel. Twin: `shaders/light_changes.wgsl`, line for line.
//!
//! # Reference
//! \[Liu99\]: C_i = max_j max(|B_i − B_j| / ((A_i + A_j) B_i), |B_i − B_j| / ((A_i + A_j) B_j)) over the faces j across the
//! edges of i. Departs: without the areas unless asked for, since with them it depends on the unit of length; and what is
//! darker than a floor counts as that.

use rayon::prelude::*;

use super::pairs::NO_FACE;
use super::rows::Face;
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{add, divide, sub};

/// One invocation a face.
pub struct LightChanges<'a> {
    /// F rows of red, green and blue, at least zero, and the area.
    pub lights: &'a Buffer<[f32; 4]>,
    /// F rows: the faces across the edges, [`NO_FACE`] for none.
    pub neighbors: &'a Buffer<Face>,
    /// F.
    pub face_count: u32,
    /// The least light that a step is measured by.
    pub floor: f32,
    /// Whether steps are divided by the area of both faces.
    pub by_area: bool,
    /// Writes F rows: the greatest change of red, green, blue, and of these.
    pub changes: &'a mut Buffer<[f32; 4]>,
}

params! {
    /// What is the same for all invocations.
    pub struct Params {
        floor: f32,
        by_area: u32,
    }
}

/// The step between two lights as a share of the darker; dark ones count as `floor`.
#[inline(always)]
fn contrast(x: f32, y: f32, params: Params) -> f32 {
    divide(sub(x, y).abs(), x.min(y).max(params.floor))
}

/// The greatest of `so_far` and the steps to the face across an edge, each for its own channel.
#[inline(always)]
fn with_step(so_far: [f32; 4], own: [f32; 4], across: u32, lights: &[[f32; 4]], params: Params) -> [f32; 4] {
    if across == NO_FACE {
        return so_far;
    }
    let other = lights[across as usize];
    let step = [0, 1, 2].map(|k| contrast(own[k], other[k], params));
    let area = if params.by_area != 0 { add(own[3], other[3]) } else { 1.0 };
    let red = so_far[0].max(divide(step[0], area));
    let green = so_far[1].max(divide(step[1], area));
    let blue = so_far[2].max(divide(step[2], area));
    [red, green, blue, red.max(green).max(blue)]
}

#[inline(always)]
fn light_change(own: [f32; 4], across: Face, lights: &[[f32; 4]], params: Params) -> [f32; 4] {
    across.corners().into_iter().fold([0.0; 4], |so_far, face| with_step(so_far, own, face, lights, params))
}

impl Kernel for LightChanges<'_> {
    const NAME: &'static str = "light_changes";
    const SOURCE: &'static str = include_str!("../../shaders/light_changes.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("NO_FACE", Constant::U32(NO_FACE))];

    fn params(&self) -> Params {
        Params { floor: self.floor, by_area: u32::from(self.by_area) }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("lights", Access::Read, self.lights),
            Binding::new("neighbors", Access::Read, self.neighbors),
            Binding::new("changes", Access::Write, self.changes),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let (params, lights, neighbors) = (self.params(), self.lights.host(), self.neighbors.host());
        let rows = self.changes.host_mut()[..self.face_count as usize].par_iter_mut().enumerate();
        rows.with_min_len(CHUNK).for_each(|(face, change)| {
            *change = light_change(lights[face], neighbors[face], lights, params);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIGHTS: [[f32; 4]; 3] = [[0.5, 0.25, 0.0, 1.0], [0.75, 0.25, 0.0, 3.0], [0.5, 0.5, 0.125, 0.5]];

    fn change(across: [u32; 3], floor: f32, by_area: bool) -> [f32; 4] {
        let [a, b, c] = across;
        light_change(LIGHTS[0], Face { a, b, c }, &LIGHTS, Params { floor, by_area: u32::from(by_area) })
    }

    #[test]
    fn changes_are_shares_of_the_darker() {
        assert_eq!(change([NO_FACE, 1, NO_FACE], 0.125, false), [0.5, 0.0, 0.0, 0.5]);
        // Blue goes from nothing to 0.125, of a floor of 0.125.
        assert_eq!(change([2, 1, NO_FACE], 0.125, false), [0.5, 1.0, 1.0, 1.0]);
        assert_eq!(change([NO_FACE; 3], 0.125, false), [0.0; 4]);
    }

    #[test]
    fn areas_divide_where_asked_for() {
        assert_eq!(change([NO_FACE, 1, NO_FACE], 0.125, true), [0.125, 0.0, 0.0, 0.125]);
        assert_eq!(change([2, 1, NO_FACE], 0.125, true), [0.125, 1.0 / 1.5, 1.0 / 1.5, 1.0 / 1.5]);
    }

    #[test]
    fn darkness_beside_darkness_is_no_change() {
        let dark = [[0.0; 4]; 2];
        let params = Params { floor: 0.0, by_area: 1 };
        assert_eq!(light_change(dark[0], Face { a: 1, b: NO_FACE, c: NO_FACE }, &dark, params), [0.0; 4]);
    }
}
