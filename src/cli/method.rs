//! The method and its options, from the arguments.

use coarsen::contract::{Feature, Weighting};
use coarsen::polish::{Flips, Objective};
use coarsen::{Method, cluster, contract};

use super::Exit;
use super::failure::refuse;
use super::values::{Lock, Weld};
use super::{args, quadrics, regions, removal, weights};

/// What the arguments of a verb say of the method.
#[derive(Debug)]
pub struct Asked<'a> {
    pub how: &'a args::How,
    /// Cells of a grid, and whether there is an error limit: targets that say something of the method.
    pub grid: Option<u32>,
    pub by_error: bool,
    pub with_log: bool,
}

/// The method that the arguments name, with its options.
///
/// # Errors
/// Options of another method.
pub fn method(asked: &Asked<'_>) -> anyhow::Result<Method> {
    let &Asked { how, grid, with_log: log, .. } = asked;
    let args::How { shape, removal, regions, weights } = how;
    let contract = contract(shape, weights::feature(weights));
    if shape.method != args::Method::Cluster && (grid.is_some() || shape.representative.is_some()) {
        return Err(refuse(Exit::Usage, "--grid and --representative are for --method cluster"));
    }
    if shape.method != args::Method::Removal && removal::is_asked(removal) {
        return Err(refuse(Exit::Usage, "--fill and --feature-angle are for --method removal"));
    }
    if !shape.method.makes_regions() && regions::is_asked(regions) {
        return Err(refuse(Exit::Usage, "options of regions are for --method vsa, superface and coplanar"));
    }
    match shape.method {
        args::Method::Contract | args::Method::Feature | args::Method::Average => {
            Ok(Method::Contract(contract::Options { log, ..contract }))
        }
        args::Method::Cluster
        | args::Method::Removal
        | args::Method::Coplanar
        | args::Method::Superface
        | args::Method::Vsa
            if log =>
        {
            Err(refuse(Exit::Usage, "--write-log is for --method contract: nothing else contracts"))
        }
        args::Method::Coplanar | args::Method::Superface | args::Method::Vsa => {
            regions::options(shape.method, regions, asked.by_error, &contract)
        }
        args::Method::Removal => removal::options(removal, &contract).map(Method::Removal),
        args::Method::Cluster => {
            let flips = contract.flips;
            if contract != (contract::Options { flips, ..contract::Options::default() }) {
                let message =
                    "--method cluster has no options of shape but --representative and --flips: leave the others away";
                return Err(refuse(Exit::Usage, message));
            }
            Ok(Method::Cluster(cluster::Options {
                flips,
                grid,
                representative: match shape.representative {
                    Some(args::Representative::Quadric) | None => cluster::Representative::Quadric,
                    Some(args::Representative::Mean) => cluster::Representative::Mean,
                    Some(args::Representative::Input) => cluster::Representative::Input,
                },
            }))
        }
    }
}

fn flips(shape: &args::Shape) -> Flips {
    let objective = match shape.flip_by {
        args::FlipBy::Distance => Objective::Distance,
        args::FlipBy::Bend => Objective::Bend,
        args::FlipBy::Shape => Objective::Shape,
    };
    Flips { sweeps: shape.flips, objective }
}

fn contract(shape: &args::Shape, feature: Feature) -> contract::Options {
    let candidates = match shape.candidates {
        args::Candidates::Pairs => contract::Candidates::Pairs,
        args::Candidates::Triangles => contract::Candidates::Triangles,
    };
    let defaults = match shape.method {
        args::Method::Feature => {
            contract::Options { weighting: Weighting::Feature(feature), ..contract::Options::feature_weighted() }
        }
        args::Method::Average => contract::Options::averaged(),
        _ if shape.candidates == args::Candidates::Triangles => {
            contract::Options { metric: contract::Metric::Plane, ..contract::Options::default() }
        }
        _ => contract::Options::default(),
    };
    contract::Options {
        metric: shape.metric.map_or(defaults.metric, |metric| match metric {
            args::Metric::Volume => contract::Metric::Volume,
            args::Metric::Plane => contract::Metric::Plane,
        }),
        candidates,
        placement: shape.placement.map_or(defaults.placement, |placement| match placement {
            args::Placement::Optimal => contract::Placement::Optimal,
            args::Placement::Segment => contract::Placement::Segment,
            args::Placement::EndpointOrMiddle => contract::Placement::EndpointOrMiddle,
            args::Placement::Endpoint => contract::Placement::Endpoint,
        }),
        weighting: defaults.weighting,
        quadrics: quadrics::stored(shape, defaults.quadrics),
        border_weight: shape.border_weight,
        lock_border: shape.lock_border,
        locked: None,
        lock: match &shape.lock {
            Some(Lock::Channel(name)) => Some(contract::Lock::Channel(name.clone())),
            // A file is read where its input is.
            Some(Lock::File(_)) | None => None,
        },
        max_flip_rad: shape.max_flip.unwrap_or(defaults.max_flip_rad),
        join_within: shape.join_within,
        non_manifold: match shape.non_manifold {
            args::NonManifold::Cut => contract::NonManifold::Cut,
            args::NonManifold::Hold => contract::NonManifold::Hold,
        },
        weld: match shape.weld {
            Weld::Off => None,
            Weld::Within(distance) => Some(distance),
        },
        fit: shape.fit,
        flips: flips(shape),
        prune: shape.prune,
        close_holes: shape.close_holes,
        attributes: attributes(&shape.attributes),
        log: false,
    }
}

fn attributes(given: &args::Attributes) -> contract::Attributes {
    let mut weights = contract::AttributeWeights::default();
    let mut channels = Vec::new();
    for (name, weight) in &given.attribute_weights {
        match name.as_str() {
            "normal" => weights.normal = *weight,
            "uv" => weights.texcoord = *weight,
            "color" => weights.color = *weight,
            "pose" => weights.pose = *weight,
            _ => channels.push((name.clone(), *weight)),
        }
    }
    weights.channels = channels.into();
    let drops = |what| given.drop.contains(&what);
    let dropped = contract::Dropped {
        normals: drops(args::Dropped::Normal) || given.normals == args::Normals::Drop,
        colors: drops(args::Dropped::Color),
        texcoords: drops(args::Dropped::Uv),
        materials: drops(args::Dropped::Material),
        channels: drops(args::Dropped::Other),
    };
    let normals = match given.normals {
        args::Normals::Recompute => contract::Normals::Recompute,
        _ => contract::Normals::Keep,
    };
    let color_space = match given.color_space {
        args::ColorSpace::Rgb => contract::ColorSpace::Rgb,
        args::ColorSpace::Luv => contract::ColorSpace::Luv,
    };
    let seams = match given.seams {
        args::Seams::Yield => contract::Seams::Yield,
        args::Seams::Hold => contract::Seams::Hold,
    };
    let lock_seams = given.lock_seams;
    contract::Attributes { weights, normals, dropped, color_space, seams, lock_seams, smooth: false }
}
