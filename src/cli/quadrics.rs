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
        args::Method::Contract => shape.metric == Some(args::Metric::Plane),
        args::Method::Feature | args::Method::Average => shape.metric != Some(args::Metric::Volume),
        args::Method::Cluster => true,
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
