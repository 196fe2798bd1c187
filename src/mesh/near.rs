//! Which points lie within a distance of each other, transitively.

use rayon::prelude::*;

use super::PARALLEL_ROWS;
use super::adjacency::group;
use super::disjoint::DisjointSets;
use super::key_table::KeyTable;
use crate::math::DVec3;

/// For every point the lowest index that a chain of steps of at most `distance` reaches.
///
/// A uniform grid whose cell has a diagonal of `distance`: points of one cell belong together without a test, and a point
/// reaches at most two cells far. Distances below 1e-300 of the largest coordinate count as that.
pub(super) fn within(points: &[DVec3], distance: f64) -> Vec<u32> {
    let largest = points.iter().fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
    // A little below 1/√3, so that rounding cannot make a cell longer than the distance.
    let cell = (distance * 0.577).max(largest * 1e-300).max(f64::MIN_POSITIVE);
    let cells: Vec<DVec3> = points.par_iter().with_min_len(PARALLEL_ROWS).map(|&p| (p / cell).floor()).collect();
    let (table, lowest_in_cell) = KeyTable::new(&cells);
    let (starts, members) = group(points.len(), points.len(), |p| [lowest_in_cell[p]]);
    let members_of = |first: u32| &members[starts[first as usize] as usize..starts[first as usize + 1] as usize];

    let reach = reach();
    let neighbors: Vec<(u32, u32)> = (0..points.len() as u32)
        .into_par_iter()
        .with_min_len(PARALLEL_ROWS)
        .filter(|&p| lowest_in_cell[p as usize] == p)
        .flat_map_iter(|p| {
            let (table, cell) = (&table, cells[p as usize]);
            // Where numbers are farther apart than cells are wide, a step may not leave the cell, and there is nothing to find.
            let neighbors = reach.iter().map(move |&step| cell + step).filter(move |&neighbor| neighbor != cell);
            neighbors.filter_map(move |neighbor| Some((p, table.find(neighbor)?)))
        })
        .filter(|&(a, b)| any_within(points, members_of(a), members_of(b), distance))
        .collect();

    let mut sets = DisjointSets::new(points.len());
    for (p, &first) in (0..).zip(&lowest_in_cell) {
        sets.join(p, first);
    }
    for (a, b) in neighbors {
        sets.join(a, b);
    }
    (0..points.len() as u32).map(|p| sets.find(p)).collect()
}

/// Half of the cells at most two away without the far corners, the other half being their mirror image.
fn reach() -> Vec<DVec3> {
    (0..125)
        .map(|i| [i / 25 - 2, i / 5 % 5 - 2, i % 5 - 2])
        .filter(|&step| step > [0; 3] && step.map(i32::abs) != [2; 3])
        .map(|step| DVec3::from(step.map(f64::from)))
        .collect()
}

/// Whether a point of `a` and one of `b` are close. Only those near the other's box are compared.
fn any_within(points: &[DVec3], a: &[u32], b: &[u32], distance: f64) -> bool {
    let near_box = |some: &[u32], others: &[u32]| -> Vec<DVec3> {
        let mut box_of = others.iter().map(|&p| points[p as usize]);
        let Some(first) = box_of.next() else { return Vec::new() };
        let (low, high) = box_of.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        let close = some.iter().map(|&p| points[p as usize]);
        close.filter(|&p| p.distance(p.clamp(low, high)) <= distance).collect()
    };
    let (near_b, near_a) = (near_box(a, b), near_box(b, a));
    near_b.iter().any(|p| near_a.iter().any(|q| p.distance(*q) <= distance))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_chain_becomes_one_set() {
        let points: Vec<DVec3> = [3.0, 0.0, 1.0, 2.0, 4.5].map(|x| DVec3::new(x, 0.0, 0.0)).to_vec();
        assert_eq!(within(&points, 1.0), [0, 0, 0, 0, 4]);
        assert_eq!(within(&points, 0.99), [0, 1, 2, 3, 4]);
        assert_eq!(within(&points, f64::INFINITY), [0; 5]);
    }

    #[test]
    fn extreme_coordinates_stay_apart() {
        let points = [1e308, -1e308, 1e-308, 0.0, 1e308].map(|x| DVec3::new(x, 0.0, 0.0));
        assert_eq!(within(&points, 1e-12), [0, 1, 2, 2, 0]);
        assert_eq!(within(&points, f64::MIN_POSITIVE), [0, 1, 2, 2, 0]);
    }

    proptest! {
        #[test]
        fn agrees_with_comparing_all_pairs(
            coordinates in prop::collection::vec([-2.0..2.0f64, -2.0..2.0, -0.2..0.2], 0..60),
            distance in 0.01..1.0f64,
        ) {
            let points: Vec<DVec3> = coordinates.into_iter().map(DVec3::from).collect();
            let mut sets = DisjointSets::new(points.len());
            for a in 0..points.len() {
                for b in 0..a {
                    if points[a].distance(points[b]) <= distance {
                        sets.join(a as u32, b as u32);
                    }
                }
            }
            let plain: Vec<u32> = (0..points.len() as u32).map(|p| sets.find(p)).collect();
            prop_assert_eq!(within(&points, distance), plain);
        }
    }
}
