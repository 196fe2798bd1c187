//! The kernels: one file a stage, the CPU twin of `shaders/<same stem>.wgsl`.
//!
//! A twin's body is a pure function with the shader's name, local names and statements; `run_cpu` only indexes, loads,
//! calls and stores, in parallel where the outputs can be split. Single-precision arithmetic goes through
//! [`crate::math::exact`], so that twin and shader agree bit for bit.

/// Declares a kernel's uniform block `Params` and the table of its fields.
macro_rules! params {
    ($($name:ident: $type:ident),+ $(,)?) => {
        /// The uniform block.
        #[repr(C)]
        #[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct Params {
            $($name: $type),+
        }

        const FIELDS: &[(&str, &str)] = &[$((stringify!($name), stringify!($type))),+];
    };
}

pub mod compact_faces;
pub mod compact_quadrics;
pub mod compact_rings;
pub mod compact_vertices;
pub mod contract_faces;
pub mod contract_quadrics;
pub mod contract_vertices;
pub mod cost_histogram;
pub mod count_candidates;
pub mod gather_candidates;
pub mod live_vertices;
pub mod pair_quadric;
pub mod pairs;
pub mod plane_costs;
pub mod plane_quadric;
pub mod plane_sums;
pub mod rows;
pub mod scan_add;
pub mod scan_blocks;
mod split;
pub mod stars;
pub mod volume_costs;
pub mod volume_sums;
