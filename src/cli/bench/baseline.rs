//! meshoptimizer, the rival, where the program is built with it.

use super::case::Single;

/// Its version and that of the crate it comes in.
pub const VERSION: &str = "meshoptimizer 1.3 (crate meshopt 0.7.0)";

/// What simplifies to a number of faces.
pub type Solver = fn(Single, usize) -> Single;

/// A function of meshoptimizer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rival {
    /// Chooses among the vertices that are there.
    Simplify,
    /// Moves them too.
    Update,
}

impl Rival {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Simplify, Self::Update];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Simplify => "meshopt",
            Self::Update => "meshopt-update",
        }
    }

    /// The function and its version.
    pub fn description(self) -> String {
        let function = match self {
            Self::Simplify => "simplify",
            Self::Update => "simplifyWithUpdate",
        };
        format!("{VERSION}, {function}, 1 thread")
    }

    /// The function, if it is built in.
    #[cfg(feature = "baseline")]
    pub fn solver(self) -> Option<Solver> {
        Some(match self {
            Self::Simplify => built_in::simplify,
            Self::Update => built_in::update,
        })
    }

    /// The function, if it is built in.
    #[cfg(not(feature = "baseline"))]
    pub fn solver(self) -> Option<Solver> {
        None
    }
}

/// Without a limit on the error, for the face count is the target.
#[cfg(feature = "baseline")]
mod built_in {
    use meshopt::{SimplifyOptions, VertexDataAdapter};

    use super::Single;

    const NO_LIMIT: f32 = 1e6;

    pub fn simplify(mesh: Single, faces: usize) -> Single {
        let Single { positions, mut indices } = mesh;
        // Whole rows at offset zero are what the adapter wants; it has no other reason to refuse.
        if let Ok(vertices) = VertexDataAdapter::new(bytemuck::cast_slice(&positions), size_of::<[f32; 3]>(), 0) {
            indices = meshopt::simplify(&indices, &vertices, 3 * faces, NO_LIMIT, SimplifyOptions::None, None);
        }
        Single { positions, indices }
    }

    pub fn update(mesh: Single, faces: usize) -> Single {
        let Single { mut positions, mut indices } = mesh;
        let (attributes, weights, stride, locks) = (&mut [], &[], 0, None);
        let (corners, options) = (3 * faces, SimplifyOptions::None);
        let left = meshopt::simplify_with_update(
            &mut indices,
            &mut positions,
            attributes,
            weights,
            stride,
            locks,
            corners,
            NO_LIMIT,
            options,
            None,
        );
        indices.truncate(left);
        Single { positions, indices }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_that_of_the_lock_file() {
        let lock = include_str!("../../../Cargo.lock");
        let version = lock.split("name = \"meshopt\"\nversion = \"").nth(1).and_then(|rest| rest.split('"').next());
        assert!(VERSION.ends_with(&format!("(crate meshopt {})", version.expect("a dependency"))), "{version:?}");
    }

    #[cfg(feature = "baseline")]
    #[test]
    fn both_reach_a_flat_square() {
        // A flat grid of four squares: everything inside is free to go.
        let positions = (0..9).map(|i| [(i % 3) as f32, (i / 3) as f32, 0.0]).collect();
        let indices = [0, 1, 3, 4].into_iter().flat_map(|i| [i, i + 1, i + 3, i + 1, i + 4, i + 3]).collect();
        let grid = Single { positions, indices };
        for rival in Rival::ALL {
            let left = rival.solver().expect("it is built in")(grid.clone(), 2);
            assert_eq!(left.indices.len(), 6, "{rival:?}: {:?}", left.indices);
        }
    }
}
