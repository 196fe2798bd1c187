//! How much memory a run takes, and how large its parts may be.

use crate::error::{Error, Result};
use crate::simplify::Budget;

/// Bytes a face that a run needs at its peak on the CPU, reading and writing included: 205 to 285 were measured on a
/// million faces, by format, with quadrics, which only the metric `plane` has by now.
const CPU_BYTES_PER_FACE: u64 = 288;
/// The same with an adapter, whose buffers may lie in the same memory: 470 were measured on software Vulkan, likewise. Parts count with
/// it on every device, for what a part is decides the result.
const GPU_BYTES_PER_FACE: u64 = 512;
/// Bytes a face of a level that waits for the others: its corners, and half a vertex with normal, color and origin.
const LEVEL_BYTES_PER_FACE: u64 = 40;
/// Bytes of the program itself, its threads, a driver, and buffers of fixed size.
pub const BYTES_ALWAYS: u64 = 64 << 20;
/// Rows on their way from and to files.
const BUFFER_BYTES: u64 = 32 << 20;
/// Bytes a vertex of the input while it is cut: its cell, and the marks of those that are frozen.
const CUTTING_BYTES_PER_VERTEX: u64 = 3;
/// Bytes a vertex of the input while parts are reduced: marks, and the new numbers of the frozen.
const REDUCING_BYTES_PER_VERTEX: u64 = 1;
/// The fewest faces that a part may be limited to.
const LEAST_PART: u64 = 1 << 14;
/// How many times the target's faces must fit the memory, so that the last pass has some to choose from.
const LEAST_CHOICE: f64 = 1.6;
/// How many times the target's faces parts are reduced to together, where they fit the memory: from 8 on the last pass decides
/// what is lost.
const CHOICE: f64 = 8.0;
/// The share of the faces that fit the memory which is aimed at.
const AIM: f64 = 0.8;

/// The bytes that a mesh of `faces` faces is estimated to need while it is read, simplified in one piece and written, beside
/// [`BYTES_ALWAYS`].
pub fn bytes_needed(faces: u64, on_gpu: bool) -> u64 {
    faces.saturating_mul(if on_gpu { GPU_BYTES_PER_FACE } else { CPU_BYTES_PER_FACE })
}

/// The bytes that levels of a mesh of `faces` faces take until the coarsest is there, beside [`bytes_needed`], where that is
/// not counted. One with only an error limit may keep them all.
pub fn bytes_of_levels(faces: u64, budgets: &[Budget]) -> u64 {
    let kept = |budget: &Budget| match budget.target_faces(faces as usize) {
        Ok(target) if budget.counts_faces() => (target as u64).min(faces),
        _ => faces,
    };
    let all = || budgets.iter().map(kept);
    (all().sum::<u64>() - all().min().unwrap_or(0)).saturating_mul(LEVEL_BYTES_PER_FACE)
}

/// The bytes that a run of `faces` faces in one piece is estimated to need, with the program itself.
pub fn estimate(faces: usize, on_gpu: bool) -> u64 {
    BYTES_ALWAYS + bytes_needed(faces as u64, on_gpu)
}

/// Bytes as a limit is given that has room for them: `105MiB`.
pub fn mebibytes(bytes: u64) -> String {
    format!("{}MiB", bytes.div_ceil(1 << 20))
}

/// What fits a limit.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// Faces of a part at most.
    pub part_faces: usize,
    /// Faces of the last pass at most.
    pub whole_faces: usize,
}

impl Room {
    /// What fits `limit` bytes when a mesh of so many vertices is reduced to `target` faces.
    ///
    /// # Errors
    /// [`Error::Limit`] with the least limit that would do.
    pub fn new(limit: u64, vertices: usize, target: usize) -> Result<Self> {
        let vertices = vertices as u64;
        let always = BYTES_ALWAYS + BUFFER_BYTES;
        let reducing = always + vertices * REDUCING_BYTES_PER_VERTEX;
        let of_target = BYTES_ALWAYS + (target as f64 * LEAST_CHOICE) as u64 * GPU_BYTES_PER_FACE;
        let of_parts = reducing + LEAST_PART * GPU_BYTES_PER_FACE;
        let least = of_target.max(of_parts).max(always + vertices * CUTTING_BYTES_PER_VERTEX);
        if limit < least {
            return Err(Error::Limit(format!(
                "the memory limit is {}MiB, and {vertices} vertices on their way to {target} faces need at least {}, in parts",
                limit >> 20,
                mebibytes(least)
            )));
        }
        let faces = |bytes: u64| (bytes / GPU_BYTES_PER_FACE).min(u64::from(u32::MAX / 4)) as usize;
        Ok(Self { part_faces: faces(limit - reducing), whole_faces: faces(limit - BYTES_ALWAYS) })
    }

    /// The faces that parts of a mesh of `faces` are reduced to together, on the way to `target`.
    pub fn aim(&self, faces: usize, target: usize) -> usize {
        let most = AIM * self.whole_faces.min(faces) as f64;
        (target as f64 * CHOICE).min(most) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_limit_is_enough() {
        for (vertices, target) in [(1000, 500), (25_000_000, 500_000), (4_000_000, 2_000_000)] {
            let error = Room::new(1 << 20, vertices, target).expect_err("a megabyte").to_string();
            let least = error.split("at least ").nth(1).and_then(|rest| rest.split(',').next()).expect("a number");
            let least: u64 = least.strip_suffix("MiB").and_then(|least| least.parse().ok()).expect("a size");
            let room = Room::new(least << 20, vertices, target).expect("enough");
            assert!(room.part_faces as u64 >= LEAST_PART && room.whole_faces as f64 >= 1.5 * target as f64, "{room:?}");
            assert!(Room::new((least - 1) << 20, vertices, target).is_err());
        }
    }

    #[test]
    fn levels_that_wait_are_counted() {
        let bytes = |budgets: &[Budget]| bytes_of_levels(1000, budgets);
        assert_eq!((bytes(&[]), bytes(&[Budget::keep(0.5)])), (0, 0));
        assert_eq!(bytes(&[Budget::keep(0.5), Budget::faces(100), Budget::faces(10)]), 600 * LEVEL_BYTES_PER_FACE);
        assert_eq!(bytes(&[Budget::error(0.1), Budget::faces(9999), Budget::keep(0.1)]), 2000 * LEVEL_BYTES_PER_FACE);
    }

    #[test]
    fn parts_leave_the_last_pass_a_choice() {
        let room = Room::new(3 << 30, 25_000_000, 500_000).expect("enough");
        assert_eq!(room.aim(50_000_000, 500_000), 4_000_000);
        assert!(room.aim(50_000_000, 3_000_000) < room.whole_faces);
    }
}
