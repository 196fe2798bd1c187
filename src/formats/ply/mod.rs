//! PLY: a text header that names elements and their properties, then text or binary rows.
//!
//! | element | properties read | types |
//! |---------|-----------------|-------|
//! | vertex | x y z | any |
//! | | nx ny nz | any |
//! | | red green blue \[alpha\], also with `diffuse_` before | float in `[0, 1]`, ushort, or byte |
//! | | s t, u v, or texture_u texture_v | float |
//! | | whatever else is no list: a channel by its name | any |
//! | face | list vertex_indices or vertex_index | any whole number |
//! | | list texcoord, two numbers a corner or none | float |
//! | | red green blue \[alpha\], as at vertices | float in `[0, 1]`, ushort, or byte |
//!
//! All else is skipped, and told where a scene is written again. Rows of a fixed size (every common file: scalar vertices, faces of three corners) are decoded
//! by all threads straight from the mapped file; lists of varying length are walked row by row.
//!
//! Written positions are `float`, or `double` when rounding to f32 would move a vertex by more than
//! 1e-6 of the bounding box's diagonal; text keeps all digits of f64 either way, and they are read whatever the declared
//! type. Written colors are bytes, with alpha where any vertex, or face, is not opaque. Texture coordinates are written as the list
//! `texcoord` of the faces, which wins over those of vertices on reading.

mod ascii;
mod binary;
mod color;
mod face;
mod fixed;
mod header;
mod looks;
mod notes;
mod property;
mod scalar;
mod stream;
mod vertex;
mod write;

pub(super) use looks::look;
pub use notes::Notes;
pub(super) use property::read_property;
pub(crate) use stream::Tables;
pub(super) use write::write;

use self::header::{Body, Header};
use crate::error::Result;
use crate::mesh::Mesh;

const FORMAT: &str = "PLY";

/// Reads any of the three encodings; also returns what the header says beside the mesh.
pub(super) fn read(bytes: &[u8]) -> Result<(Mesh, Notes)> {
    let header = Header::parse(bytes)?;
    let mesh = match header.body {
        Body::Text => ascii::read(&header, bytes),
        Body::Binary(order) => binary::read(&header, order, bytes),
    }?;
    Ok((mesh, Notes::of(header)))
}
