//! A line a device: time over size, both by powers of ten.

use plotters::backend::DrawingBackend;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::super::numbers::{millis, short};
use super::super::record::{Growth, Record};
use super::chart::{Chart, Line, around};
use super::{FONT, INK, color, title};

const WIDTH: u32 = 860;
/// Of the title, and of the part of each job.
const HEAD: u32 = 40;
const PART: u32 = 460;

type Fault = Box<dyn std::error::Error>;

/// Draws the jobs below each other.
pub fn draw(record: &Record) -> Result<String, Fault> {
    let jobs = record.cases.first().map_or(0, |case| case.jobs.len());
    let mut picture = String::new();
    {
        let size = (WIDTH, HEAD + PART * jobs as u32);
        let area = SVGBackend::with_string(&mut picture, size).into_drawing_area();
        area.fill(&WHITE)?;
        let (head, body) = area.split_vertically(HEAD);
        head.draw_text(&title(record), &(FONT, 20).into_font().color(&INK), (20, 12))?;
        for (job, part) in body.split_evenly((jobs.max(1), 1)).iter().enumerate().take(jobs) {
            lines(part, record, job)?;
        }
        area.present()?;
    }
    Ok(picture)
}

/// The lines of one job.
fn lines<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    record: &Record,
    job: usize,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let target = record.cases.first().map_or_else(String::new, |case| case.jobs[job].to_string());
    let line = |growth: &Growth| {
        let power = growth.exponent.map_or_else(String::new, |power| format!(" (power {power:.2})"));
        let label = format!("{}{power}", growth.device);
        (Line { label, points: record.times(&growth.device, job).collect() }, color(record, &growth.device))
    };
    let lines: Vec<_> = record.growth.iter().filter(|growth| growth.job == job).map(line).collect();
    let chart = Chart {
        caption: format!("to {target}: milliseconds over faces"),
        y: around(lines.iter().flat_map(|(line, _)| line.points.iter().map(|point| point.1)), 1.5).log_scale(),
        x_text: &|faces| short(faces.round() as usize),
        y_text: &millis,
        names: SeriesLabelPosition::UpperLeft,
    };
    chart.draw(area, &lines)
}
