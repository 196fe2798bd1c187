//! What vertices count: the arguments' weighting, weights from a file, and the feature degrees as a file.

use std::path::{Path, PathBuf};

use coarsen::contract::{self, Feature, FeatureMode, Options, Update, Weighting, feature_degrees};
use coarsen::formats::{self, Format, Weights};
use coarsen::report::heatmap;
use coarsen::{Device, Mesh, Method};

use super::Exit;
use super::args;
use super::failure::{at, refuse};
use super::resolve::{Problems, check_beside};
use super::setup::{Setup, Shared};
use super::source::Source;
use super::values::Lock;

/// λ of the mode `gated`: measured best with its gate.
const GATED_LAMBDA: f32 = 16.0;

/// The feature weights that the arguments name.
pub fn feature(args: &args::Weights) -> Feature {
    let defaults = Feature::default();
    let mode = match args.feature_mode {
        None if args.feature_lambda.is_none() => defaults.mode,
        None | Some(args::FeatureMode::Affine) => FeatureMode::Affine { lambda: args.feature_lambda.unwrap_or(4.0) },
        Some(args::FeatureMode::Gated) => FeatureMode::Gated { lambda: args.feature_lambda.unwrap_or(GATED_LAMBDA) },
        Some(args::FeatureMode::Contrast) => FeatureMode::Contrast,
        Some(args::FeatureMode::Entropy) => FeatureMode::Entropy,
    };
    let literal = matches!(mode, FeatureMode::Contrast | FeatureMode::Entropy);
    Feature {
        mode,
        curvature_floor: args.feature_floor.unwrap_or(if literal { 0.0 } else { defaults.curvature_floor }),
        update: match args.feature_update {
            Some(args::FeatureUpdate::Recompute) => Update::Recompute,
            _ => Update::Static,
        },
    }
}

/// Notes what contradicts itself in the arguments, on the way to a file of features or not.
pub fn check(how: &args::How, source: Option<&Source>, with_file: bool, problems: &mut Problems) {
    let weights = &how.weights;
    let is_feature = how.shape.method == args::Method::Feature;
    for (name, is_given) in [
        ("--feature-mode", weights.feature_mode.is_some()),
        ("--feature-lambda", weights.feature_lambda.is_some()),
        ("--feature-update", weights.feature_update.is_some()),
        ("--feature-floor", weights.feature_floor.is_some() && !with_file),
    ] {
        if is_given && !is_feature {
            problems.add(format!("{name} is for --method feature"));
        }
    }
    if matches!(weights.feature_mode, Some(args::FeatureMode::Contrast | args::FeatureMode::Entropy))
        && weights.feature_lambda.is_some()
    {
        problems.add("--feature-lambda is for the modes 'affine' and 'gated'");
    }
    if is_feature && weights.weight.is_some() {
        problems.add("--weight and --method feature contradict each other: both say what vertices count");
    }
    let contracts = matches!(how.shape.method, args::Method::Contract | args::Method::Feature | args::Method::Average);
    if how.shape.lock.is_some() && !contracts {
        problems.add("--lock is for --method contract, feature and average");
    }
    if let (Some(Weights::Property(name)), Some(source)) = (&weights.weight, source)
        && !source.path().is_some_and(|path| Format::from_path(path).is_ok_and(|(format, _)| format == Format::Ply))
    {
        problems.add(format!("'ply:{name}' names numbers in the input, and '{source}' is no PLY file"));
    }
}

/// The file for the feature degrees that the arguments name.
pub fn feature_sink(
    args: Shared<'_>,
    source: Option<&Source>,
    outputs: &[&Path],
    problems: &mut Problems,
) -> Option<PathBuf> {
    let name = args.feature_file.write_feature.as_ref()?;
    let path = PathBuf::from(name);
    if !Format::from_path(&path).is_ok_and(|(format, _)| format == Format::Ply) {
        problems.add(format!("'{name}' is no PLY: give --write-feature a name that ends in .ply"));
        return None;
    }
    let input = source.and_then(Source::path);
    check_beside("--write-feature", &path, input, outputs, args.writing.overwrite, problems);
    Some(path)
}

/// The file of vertices that stay, where the arguments name one.
pub fn lock_file(how: &args::How) -> Option<PathBuf> {
    match &how.shape.lock {
        Some(Lock::File(path)) => Some(path.clone()),
        _ => None,
    }
}

/// The method, with the vertices of a file that stay.
///
/// # Errors
/// A file that cannot be read, or is no list of numbers.
pub fn with_lock(method: Method, file: Option<&Path>) -> anyhow::Result<Method> {
    let (Some(path), Method::Contract(options)) = (file, &method) else { return Ok(method) };
    let vertices = formats::read_indices(path).map_err(|error| at(path, error))?;
    Ok(Method::Contract(Options { lock: Some(contract::Lock::Vertices(vertices.into())), ..options.clone() }))
}

/// The method, with the weights and locks that it names read.
///
/// # Errors
/// A file that cannot be read, or is no list of numbers; what the numbers are is the library's to judge.
pub fn method(setup: &Setup) -> anyhow::Result<Method> {
    let method = with_lock(setup.method.clone(), setup.lock.as_deref())?;
    let (Some(weight), Method::Contract(options)) = (&setup.weight, &method) else { return Ok(method) };
    let numbers = match (weight, setup.source.path()) {
        (Weights::File(path), _) => formats::read_numbers(path).map_err(|error| at(path, error))?,
        (Weights::Property(name), Some(path)) => formats::read_property(path, name).map_err(|error| at(path, error))?,
        (Weights::Property(name), None) => {
            return Err(refuse(Exit::Usage, format!("'ply:{name}' needs a PLY file as the input")));
        }
    };
    let weights: Vec<f32> = numbers.into_iter().map(|number| number as f32).collect();
    Ok(Method::Contract(Options { weighting: Weighting::Given(weights.into()), ..options.clone() }))
}

/// Writes the feature degrees of the input, where that is asked for.
///
/// # Errors
/// As [`feature_degrees`] and [`formats::write_with_property`].
pub fn write_features(setup: &Setup, input: &Mesh, device: &Device) -> anyhow::Result<()> {
    let Some((path, feature)) = &setup.write_feature else { return Ok(()) };
    let degrees =
        feature_degrees(input, feature, device).map_err(|error| at(setup.source.to_string().as_ref(), error))?;
    let heights: Vec<f64> = degrees.iter().copied().map(f64::from).collect();
    let colored = heatmap(input, &heights, None)?;
    Ok(device.install(|| formats::write_with_property(&colored, path, &setup.writing, ("feature", &degrees)))?)
}
