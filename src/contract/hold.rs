//! Numbers of new wedges stay near those that are there.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use super::cost_lanes::Lanes;

/// How far past the numbers of corners new ones may be, of their range: `of` it times a factor, and more.
#[derive(Debug, Clone, Copy)]
pub struct Past<'a> {
    /// One of each number that is summed.
    pub of: &'a [Lanes],
    /// What those are multiplied by.
    pub times: f32,
    /// What is added for every number.
    pub plus: f32,
}

/// A number brought to a range, or no farther off it than `past` of its length.
#[inline(always)]
pub fn held(x: f32, [low, high]: [f32; 2], past: f32) -> f32 {
    // A range may be infinite.
    let past = if past > 0.0 { (high - low) * past } else { 0.0 };
    let (low, high) = (low - past, high + past);
    let (low, high) = (if low > f32::MIN { low } else { f32::MIN }, if high < f32::MAX { high } else { f32::MAX });
    let x = if x >= low { x } else { low };
    if x <= high { x } else { high }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_brought_to_its_range() {
        for (past, expected) in [(0.0, [1.0, 2.0, 3.0]), (0.5, [0.0, 2.0, 4.0])] {
            assert_eq!([-100.0, 2.0, 100.0].map(|x| held(x, [1.0, 3.0], past)), expected);
        }
        let wild = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
        assert_eq!(wild.map(|x| held(x, [f32::MIN, f32::MAX], 0.5)), [f32::MAX, f32::MIN, f32::MIN]);
        // A zero keeps its sign.
        assert!(held(-0.0, [0.0, 1.0], 0.0).is_sign_negative() && held(0.0, [0.0, 1.0], 0.0).is_sign_positive());
    }
}
