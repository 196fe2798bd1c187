//! glTF in and out: what is read, what survives, what is refused.

#[path = "../support/models.rs"]
#[expect(dead_code, clippy::print_stdout, reason = "shared by test crates; a skip must be seen")]
mod models;

mod files;
mod hostile;
mod reading;
mod scene;
mod survival;
