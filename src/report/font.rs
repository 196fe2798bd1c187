//! Words on a canvas, by a small font of strokes.
//!
//! A glyph is a few strokes of a round pen. A stroke is a list of points, two hexadecimal digits each: x from the left, y
//! from below, where 4 is the base line, b the height of small letters and e that of digits. Two points are a straight
//! line; more are the control polygon of a quadratic B-spline, which starts at the first, ends at the last, and touches
//! the middle of each leg between. A point written twice is a corner. `o` in front closes the stroke: the four corners of
//! a box make its oval.

use super::canvas::{Canvas, Color};

/// The characters and their strokes.
const GLYPHS: &[(char, &str)] = &[
    ('0', "o04646e0e"),
    ('1', "1b3e3e34"),
    ('2', "0b0e6e6a040464"),
    ('3', "0c0e5e59292969640406"),
    ('4', "545e5e070767"),
    ('5', "5e0e0e09091a6b640405"),
    ('6', "o04646a0a 5e0e07"),
    ('7', "0e6e6e24"),
    ('8', "o04646909 o19595e1e"),
    ('9', "o08686e0e 6b6414"),
    ('.', "1414"),
    (',', "1402"),
    ('%', "o0a3a3e0e 049e o64949868"),
    ('-', "0848"),
    ('+', "0868 3b35"),
    ('/', "026e"),
    ('>', "0b585805"),
    (':', "1414 1a1a"),
    ('(', "2f0d0422"),
    (')', "0f2d2402"),
    ('a', "o04545b0b 5b54"),
    ('b', "o04545b0b 0e04"),
    ('c', "5a5b0b045455"),
    ('d', "o04545b0b 5e54"),
    ('e', "0858585b0b045455"),
    ('f', "4e2e2b24 0b4b"),
    ('g', "o04545b0b 5b500001"),
    ('h', "0e04 080b5b5854"),
    ('i', "1b14 1e1e"),
    ('j', "2b2000 2e2e"),
    ('k', "0e04 5b07 2854"),
    ('l', "1e14"),
    ('m', "0b04 080b4b4844 484b8b8884"),
    ('n', "0b04 080b5b5854"),
    ('o', "o04545b0b"),
    ('p', "o04545b0b 0b00"),
    ('q', "o04545b0b 5b50"),
    ('r', "0b04 080b4b"),
    ('s', "5a5b0b080757540405"),
    ('t', "2e272454 0b4b"),
    ('u', "0b07045457 5b54"),
    ('v', "0b34346b"),
    ('w', "0b24244b4b64648b"),
    ('x', "0b54 045b"),
    ('y', "0b34 6b20"),
    ('z', "0b5b5b040454"),
];

/// The height of digits in units of the glyphs.
const HEIGHT: f32 = 10.0;
/// The unit that the base line has.
const BASE: f32 = 4.0;
/// The pen's half width, in units.
const PEN: f32 = 0.62;
/// Between two glyphs, and the width of a space.
const GAP: f32 = 2.9;
const SPACE: f32 = 3.2;

type Point = [f32; 2];

/// The strokes of a character as chains of points; none for a space and a character the font does not have.
fn strokes(character: char) -> Vec<Vec<Point>> {
    let coded = GLYPHS.iter().find(|(glyph, _)| *glyph == character).map_or("", |(_, strokes)| strokes);
    coded.split_whitespace().map(stroke).collect()
}

fn stroke(code: &str) -> Vec<Point> {
    let (closed, code) = code.strip_prefix('o').map_or((false, code), |code| (true, code));
    let digits: Vec<f32> = code.chars().map(|c| c.to_digit(16).unwrap_or(0) as f32).collect();
    let mut points: Vec<Point> = digits.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
    let middle = |p: Point, q: Point| [(p[0] + q[0]) / 2.0, (p[1] + q[1]) / 2.0];
    if closed && points.len() > 2 {
        // From the middle of the leg between the last and the first point around to itself.
        let seam = middle(points[points.len() - 1], points[0]);
        points.insert(0, seam);
        points.push(seam);
    }
    let count = points.len();
    if count < 3 {
        return points;
    }
    let mut chain = vec![points[0]];
    for i in 1..count - 1 {
        let from = if i == 1 { points[0] } else { middle(points[i - 1], points[i]) };
        let to = if i == count - 2 { points[count - 1] } else { middle(points[i], points[i + 1]) };
        chain.extend((1..=8).map(|step| {
            let t = step as f32 / 8.0;
            std::array::from_fn(|x| {
                (1.0 - t) * (1.0 - t) * from[x] + 2.0 * t * (1.0 - t) * points[i][x] + t * t * to[x]
            })
        }));
    }
    chain
}

fn right_end(strokes: &[Vec<Point>]) -> f32 {
    strokes.iter().flatten().map(|p| p[0]).fold(0.0, f32::max)
}

/// How wide `text` is when its digits are `height` high, in pixels.
pub fn width(text: &str, height: f32) -> f32 {
    let advance = |c: char| if c == ' ' { SPACE } else { right_end(&strokes(c)) + GAP };
    (text.chars().map(advance).sum::<f32>() - GAP).max(0.0) * height / HEIGHT
}

/// Writes `text` from `x` on with its base line at `y`, its digits `height` high, in pixels.
pub fn write(canvas: &mut Canvas, text: &str, [x, y]: Point, height: f32, color: Color) {
    let unit = height / HEIGHT;
    let mut left = x;
    for character in text.chars() {
        if character == ' ' {
            left += SPACE * unit;
            continue;
        }
        let glyph = strokes(character);
        let place = |p: &Point| [left + p[0] * unit, y - (p[1] - BASE) * unit];
        let lines: Vec<[Point; 2]> =
            glyph.iter().flat_map(|chain| chain.windows(2).map(|pair| [place(&pair[0]), place(&pair[1])])).collect();
        let end = right_end(&glyph);
        let columns = (left - unit * 2.0).floor() as i64..=(left + (end + 2.0) * unit).ceil() as i64;
        let rows = (y - 13.0 * unit).floor() as i64..=(y + 6.0 * unit).ceil() as i64;
        for (row, column) in rows.flat_map(|row| columns.clone().map(move |column| (row, column))) {
            let at = [column as f32 + 0.5, row as f32 + 0.5];
            let nearest = lines.iter().map(|line| distance(at, line)).fold(f32::INFINITY, f32::min);
            let cover = (PEN * unit + 0.5 - nearest).clamp(0.0, 1.0);
            if cover > 0.0 {
                canvas.blend(column, row, color, cover);
            }
        }
        left += (end + GAP) * unit;
    }
}

/// From a point to a line between two.
fn distance(p: Point, [a, b]: &[Point; 2]) -> f32 {
    let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length_sq = d[0] * d[0] + d[1] * d[1];
    let t = if length_sq > 0.0 { ((d[0] * e[0] + d[1] * e[1]) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    let off = [e[0] - t * d[0], e[1] - t * d[1]];
    (off[0] * off[0] + off[1] * off[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_pairs_of_digits() {
        for (character, code) in GLYPHS {
            for stroke in code.split_whitespace() {
                let digits = stroke.strip_prefix('o').unwrap_or(stroke);
                let good = digits.len() % 2 == 0 && digits.len() >= 4 && digits.chars().all(|c| c.is_ascii_hexdigit());
                assert!(good, "'{character}': {stroke}");
            }
        }
    }

    #[test]
    fn a_box_makes_an_oval_that_touches_it() {
        let oval = stroke("o04646e0e");
        let extent = |axis: usize| {
            let values = oval.iter().map(|p| p[axis]);
            (values.clone().fold(f32::MAX, f32::min), values.fold(f32::MIN, f32::max))
        };
        assert_eq!((extent(0), extent(1)), ((0.0, 6.0), (4.0, 14.0)));
        assert_eq!(oval.first(), oval.last());
        assert_eq!(stroke("1e14"), [[1.0, 14.0], [1.0, 4.0]]);
    }

    #[test]
    fn words_have_a_width_and_leave_ink_inside_it() {
        assert_eq!((width("", 10.0), width("1", 10.0)), (0.0, 3.0));
        assert!((width("10", 20.0) - 2.0 * (3.0 + GAP + 6.0)).abs() < 1e-5);
        let mut canvas = Canvas::new(40, 20, [1.0; 3]);
        let blank = canvas.png().expect("a PNG");
        write(&mut canvas, "€ ", [5.0, 15.0], 10.0, [0.0; 3]);
        assert_eq!(canvas.png().expect("a PNG"), blank);
        write(&mut canvas, "8%", [5.0, 15.0], 10.0, [0.0; 3]);
        assert_ne!(canvas.png().expect("a PNG"), blank);
        write(&mut canvas, "outside", [-900.0, 1e4], 10.0, [0.0; 3]);
    }
}
