//! The picture of a comparison: before, after, and where they deviate.

use super::camera::{Camera, Frame, aspect};
use super::canvas::{Canvas, Color};
use super::shade::{Paint, SAMPLES, render};
use super::skin::Model;
use super::{font, heat};
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::mesh::Mesh;

/// The axis that points up in a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// As many scans and models for screens have it.
    Y,
    /// As drawings, terrains and the built-in samples have it.
    #[default]
    Z,
}

/// How to draw a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureOptions {
    /// In pixels; the height follows from the mesh.
    pub width: usize,
    /// Rows: 1 from the front, 2 from the back as well.
    pub views: usize,
    /// What is up.
    pub up: Up,
    /// The deviation that has the last color, in model units; without one, what 99 in 100 vertices do not pass.
    pub limit: Option<f64>,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self { width: 1800, views: 1, up: Up::Z, limit: None }
    }
}

/// The widths that can be drawn, in pixels.
const WIDTHS: std::ops::RangeInclusive<usize> = 240..=9600;
const BACKGROUND: Color = [0.955, 0.955, 0.962];
const INK: Color = [0.20, 0.20, 0.22];
/// Height over width that a panel has at least and at most.
const ASPECTS: (f64, f64) = (0.5, 1.5);
/// Where the eye stands in each row, right, before and above the mesh.
const VIEWS: [DVec3; 2] = [DVec3::new(0.45, 1.0, 0.28), DVec3::new(-0.6, -1.0, 0.4)];

/// How much higher it stands for a mesh without height, which shows little from the side.
const LIFT: f64 = 0.5;

/// Draws `before`, `after`, and `before` with the color of each vertex by its distance, all from the same eye, as PNG.
///
/// A row of three panels for each view; the faces are counted below, and a bar tells the colors in percent of the
/// diagonal of `before`. A model with colors or textures is drawn with them, another as clay with lines around its faces.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh; [`Error::Parameter`] for distances that [`heat::heatmap`] refuses, a width
/// outside 240 to 9600, or another number of views than 1 or 2.
pub fn picture<'a>(
    before: impl Into<Model<'a>>,
    after: impl Into<Model<'a>>,
    distances: &[f64],
    options: &PictureOptions,
) -> Result<Vec<u8>> {
    let models = [before.into(), after.into()];
    let [before, after] = models.map(|model| model.mesh);
    before.check()?;
    after.check()?;
    let limit = heat::checked_limit(before, distances, options.limit)?;
    if !WIDTHS.contains(&options.width) {
        let (least, most) = (WIDTHS.start(), WIDTHS.end());
        return Err(Error::Parameter(format!("a picture is {least} to {most} pixels wide, not {}", options.width)));
    }
    if !(1..=VIEWS.len()).contains(&options.views) {
        return Err(Error::Parameter(format!("a picture has 1 or 2 views, not {}", options.views)));
    }
    let lift = DVec3::Z * LIFT * flatness(before, options.up);
    let views: Vec<DVec3> = VIEWS.iter().take(options.views).map(|&view| oriented(view + lift, options.up)).collect();
    let layout = Layout::new(before, &views, options);
    let mut canvas = Canvas::new(options.width, layout.height(views.len()), BACKGROUND);
    let painted = |model: Model<'a>| (model, if model.is_colored() { Paint::Colors } else { Paint::Clay });
    let [left, right] = models.map(painted);
    let panels = [left, right, (before.into(), Paint::Heat { distances, limit })];
    for (row, &view) in views.iter().enumerate() {
        let camera = Camera::new(before, view, oriented(DVec3::Z, options.up), &layout.frame());
        for (column, &(model, paint)) in panels.iter().enumerate() {
            let drawn = render(model, paint, &camera, &layout.frame(), BACKGROUND);
            canvas.put(column * layout.panel, row * layout.row, layout.panel, &drawn.pixels);
        }
    }
    layout.caption(&mut canvas, 0, views.len(), &faces(before));
    layout.caption(&mut canvas, 1, views.len(), &faces(after));
    let diagonal = before.diagonal();
    let most = percent(if diagonal > 0.0 { limit / diagonal } else { 0.0 });
    let sign = if distances.iter().any(|&distance| distance > limit) { "> " } else { "" };
    layout.legend(&mut canvas, views.len(), &format!("{sign}{most} of diagonal"));
    canvas.png()
}

/// A direction given right, before and above, in the axes of the model.
fn oriented(DVec3 { x, y, z }: DVec3, up: Up) -> DVec3 {
    match up {
        Up::Y => DVec3::new(x, z, y),
        Up::Z => DVec3::new(x, -y, z),
    }
}

/// 1 for a mesh without height, 0 for one at least as high as it is wide.
fn flatness(mesh: &Mesh, up: Up) -> f64 {
    let (low, high) = mesh.bounds();
    let size = high - low;
    let (wide, height) = match up {
        Up::Y => (size.x.max(size.z), size.y),
        Up::Z => (size.x.max(size.y), size.z),
    };
    if wide > 0.0 && wide.is_finite() { (1.0 - height / wide).max(0.0) } else { 0.0 }
}

/// Where things stand, in pixels.
struct Layout {
    /// A panel's width and height.
    panel: usize,
    row: usize,
    /// The height of digits.
    text: f32,
}

impl Layout {
    fn new(mesh: &Mesh, views: &[DVec3], options: &PictureOptions) -> Self {
        let panel = options.width / 3;
        let tallest = views.iter().map(|&view| aspect(mesh, view, oriented(DVec3::Z, options.up))).fold(0.0, f64::max);
        let row = panel as f64 * tallest.clamp(ASPECTS.0, ASPECTS.1);
        Self { panel, row: row.round() as usize, text: options.width as f32 / 90.0 }
    }

    fn frame(&self) -> Frame {
        Frame { width: self.panel * SAMPLES, height: self.row * SAMPLES, margin: self.panel * SAMPLES / 14 }
    }

    fn height(&self, rows: usize) -> usize {
        rows * self.row + (3.2 * self.text) as usize
    }

    /// The base line of what is written below the rows.
    fn base(&self, rows: usize) -> f32 {
        rows as f32 * self.row as f32 + 1.5 * self.text
    }

    /// Writes in the middle below a column.
    fn caption(&self, canvas: &mut Canvas, column: usize, rows: usize, text: &str) {
        let middle = (column as f32 + 0.5) * self.panel as f32;
        let left = middle - font::width(text, self.text) / 2.0;
        font::write(canvas, text, [left, self.base(rows)], self.text, INK);
    }

    /// Draws the color scale below the last column, `0` before it, what its end means behind it.
    fn legend(&self, canvas: &mut Canvas, rows: usize, to: &str) {
        let from = "0";
        let [from_width, to_width] = [from, to].map(|text| font::width(text, self.text));
        let (gap, bar) = (0.7 * self.text, self.panel as f32 * 0.28);
        let left = 2.5 * self.panel as f32 - (from_width + gap + bar + gap + to_width) / 2.0;
        let base = self.base(rows);
        font::write(canvas, from, [left, base], self.text, INK);
        let start = (left + from_width + gap).round() as i64;
        let length = bar.round() as i64;
        for (x, y) in (0..length).flat_map(|x| (0..self.text.round() as i64).map(move |y| (x, y))) {
            let color = heat::color((x as f64 + 0.5) / length as f64);
            canvas.blend(start + x, base.round() as i64 - 1 - y, color, 1.0);
        }
        font::write(canvas, to, [start as f32 + bar + gap, base], self.text, INK);
    }
}

/// `868,000 faces`.
fn faces(mesh: &Mesh) -> String {
    let digits = mesh.faces.len().to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text + if mesh.faces.len() == 1 { " face" } else { " faces" }
}

/// A share in percent with three digits that count: `0.0123 %`.
fn percent(share: f64) -> String {
    let percent = share * 100.0;
    if percent == 0.0 {
        return "0 %".into();
    }
    let mut decimals = 2;
    let mut scaled = percent;
    while scaled < 1.0 && decimals < 12 {
        scaled *= 10.0;
        decimals += 1;
    }
    format!("{percent:.decimals$} %")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{icosphere, plane, torus};

    fn small(views: usize) -> PictureOptions {
        PictureOptions { width: 300, views, ..PictureOptions::default() }
    }

    fn size(png: &[u8]) -> (u32, u32) {
        let reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().expect("a header");
        reader.info().size()
    }

    #[test]
    fn a_picture_has_the_size_asked_for() {
        let (before, after) = (icosphere(3), icosphere(1));
        let distances = vec![0.1; before.positions.len()];
        let png = |views| picture(&before, &after, &distances, &small(views)).expect("a picture");
        let ((width, one), (_, two)) = (size(&png(1)), size(&png(2)));
        assert!(width == 300 && (100..120).contains(&one) && (200..230).contains(&two), "{width} {one} {two}");
    }

    #[test]
    fn what_is_flat_is_seen_from_higher() {
        let flat = plane(3, 3);
        assert_eq!(
            (flatness(&flat, Up::Z), flatness(&flat, Up::Y), flatness(&Mesh::default(), Up::Z)),
            (1.0, 0.0, 0.0)
        );
    }

    #[test]
    fn the_threads_do_not_show() {
        let (before, after) = (torus(60, 40), torus(12, 8));
        let distances: Vec<f64> = (0..before.positions.len()).map(|i| i as f64).collect();
        let png = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| picture(&before, &after, &distances, &small(2))).expect("a picture")
        };
        assert_eq!(png(1), png(5));
    }

    #[test]
    fn little_and_nothing_can_be_drawn() {
        let point = Mesh::new(vec![DVec3::ZERO; 3], vec![[0, 1, 2]]);
        let triangle = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Z], vec![[0, 1, 2]]);
        let huge = Mesh::new(vec![DVec3::splat(-1e308), DVec3::X * 1e308, DVec3::Z * 1e308], vec![[0, 1, 2]]);
        let line = Mesh::new(vec![DVec3::ZERO, DVec3::Z, DVec3::Z * 2.0], vec![[0, 1, 2]]);
        for before in [Mesh::default(), point, triangle, huge, line] {
            let distances = vec![0.0; before.positions.len()];
            for after in [Mesh::default(), plane(1, 1)] {
                let png = picture(&before, &after, &distances, &small(2)).expect("a picture");
                assert_eq!(size(&png).0, 300);
            }
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        let mesh = plane(1, 1);
        for (options, distances) in [
            (PictureOptions { width: 10, ..small(1) }, vec![0.0; 4]),
            (small(0), vec![0.0; 4]),
            (small(3), vec![0.0; 4]),
            (small(1), vec![0.0; 3]),
        ] {
            assert!(matches!(picture(&mesh, &mesh, &distances, &options), Err(Error::Parameter(_))));
        }
        let bad = Mesh::new(vec![DVec3::ZERO], vec![[0, 0, 9]]);
        assert!(matches!(picture(&mesh, &bad, &[0.0; 4], &small(1)), Err(Error::Mesh(_))));
    }

    #[test]
    fn numbers_read_well() {
        let mesh = |count| Mesh::new(vec![DVec3::ZERO], vec![[0; 3]; count]);
        assert_eq!(
            [0, 1, 868, 1000, 1_234_567].map(|count| faces(&mesh(count))),
            ["0 faces", "1 face", "868 faces", "1,000 faces", "1,234,567 faces"]
        );
        assert_eq!(
            [0.0, 0.5, 0.0123, 0.0012, 1.2e-5].map(percent),
            ["0 %", "50.00 %", "1.23 %", "0.120 %", "0.00120 %"]
        );
    }
}
