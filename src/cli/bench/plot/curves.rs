//! A line a scene: the share of its faces that superfaces keep, over the step of light and over the color along borders.

use plotters::prelude::*;

use super::super::numbers::{percent, three_digits};
use super::COLORS;
use super::chart::{Chart, Line};

const WIDTH: u32 = 860;
/// Of each chart.
const PART: u32 = 420;

/// Draws both charts below each other.
pub fn draw(lines: &[Vec<Line>; 2]) -> Result<String, Box<dyn std::error::Error>> {
    let mut picture = String::new();
    {
        let area = SVGBackend::with_string(&mut picture, (WIDTH, 2 * PART)).into_drawing_area();
        area.fill(&WHITE)?;
        let captions = [
            "superfaces: faces kept over ε, the step of light",
            "superfaces: faces kept over δ, the color along borders",
        ];
        for ((part, lines), caption) in area.split_evenly((2, 1)).iter().zip(lines).zip(captions) {
            let most = lines.iter().flat_map(|line| &line.points).map(|point| point.1).fold(0.0, f64::max);
            let chart = Chart {
                caption: caption.into(),
                y: 0.0..1.1 * most,
                x_text: &three_digits,
                y_text: &|share| percent((share * 1e3).round() / 1e3),
                names: SeriesLabelPosition::UpperRight,
            };
            let lines: Vec<_> = lines.iter().cloned().zip(COLORS.into_iter().cycle()).collect();
            chart.draw(part, &lines)?;
        }
        area.present()?;
    }
    Ok(picture)
}
