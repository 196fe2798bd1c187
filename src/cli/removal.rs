//! From arguments to the options of vertex removal.

use coarsen::{contract, removal};

use super::Exit;
use super::args::{self, Fill};
use super::failure::refuse;

/// The options of vertex removal; `shared` are those of shape, as contraction would take them.
///
/// # Errors
/// An option that removal does not have.
pub fn options(args: &args::Removal, shared: &contract::Options) -> anyhow::Result<removal::Options> {
    let contract::Options { lock_border, max_flip_rad, weld, flips, .. } = *shared;
    if *shared != (contract::Options { lock_border, max_flip_rad, weld, flips, ..contract::Options::default() }) {
        let message = "--method removal takes --fill, --feature-angle, --lock-border, --max-flip, --weld and --flips of the options of \
                       shape: leave the others away";
        return Err(refuse(Exit::Usage, message));
    }
    Ok(removal::Options {
        fill: match args.fill {
            Some(Fill::Fan) => removal::Fill::Fan,
            Some(Fill::Ears) => removal::Fill::Ears,
            Some(Fill::Dynamic) => removal::Fill::Dynamic,
            Some(Fill::Exhaustive) => removal::Fill::Exhaustive,
            None => removal::Fill::default(),
        },
        features: args.feature_angle.map_or_else(removal::Features::default, removal::Features::Keep),
        lock_border,
        max_flip_rad,
        weld,
        flips,
    })
}

/// Whether an option is given that only vertex removal has.
pub fn is_asked(args: &args::Removal) -> bool {
    args.fill.is_some() || args.feature_angle.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_of_shape_are_shared_or_refused() {
        let args = args::Removal { fill: Some(Fill::Ears), feature_angle: Some(0.5) };
        let shared = contract::Options { lock_border: true, weld: None, ..contract::Options::default() };
        let expected = removal::Options {
            fill: removal::Fill::Ears,
            features: removal::Features::Keep(0.5),
            lock_border: true,
            weld: None,
            ..removal::Options::default()
        };
        assert_eq!(options(&args, &shared).ok(), Some(expected));
        assert!(options(&args, &contract::Options { fit: 1, ..shared }).is_err());
        assert!(is_asked(&args) && !is_asked(&args::Removal { fill: None, feature_angle: None }));
        // What is no option says the same as the engine's defaults.
        assert_eq!(
            options(&args::Removal { fill: None, feature_angle: None }, &contract::Options::default()).ok(),
            Some(removal::Options::default())
        );
    }
}
