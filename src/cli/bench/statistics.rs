//! Medians, spreads, and the power by which one number grows with another.

use serde::Serialize;

/// The seconds of several runs of one job.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timing {
    pub median: f64,
    pub min: f64,
    pub max: f64,
    /// In the order they were run.
    pub runs: Vec<f64>,
}

impl Timing {
    /// Sums up `runs`, of which there is one at least.
    pub fn of(runs: Vec<f64>) -> Self {
        let sorted = sorted(&runs);
        let (min, max) = (sorted.first().copied().unwrap_or(f64::NAN), sorted.last().copied().unwrap_or(f64::NAN));
        Self { median: median(&sorted), min, max, runs }
    }

    /// The run at the median, the faster of two that are beside it.
    pub fn median_run(&self) -> usize {
        let mut order: Vec<usize> = (0..self.runs.len()).collect();
        order.sort_by(|&a, &b| self.runs[a].total_cmp(&self.runs[b]));
        order.get((order.len().max(1) - 1) / 2).copied().unwrap_or(0)
    }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The middle of sorted values, or halfway between the two in the middle.
fn median(sorted: &[f64]) -> f64 {
    match (sorted.len(), sorted.len() / 2) {
        (0, _) => f64::NAN,
        (count, middle) if count % 2 == 1 => sorted[middle],
        (_, middle) => f64::midpoint(sorted[middle - 1], sorted[middle]),
    }
}

/// The power `p` of the law y = c · xᵖ that fits `points` best: the slope of least squares between the logarithms.
///
/// Nothing without two different positive `x`.
pub fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> =
        points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let mean_x = logs.iter().map(|(x, _)| x).sum::<f64>() / count;
    let mean_y = logs.iter().map(|(_, y)| y).sum::<f64>() / count;
    let spread: f64 = logs.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    let common: f64 = logs.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    (spread > 0.0).then(|| common / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        let odd = Timing::of(vec![3.0, 1.0, 5.0]);
        assert_eq!((odd.median, odd.min, odd.max, odd.median_run()), (3.0, 1.0, 5.0, 0));
        let even = Timing::of(vec![4.0, 1.0, 2.0, 9.0]);
        assert_eq!((even.median, even.min, even.max, even.median_run()), (3.0, 1.0, 9.0, 2));
        let one = Timing::of(vec![7.0]);
        assert_eq!((one.median, one.min, one.max, one.median_run()), (7.0, 7.0, 7.0, 0));
        assert_eq!(even.runs, [4.0, 1.0, 2.0, 9.0]);
    }

    #[test]
    fn the_power_of_a_power_law_is_found() {
        let law = |power: f64| [1e5, 3e5, 1e6, 3e6].map(|x: f64| (x, 2.5e-7 * x.powf(power)));
        for power in [0.5, 1.0, 1.07, 2.0] {
            let found = exponent(&law(power)).expect("four sizes");
            assert!((found - power).abs() < 1e-12, "{found} for {power}");
        }
        // Least squares: one point above and one below by as much leave the slope of the middle.
        let bent = [(1.0, 1.0), (10.0, 20.0), (100.0, 100.0)];
        assert!((exponent(&bent).expect("three sizes") - 1.0).abs() < 1e-12);
    }

    #[test]
    fn one_size_has_no_power() {
        assert_eq!(exponent(&[]), None);
        assert_eq!(exponent(&[(5.0, 1.0)]), None);
        assert_eq!(exponent(&[(5.0, 1.0), (5.0, 2.0), (0.0, 1.0)]), None);
    }
}
