//! Of all steps together.

use std::f64::consts::TAU;

use proptest::prelude::*;

use super::cases::*;
use super::*;
use crate::math::tie_hash;

#[test]
fn shapes_of_every_kind_are_filled() {
    let shapes = [
        ("triangle", outline(&[vec![[0., 0.], [1., 0.], [0., 1.]]])),
        ("comb", comb(40)),
        ("spiral", spiral(200, 5.0)),
        ("star", outline(&[star([0.0; 2], 300, 1.0, 0.9, 1)])),
        ("plate", plate(6, 20, 0.5, 1)),
        ("plate with square holes", plate(6, 4, 0.0, 1)),
    ];
    for (name, shape) in shapes {
        for angle in [0.0, 0.3, TAU / 4.0, 3.0] {
            let shape = turned(shape.clone(), angle);
            for by in BOTH {
                assert_eq!(checked(&shape, by).len(), plain_count(&shape), "{name} {angle} {by:?}");
            }
        }
    }
}

#[test]
fn results_are_the_same_at_every_size() {
    let plate = plate(3, 12, 0.5, 7);
    for by in BOTH {
        let triangles = checked(&plate, by);
        for exponent in [-1000, -300, 300, 1000] {
            let mut sized = plate.clone();
            sized.points.iter_mut().for_each(|p| *p *= 2.0_f64.powi(exponent));
            assert_eq!(checked(&sized, by), triangles, "{exponent} {by:?}");
        }
    }
}

/// Rings that touch: the count is that of the rings that the inside sees.
#[test]
fn touching_rings_are_filled() {
    let square = vec![[0., 0.], [4., 0.], [4., 4.], [2., 4.], [0., 4.], [0., 2.]];
    // At a corner of the outer ring, at two of them in a row of holes, at each other, at a straight corner.
    let corner = vec![[0., 0.], [1., 2.], [2., 1.]];
    let straight = vec![[2., 4.], [3., 3.], [1., 3.]];
    let beside = vec![[2., 1.], [3., 2.], [3., 1.]];
    let alone = vec![[1.5, 2.], [2., 2.5], [2., 2.]];
    let joined: [(Vec<Vec<[f64; 2]>>, usize); 5] = [
        (vec![square.clone(), corner.clone()], 7),
        (vec![square.clone(), straight.clone()], 7),
        (vec![square.clone(), corner.clone(), straight.clone()], 10),
        (vec![square.clone(), corner.clone(), beside.clone()], 10),
        (vec![square.clone(), corner, beside, straight, alone], 18),
    ];
    for (rings, count) in joined {
        for angle in 0..16 {
            let outline = turned(outline(&rings), f64::from(angle) * TAU / 16.0 + 0.01);
            for by in BOTH {
                assert_eq!(checked(&outline, by).len(), count, "{by:?} {} {angle}", rings.len());
            }
        }
    }
}

/// Where a hole touches the outer ring, or two lobes are one ring, the inside goes on along other edges; where a ring that follows
/// the inside is closed by a pinch it does not.
#[test]
fn what_the_inside_joins_otherwise_is_told() {
    let square = vec![[0., 0.], [4., 0.], [4., 4.], [2., 4.], [0., 4.]];
    let hole = vec![[2., 4.], [3., 3.], [1., 3.]];
    let inside = vec![[2., 3.5], [3., 3.], [1., 3.]];
    let lobes = vec![[0., 0.], [2., -1.], [2., 1.], [0., 0.], [-2., 1.], [-2., -1.]];
    let closed = vec![[0., 0.], [4., 0.], [4., 4.], [2., 4.], [3., 1.], [1., 1.], [2., 4.], [0., 4.]];
    let told = |rings: &[Vec<[f64; 2]>]| first_joined_otherwise(&outline(rings));
    assert_eq!(told(&[square.clone(), hole]), Some(2));
    assert_eq!(told(&[lobes]), Some(2));
    assert_eq!([told(&[square, inside]), told(&[closed])], [None; 2]);
}

/// A ring closed by a pinch, and a region that hangs together at a vertex only.
#[test]
fn pinched_rings_are_filled() {
    let closed = vec![[0., 0.], [4., 0.], [4., 4.], [2., 4.], [3., 1.], [1., 1.], [2., 4.], [0., 4.]];
    let lobes = vec![[0., 0.], [2., -1.], [2., 1.], [0., 0.], [-2., 1.], [-2., -1.]];
    for (ring, count) in [(closed, 6), (lobes, 2)] {
        for start in 0..ring.len() {
            let mut ring = ring.clone();
            ring.rotate_left(start);
            for by in BOTH {
                assert_eq!(checked(&outline(&[ring.clone()]), by).len(), count, "{by:?} {start}");
            }
        }
    }
}

#[test]
fn hostile_outlines_are_refused() {
    let points = |points: &[[f64; 2]]| points.iter().map(|&p| p.into()).collect::<Vec<DVec2>>();
    let plane = |ring: &[[f64; 2]]| Outline {
        points: points(ring),
        vertices: (0..ring.len() as u32).collect(),
        ring_starts: vec![0, ring.len() as u32],
    };
    let square = plane(&[[0., 0.], [1., 0.], [1., 1.], [0., 1.]]);
    let mut cases = vec![
        Outline::default(),
        Outline { ring_starts: vec![], ..square.clone() },
        Outline { ring_starts: vec![0, 2, 4], ..square.clone() },
        Outline { ring_starts: vec![0, 4, 3, 4], ..square.clone() },
        Outline { ring_starts: vec![1, 4], ..square.clone() },
        Outline { ring_starts: vec![0, 9], ..square.clone() },
        Outline { vertices: vec![0; 3], ..square.clone() },
        Outline { vertices: vec![0; 4], ..square.clone() },
        plane(&[[0.0; 2]; 7]),
        plane(&[[0., 0.], [1., 0.], [2., 0.], [3., 0.]]),
        plane(&[[0., 0.], [1., 0.], [0., 0.], [0., 1.]]),
        plane(&[[0., 0.], [0., 1.], [1., 1.], [1., 0.]]),
        plane(&[[f64::INFINITY, 0.], [1., 0.], [2., 3.]]),
        plane(&[[f64::NAN, 0.], [1., 0.], [2., 3.]]),
        plane(&[[f64::MAX, 0.], [-f64::MAX, 0.], [0., f64::MAX], [0., -f64::MAX]]),
        plane(&[[5e-324, 0.], [0., 5e-324], [1., 1.], [1e-200, 1e-200]]),
    ];
    // Points without order, some of them in a row, and all in few places.
    for (count, places) in [(50, u32::MAX), (2000, u32::MAX), (2000, 40), (2000, 5)] {
        let at = |i: u32| [1, 2].map(|axis| f64::from(tie_hash(i, axis) % places));
        cases.push(outline(&[(0..count).map(at).collect()]));
    }
    for outline in cases {
        assert!(outline.fault().is_some());
        BOTH.into_iter().for_each(|by| assert_eq!(triangulate(&outline, by), None));
        improve(&outline, &mut [[0, 1, 2], [0, 0, 9]], |_, _| false);
        assert!(!flip_away(&outline, &mut [[0, 1, 2]], [0, 1], |_, _| false));
    }
}

/// Corners one unit in the last place beside a straight line.
#[test]
fn corners_that_are_almost_straight_are_used() {
    let next = |x: f64, steps: i64| f64::from_bits((x.to_bits() as i64 + steps) as u64);
    let mut used = 0;
    for seed in 0..50 {
        let step = |i: u32| i64::from(tie_hash(i, seed) % 5) - 2;
        let mut ring: Vec<[f64; 2]> =
            (0..60).map(|i| [1.0 + f64::from(i) / 60.0, next(1.0 + f64::from(i) / 60.0, step(i))]).collect();
        ring.push([1.2, 3.0]);
        let outline = outline(&[ring]);
        if outline.fault().is_none() {
            used += 1;
            let triangles = triangulate(&outline, Triangulation::Ears).expect("triangles");
            assert_eq!(triangles.len(), 59);
        }
    }
    assert!(used > 20, "{used} rings are simple");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn stars_with_holes_are_filled(
        seed in 0..u32::MAX / 2, corners in 3..60_u32, roughness in 0.0..0.95, holes in 1..6_u32, angle in 0.0..TAU, exponent in -900..900
    ) {
        let size = 2.0_f64.powi(exponent);
        let mut outline = turned(plate(holes, corners, roughness, seed), angle);
        outline.points.iter_mut().for_each(|p| *p *= size);
        for by in BOTH {
            prop_assert_eq!(checked(&outline, by).len(), plain_count(&outline));
        }
    }

    #[test]
    fn stars_are_filled_and_improved(seed in 0..u32::MAX, corners in 3..400_u32, roughness in 0.0..0.999) {
        let outline = outline(&[star([0.3, -0.2], corners, 1.0, roughness, seed)]);
        for by in BOTH {
            let mut triangles = checked(&outline, by);
            prop_assert_eq!(triangles.len(), corners as usize - 2);
            improve(&outline, &mut triangles, |a, b| (a + b) % 3 == 0);
            check(&outline, &triangles);
        }
    }
}
