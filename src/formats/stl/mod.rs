//! STL: triangles with their own three vertices each. Equal positions are joined on reading.
//!
//! | bytes | binary STL, little endian |
//! |-------|----------------------------|
//! | 80 | free header, which may also start with `solid` |
//! | 4 | facet count |
//! | 50 a facet | normal and three vertices, 12 × f32; 2 free bytes |
//!
//! Which form a file has is decided by its length, not by its first word. The stored facet normals are ignored, and so are
//! the free bytes of facets, of which a warning tells.

mod facets;
mod join;
mod read;
mod write;

pub(crate) use facets::Facets;
pub(super) use read::{has_more, is_binary, read};
pub(super) use write::write;

const FORMAT: &str = "STL";
/// The free header and the facet count.
const HEADER_BYTES: usize = 84;
const FACET_BYTES: usize = 50;
