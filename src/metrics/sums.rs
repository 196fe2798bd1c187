//! What a [`Spread`] is made of.

use super::Spread;

/// Adds deviations up. Merged in a fixed order, the result is the same with any number of threads.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sums {
    count: u64,
    sum: f64,
    sum_of_squares: f64,
    max: f64,
}

impl Sums {
    /// One more sample.
    pub fn add(&mut self, deviation: f64) {
        self.count += 1;
        self.sum += deviation;
        self.sum_of_squares += deviation * deviation;
        self.max = self.max.max(deviation);
    }

    /// The samples of `other` after the own.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.sum_of_squares += other.sum_of_squares;
        self.max = self.max.max(other.max);
    }

    /// The spread of all samples, or `None` of none.
    pub fn finish(&self) -> Option<Spread> {
        let count = self.count as f64;
        let spread = || Spread { max: self.max, mean: self.sum / count, rms: (self.sum_of_squares / count).sqrt() };
        (self.count > 0).then(spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merged_sums_are_the_sums_of_all() {
        let of = |values: &[f64]| {
            let mut sums = Sums::default();
            values.iter().for_each(|&value| sums.add(value));
            sums
        };
        let mut merged = of(&[1.0, 7.0]);
        merged.merge(&of(&[5.0, 5.0]));
        assert_eq!(merged, of(&[1.0, 7.0, 5.0, 5.0]));
        assert_eq!(merged.finish(), Some(Spread { max: 7.0, mean: 4.5, rms: 5.0 }));
        assert_eq!(of(&[]).finish(), None);
    }
}
