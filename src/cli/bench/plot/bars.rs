//! A bar a device and job, with its time beside it.

use plotters::backend::DrawingBackend;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::numbers::{grouped, millis};
use super::super::record::{JobRecord, Record};
use super::{FAINT, FONT, INK, color, title};

const WIDTH: i32 = 860;
const MARGIN: i32 = 20;
/// Left ends of the bars, and how long the longest is; the rest is for labels.
const BARS_AT: i32 = 170;
const LONGEST: i32 = 520;
const BAR: i32 = 16;
const STEP: i32 = 24;
const HEAD: i32 = 40;
/// From the end of one job to the head of the next.
const GAP: i32 = 18;

type Fault = Box<dyn std::error::Error>;

/// Draws all jobs below each other, each on its own scale from zero.
pub fn draw(record: &Record) -> Result<String, Fault> {
    let jobs: Vec<(&str, usize, &JobRecord)> = (record.cases.iter())
        .flat_map(|case| case.jobs.iter().map(|job| (case.input.as_str(), case.faces, job)))
        .collect();
    let height = HEAD + jobs.iter().map(|(.., job)| HEAD + GAP + STEP * job.results.len() as i32).sum::<i32>() + HEAD;
    let mut picture = String::new();
    {
        let area = SVGBackend::with_string(&mut picture, (WIDTH as u32, height as u32)).into_drawing_area();
        area.fill(&WHITE)?;
        let text = |size: i32, ink: RGBColor, h, v| (FONT, size).into_font().color(&ink).pos(Pos::new(h, v));
        area.draw_text(&title(record), &text(20, INK, HPos::Left, VPos::Center), (MARGIN, HEAD / 2))?;
        let mut y = HEAD;
        for (input, faces, job) in jobs {
            let head = format!("{input}: {} faces to {job}, milliseconds", grouped(faces));
            area.draw_text(&head, &text(17, INK, HPos::Left, VPos::Center), (MARGIN, y + HEAD / 2))?;
            y += HEAD;
            bars(&area, record, job, y)?;
            y += STEP * job.results.len() as i32 + GAP;
        }
        let foot = "median; the thin line is from the least to the greatest";
        area.draw_text(foot, &text(14, INK, HPos::Left, VPos::Center), (MARGIN, height - HEAD / 2))?;
        area.present()?;
    }
    Ok(picture)
}

/// The bars of one job, the first at `y`.
fn bars<B: DrawingBackend>(
    area: &DrawingArea<B, plotters::coord::Shift>,
    record: &Record,
    job: &JobRecord,
    mut y: i32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let longest = job.results.iter().map(|figures| figures.seconds.max).fold(f64::MIN_POSITIVE, f64::max);
    let at = |secs: f64| BARS_AT + (secs / longest * f64::from(LONGEST)).round() as i32;
    let text = |h| (FONT, 15).into_font().color(&INK).pos(Pos::new(h, VPos::Center));
    let end = y + STEP * job.results.len() as i32;
    area.draw(&PathElement::new(vec![(BARS_AT, y), (BARS_AT, end)], FAINT))?;
    for figures in &job.results {
        let (seconds, middle) = (&figures.seconds, y + STEP / 2);
        let corners = [(BARS_AT, middle - BAR / 2), (at(seconds.median), middle + BAR / 2)];
        area.draw(&Rectangle::new(corners, color(record, &figures.device).filled()))?;
        area.draw(&PathElement::new(vec![(at(seconds.min), middle), (at(seconds.max), middle)], INK))?;
        area.draw_text(&figures.device, &text(HPos::Right), (BARS_AT - 8, middle))?;
        area.draw_text(&millis(seconds.median), &text(HPos::Left), (at(seconds.max) + 8, middle))?;
        y += STEP;
    }
    Ok(())
}
