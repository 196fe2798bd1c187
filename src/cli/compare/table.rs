//! A comparison as a table for people.

use std::fmt::Write;

use coarsen::mesh::Topology;
use coarsen::metrics::{MaterialTexture, Side};

use super::record::Record;

/// The width of the names and of a column.
const NAMES: usize = 24;
const COLUMN: usize = 14;

/// The table: distances and directions of both sides, then the meshes side by side; textures by material where `is_verbose`.
pub fn table(record: &Record, is_verbose: bool) -> String {
    let mut text = format!("A  {}\nB  {}\n\n", record.a, record.b);
    deviations(&mut text, record);
    text.push('\n');
    meshes(&mut text, record);
    text.push('\n');
    let line = |text: &mut String, name: &str, value: String| {
        // Writing to a text cannot fail.
        let _ = writeln!(text, "{name:NAMES$}{value}");
    };
    line(&mut text, "diagonal of A", figure(record.diagonal));
    let worst = |side: &Side| side.worst.map(figure).join("  ");
    line(&mut text, "farthest from B", worst(&record.forward));
    line(&mut text, "farthest from A", worst(&record.backward));
    if let Some(texture) = &record.texture {
        let [max, rms] = [texture.deviation.max, texture.deviation.rms].map(figure);
        line(&mut text, "texture, moved", format!("{max} at most, {rms} root mean square"));
        line(&mut text, "texture, mapping", figure(texture.mapping_distance));
        line(&mut text, "texture, in common", format!("{:.2} %", 100.0 * texture.covered));
    }
    let materials = &record.texture_materials;
    materials
        .iter()
        .filter(|_| is_verbose)
        .for_each(|material| line(&mut text, "  of material", of_material(material)));
    let alone = materials.iter().filter(|material| material.faces.contains(&0)).count();
    if alone > 0 && !is_verbose {
        line(&mut text, "texture, materials", format!("{alone} have faces in one mesh alone: -v lists all"));
    }
    if let Some(images) = &record.images {
        let (rmse, greatest) = (figure(images.rmse), figure(images.greatest.rmse));
        let value = format!("{rmse} root mean square, {greatest} from {}", images.greatest.view);
        line(&mut text, "images, six sides", value);
    }
    if let Some(screen) = &record.screen {
        let [max, rms] = [screen.pixels.max, screen.pixels.rms].map(figure);
        line(&mut text, "on the screen", format!("{max} pixels at most, {rms} root mean square"));
    }
    line(&mut text, "seconds", format!("read {:.2}, measure {:.2}", record.seconds.read, record.seconds.measure));
    text
}

/// What a material's texture has moved.
fn of_material(MaterialTexture { name, faces: [here, there], texture }: &MaterialTexture) -> String {
    let name = name.escape_default();
    match texture {
        Some(texture) => {
            let [max, rms] = [texture.deviation.max, texture.deviation.rms].map(figure);
            let common = 100.0 * texture.covered;
            format!("'{name}': {max} at most, {rms} root mean square, {common:.2} % in common")
        }
        None if *here == 0 => format!("'{name}': faces in A: none, in B: {there}"),
        None if *there == 0 => format!("'{name}': faces in A: {here}, in B: none"),
        None => format!("'{name}': no texture coordinates"),
    }
}

fn deviations(text: &mut String, record: &Record) {
    let (forward, backward) = (&record.forward, &record.backward);
    row(text, "", ["A to B", "B to A", "symmetric", "% of diagonal"]);
    for (name, of) in [
        (
            "distance, greatest",
            [forward.distance.max, backward.distance.max, record.symmetric.max, record.relative.max],
        ),
        (
            "distance, mean",
            [forward.distance.mean, backward.distance.mean, record.symmetric.mean, record.relative.mean],
        ),
        ("root mean square", [forward.distance.rms, backward.distance.rms, record.symmetric.rms, record.relative.rms]),
    ] {
        let [forward, backward, symmetric, relative] = of;
        row(text, name, [forward, backward, symmetric, 100.0 * relative].map(figure));
    }
    let (here, there) = (&forward.normals, &backward.normals);
    for (name, of) in [
        ("normals, greatest", [here.max_rad, there.max_rad]),
        ("normals, 95 in 100", [here.p95_rad, there.p95_rad]),
        ("normals, mean", [here.mean_rad, there.mean_rad]),
    ] {
        row(text, name, [of[0], of[1], of[0].max(of[1])].map(degrees));
    }
    if let (Some(here), Some(there)) = (&forward.colors, &backward.colors) {
        for (name, of) in [
            ("colors RGB, greatest", [here.rgb.max, there.rgb.max]),
            ("colors RGB, mean", [here.rgb.mean, there.rgb.mean]),
            ("colors L*u*v*, greatest", [here.luv.max, there.luv.max]),
            ("colors L*u*v*, mean", [here.luv.mean, there.luv.mean]),
        ] {
            row(text, name, [of[0], of[1], of[0].max(of[1])].map(figure));
        }
    }
    row(text, "samples", [forward.samples, backward.samples].map(|count| count.to_string()));
}

fn meshes(text: &mut String, record: &Record) {
    let (a, b) = (&record.topology.a, &record.topology.b);
    row(text, "", ["A", "B"]);
    let mut both = |name: &str, of: &dyn Fn(&Topology) -> String| row(text, name, [of(a), of(b)]);
    both("vertices", &|t| t.vertices.to_string());
    both("faces", &|t| t.faces.to_string());
    both("components", &|t| t.components.to_string());
    both("Euler characteristic", &|t| t.euler.to_string());
    both("genus", &|t| t.genus.map_or_else(|| "-".into(), |genus| genus.to_string()));
    both("border loops", &|t| t.border_loops.to_string());
    both("border edges", &|t| t.border_edges.to_string());
    both("non-manifold edges", &|t| t.nonmanifold_edges.to_string());
    both("non-manifold vertices", &|t| t.nonmanifold_vertices.to_string());
    let (a, b) = (&record.quality.a, &record.quality.b);
    row(text, "faces below 10°", [a, b].map(|q| format!("{:.2} %", 100.0 * q.below_10_degrees)));
    row(text, "smallest angle", [a, b].map(|q| degrees(q.min_angle_rad)));
    row(text, "shape of faces, mean", [a, b].map(|q| format!("{:.3}", q.mean_ratio)));
    row(text, "sliver to equilateral", [a, b].map(|q| bars(&q.ratio_histogram)));
}

/// A name and right-aligned columns.
fn row<const N: usize>(text: &mut String, name: &str, columns: [impl AsRef<str>; N]) {
    let _ = write!(text, "{name:NAMES$}");
    for column in columns {
        let _ = write!(text, "{:>COLUMN$}", column.as_ref());
    }
    text.push('\n');
}

/// Five digits that count.
fn figure(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.4e}");
    }
    let whole_digits = size.log10().floor() as i32 + 1;
    format!("{value:.*}", (5 - whole_digits).clamp(0, 8) as usize)
}

fn degrees(angle_rad: f64) -> String {
    format!("{:.2}°", angle_rad.to_degrees())
}

/// A bar for each count, as high as its share of the greatest; a dot for none.
fn bars(counts: &[u64]) -> String {
    let greatest = counts.iter().copied().max().unwrap_or(0).max(1);
    let bar = |count: u64| match count {
        0 => '·',
        count => ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'][(count as u128 * 8).div_ceil(greatest.into()) as usize - 1],
    };
    counts.iter().map(|&count| bar(count)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_five_digits() {
        let texts = [0.0, 1.0, -12.345678, 0.00123456, 9.9e-5, 123_456.7, 1e6, 0.1].map(figure);
        assert_eq!(texts, ["0", "1.0000", "-12.346", "0.0012346", "9.9000e-5", "123457", "1.0000e6", "0.10000"]);
    }

    #[test]
    fn bars_rise_with_counts() {
        assert_eq!(bars(&[0, 1, 50, 100, 99, u64::MAX]), "·▁▁▁▁█");
        assert_eq!(bars(&[1, 2, 4, 8, 7]), "▁▂▄█▇");
        assert_eq!(bars(&[0; 3]), "···");
    }
}
