//! The record as a picture: bars by device, or lines over the size; and curves of the papers.

mod bars;
mod chart;
mod curves;
mod lines;

use anyhow::anyhow;
use plotters::prelude::*;

use super::record::Record;
pub use chart::Line;

/// Colors that stay apart for every kind of sight [OI08], one a device, again from the first when they run out.
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(230, 159, 0),
    RGBColor(204, 121, 167),
    RGBColor(110, 110, 110),
    RGBColor(0, 0, 0),
];
const INK: RGBColor = RGBColor(40, 40, 40);
const FAINT: RGBColor = RGBColor(190, 190, 190);
/// The viewer's own.
const FONT: &str = "sans-serif";

/// The picture as SVG text.
///
/// # Errors
/// What the drawing library has to say; it has no reason to refuse.
pub fn svg(record: &Record) -> anyhow::Result<String> {
    let drawn = if record.scales { lines::draw(record) } else { bars::draw(record) };
    drawn.map_err(|error| anyhow!("cannot draw: {error}"))
}

/// Faces of superfaces over either tolerance, as SVG text.
///
/// # Errors
/// As [`svg`].
pub fn curves(lines: &[Vec<Line>; 2]) -> anyhow::Result<String> {
    curves::draw(lines).map_err(|error| anyhow!("cannot draw: {error}"))
}

/// The color of a device: by its place among all, so that it is the same in every part.
fn color(record: &Record, device: &str) -> RGBColor {
    let place = record.devices.iter().position(|entrant| entrant.name == device).unwrap_or(0);
    COLORS[place % COLORS.len()]
}

/// What stands at the top.
fn title(record: &Record) -> String {
    format!("coarsen {}: {}, {} cores", record.version, record.machine.cpu, record.machine.cores)
}
