//! A line a device: time over size, both by powers of ten.

use plotters::backend::DrawingBackend;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::super::numbers::{millis, short};
use super::super::record::Record;
use super::{FAINT, FONT, INK, color, title};

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
    let points: Vec<(f64, f64)> =
        record.growth.iter().filter(|growth| growth.job == job).flat_map(|g| record.times(&g.device, job)).collect();
    if points.is_empty() {
        return Ok(());
    }
    let around = |values: &mut dyn Iterator<Item = f64>, room: f64| {
        let (least, most) = values.fold((f64::MAX, f64::MIN), |(least, most), x| (least.min(x), most.max(x)));
        least / room..most * room
    };
    let (x, y) = (around(&mut points.iter().map(|p| p.0), 1.15), around(&mut points.iter().map(|p| p.1), 1.5));
    let target = record.cases.first().map_or_else(String::new, |case| case.jobs[job].to_string());
    let mut chart = ChartBuilder::on(area)
        .caption(format!("to {target}: milliseconds over faces"), (FONT, 17).into_font().color(&INK))
        .margin(16)
        .x_label_area_size(34)
        .y_label_area_size(64)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    let text = (FONT, 14).into_font().color(&INK);
    chart
        .configure_mesh()
        .x_max_light_lines(1)
        .label_style(text.clone())
        .axis_style(INK)
        .bold_line_style(FAINT.mix(0.6))
        .light_line_style(FAINT.mix(0.25))
        .x_label_formatter(&|faces| short(faces.round() as usize))
        .y_label_formatter(&|secs| millis(*secs))
        .draw()?;
    for growth in record.growth.iter().filter(|growth| growth.job == job) {
        let color = color(record, &growth.device);
        let series: Vec<(f64, f64)> = record.times(&growth.device, job).collect();
        let power = growth.exponent.map_or_else(String::new, |power| format!(" (power {power:.2})"));
        chart
            .draw_series(LineSeries::new(series.iter().copied(), color.stroke_width(2)).point_size(4))?
            .label(format!("{}{power}", growth.device))
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 22, y)], color.stroke_width(3)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .legend_area_size(30)
        .margin(10)
        .border_style(FAINT)
        .background_style(WHITE.mix(0.9))
        .label_font(text)
        .draw()
}
