//! A surface by its texture coordinates: where on it a place of the texture lies, nearest to a point.

use rayon::join;

use super::rims::rims_of;
use crate::math::{DVec2, DVec3};
use crate::mesh::Mesh;

/// Faces of a leaf.
const LEAF_FACES: usize = 8;
/// Faces below which a thread of its own does not pay.
const LEAST_FACES: usize = 1 << 12;
/// How far outside a face, as a share of it, a place still belongs to it: on a border rounding must not decide.
const SLACK: f64 = 1e-9;

/// A face with an area in the texture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// Its corners in the texture.
    pub uv: [DVec2; 3],
    corners: [DVec3; 3],
    /// Twice the area in the texture, negative where it is mirrored.
    twice_area: f64,
}

impl Patch {
    /// A face of a mesh; `None` when it covers nothing of the texture.
    pub fn of(mesh: &Mesh, face: usize) -> Option<Self> {
        let uv = mesh.texcoords.as_ref()?[face].map(|uv| uv.as_dvec2());
        let twice_area = (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]);
        let corners = mesh.faces[face].map(|v| mesh.positions[v as usize]);
        (twice_area != 0.0).then_some(Self { uv, corners, twice_area })
    }

    /// The area in the texture.
    pub fn area(&self) -> f64 {
        self.twice_area.abs() / 2.0
    }

    /// What its corners weigh at a place of the texture: some are negative outside.
    fn weights(&self, place: DVec2) -> [f64; 3] {
        let [a, b, c] = self.uv;
        let second = (place - a).perp_dot(c - a) / self.twice_area;
        let third = (b - a).perp_dot(place - a) / self.twice_area;
        [1.0 - second - third, second, third]
    }

    fn weighted(&self, weights: [f64; 3]) -> DVec3 {
        let parts = self.corners.iter().zip(weights).map(|(&corner, weight)| corner * weight);
        parts.fold(DVec3::ZERO, |point, part| point + part)
    }

    /// The point of the face at a place of the texture; `None` outside.
    pub fn at(&self, place: DVec2) -> Option<DVec3> {
        let weights = self.weights(place);
        if !weights.iter().all(|&weight| weight >= -SLACK) {
            return None;
        }
        let weights = weights.map(|weight| weight.max(0.0));
        let sum: f64 = weights.iter().sum();
        Some(self.weighted(weights.map(|weight| weight / sum)))
    }

    /// The way from a point of `other` to an edge of this face, and from its place in the texture to that of the edge, as long as
    /// it is on `other`: about the shortest of all by points of the edge.
    fn distance_by(&self, edge: usize, point: DVec3, other: &Patch) -> f64 {
        let next = (edge + 1) % 3;
        let (from, along) = (self.corners[edge] - point, self.corners[next] - self.corners[edge]);
        let ends = [edge, next].map(|corner| other.weighted(other.weights(self.uv[corner])) - point);
        let (away, onward) = (ends[0], ends[1] - ends[0]);
        let length_sq = along.length_squared() + onward.length_squared();
        let t = -(from.dot(along) + away.dot(onward)) / length_sq;
        // Of an edge without a length any point will do.
        let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
        (from + along * t).length() + (away + onward * t).length()
    }

    fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for (&uv, &corner) in self.uv.iter().zip(&self.corners) {
            bounds.uv = [bounds.uv[0].min(uv), bounds.uv[1].max(uv)];
            bounds.points = [bounds.points[0].min(corner), bounds.points[1].max(corner)];
        }
        let slack = (bounds.uv[1] - bounds.uv[0]) * (4.0 * SLACK);
        bounds.uv = [bounds.uv[0] - slack, bounds.uv[1] + slack];
        bounds
    }
}

/// A box in the texture and one in space.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    uv: [DVec2; 2],
    points: [DVec3; 2],
}

impl Bounds {
    const EMPTY: Self =
        Self { uv: [DVec2::INFINITY, DVec2::NEG_INFINITY], points: [DVec3::INFINITY, DVec3::NEG_INFINITY] };

    fn union(self, other: Self) -> Self {
        Self {
            uv: [self.uv[0].min(other.uv[0]), self.uv[1].max(other.uv[1])],
            points: [self.points[0].min(other.points[0]), self.points[1].max(other.points[1])],
        }
    }

    fn holds(&self, place: DVec2) -> bool {
        place.cmpge(self.uv[0]).all() && place.cmple(self.uv[1]).all()
    }

    fn distance_sq(&self, point: DVec3) -> f64 {
        point.distance_squared(point.clamp(self.points[0], self.points[1]))
    }

    /// The middle as one row: u, v, x, y, z.
    fn middle(&self) -> [f64; 5] {
        let (uv, p) = ((self.uv[0] + self.uv[1]) / 2.0, self.points[0] / 2.0 + self.points[1] / 2.0);
        [uv.x, uv.y, p.x, p.y, p.z]
    }
}

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds,
    /// A leaf's first face; otherwise how far behind this node the second child stands. The first is the next.
    first: u32,
    /// The faces of a leaf; 0 for a node with children.
    count: u32,
    /// Whether a face of it has an edge on the rim of a chart.
    has_rim: bool,
}

/// Finds the points of a surface at a place of its texture.
///
/// A tree over boxes in the texture and in space at once: where thousands of faces repeat the same part of a texture,
/// the boxes in space still lead to the near ones.
#[derive(Debug)]
pub(super) struct Atlas<'a> {
    mesh: &'a Mesh,
    nodes: Vec<Node>,
    faces: Vec<u32>,
    /// Of each of these faces, as bits, which edges are on the rim of a chart.
    rims: Vec<u8>,
}

impl<'a> Atlas<'a> {
    /// The atlas of these faces of a mesh that passes [`Mesh::check`].
    pub fn new(mesh: &'a Mesh, faces: &[u32]) -> Self {
        let mut faces: Vec<u32> =
            faces.iter().copied().filter(|&face| Patch::of(mesh, face as usize).is_some()).collect();
        let whole = Builder { mesh, scale: [0.0; 5] }.bounds(&faces);
        // Lengths in the texture and in space are compared as shares of the whole.
        let shares = |size: f64| if size > 0.0 && size.is_finite() { 1.0 / size } else { 0.0 };
        let uv = shares((whole.uv[1] - whole.uv[0]).max_element());
        let point = shares((whole.points[1] - whole.points[0]).max_element());
        let builder = Builder { mesh, scale: [uv, uv, point, point, point] };
        let mut nodes = if faces.is_empty() { Vec::new() } else { builder.build(&mut faces, 0) };
        let rims = rims_of(mesh, &faces);
        // Children stand behind their node.
        for at in (0..nodes.len()).rev() {
            let Node { first, count, .. } = nodes[at];
            nodes[at].has_rim = match count {
                0 => nodes[at + 1].has_rim || nodes[at + first as usize].has_rim,
                _ => rims[first as usize..(first + count) as usize].iter().any(|&edges| edges != 0),
            };
        }
        Self { mesh, nodes, faces, rims }
    }

    /// How far the nearest point at a place of the texture is from `point`, which `patch`, of another mesh, has there; `None` where
    /// the texture is not used. Where the rim of a chart is nearer, with the texture's way from there, the place is past this rim,
    /// and what has been found lies on another part that shows the same texels: the way by the rim counts.
    pub fn distance(&self, place: DVec2, point: DVec3, patch: &Patch) -> Option<f64> {
        let nearest = self.nearest(place, point)?;
        Some(if nearest > 0.0 { self.nearest_rim(point, patch, nearest) } else { nearest })
    }

    /// The least of `least` and the ways by edges on rims, the nearest of which are tried first: where cards repeat a texture all
    /// edges are on rims.
    fn nearest_rim(&self, point: DVec3, patch: &Patch, mut least: f64) -> f64 {
        let distance_sq = |at: usize| self.nodes[at].bounds.distance_sq(point);
        let mut waiting = vec![(0, distance_sq(0))];
        while let Some((at, distance)) = waiting.pop() {
            let Node { first, count, has_rim, .. } = self.nodes[at];
            if !has_rim || distance >= least * least {
                continue;
            }
            if count == 0 {
                let [one, other] = [at + 1, at + first as usize].map(|child| (child, distance_sq(child)));
                waiting.extend(if one.1 <= other.1 { [other, one] } else { [one, other] });
                continue;
            }
            for number in first as usize..(first + count) as usize {
                let edges = (0..3).filter(|edge| self.rims[number] >> edge & 1 != 0);
                let Some(own) = Patch::of(self.mesh, self.faces[number] as usize) else { continue };
                least = edges.map(|edge| own.distance_by(edge, point, patch)).fold(least, f64::min);
            }
        }
        least
    }

    /// How far the nearest point at a place of the texture is from `point`; `None` where the texture is not used.
    fn nearest(&self, place: DVec2, point: DVec3) -> Option<f64> {
        let mut nearest_sq: Option<f64> = None;
        let may_hold = |at: usize, nearest_sq: Option<f64>| {
            let bounds = &self.nodes[at].bounds;
            let distance_sq = bounds.distance_sq(point);
            (bounds.holds(place) && nearest_sq.is_none_or(|nearest| distance_sq < nearest)).then_some(distance_sq)
        };
        let mut waiting: Vec<usize> = Vec::new();
        waiting.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(at) = waiting.pop() {
            let node = self.nodes[at];
            if may_hold(at, nearest_sq).is_none() {
                continue;
            }
            if node.count > 0 {
                let faces = node.first as usize..(node.first + node.count) as usize;
                let patches = self.faces[faces].iter().filter_map(|&face| Patch::of(self.mesh, face as usize));
                for found in patches.filter_map(|patch| patch.at(place)) {
                    let distance_sq = found.distance_squared(point);
                    nearest_sq = Some(nearest_sq.map_or(distance_sq, |nearest| nearest.min(distance_sq)));
                }
                continue;
            }
            let children = [at + 1, at + node.first as usize];
            match children.map(|child| may_hold(child, nearest_sq)) {
                [Some(one), Some(other)] if one <= other => waiting.extend([children[1], children[0]]),
                [one, other] => {
                    waiting.extend(one.map(|_| children[0]));
                    waiting.extend(other.map(|_| children[1]));
                }
            }
        }
        nearest_sq.map(f64::sqrt)
    }
}

/// Makes the nodes.
struct Builder<'a> {
    mesh: &'a Mesh,
    /// Takes the axes of [`Bounds::middle`] to shares of the whole.
    scale: [f64; 5],
}

impl Builder<'_> {
    fn bounds_of(&self, face: u32) -> Bounds {
        Patch::of(self.mesh, face as usize).map_or(Bounds::EMPTY, |patch| patch.bounds())
    }

    fn bounds(&self, faces: &[u32]) -> Bounds {
        faces.iter().fold(Bounds::EMPTY, |bounds, &face| bounds.union(self.bounds_of(face)))
    }

    /// The nodes over `faces`, which start at `first` of all; halves at the median of the widest axis.
    fn build(&self, faces: &mut [u32], first: usize) -> Vec<Node> {
        let count = faces.len();
        if count <= LEAF_FACES {
            return vec![Node { bounds: self.bounds(faces), first: first as u32, count: count as u32, has_rim: false }];
        }
        let (mut bounds, mut low, mut high) = (Bounds::EMPTY, [f64::INFINITY; 5], [f64::NEG_INFINITY; 5]);
        for &face in &*faces {
            let own = self.bounds_of(face);
            bounds = bounds.union(own);
            for (axis, middle) in own.middle().into_iter().enumerate() {
                (low[axis], high[axis]) = (low[axis].min(middle), high[axis].max(middle));
            }
        }
        let width = |axis: usize| (high[axis] - low[axis]) * self.scale[axis];
        let widest = (1..5).fold(0, |widest, axis| if width(axis) > width(widest) { axis } else { widest });
        let middle = |face: u32| self.bounds_of(face).middle()[widest];
        faces.select_nth_unstable_by(count / 2, |&a, &b| middle(a).total_cmp(&middle(b)).then(a.cmp(&b)));
        let (left, right) = faces.split_at_mut(count / 2);
        let second = first + left.len();
        let (left, right) = if count >= LEAST_FACES {
            join(|| self.build(left, first), || self.build(right, second))
        } else {
            (self.build(left, first), self.build(right, second))
        };
        let mut nodes = vec![Node { bounds, first: 1 + left.len() as u32, count: 0, has_rim: false }];
        nodes.extend(left);
        nodes.extend(right);
        nodes
    }
}
