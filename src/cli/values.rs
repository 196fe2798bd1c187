//! Numbers as people write them on a command line: `20k`, `10%`, `8GiB`.

use std::path::PathBuf;
use std::time::Duration;

use coarsen::batch::Shard;
use coarsen::cluster::MOST_CELLS;
use coarsen::formats::Weights;
use coarsen::metrics::{Kinds, MOST_SAMPLES, Options, View};

/// A count: `20000`, `20_000`, `20k`, `1.5M`, `2G`.
pub fn count(text: &str) -> Result<usize, String> {
    if text.ends_with('%') {
        return Err(format!("it is a percentage: write --ratio {text} for a share of the faces"));
    }
    let (digits, factor) = match text.char_indices().last() {
        Some((end, 'k' | 'K')) => (&text[..end], 1e3),
        Some((end, 'm' | 'M')) => (&text[..end], 1e6),
        Some((end, 'g' | 'G')) => (&text[..end], 1e9),
        _ => (text, 1.0),
    };
    let count = number(&digits.replace('_', "")).ok().map(|n| n * factor);
    match count {
        Some(count) if count.fract() == 0.0 && (1.0..=1e15).contains(&count) => Ok(count as usize),
        _ => Err("give a whole number from 1, such as 20000, 20k or 1.5M".into()),
    }
}

/// A fraction in `[0, 1]`: `0.1` or `10%`.
pub fn fraction(text: &str) -> Result<f64, String> {
    let fraction = match text.strip_suffix('%') {
        Some(percent) => number(percent).map(|n| n / 100.0),
        None => number(text),
    };
    match fraction {
        Ok(fraction) if (0.0..=1.0).contains(&fraction) => Ok(fraction),
        Ok(fraction) if fraction > 1.0 && !text.ends_with('%') && fraction <= 100.0 => {
            Err(format!("it is more than the whole: write {text}% for a percentage"))
        }
        _ => Err("give a fraction from 0 to 1, or a percentage such as 10%".into()),
    }
}

/// A length in model units, 0 or more.
pub fn length(text: &str) -> Result<f64, String> {
    number(text).map_err(|()| "give a length in model units, 0 or more".into())
}

/// A weight, 0 or more.
pub fn weight(text: &str) -> Result<f32, String> {
    match number(text) {
        Ok(weight) if weight <= 1e6 => Ok(weight as f32),
        _ => Err("give a number from 0 to 1000000".into()),
    }
}

/// An angle in degrees, above 0 and at most 90; the result is in radians.
pub fn angle(text: &str) -> Result<f32, String> {
    // The angle is rounded after the conversion: 90 is a quarter turn exactly as f32 has it.
    flat_angle(text).map(|radians| radians as f32)
}

/// [`angle`] in double precision.
pub fn flat_angle(text: &str) -> Result<f64, String> {
    match number(text.strip_suffix('°').unwrap_or(text)) {
        Ok(degrees) if degrees > 0.0 && degrees <= 90.0 => Ok(degrees.to_radians()),
        _ => Err("give degrees above 0 and up to 90".into()),
    }
}

/// An angle between faces in degrees, up to 180; the result is in radians.
pub fn feature_angle(text: &str) -> Result<f32, String> {
    match number(text.strip_suffix('°').unwrap_or(text)) {
        Ok(degrees) if (0.0..=180.0).contains(&degrees) => Ok((degrees.to_radians() as f32).min(std::f32::consts::PI)),
        _ => Err("give degrees from 0 to 180".into()),
    }
}

/// How far apart welded vertices may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weld {
    /// Nothing is welded.
    Off,
    /// At most this far, in model units; 0 welds equal positions.
    Within(f64),
}

/// Cells along the longest side of a grid.
pub fn cells(text: &str) -> Result<u32, String> {
    let cells = count(text).ok().and_then(|cells| u32::try_from(cells).ok());
    cells.filter(|&cells| cells <= MOST_CELLS).ok_or_else(|| format!("give a whole number from 1 to {MOST_CELLS}"))
}

/// `off` or a length.
pub fn weld(text: &str) -> Result<Weld, String> {
    match text {
        "off" => Ok(Weld::Off),
        _ => number(text).map(Weld::Within).map_err(|()| "give a length in model units, or 'off'".into()),
    }
}

/// The weight of an attribute: NAME=WEIGHT.
pub fn weight_of(text: &str) -> Result<(String, f32), String> {
    let weight = text.split_once('=').filter(|(name, _)| !name.is_empty());
    let parsed = weight.and_then(|(name, weight)| Some((name.to_owned(), number(weight).ok()? as f32)));
    parsed.ok_or_else(|| "give NAME=WEIGHT, such as normal=0.5, with a weight of 0 or more".into())
}

/// A number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|&n| n > 0.0).ok_or_else(|| "give a number above 0".into())
}

/// An angle of view in degrees, above 0 and below 180; the result is in radians.
pub fn fov(text: &str) -> Result<f64, String> {
    match number(text.strip_suffix('°').unwrap_or(text)) {
        Ok(degrees) if degrees > 0.0 && degrees < 180.0 => Ok(degrees.to_radians()),
        _ => Err("give degrees above 0 and below 180".into()),
    }
}

/// A step from level to level: a fraction above 0 and below 1.
pub fn step(text: &str) -> Result<f64, String> {
    let step = fraction(text).ok().filter(|&step| step > 0.0 && step < 1.0);
    step.ok_or_else(|| "give a fraction above 0 and below 1, or a percentage such as 50%".into())
}

/// A view: `DISTANCE,FOV,HEIGHT` in model units, degrees and pixels.
pub fn view(text: &str) -> Result<View, String> {
    let numbers: Result<Vec<f64>, ()> = text.split(',').map(|part| number(part.trim())).collect();
    let Ok(&[distance, degrees, height]) = numbers.as_deref() else {
        return Err("give distance, degrees and pixels, such as 10,45,1080".into());
    };
    let view = View { distance, fov_rad: degrees.to_radians(), height };
    view.check().map(|()| view).map_err(|error| error.to_string())
}

/// How many samples to measure by.
pub fn samples(text: &str) -> Result<usize, String> {
    let samples = count(text)?;
    let options = Options { samples: Some(samples), ..Options::default() };
    options
        .check()
        .map(|()| samples)
        .map_err(|_| format!("more than {MOST_SAMPLES} samples would take hours: give fewer"))
}

/// Kinds of samples: `vertices,edges,faces`, or some of them.
pub fn kinds(text: &str) -> Result<Kinds, String> {
    let mut kinds = Kinds { vertices: false, edges: false, faces: false };
    for kind in text.split(',') {
        match kind.trim() {
            "vertices" => kinds.vertices = true,
            "edges" => kinds.edges = true,
            "faces" => kinds.faces = true,
            _ => return Err("give some of vertices, edges and faces, with commas between".into()),
        }
    }
    let options = Options { kinds, ..Options::default() };
    options.check().map(|()| kinds).map_err(|_| "edges alone have no mean: add vertices or faces".into())
}

/// Most sweeps that can be asked for; after some ten nothing moves.
const MOST_SWEEPS: u32 = 100;

/// `off` or a count of sweeps.
pub fn sweeps(text: &str) -> Result<u32, String> {
    match text {
        "off" => Ok(0),
        _ => text
            .parse()
            .ok()
            .filter(|&sweeps| sweeps <= MOST_SWEEPS)
            .ok_or_else(|| format!("give a number of sweeps up to {MOST_SWEEPS}, or 'off'")),
    }
}

/// A time in seconds, more than 0.
pub fn seconds(text: &str) -> Result<Duration, String> {
    match number(text.strip_suffix('s').unwrap_or(text)) {
        Ok(seconds) if (1e-3..=1e9).contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => Err("give seconds, such as 600".into()),
    }
}

/// A part of all: `2/3`.
pub fn shard(text: &str) -> Result<Shard, String> {
    let parts = text.split_once('/').and_then(|(number, count)| Some((number.parse().ok()?, count.parse().ok()?)));
    let shard = parts.and_then(|(number, count)| Shard::new(number, count).ok());
    shard.ok_or_else(|| "give I/N, such as 1/3, 2/3 or 3/3".into())
}

/// Which vertices stay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lock {
    /// Those with a number above 0 in this channel.
    Channel(String),
    /// Those that a file lists.
    File(PathBuf),
}

/// A channel, or a file where it looks like a path.
pub fn lock(text: &str) -> Result<Lock, String> {
    match text {
        "" => Err("give the name of a channel, or a file of one number of a vertex a line".into()),
        path if path.contains(['.', '/', '\\']) => Ok(Lock::File(path.into())),
        name => Ok(Lock::Channel(name.into())),
    }
}

/// A file's name, or `ply:PROPERTY`.
pub fn weight_source(text: &str) -> Result<Weights, String> {
    match text.strip_prefix("ply:") {
        _ if text.is_empty() => Err("give a file of one number a line, or ply:NAME".into()),
        Some("") => Err("give the property a name, such as ply:saliency".into()),
        Some(name) => Ok(Weights::Property(name.into())),
        None => Ok(Weights::File(text.into())),
    }
}

/// Bytes: `8GiB`, `8G` and `8g` are 8 × 2³⁰, `500MB` is 500 × 10⁶, a bare number counts bytes.
pub fn bytes(text: &str) -> Result<u64, String> {
    let end = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let factor = match text[end..].to_ascii_lowercase().as_str() {
        "" | "b" => Some(1.0),
        "k" | "kib" => Some(1024.0),
        "m" | "mib" => Some(1024.0 * 1024.0),
        "g" | "gib" => Some(1024.0 * 1024.0 * 1024.0),
        "t" | "tib" => Some(1024.0 * 1024.0 * 1024.0 * 1024.0),
        "kb" => Some(1e3),
        "mb" => Some(1e6),
        "gb" => Some(1e9),
        "tb" => Some(1e12),
        _ => None,
    };
    match (number(text[..end].trim_end()), factor) {
        (Ok(size), Some(factor)) if size > 0.0 => Ok((size * factor) as u64),
        _ => Err("give a size such as 8GiB, 500MiB or 2GB".into()),
    }
}

/// A plain decimal number that is not negative: no sign, no `inf`, no `nan`.
fn number(text: &str) -> Result<f64, ()> {
    let plain = text.starts_with(|c: char| c.is_ascii_digit() || c == '.') && text.bytes().any(|b| b.is_ascii_digit());
    text.parse().ok().filter(|n: &f64| plain && n.is_finite()).ok_or(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts() {
        for (text, expected) in
            [("20000", 20_000), ("20_000", 20_000), ("20k", 20_000), ("1.5M", 1_500_000), ("2G", 2_000_000_000)]
        {
            assert_eq!(count(text), Ok(expected), "{text}");
        }
        assert_eq!(count("20%"), Err("it is a percentage: write --ratio 20% for a share of the faces".into()));
        for text in ["", "k", "0", "-5", "1.5", "1.2345k", "inf", "NaN", "1e300", "1e400", "é", "+4"] {
            assert!(count(text).is_err(), "{text}");
        }
    }

    #[test]
    fn grids() {
        assert_eq!((cells("200"), cells("2k"), cells("2097152")), (Ok(200), Ok(2000), Ok(2_097_152)));
        for text in ["0", "-1", "2097153", "1.5", "9G", "10%", "x"] {
            assert_eq!(cells(text), Err("give a whole number from 1 to 2097152".into()), "{text}");
        }
    }

    #[test]
    fn fractions() {
        for (text, expected) in [("0.1", 0.1), ("10%", 0.1), ("1", 1.0), ("100%", 1.0), ("0", 0.0), (".5", 0.5)] {
            assert_eq!(fraction(text), Ok(expected), "{text}");
        }
        assert_eq!(fraction("25"), Err("it is more than the whole: write 25% for a percentage".into()));
        for text in ["", "%", "-0.1", "101%", "1e9", "nan", "inf%", "10 %"] {
            assert!(fraction(text).is_err(), "{text}");
        }
    }

    #[test]
    fn weights_come_from_a_file_or_a_property() {
        assert_eq!(weight_source("a.txt"), Ok(Weights::File("a.txt".into())));
        assert_eq!(weight_source("./ply:x"), Ok(Weights::File("./ply:x".into())));
        assert_eq!(weight_source("ply:saliency"), Ok(Weights::Property("saliency".into())));
        assert!(weight_source("").is_err() && weight_source("ply:").is_err());
    }

    #[test]
    fn times_and_shards() {
        assert_eq!((seconds("1.5"), seconds("600s")), (Ok(Duration::from_millis(1500)), Ok(Duration::from_secs(600))));
        assert_eq!(shard("2/3").ok(), Shard::new(2, 3).ok());
        assert!(seconds("0").is_err() && seconds("-1").is_err() && seconds("1e10").is_err());
        for text in ["", "2", "0/3", "4/3", "1/0", "a/b", "-1/3", "1/2/3"] {
            assert!(shard(text).is_err(), "{text}");
        }
    }

    #[test]
    fn views() {
        let expected = View { distance: 10.0, fov_rad: std::f64::consts::FRAC_PI_4, height: 1080.0 };
        assert_eq!((view("10,45,1080"), view("10, 45, 1080")), (Ok(expected), Ok(expected)));
        for text in ["", "10", "10,45", "10,45,1080,1", "0,45,1080", "10,180,1080", "10,45,0", "10,nan,1080", "-1,45,9"]
        {
            assert!(view(text).is_err(), "{text}");
        }
    }

    #[test]
    fn samples_end_where_they_would_take_hours() {
        assert_eq!((samples("500k"), samples("17179869184")), (Ok(500_000), Ok(1 << 34)));
        for text in ["17179869185", "1000000000000000", "0", "10%"] {
            assert!(samples(text).is_err(), "{text}");
        }
    }

    #[test]
    fn kinds_of_samples() {
        assert_eq!(kinds("vertices,edges,faces"), Ok(Kinds::default()));
        assert_eq!(kinds("faces, vertices"), Ok(Kinds { edges: false, ..Kinds::default() }));
        for text in ["", "edges", "faces,", "corners", "Faces"] {
            assert!(kinds(text).is_err(), "{text}");
        }
    }

    #[test]
    fn sizes_angles_and_weld_distances() {
        let sizes = [
            ("8GiB", 8 << 30),
            ("8g", 8 << 30),
            ("500MB", 500_000_000),
            ("1.5k", 1536),
            ("42", 42),
            ("2 TiB", 2 << 40),
        ];
        for (text, expected) in sizes {
            assert_eq!(bytes(text), Ok(expected), "{text}");
        }
        for text in ["", "GiB", "0", "8XB", "-1G", "8GiBs"] {
            assert!(bytes(text).is_err(), "{text}");
        }
        assert_eq!(angle("90"), Ok(std::f32::consts::FRAC_PI_2));
        assert!(angle("0").is_err() && angle("90.1").is_err() && angle("x").is_err());
        assert_eq!(
            (weld("off"), weld("0"), weld("1e-3")),
            (Ok(Weld::Off), Ok(Weld::Within(0.0)), Ok(Weld::Within(1e-3)))
        );
        assert!(weld("-1").is_err() && weld("on").is_err());
    }
}
