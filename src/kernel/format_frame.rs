//! The coordinates that stored quadrics are about. In WGSL: `shaders/shared/format_frame.wgsl`.

use crate::backend::params;
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, flush3, scale3, sub3};

params! {
    /// Where these coordinates have their origin, in those of the rows, and how long they say that a row's unit is.
    pub struct FormatFrame {
        /// The origin along the first axis.
        pub origin_x: f32,
        /// The origin along the second axis.
        pub origin_y: f32,
        /// The origin along the third axis.
        pub origin_z: f32,
        /// What one is in the rows is this here.
        pub unit: f32,
    }
}

/// A position of the rows in these coordinates.
#[inline(always)]
pub fn in_format(p: Vec3, params: FormatFrame) -> Vec3 {
    let origin = Vec3::new(params.origin_x, params.origin_y, params.origin_z);
    flush3(scale3(sub3(p, origin), params.unit), LEAST_FACTOR)
}
