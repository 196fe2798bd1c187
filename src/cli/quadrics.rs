//! How the initial quadrics are stored: from the arguments.

use coarsen::contract::{QuadricFormat, QuadricFrame, Quadrics};

use super::args::{self, Shape};
use super::resolve::Problems;

/// What the arguments say of quadrics, over what the method does without.
pub fn stored(shape: &Shape, defaults: Quadrics) -> Quadrics {
    let format = match shape.quadric_format {
        None => defaults.format,
        Some(args::QuadricFormat::Full) => None,
        Some(args::QuadricFormat::F32) => Some(QuadricFormat::F32),
        Some(args::QuadricFormat::F16) => Some(QuadricFormat::F16),
        Some(args::QuadricFormat::Snorm16) => Some(QuadricFormat::Snorm16),
        Some(args::QuadricFormat::Rgba8) => Some(QuadricFormat::Rgba8),
        Some(args::QuadricFormat::Local16) => Some(QuadricFormat::Local16),
        Some(args::QuadricFormat::Local8) => Some(QuadricFormat::Local8),
    };
    let frame = match shape.quadric_frame {
        None => defaults.frame,
        Some(args::QuadricFrame::Normalized) => QuadricFrame::Normalized,
        Some(args::QuadricFrame::Raw) => QuadricFrame::Raw,
    };
    Quadrics { format, frame, ..defaults }
}

/// Notes what contradicts itself in the arguments.
pub fn check(shape: &Shape, problems: &mut Problems) {
    let is_plane = match shape.method {
        // Triangles take the metric that they need.
        args::Method::Contract => match shape.metric {
            Some(metric) => metric == args::Metric::Plane,
            None => shape.candidates == args::Candidates::Triangles,
        },
        args::Method::Feature | args::Method::Average => shape.metric != Some(args::Metric::Volume),
        // Refused with all other options of contraction.
        args::Method::Cluster
        | args::Method::Removal
        | args::Method::Vsa
        | args::Method::Superface
        | args::Method::Coplanar => true,
    };
    if shape.method == args::Method::Average && !is_plane {
        problems.add("--method average and --metric volume contradict each other: 'volume' accumulates no quadrics");
    } else if !is_plane && (shape.quadric_format.is_some() || shape.quadric_frame.is_some()) {
        problems.add("--quadric-format and --quadric-frame are for --metric plane");
    }
    let is_local = |format| matches!(format, args::QuadricFormat::Local16 | args::QuadricFormat::Local8);
    let about_one_origin = match shape.quadric_format {
        None => shape.method == args::Method::Average,
        Some(format) => format != args::QuadricFormat::Full && !is_local(format),
    };
    if shape.quadric_frame.is_some() && !about_one_origin {
        problems.add("--quadric-frame is for --quadric-format f32, f16, snorm16 and rgba8");
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use coarsen::Method;
    use coarsen::contract::{Metric, Options, PlaneWeight};

    use super::*;
    use crate::cli::args::{Arguments, Verb};
    use crate::cli::resolve;

    fn options(line: &str) -> Result<Options, String> {
        let line = format!("coarsen simplify sample:part - --format ply -f 8 {line}");
        let Ok(Arguments { verb: Verb::Simplify(args), .. }) = Arguments::try_parse_from(line.split_whitespace())
        else {
            panic!("'{line}' does not parse")
        };
        match resolve::simplify(&args).map(|job| job.setup.method) {
            Ok(Method::Contract(options)) => Ok(options),
            Ok(other) => panic!("{other:?}"),
            Err(error) => Err(error.to_string()),
        }
    }

    #[test]
    fn formats_reach_the_engine() {
        assert_eq!(options("--method average"), Ok(Options::averaged()));
        let with = |quadrics, line: &str| assert_eq!(options(line), Ok(Options { quadrics, ..Options::averaged() }));
        let averaged = Options::averaged().quadrics;
        with(Quadrics { format: None, ..averaged }, "--method average --quadric-format full");
        let raw = Quadrics { format: Some(QuadricFormat::Rgba8), frame: QuadricFrame::Raw, ..averaged };
        with(raw, "--method average --quadric-format rgba8 --quadric-frame raw");
        let by_area = options("--metric plane --quadric-format local16").expect("a good line");
        let local = Quadrics { planes: PlaneWeight::Area, format: Some(QuadricFormat::Local16), ..Quadrics::default() };
        assert_eq!((by_area.metric, by_area.quadrics), (Metric::Plane, local));
        let of_triangles = options("--candidates triangles --quadric-format local16").expect("a good line");
        assert_eq!(of_triangles.quadrics.format, Some(QuadricFormat::Local16));
        assert_eq!(
            options("--method feature --quadric-format f16").map(|o| o.quadrics.format),
            Ok(Some(QuadricFormat::F16))
        );
    }

    #[test]
    fn contradictions_are_told() {
        for (line, part) in [
            ("--method average --metric volume", "--method average and --metric volume contradict"),
            ("--quadric-format f32", "are for --metric plane"),
            ("--method feature --metric volume --quadric-format full", "are for --metric plane"),
            ("--metric plane --quadric-frame raw", "--quadric-frame is for"),
            ("--method average --quadric-format local8 --quadric-frame normalized", "--quadric-frame is for"),
            ("--method cluster --quadric-format f32", "no options of shape"),
        ] {
            let error = options(line).expect_err("a contradiction");
            assert!(error.contains(part), "{line}: {error}");
        }
    }
}
