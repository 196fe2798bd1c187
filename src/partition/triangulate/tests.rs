use std::f64::consts::TAU;

use proptest::prelude::*;

use super::cases::*;
use super::sides::{segments_meet, turn};
use super::*;
use crate::math::{DVec2, radius_ratio};

const BOTH: [Triangulation; 2] = [Triangulation::Earcut, Triangulation::Ears];

/// Triangulates and looks at the result without the help of `is_whole`.
fn checked(outline: &Outline, by: Triangulation) -> Vec<[u32; 3]> {
    assert_eq!(outline.fault(), None);
    let triangles = triangulate(outline, by).expect("an outline without fault");
    check(outline, &triangles);
    triangles
}

fn check(outline: &Outline, triangles: &[[u32; 3]]) {
    let vertex = |i: u32| outline.vertices[i as usize];
    let mut edges: Vec<[u32; 2]> =
        triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).map(|edge| edge.map(vertex)).collect();
    edges.sort_unstable();
    assert!(edges.windows(2).all(|pair| pair[0] != pair[1]), "an edge occurs twice");
    assert!(edges.iter().all(|[a, b]| a != b), "an edge without length");
    let ring_edges = (0..).zip(outline.successors()).map(|(a, b)| [a, b].map(vertex));
    let mut borders: Vec<[u32; 2]> = ring_edges.collect();
    borders.sort_unstable();
    let alone: Vec<[u32; 2]> = edges.iter().copied().filter(|&[a, b]| edges.binary_search(&[b, a]).is_err()).collect();
    assert_eq!(alone, borders, "edges with one triangle are those of the outline");
    let points = outline.scaled();
    let areas = triangles.iter().map(|t| {
        let [a, b, c] = t.map(|i| points[i as usize]);
        assert!(turn(a, b, c) > 0.0, "{t:?} has no area");
        (b - a).perp_dot(c - a) / 2.0
    });
    let whole: f64 = outline.rings().map(|ring| signed_area(&points[ring])).sum();
    assert!((areas.sum::<f64>() - whole).abs() <= 1e-9 * whole);
}

fn plain_count(outline: &Outline) -> usize {
    outline.points.len() + 2 * (outline.rings().len() - 1) - 2
}

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

/// Against a look at all corners and all points for each ear.
#[test]
fn the_roundest_ear_goes_first() {
    for (outline, seed) in (0..40).map(|seed| (outline(&[star([0.0; 2], 60, 1.0, 0.97, seed)]), seed)) {
        let points = outline.scaled();
        let mut ring: Vec<u32> = (0..60).collect();
        let mut expected = Vec::new();
        while ring.len() > 2 {
            let corner = |at: usize| [ring.len() - 1, 0, 1].map(|step| ring[(at + step) % ring.len()]);
            let mut best = (-1.0, 0);
            for at in 0..ring.len() {
                let [a, b, c] = corner(at).map(|i| points[i as usize]);
                let holds = |&i: &u32| {
                    let p = points[i as usize];
                    turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
                };
                let others = ring.iter().filter(|i| !corner(at).contains(i));
                let ratio = radius_ratio([a.distance(b), b.distance(c), c.distance(a)]);
                if turn(a, b, c) > 0.0 && ratio > best.0 && !others.into_iter().any(holds) {
                    best = (ratio, at);
                }
            }
            expected.push(corner(best.1));
            ring.remove(best.1);
        }
        assert_eq!(checked(&outline, Triangulation::Ears), expected, "{seed}");
    }
}

/// A hole in the middle of a square: its top is joined with the upper right corner.
#[test]
fn holes_are_joined_with_what_is_above() {
    let ring = |s: f64| vec![[-s, -s], [s, -s], [s, s], [-s, s]];
    let mut hole = ring(1.0);
    hole.reverse();
    let outline = outline(&[ring(3.0), hole]);
    let points = outline.scaled();
    let west = crossings::sweep(&outline, &points).expect("no fault");
    let mut nodes = Nodes::new(&outline, &points);
    bridge::bridge(&mut nodes, &points, &west, |_, _| true).expect("a bridge");
    // 3 --------- 2        The top of the hole, 5, and the nearest of the corners above it.
    // |  4 --- 5  |
    // |  |     |  |
    // |  7 --- 6  |
    // 0 --------- 1
    let ring: Vec<u32> = nodes.ring(0).map(|node| nodes.point[node as usize]).collect();
    assert_eq!(ring, [0, 1, 2, 5, 6, 7, 4, 5, 2, 3]);
}

#[test]
fn bridges_do_not_cross() {
    for (holes, corners, roughness) in [(12, 12, 0.9), (20, 4, 0.2), (8, 40, 0.99)] {
        for seed in 0..3 {
            let outline = turned(plate(holes, corners, roughness, seed), f64::from(seed));
            let points = outline.scaled();
            let west = crossings::sweep(&outline, &points).expect("no fault");
            let mut nodes = Nodes::new(&outline, &points);
            bridge::bridge(&mut nodes, &points, &west, |_, _| true).expect("bridges");
            // The bridges are the edges of the nodes added, each walked both ways.
            let at = |node: u32| points[nodes.point[node as usize] as usize];
            let first = points.len() as u32;
            let bridges: Vec<[DVec2; 2]> =
                (first..nodes.next.len() as u32).step_by(2).map(|node| [at(node), at(node + 1)]).collect();
            assert_eq!(bridges.len(), (holes * holes) as usize);
            let edges = (0..first).map(|i| [i, outline.successor(i)].map(|i| points[i as usize]));
            let all: Vec<[DVec2; 2]> = edges.chain(bridges.iter().copied()).collect();
            for (i, bridge) in bridges.iter().enumerate() {
                for (j, other) in all.iter().enumerate().filter(|&(j, _)| j != first as usize + i) {
                    let shares_end = bridge.iter().any(|end| other.contains(end));
                    assert!(shares_end || !segments_meet(*bridge, *other), "{holes} {seed}: bridge {i} and edge {j}");
                }
            }
            assert_eq!(nodes.ring(0).count(), nodes.next.len(), "not one ring");
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

/// Against what a look at all pairs of edges and at the winding number beside every edge says; with small whole coordinates most
/// rings touch themselves or each other somewhere.
#[test]
fn faults_are_those_of_all_pairs() {
    let (mut sound, mut pinched) = (0, 0);
    for seed in 0..30_000 {
        let number = |i: u32, most: u32| tie_number(i, seed) % most;
        let mut rings: Vec<Vec<[f64; 2]>> = Vec::new();
        for ring in 0..1 + number(0, 3) {
            let count = 3 + number(1 + ring, 4);
            let grid = if ring == 0 { 6 } else { 5 };
            let at = |i: u32, axis: u32| f64::from(number(100 * ring + 10 * i + axis, grid));
            let mut points: Vec<[f64; 2]> = (2..2 + count).map(|i| [at(i, 0), at(i, 1)]).collect();
            if ring == 0 {
                points = vec![[-1., -1.], [6., -1.], [6., 6.], [-1., 6.]];
                points.splice(2..2, (2..2 + count / 2).map(|i| [at(i, 0), at(i, 1)]));
            }
            rings.push(points);
        }
        let outline = outline(&rings);
        let expected = is_sound_by_pairs(&outline);
        let fault = outline.fault();
        assert_eq!(fault.is_none(), expected, "{seed}: {fault:?} {rings:?}");
        if expected {
            sound += 1;
            let mut vertices = outline.vertices.clone();
            vertices.sort_unstable();
            vertices.dedup();
            pinched += usize::from(vertices.len() < outline.vertices.len());
            BOTH.into_iter().for_each(|by| drop(checked(&outline, by)));
        } else {
            BOTH.into_iter().for_each(|by| assert_eq!(triangulate(&outline, by), None));
        }
    }
    assert!(sound > 1000 && pinched > 100, "{sound} {pinched}");
}

fn tie_number(index: u32, seed: u32) -> u32 {
    crate::math::tie_hash(index, seed) >> 8
}

fn is_sound_by_pairs(outline: &Outline) -> bool {
    let n = outline.points.len();
    let edge = |i: usize| [i as u32, outline.successor(i as u32)].map(|i| outline.points[i as usize]);
    for i in 0..n {
        let [a, b] = edge(i);
        if a == b {
            return false;
        }
        for j in 0..i {
            let [c, d] = edge(j);
            let shared = [a, b].into_iter().find(|&p| p == c || p == d);
            let fits = match shared {
                None => !segments_meet([a, b], [c, d]),
                Some(p) => {
                    let [q, r] = [if p == a { b } else { a }, if p == c { d } else { c }];
                    turn(p, q, r) != 0.0 || (q - p).dot(r - p) < 0.0
                }
            };
            if !fits {
                return false;
            }
        }
    }
    let winding = |p: DVec2| -> i32 {
        let passes = (0..n).map(edge).map(|[a, b]| match ((a.y > p.y), (b.y > p.y)) {
            (false, true) if turn(a, b, p) > 0.0 => 1,
            (true, false) if turn(a, b, p) < 0.0 => -1,
            _ => 0,
        });
        passes.sum()
    };
    (0..n).map(edge).all(|[a, b]| {
        let aside = (b - a).perp() * 1e-4;
        let middle = a + (b - a) * 0.4987;
        winding(middle + aside) == 1 && winding(middle - aside) == 0
    })
}

#[test]
fn crossings_are_found() {
    let square = || vec![[0., 0.], [4., 0.], [4., 4.], [0., 4.]];
    let hole = |x: f64, y: f64| vec![[x, y], [x, y + 1.], [x + 1., y + 1.], [x + 1., y]];
    let crossing = |rings: &[Vec<[f64; 2]>]| crossed(&outline(rings));
    assert_eq!(crossing(&[square(), hole(1., 1.)]), None);
    // The two sides of a bow tie.
    assert_eq!(crossing(&[vec![[0., 0.], [4., 4.], [4., 0.], [0., 4.]]]).map(sorted), Some([0, 2]));
    // A corner of a hole on a side, and one across it.
    assert_eq!(crossing(&[square(), vec![[4., 2.], [3., 1.], [3., 3.]]]).map(|edges| edges.contains(&1)), Some(true));
    assert_eq!(crossing(&[square(), hole(3.5, 1.)]).map(|edges| edges.contains(&1)), Some(true));
    // Two vertices at one place.
    let mut pinched = outline(&[square(), vec![[0., 0.], [1., 2.], [2., 1.]]]);
    assert_eq!(crossed(&pinched), None);
    pinched.vertices[4] = 99;
    assert_eq!(crossed(&pinched).map(sorted), Some([0, 4]));
    // One vertex at two places.
    let mut torn = outline(&[square(), hole(1., 1.)]);
    torn.vertices[6] = 0;
    assert_eq!(crossed(&torn), Some([0, 6]));
    // A hole outside and one in another: no edges cross.
    assert_eq!(outline(&[square(), hole(1., 1.), hole(7., 7.)]).fault(), Some(Fault::Misplaced(2)));
    let inner = vec![[1.2, 1.2], [1.2, 1.8], [1.8, 1.8], [1.8, 1.2]];
    assert_eq!(outline(&[square(), hole(1., 1.), inner.clone()]).fault(), Some(Fault::Misplaced(2)));
    assert_eq!(crossed(&outline(&[square(), inner, hole(1., 1.)])), None);
}

fn crossed(outline: &Outline) -> Option<[usize; 2]> {
    match outline.fault() {
        Some(Fault::Crossing(edges)) => Some(edges),
        _ => None,
    }
}

fn sorted(mut edges: [usize; 2]) -> [usize; 2] {
    edges.sort_unstable();
    edges
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
        let at = |i: u32| [1, 2].map(|axis| f64::from(crate::math::tie_hash(i, axis) % places));
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
    for seed in 0..50 {
        let step = |i: u32| i64::from(crate::math::tie_hash(i, seed) % 5) - 2;
        let mut ring: Vec<[f64; 2]> =
            (0..60).map(|i| [1.0 + f64::from(i) / 60.0, next(1.0 + f64::from(i) / 60.0, step(i))]).collect();
        ring.push([1.2, 3.0]);
        let outline = outline(&[ring]);
        if outline.fault().is_none() {
            let triangles = triangulate(&outline, Triangulation::Ears).expect("triangles");
            assert_eq!(triangles.len(), 59);
        }
    }
}

#[test]
fn flips_make_rounder_triangles() {
    for shape in [plate(5, 20, 0.5, 1), comb(30), turned(spiral(100, 3.0), 0.5)] {
        let angle = |triangles: &[[u32; 3]]| {
            let angles = triangles.iter().map(|t| {
                let [a, b, c] = t.map(|i| shape.points[i as usize]);
                (b - a).angle_to(c - a).min((c - b).angle_to(a - b)).min((a - c).angle_to(b - c))
            });
            angles.sum::<f64>() / triangles.len() as f64
        };
        for by in BOTH {
            let mut triangles = checked(&shape, by);
            let before = angle(&triangles);
            improve(&shape, &mut triangles, |_, _| false);
            check(&shape, &triangles);
            assert!(angle(&triangles) > before, "{by:?}: {} after {before}", angle(&triangles));
            let again = triangles.clone();
            improve(&shape, &mut triangles, |_, _| false);
            assert_eq!(triangles, again, "not done the first time");
        }
    }
    // The long diagonal of a kite, unless the short one is taken.
    let kite = outline(&[vec![[0., 0.], [3., -1.], [6., 0.], [3., 1.]]]);
    let long = [[0, 1, 2], [0, 2, 3]];
    let mut triangles = long;
    improve(&kite, &mut triangles, |a, b| [a.min(b), a.max(b)] == [1, 3]);
    assert_eq!(triangles, long);
    improve(&kite, &mut triangles, |_, _| false);
    check(&kite, &triangles);
    assert!(triangles.iter().all(|t| t.contains(&1) && t.contains(&3)), "{triangles:?}");
}

/// Whether some other diagonal of an outline without pinches crosses one of its own.
fn is_avoidable(outline: &Outline, [a, b]: [u32; 2]) -> bool {
    let at = |i: u32| outline.points[i as usize];
    let n = outline.points.len() as u32;
    let crosses = |[p, q]: [u32; 2], [r, s]: [u32; 2]| {
        let shares_end = [p, q].iter().any(|end| [r, s].contains(end));
        !shares_end && segments_meet([p, q].map(at), [r, s].map(at))
    };
    let all = (0..n).flat_map(|p| (0..p).map(move |q| [p, q]));
    all.into_iter().any(|[p, q]| {
        let is_free = || {
            (0..n).all(|i| {
                let on_it =
                    i != p && i != q && turn(at(p), at(q), at(i)) == 0.0 && segments_meet([at(p), at(q)], [at(i); 2]);
                !on_it && !crosses([p, q], [i, outline.successor(i)])
            })
        };
        crosses([p, q], [a, b]) && is_free()
    })
}

#[test]
fn an_edge_is_flipped_away() {
    for shape in [plate(3, 12, 0.5, 1), outline(&[star([0.0; 2], 60, 1.0, 0.9, 1)]), comb(8)] {
        for by in BOTH {
            let triangles = checked(&shape, by);
            let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
            let has = |triangles: &[[u32; 3]], [a, b]: [u32; 2]| {
                triangles.iter().flat_map(sides).any(|side| side == [a, b] || side == [b, a])
            };
            let (mut gone, mut kept) = (0, 0);
            for diagonal in triangles.iter().flat_map(sides) {
                let mut after = triangles.clone();
                if flip_away(&shape, &mut after, diagonal, |_, _| false) {
                    gone += 1;
                    check(&shape, &after);
                    assert!(!has(&after, diagonal));
                } else {
                    assert_eq!(after, triangles);
                    let is_side = (0..).zip(shape.successors()).any(|side| diagonal == [side.0, side.1]);
                    kept += usize::from(!is_side && is_avoidable(&shape, diagonal));
                }
                let mut after = triangles.clone();
                assert!(!flip_away(&shape, &mut after, diagonal, |_, _| true) && after == triangles);
            }
            println!("{by:?}: {gone} gone, {kept} kept");
        }
    }
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
