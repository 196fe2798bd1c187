//! What several integration tests share: slow, obvious, independent oracles. None of it calls the library's algorithms.
#![allow(dead_code, reason = "every test binary uses its own part")]
#![allow(clippy::print_stdout, reason = "tests print what a reader of a failure needs")]

pub mod average;
pub mod cells;
pub mod deviation;
pub mod engine;
pub mod heap;
pub mod independent;
pub mod models;
pub mod quadric;
pub mod shapes;
pub mod texture;
