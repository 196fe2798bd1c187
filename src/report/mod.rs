//! What a person looks at: heat maps and pictures of meshes.
//!
//! One software rasterizer for all machines, instead of the GPU where there is one: a picture then has the same bytes
//! everywhere, needs no adapter, and can be compared by a test. It is fast enough, too: three panels, two of them of a
//! million faces, take 700 ms of CPU time, PNG included, about 400 ms on 2 cores. For the sake of the bytes nothing here
//! calls a transcendental function, whose last bits differ between systems: lights, lens and color scale are numbers, and
//! colors are blended in squares, which is close to sRGB's curve.
//!
//! Reading order: [`picture()`], `camera`, `raster`, `shade`.

mod camera;
mod canvas;
mod font;
pub mod heat;
pub mod picture;
mod raster;
mod shade;

pub use heat::heatmap;
pub use picture::{PictureOptions, Up, picture};
