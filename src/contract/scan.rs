//! Exclusive prefix sums of any length, in levels of one block each.

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::scan_add::ScanAdd;
use crate::kernel::scan_blocks::{SCAN_BLOCK, ScanBlocks};

/// The block sums of every level, for scans up to a length.
#[derive(Debug)]
pub struct Scan {
    levels: Vec<Buffer<u32>>,
}

impl Scan {
    /// For scans of at most `longest` values.
    pub fn new(queue: &Queue, longest: usize) -> Result<Self> {
        let mut levels = Vec::new();
        let mut len = longest;
        loop {
            len = len.div_ceil(SCAN_BLOCK as usize);
            levels.push(queue.buffer(len)?);
            if len <= 1 {
                return Ok(Self { levels });
            }
        }
    }

    /// Replaces every one of `count` values by the sum of those before it.
    pub fn run(&mut self, queue: &mut Queue, values: &mut Buffer<u32>, count: usize) -> Result<()> {
        scan(queue, values, count, &mut self.levels)
    }
}

fn scan(queue: &mut Queue, values: &mut Buffer<u32>, count: usize, levels: &mut [Buffer<u32>]) -> Result<()> {
    let Some((sums, levels)) = levels.split_first_mut() else { return Ok(()) };
    queue.run(ScanBlocks { values, count: count as u32, sums })?;
    let blocks = count.div_ceil(SCAN_BLOCK as usize);
    if blocks > 1 {
        scan(queue, sums, blocks, levels)?;
        queue.run(ScanAdd { sums, values, count: count as u32 })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Device;

    #[test]
    fn scans_every_length_like_a_running_sum() {
        let device = Device::cpu(2).expect("threads start");
        let mut queue = device.cpu_queue();
        for len in [1, 2, 1023, 1024, 1025, 5000, 1024 * 1024 + 3] {
            let values: Vec<u32> = (0..len as u32).map(|i| i % 7).collect();
            let mut expected = values.clone();
            let mut sum = 0;
            for value in &mut expected {
                sum += std::mem::replace(value, sum);
            }
            let mut buffer = queue.buffer_from(values).expect("host memory");
            Scan::new(&queue, len).and_then(|mut s| s.run(&mut queue, &mut buffer, len)).expect("runs on the host");
            assert!(buffer.host() == expected, "scan of {len}");
        }
    }
}
