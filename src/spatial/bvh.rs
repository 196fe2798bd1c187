//! A bounding volume hierarchy over the triangles of a mesh.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::Frame;
use super::bounds::Bounds;
use super::split::{Item, bounds_of, split};
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;

/// Most triangles in a leaf: makes 0.64 nodes a face.
pub const LEAF: usize = 4;

/// Levels below the root at most: 32 cut by cost, then halving, which takes 2³⁰ triangles to a leaf in 28.
pub const MOST_LEVELS: usize = 64;

/// Ranges up to this long become subtrees in one piece, by one thread.
const SUBTREE: usize = 1 << 13;

/// A box in the frame, and what is in it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Node {
    /// Lower corner.
    pub low: [f32; 3],
    /// The first of two nodes below, which stand side by side, or of a leaf's triangles.
    pub first: u32,
    /// Upper corner.
    pub high: [f32; 3],
    /// Triangles of a leaf; 0 for an inner node.
    pub count: u32,
}

impl Node {
    fn new(bounds: Bounds) -> Self {
        Self { low: bounds.low.to_array(), first: 0, high: bounds.high.to_array(), count: 0 }
    }
}

/// The tree over a mesh: 36 bytes a face, some 75 while it is built.
///
/// The same for any number of threads.
#[derive(Debug)]
pub struct Bvh<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) frame: Frame,
    /// The root first.
    pub(super) nodes: Vec<Node>,
    /// Corners of the triangles, leaf by leaf.
    pub(super) corners: Vec<[u32; 3]>,
    /// Which face each of them is.
    pub(super) faces: Vec<u32>,
}

/// A range of items that is to become the node `node`.
struct Open<'i> {
    node: usize,
    first: usize,
    depth: u32,
    items: &'i mut [Item],
}

impl<'a> Bvh<'a> {
    /// The tree over the faces of a mesh that passes [`Mesh::check`], in a frame that holds it.
    pub fn new(mesh: &'a Mesh, frame: Frame) -> Self {
        let mut items = Vec::new();
        (mesh.faces.par_iter().enumerate())
            .map(|(f, &face)| Item { bounds: outward(frame.corners(mesh, face)), face: f as u32 })
            .collect_into_vec(&mut items);
        let nodes = build(&mut items);
        let faces: Vec<u32> = items.into_par_iter().map(|item| item.face).collect();
        let corners = faces.par_iter().map(|&f| mesh.faces[f as usize]).collect();
        Self { mesh, frame, nodes, corners, faces }
    }

    /// The nodes, the root first; none over a mesh without faces.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The corners of the triangles in the order of the leaves.
    pub fn corners(&self) -> &[[u32; 3]] {
        &self.corners
    }

    /// Which face each triangle of [`Bvh::corners`] is.
    pub fn faces(&self) -> &[u32] {
        &self.faces
    }

    /// The frame that the boxes are in.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// The mesh below.
    pub fn mesh(&self) -> &'a Mesh {
        self.mesh
    }
}

/// The box of a triangle, rounded outward.
fn outward([a, b, c]: [DVec3; 3]) -> Bounds {
    let down = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
    let up = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    Bounds {
        low: Vec3::new(down(low.x), down(low.y), down(low.z)),
        high: Vec3::new(up(high.x), up(high.y), up(high.z)),
    }
}

/// Orders `items` leaf by leaf and returns the nodes above them.
///
/// Large ranges are cut level by level, all of a level side by side; what is left becomes subtrees, which are joined in
/// their order. Neither depends on who does it.
fn build(items: &mut [Item]) -> Vec<Node> {
    if items.is_empty() {
        return Vec::new();
    }
    let mut nodes = vec![Node::new(bounds_of(items))];
    let mut open = vec![Open { node: 0, first: 0, depth: 0, items }];
    let mut small = Vec::new();
    while !open.is_empty() {
        let (large, rest): (Vec<_>, Vec<_>) = open.into_iter().partition(|range| range.items.len() > SUBTREE);
        small.extend(rest);
        let halves: Vec<_> = large.into_par_iter().map(|range| (range.node, cut(range))).collect();
        open = Vec::with_capacity(2 * halves.len());
        for (node, (boxes, ranges)) in halves {
            nodes[node].first = nodes.len() as u32;
            for (bounds, range) in boxes.into_iter().zip(ranges) {
                open.push(Open { node: nodes.len(), ..range });
                nodes.push(Node::new(bounds));
            }
        }
    }
    let subtrees: Vec<_> = small.into_par_iter().map(|range| (range.node, subtree(range))).collect();
    nodes.reserve_exact(subtrees.iter().map(|(_, subtree)| subtree.len() - 1).sum());
    for (node, subtree) in subtrees {
        // The subtree's root is there already, so its other nodes move by one less.
        let shift = nodes.len() as u32 - 1;
        let moved = |n: Node| Node { first: if n.count == 0 { n.first + shift } else { n.first }, ..n };
        let mut subtree = subtree.into_iter().map(moved);
        if let Some(root) = subtree.next() {
            nodes[node] = root;
        }
        nodes.extend(subtree);
    }
    nodes
}

/// Cuts a range in two.
fn cut(range: Open<'_>) -> ([Bounds; 2], [Open<'_>; 2]) {
    let (middle, boxes) = split(range.items, range.depth);
    let (left, right) = range.items.split_at_mut(middle);
    let depth = range.depth + 1;
    let first = range.first + middle;
    (boxes, [Open { items: left, depth, ..range }, Open { node: range.node, first, depth, items: right }])
}

/// The nodes over a range, its root first, depth first.
fn subtree(range: Open<'_>) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(range.items.len());
    nodes.push(Node::new(bounds_of(range.items)));
    let mut open = vec![Open { node: 0, ..range }];
    while let Some(range) = open.pop() {
        let node = &mut nodes[range.node];
        if range.items.len() <= LEAF {
            (node.first, node.count) = (range.first as u32, range.items.len() as u32);
            continue;
        }
        let node = range.node;
        let (boxes, [left, right]) = cut(range);
        let below = nodes.len();
        nodes[node].first = below as u32;
        nodes.extend(boxes.map(Node::new));
        open.push(Open { node: below + 1, ..right });
        open.push(Open { node: below, ..left });
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{sample, shapes};

    /// Every face is in one leaf, every box holds what is below, and how deep the tree is.
    fn depth(bvh: &Bvh<'_>) -> usize {
        let mut seen = vec![false; bvh.mesh.faces.len()];
        let mut open = vec![(0, 0)];
        let mut deepest = 0;
        let mut nodes = 0;
        while let Some((node, depth)) = open.pop() {
            let Node { low, first, high, count } = bvh.nodes[node];
            let holds =
                |l: [f64; 3], h: [f64; 3]| (0..3).all(|k| f64::from(low[k]) <= l[k] && h[k] <= f64::from(high[k]));
            deepest = deepest.max(depth);
            nodes += 1;
            if count == 0 {
                for below in [first as usize, first as usize + 1] {
                    let child = &bvh.nodes[below];
                    assert!(holds(child.low.map(f64::from), child.high.map(f64::from)));
                    open.push((below, depth + 1));
                }
            }
            assert!(count as usize <= LEAF);
            for slot in first..first + count {
                let face = bvh.faces[slot as usize] as usize;
                assert!(!std::mem::replace(&mut seen[face], true), "face {face} twice");
                assert_eq!(bvh.corners[slot as usize], bvh.mesh.faces[face]);
                for corner in bvh.frame.corners(bvh.mesh, bvh.mesh.faces[face]) {
                    assert!(holds(corner.to_array(), corner.to_array()));
                }
            }
        }
        assert!(seen.iter().all(|&seen| seen) && nodes == bvh.nodes.len());
        deepest
    }

    #[test]
    fn the_tree_holds_every_face_once_and_is_shallow() {
        for mesh in [sample("statue", Some(30_000)).unwrap(), shapes::plane(3, 1), shapes::tetrahedron()] {
            let levels = depth(&Bvh::new(&mesh, Frame::of(&mesh, &mesh)));
            assert!(levels < 30, "{levels}");
        }
    }

    #[test]
    fn coincident_and_spiraling_triangles_stay_within_the_bounded_depth() {
        let coincident = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]; 50_000]);
        assert!(depth(&Bvh::new(&coincident, Frame::of(&coincident, &coincident))) < 20);
        // Every cut by cost takes off one triangle.
        let positions = (0..900).map(|i| DVec3::splat(0.5f64.powi(i / 3)) + DVec3::X * f64::from(i % 3) * 1e-3);
        let faces = (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let spiral = Mesh::new(positions.collect(), faces);
        assert!(depth(&Bvh::new(&spiral, Frame::of(&spiral, &spiral))) < MOST_LEVELS);
    }

    #[test]
    fn threads_do_not_change_the_tree() {
        let mesh = sample("part", Some(60_000)).unwrap();
        let trees = [1, 2, 5].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let bvh = pool.install(|| Bvh::new(&mesh, Frame::of(&mesh, &mesh)));
            (bvh.nodes, bvh.faces)
        });
        assert!(trees[0] == trees[1] && trees[0] == trees[2]);
    }
}
