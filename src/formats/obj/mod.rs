//! OBJ, Wavefront's text format: `v`, `vt`, `vn` and `f` lines, and what stands between them: `usemtl`, `g`, `o`, `mtllib`;
//! lines and points are told as lost, everything else is skipped.
//!
//! [`plain`] reads what nearly all files hold, by all threads. The others are parsed by `tobj`: [`normalize`] feeds it a
//! plainer text in which the things it cannot do are already done: continued lines, vertices without a color among colored
//! ones, corners without a normal among others, indices out of range. It also keeps the texture coordinates, which `tobj`
//! need not see. Groups and materials are taken out on the way, so that vertices keep their number in the file and no
//! material border becomes an open border.
//!
//! A vertex whose corners have different normals is repeated at the end, once for each further one; it is written as one `v`
//! line again.

mod groups;
mod library;
mod looks;
mod normalize;
mod plain;
mod read;
mod shading;
mod words;
mod write;

pub(super) use groups::{in_object, object_of};
pub use library::Libraries;
pub(super) use library::{described, plain_name, write_library};
pub(super) use looks::looks;
pub(super) use read::read;
pub(super) use write::{write, write_objects};

const FORMAT: &str = "OBJ";
