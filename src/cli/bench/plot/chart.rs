//! Lines over powers of ten.

use std::ops::Range;

use plotters::backend::DrawingBackend;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::{FAINT, FONT, INK};

/// A line of a chart.
#[derive(Clone)]
pub struct Line {
    pub label: String,
    pub points: Vec<(f64, f64)>,
}

/// A chart, the axis along its bottom by powers of ten.
pub struct Chart<'a, Y> {
    pub caption: String,
    /// The axis up the side.
    pub y: Y,
    /// How numbers along the bottom and up the side are written.
    pub x_text: &'a dyn Fn(f64) -> String,
    pub y_text: &'a dyn Fn(f64) -> String,
    /// Where the names of the lines stand.
    pub names: SeriesLabelPosition,
}

/// From the least to the greatest of `values`, and so many times more on either side.
pub fn around(values: impl Iterator<Item = f64>, room: f64) -> Range<f64> {
    let (least, most) = values.fold((f64::MAX, f64::MIN), |(least, most), x| (least.min(x), most.max(x)));
    least / room..most * room
}

impl<Y: AsRangedCoord<Value = f64>> Chart<'_, Y>
where
    Y::CoordDescType: ValueFormatter<f64>,
{
    /// Draws lines in their colors; nothing of none.
    pub fn draw<B: DrawingBackend>(
        self,
        area: &DrawingArea<B, Shift>,
        lines: &[(Line, RGBColor)],
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let mut xs = lines.iter().flat_map(|(line, _)| line.points.iter().map(|point| point.0)).peekable();
        if xs.peek().is_none() {
            return Ok(());
        }
        let x = around(xs, 1.15).log_scale();
        let mut chart = ChartBuilder::on(area)
            .caption(self.caption, (FONT, 17).into_font().color(&INK))
            .margin(16)
            .x_label_area_size(34)
            .y_label_area_size(64)
            .build_cartesian_2d(x, self.y)?;
        let text = (FONT, 14).into_font().color(&INK);
        chart
            .configure_mesh()
            .x_max_light_lines(1)
            .label_style(text.clone())
            .axis_style(INK)
            .bold_line_style(FAINT.mix(0.6))
            .light_line_style(FAINT.mix(0.25))
            .x_label_formatter(&|x| (self.x_text)(*x))
            .y_label_formatter(&|y| (self.y_text)(*y))
            .draw()?;
        for &(Line { ref label, ref points }, color) in lines {
            chart
                .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)).point_size(4))?
                .label(label.as_str())
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 22, y)], color.stroke_width(3)));
        }
        chart
            .configure_series_labels()
            .position(self.names)
            .legend_area_size(30)
            .margin(10)
            .border_style(FAINT)
            .background_style(WHITE.mix(0.9))
            .label_font(text)
            .draw()
    }
}
