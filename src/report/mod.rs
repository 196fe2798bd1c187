//! What a person looks at: heat maps and pictures of meshes, and how far pictures differ.
//!
//! One software rasterizer for all machines, instead of the GPU where there is one: a picture then has the same bytes
//! everywhere, needs no adapter, and can be compared by a test. It is fast enough, too: three panels, two of them of a
//! million faces, take 700 ms of CPU time, PNG included, about 400 ms on 2 cores. For the sake of the bytes nothing here
//! calls a transcendental function, whose last bits differ between systems: lights, lens and color scale are numbers, and
//! colors are blended in squares, which is close to sRGB's curve.
//!
//! Reading order: [`picture()`], `camera`, `raster`, `shade`, `skin`; and [`image_difference()`].

mod camera;
mod canvas;
pub mod difference;
mod font;
pub mod heat;
pub mod picture;
mod raster;
mod shade;
mod skin;

pub use difference::{ImageDifference, ViewDifference, image_difference};
pub use heat::heatmap;
pub use picture::{PictureOptions, Up, picture};
pub use skin::Model;
