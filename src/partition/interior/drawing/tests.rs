//! Triangles stay a triangulation of their outline whatever is put in and taken out.

use super::super::super::triangulate::sides::triangle_holds;
use super::*;

/// Counter-clockwise from the least corner, sorted.
fn sorted(drawing: Drawing<'_>) -> Vec<[u32; 3]> {
    let turned = |t: [u32; 3]| {
        let least = (0..3).min_by_key(|&k| t[k]).unwrap_or_default();
        [0, 1, 2].map(|i| t[(least + i) % 3])
    };
    let mut triangles: Vec<[u32; 3]> = drawing.into_parts().0.into_iter().map(turned).collect();
    triangles.sort_unstable();
    triangles
}

/// Links go both ways, and every triangle is the right way round.
fn check(drawing: &Drawing<'_>) {
    for t in 0..drawing.triangles.len() as u32 {
        for k in 0..3 {
            let other = drawing.across[t as usize][k];
            let [a, b] = drawing.edge(t, k);
            assert!(
                other == NONE
                    || (0..3).any(|j| drawing.edge(other, j) == [b, a] && drawing.across[other as usize][j] == t)
            );
        }
        assert!(drawing.side(drawing.edge(t, 0), drawing.triangles[t as usize][2]) > 0.0);
    }
}

/// Puts a vertex into the first triangle that holds it.
fn put(drawing: &mut Drawing<'_>, vertex: u32) -> bool {
    let holds = |&t: &u32| (0..3).all(|k| drawing.side(drawing.edge(t, k), vertex) >= 0.0);
    let found = (0..drawing.len() as u32).find(holds);
    found.is_some_and(|t| drawing.insert(vertex, t).is_some())
}

fn points(list: &[[f64; 2]]) -> Vec<DVec2> {
    list.iter().map(|&p| DVec2::from(p)).collect()
}

#[test]
fn a_point_in_a_triangle_makes_three() {
    let points = points(&[[0.0, 0.0], [3.0, 0.0], [0.0, 3.0], [1.0, 1.0]]);
    let kept = KeptEdges::default();
    let mut drawing = Drawing::new(&points, vec![[0, 1, 2]], &kept);
    assert!(put(&mut drawing, 3));
    check(&drawing);
    assert_eq!(sorted(drawing), [[0, 1, 3], [0, 3, 2], [1, 2, 3]]);
}

#[test]
fn a_point_on_an_edge_makes_four_unless_the_edge_stays() {
    let points = points(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0], [1.0, 0.0], [5.0, 5.0]]);
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    let kept = KeptEdges::default();
    let mut drawing = Drawing::new(&points, triangles.clone(), &kept);
    assert!(put(&mut drawing, 4));
    check(&drawing);
    assert!(!put(&mut drawing, 5), "on the outline");
    assert!(!put(&mut drawing, 6), "outside");
    assert!(!put(&mut drawing, 4), "at a corner");
    assert_eq!(sorted(drawing), [[0, 1, 4], [0, 4, 3], [1, 2, 4], [2, 3, 4]]);
    let kept = KeptEdges::from_iter([[0, 2]]);
    let mut drawing = Drawing::new(&points, triangles.clone(), &kept);
    assert!(!put(&mut drawing, 4));
    assert_eq!(sorted(drawing), triangles);
}

/// The diagonal 0–2 of a flat diamond is longer than 1–3: a point below it flips it, unless it stays.
#[test]
fn edges_flip_toward_delaunay() {
    let points = points(&[[0.0, 0.0], [4.0, -1.0], [8.0, 0.0], [4.0, 1.0], [4.0, -0.5]]);
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    let kept = KeptEdges::default();
    let mut drawing = Drawing::new(&points, triangles.clone(), &kept);
    assert!(put(&mut drawing, 4));
    check(&drawing);
    assert_eq!(sorted(drawing), [[0, 1, 4], [0, 4, 3], [1, 2, 4], [2, 3, 4]]);
    let kept = KeptEdges::from_iter([[0, 2]]);
    let mut drawing = Drawing::new(&points, triangles, &kept);
    assert!(put(&mut drawing, 4));
    assert_eq!(sorted(drawing), [[0, 1, 4], [0, 2, 3], [0, 4, 2], [1, 2, 4]]);
}

/// A vertex with five around it: the fan from each takes its place, and points stay in what holds them.
#[test]
fn a_fan_takes_the_place_of_a_star() {
    let list = [[0.0, 0.0], [4.0, 0.0], [5.0, 3.0], [2.0, 5.0], [-1.0, 3.0], [2.0, 2.0], [2.5, 1.0], [1.0, 3.0]];
    let points = points(&list);
    let kept = KeptEdges::default();
    for apex in 0..5 {
        let triangles = (0..5).map(|i| [i, (i + 1) % 5, 5]).collect();
        let mut drawing = Drawing::new(&points, triangles, &kept);
        drawing.add(0, 6);
        drawing.add(3, 7);
        let mut star = Star::default();
        assert!(drawing.star(5, 2, &mut star));
        assert_eq!(star.ring, [2, 3, 4, 0, 1]);
        assert_eq!(drawing.remove(5, &star, apex).len(), 3);
        let mut members = Vec::new();
        let (triangles, lists) = drawing.into_parts();
        for (triangle, list) in triangles.iter().zip(lists) {
            let corners = triangle.map(|v| points[v as usize]);
            assert!(turn(corners[0], corners[1], corners[2]) > 0.0 && triangle.contains(&[2, 3, 4, 0, 1][apex]));
            assert!(list.iter().all(|&p| triangle_holds(corners, points[p as usize])));
            members.extend(list);
        }
        members.sort_unstable();
        assert_eq!((triangles.len(), members), (3, vec![5, 6, 7]));
    }
}

/// Around a hole: a square ring of eight triangles.
#[test]
fn many_points_keep_the_outline_and_the_area() {
    let mut list = vec![[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [3.0, 3.0], [6.0, 3.0], [6.0, 6.0], [3.0, 6.0]];
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    while list.len() < 600 {
        let p = [9.0 * random(), 9.0 * random()];
        // Every third on lines that others are on too.
        let p = if list.len() % 3 == 0 { [p[0].round(), p[1]] } else { p };
        if !p.iter().all(|x| (3.0..=6.0).contains(x)) {
            list.push(p);
        }
    }
    let points = points(&list);
    let ring = (0..4).flat_map(|i| {
        let (j, inner) = ((i + 1) % 4, i + 4);
        [[i, j, inner], [j, j + 4, inner]]
    });
    let kept: KeptEdges = (0..4)
        .flat_map(|i| [[i, (i + 1) % 4], [i + 4, (i + 1) % 4 + 4]])
        .map(|[a, b]: [u32; 2]| [a.min(b), a.max(b)])
        .collect();
    let mut drawing = Drawing::new(&points, ring.collect(), &kept);
    let inserted = (8..600).filter(|&v| put(&mut drawing, v)).count();
    check(&drawing);
    // Those that were put on the outline, and those at the place of another, stay out.
    assert!(inserted > 550, "{inserted}");
    let borders: Vec<[u32; 2]> = (0..drawing.triangles.len() as u32)
        .flat_map(|t| [0, 1, 2].map(|k| (t, k)))
        .filter(|&(t, k)| drawing.across[t as usize][k] == NONE)
        .map(|(t, k)| drawing.edge(t, k))
        .collect();
    assert_eq!(borders.len(), 8);
    assert!(borders.iter().all(|&[a, b]| kept.contains(&[a.min(b), a.max(b)])));
    assert_eq!(drawing.triangles.len(), 8 + 2 * inserted);
    // No edge but those of the outline can flip any more.
    for t in 0..drawing.triangles.len() as u32 {
        assert!((0..3).all(|k| !drawing.should_flip(t, k)));
    }
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        (b - a).perp_dot(c - a) / 2.0
    };
    assert!((drawing.triangles.iter().map(area).sum::<f64>() - 72.0).abs() < 1e-9);
}

/// The corners of a grid's cells lie on circles: no rounding turns their diagonals, which what is less than that off does.
#[test]
fn what_is_on_a_circle_stays() {
    let kept = KeptEdges::default();
    let flips = |by: f64| {
        let cells = (0..100).map(|i| DVec2::new(f64::from(i), f64::from(i * i)) / 7.0);
        cells
            .filter(|&low| {
                let corners = [[0.0, 0.0], [1.0, 0.0], [1.0 - by, 1.0 - by], [0.0, 1.0]];
                let points = corners.map(|p| low + DVec2::from(p) / 7.0);
                let drawing = Drawing::new(&points, vec![[0, 1, 3], [1, 2, 3]], &kept);
                drawing.should_flip(0, 1)
            })
            .count()
    };
    assert_eq!([flips(0.0), flips(-1e-6), flips(1e-6)], [0, 0, 100]);
}
