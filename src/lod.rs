//! Levels of detail that share one list of vertices: a level is a list of indices.
//!
//! ```
//! use coarsen::contract::{Options, Placement};
//! use coarsen::{Budget, Device, Method, lod, mesh, simplify_levels};
//!
//! # fn main() -> coarsen::Result<()> {
//! let part = mesh::sample("part", Some(5_000))?;
//! let method = Method::Contract(Options { placement: Placement::Endpoint, ..Options::default() });
//! let budgets = [0.5, 0.25, 0.1].map(Budget::keep);
//! let levels = simplify_levels(&part, &method, &budgets, &Device::cpu(0)?, None)?;
//! let shared = lod::share_vertices(&levels)?;
//! assert_eq!(shared.vertices.positions.len(), levels[0].mesh.positions.len());
//! // A coarser level uses fewer of them, the first ones.
//! assert!(shared.levels[2].vertices < shared.levels[1].vertices);
//! # Ok(())
//! # }
//! ```

use crate::error::{Error, Result};
use crate::mesh::{Mesh, take};
use crate::simplify::Outcome;

/// Marks an input vertex that is in no level.
const NONE: u32 = u32::MAX;

/// Levels of one list of vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct SharedLevels {
    /// All vertices, with normals and colors as the finest level has them, and no faces. A coarser level uses the first of
    /// them.
    pub vertices: Mesh,
    /// One for each of those given.
    pub levels: Vec<SharedLevel>,
}

/// A level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SharedLevel {
    /// How many of the vertices it uses, all from the first on.
    pub vertices: usize,
    /// Its faces, in the order that they have in its own mesh.
    pub faces: Vec<[u32; 3]>,
}

/// Puts the vertices of `levels`, which go from fine to coarse, into one list in which each level uses the first ones.
///
/// Such are the levels of [`simplify_levels`](crate::simplify_levels()) by contraction with
/// [`Placement::Endpoint`](crate::contract::Placement::Endpoint), where every vertex of a level is one of the finer levels'.
///
/// # Errors
/// [`Error::Parameter`] for levels that have vertices of their own, or texture coordinates, which belong to corners.
pub fn share_vertices(levels: &[Outcome]) -> Result<SharedLevels> {
    let Some(finest) = levels.first() else {
        return Ok(SharedLevels { vertices: Mesh::default(), levels: Vec::new() });
    };
    if levels.iter().any(|level| level.mesh.texcoords.is_some()) {
        return Err(Error::Parameter("levels that share their vertices hold no texture coordinates: drop them".into()));
    }
    let rows = rows_in(finest, levels)?;
    let mut coarsest_use = vec![0; finest.mesh.positions.len()];
    for (number, rows) in rows.iter().enumerate() {
        rows.iter().for_each(|&row| coarsest_use[row as usize] = number);
    }
    let mut order: Vec<u32> = (0..coarsest_use.len() as u32).collect();
    order.sort_by_key(|&row| std::cmp::Reverse(coarsest_use[row as usize]));
    let mut place = vec![0; order.len()];
    (0..).zip(&order).for_each(|(new, &row)| place[row as usize] = new);

    let level = |(level, rows): (&Outcome, &Vec<u32>)| SharedLevel {
        vertices: rows.len(),
        faces: level.mesh.faces.iter().map(|face| face.map(|v| place[rows[v as usize] as usize])).collect(),
    };
    Ok(SharedLevels {
        vertices: Mesh {
            positions: take(&finest.mesh.positions, &order),
            normals: finest.mesh.normals.as_ref().map(|normals| take(normals, &order)),
            colors: finest.mesh.colors.as_ref().map(|colors| take(colors, &order)),
            ..Mesh::default()
        },
        levels: levels.iter().zip(&rows).map(level).collect(),
    })
}

/// For every level the vertex of the finest that each of its own is.
fn rows_in(finest: &Outcome, levels: &[Outcome]) -> Result<Vec<Vec<u32>>> {
    let past = finest.vertex_origin.iter().max().map_or(0, |&last| last as usize + 1);
    let refused = |number: usize| {
        let way = "contract with the placement 'endpoint', from fine to coarse";
        Error::Parameter(format!("level {} has vertices of its own: {way}", number + 1))
    };
    if past > u32::MAX as usize {
        return Err(refused(0));
    }
    let mut row_of = vec![NONE; past];
    (0..).zip(&finest.vertex_origin).for_each(|(row, &origin)| row_of[origin as usize] = row);
    let mut found: Vec<Vec<u32>> = Vec::with_capacity(levels.len());
    let mut uses = vec![0; finest.mesh.positions.len()];
    for (number, level) in levels.iter().enumerate() {
        let mut rows = Vec::with_capacity(level.vertex_origin.len());
        for (&origin, position) in level.vertex_origin.iter().zip(&level.mesh.positions) {
            let row = row_of.get(origin as usize).copied().filter(|&row| row != NONE).ok_or_else(|| refused(number))?;
            if uses[row as usize] != number || finest.mesh.positions[row as usize] != *position {
                return Err(refused(number));
            }
            uses[row as usize] += 1;
            rows.push(row);
        }
        found.push(rows);
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Device;
    use crate::contract::{Options, Placement};
    use crate::mesh::shapes;
    use crate::simplify::{Budget, Method, simplify_levels};

    fn levels(placement: Placement, shares: &[f64]) -> (Mesh, Vec<Outcome>) {
        let mut ball = shapes::icosphere(3);
        ball.colors = Some((0..ball.positions.len()).map(|i| [i as f32 / 1000.0, 0.5, 1.0, 1.0]).collect());
        let budgets: Vec<Budget> = shares.iter().map(|&share| Budget::keep(share)).collect();
        let method = Method::Contract(Options { placement, ..Options::default() });
        let device = Device::cpu(1).expect("a thread starts");
        let levels = simplify_levels(&ball, &method, &budgets, &device, None).expect("a valid mesh");
        (ball, levels)
    }

    #[test]
    fn a_coarser_level_uses_the_first_vertices() {
        let (_, levels) = levels(Placement::Endpoint, &[0.6, 0.3, 0.3, 0.1]);
        let shared = share_vertices(&levels).expect("nested levels");
        assert_eq!(shared.vertices.positions.len(), levels[0].mesh.positions.len());
        for (own, level) in shared.levels.iter().zip(&levels) {
            assert_eq!(own.vertices, level.mesh.positions.len());
            let used: std::collections::BTreeSet<u32> = own.faces.iter().flatten().copied().collect();
            assert!(used.into_iter().eq(0..own.vertices as u32));
            for (face, before) in own.faces.iter().zip(&level.mesh.faces) {
                let at =
                    |mesh: &Mesh, v: u32| (mesh.positions[v as usize], mesh.colors.as_ref().map(|c| c[v as usize]));
                let [ours, theirs] =
                    [(face, &shared.vertices), (before, &level.mesh)].map(|(f, m)| f.map(|v| at(m, v)));
                assert_eq!(ours, theirs);
            }
        }
    }

    #[test]
    fn levels_with_vertices_of_their_own_are_refused() {
        let refused = |levels: &[Outcome]| match share_vertices(levels) {
            Err(Error::Parameter(message)) => message,
            other => panic!("{other:?}"),
        };
        let (_, placed) = levels(Placement::Optimal, &[0.6, 0.3]);
        assert!(refused(&placed).contains("level 1 has vertices of its own"));
        let (_, mut nested) = levels(Placement::Endpoint, &[0.6, 0.3]);
        nested.reverse();
        assert!(refused(&nested).contains("level 2"));
        nested[0].mesh.texcoords = Some(Vec::new());
        assert!(refused(&nested).contains("no texture coordinates"));
        assert_eq!(share_vertices(&[]).map(|shared| shared.levels.len()).ok(), Some(0));
    }
}
