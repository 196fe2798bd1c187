//! Where the nodes of a scene put its meshes.

use serde_json::Value;

use super::json::Json;
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DMat4, DQuat, DVec3, Vec3};

/// From the space of a mesh to that of the scene, and back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placement {
    to_scene: DAffine3,
    from_scene: DAffine3,
    /// Whether nothing is to be done.
    is_identity: bool,
    /// Whether directions stay what they are: nothing but a shift and a size.
    keeps_directions: bool,
    /// Whether faces turn over.
    pub(super) is_mirrored: bool,
}

impl Placement {
    pub(super) const IDENTITY: Self = Self {
        to_scene: DAffine3::IDENTITY,
        from_scene: DAffine3::IDENTITY,
        is_identity: true,
        keeps_directions: true,
        is_mirrored: false,
    };

    /// That of a transform; none where it cannot be undone.
    pub(super) fn of(to_scene: DAffine3) -> Option<Self> {
        let from_scene = to_scene.inverse();
        let matrix = to_scene.matrix3;
        // Scales of a thousandth are common, a flat matrix of rounding errors is none.
        let volume = matrix.x_axis.length() * matrix.y_axis.length() * matrix.z_axis.length();
        let determinant = matrix.determinant();
        if !(to_scene.is_finite() && from_scene.is_finite() && determinant.abs() > 1e-12 * volume) {
            return None;
        }
        let size = matrix.x_axis.x;
        Some(Self {
            is_identity: to_scene == DAffine3::IDENTITY,
            keeps_directions: size > 0.0 && matrix == DMat3::from_diagonal(DVec3::splat(size)),
            is_mirrored: determinant < 0.0,
            to_scene,
            from_scene,
        })
    }

    /// A shift; none that is not finite.
    pub(super) fn shift(by: DVec3) -> Self {
        Self::of(DAffine3::from_translation(by)).unwrap_or(Self::IDENTITY)
    }

    /// How many times as long an edge of a mesh is at most, along the axis that is stretched most.
    fn stretch(&self) -> f64 {
        let DMat3 { x_axis, y_axis, z_axis } = self.to_scene.matrix3;
        [x_axis, y_axis, z_axis].map(DVec3::length).into_iter().fold(0.0, f64::max)
    }

    pub(super) fn point_to_scene(&self, point: Vec3) -> DVec3 {
        self.position_to_scene(point.as_dvec3())
    }

    /// The same in double precision, as the scene has it where something is moved in it.
    pub(super) fn position_to_scene(&self, point: DVec3) -> DVec3 {
        if self.is_identity { point } else { self.to_scene.transform_point3(point) }
    }

    /// From where `first` puts something to where this does; none where that cannot be undone.
    pub(super) fn from(&self, first: &Self) -> Option<Self> {
        Self::of(self.to_scene * first.from_scene)
    }

    pub(super) fn point_from_scene(&self, point: DVec3) -> Vec3 {
        if self.is_identity {
            return point.as_vec3();
        }
        let DAffine3 { matrix3, translation } = self.from_scene;
        let magnitude = matrix3.abs() * point.abs() + translation.abs();
        without_rounding(matrix3 * point + translation, magnitude, f64::EPSILON)
    }

    /// What is added to a point.
    pub(super) fn vector_to_scene(&self, vector: Vec3) -> Vec3 {
        if self.is_identity { vector } else { (self.to_scene.matrix3 * vector.as_dvec3()).as_vec3() }
    }

    pub(super) fn vector_from_scene(&self, vector: Vec3) -> Vec3 {
        if self.is_identity {
            return vector;
        }
        let (matrix, vector) = (self.from_scene.matrix3, vector.as_dvec3());
        without_rounding(matrix * vector, matrix.abs() * vector.abs(), f32::EPSILON.into())
    }

    pub(super) fn normal_to_scene(&self, normal: Vec3) -> Vec3 {
        self.direction(normal, self.from_scene.matrix3.transpose())
    }

    pub(super) fn normal_from_scene(&self, normal: Vec3) -> Vec3 {
        self.direction(normal, self.to_scene.matrix3.transpose())
    }

    /// A tangent: a direction along the surface, and the side of the third axis.
    pub(super) fn tangent_to_scene(&self, tangent: [f32; 4]) -> [f32; 4] {
        self.tangent(tangent, self.to_scene.matrix3)
    }

    pub(super) fn tangent_from_scene(&self, tangent: [f32; 4]) -> [f32; 4] {
        self.tangent(tangent, self.from_scene.matrix3)
    }

    fn tangent(&self, [x, y, z, side]: [f32; 4], matrix: DMat3) -> [f32; 4] {
        let [x, y, z] = self.direction(Vec3::new(x, y, z), matrix).to_array();
        [x, y, z, if self.is_mirrored { -side } else { side }]
    }

    fn direction(&self, direction: Vec3, matrix: DMat3) -> Vec3 {
        // What is not finite is told later.
        if self.keeps_directions || !direction.is_finite() {
            return direction;
        }
        (matrix * direction.as_dvec3()).normalize_or_zero().as_vec3()
    }
}

/// Sums in single precision, those that are only rounding as zero, for they were: the sides of a box stay flat. `magnitude` is what
/// their terms add up to without signs, `precision` that of the terms.
fn without_rounding(sums: DVec3, magnitude: DVec3, precision: f64) -> Vec3 {
    let kept =
        |axis: usize| if sums[axis].abs() <= 4.0 * precision * magnitude[axis] { 0.0 } else { sums[axis] as f32 };
    Vec3::from_array([0, 1, 2].map(kept))
}

/// A mesh in a node.
#[derive(Debug, Clone)]
pub(super) struct Instance {
    pub(super) placement: Placement,
    /// The node's name; empty without.
    pub(super) name: String,
}

/// The nodes of the scene that show a mesh.
#[derive(Debug, Clone)]
pub(super) struct Instances {
    /// The one that places it where it is simplified: of those that are shown the one that shows it largest, so that a limit holds
    /// for all; or the first that has it where none is.
    pub(super) first: Instance,
    /// The others, by what leads from there to them.
    pub(super) others: Vec<Instance>,
}

/// The instances of each mesh. With a skin, whose joints place it, it stays where it is, once for all such nodes; so does one
/// whose transform cannot be undone, which is shown nowhere. `instance_transforms` tells those of a node's instances to
/// its space, where these are not nodes.
///
/// # Errors
/// [`crate::Error::Format`] for nodes that are their own descendants or have two parents; those of `instance_transforms`.
pub(super) fn instances(
    json: &Value,
    instance_transforms: impl Fn(&Json<'_>) -> Result<Option<Vec<DAffine3>>>,
) -> Result<Vec<Instances>> {
    let root = Json::root(json);
    let nodes = root.elements("nodes")?;
    let transforms = world_transforms(&nodes)?;
    let are_shown = shown(json, nodes.len());
    let meshes = root.elements("meshes")?.len();
    let (mut of_shown, mut of_others, mut has_skin) =
        (vec![Vec::new(); meshes], vec![None; meshes], vec![false; meshes]);
    for (number, (node, transform)) in nodes.iter().zip(transforms).enumerate() {
        let Some(mesh) = node.optional_whole("mesh")? else { continue };
        if mesh >= meshes {
            return Err(node.error(format!("has no meshes[{mesh}]")));
        }
        let is_skinned = node.get("skin").is_some();
        let repeated = if is_skinned { None } else { instance_transforms(node)? };
        let name = node.value.get("name").and_then(Value::as_str).unwrap_or_default();
        let instance = |placement| Instance { placement, name: name.into() };
        let transforms = repeated.unwrap_or_else(|| vec![DAffine3::IDENTITY]);
        let placements = transforms.into_iter().filter_map(|own| match is_skinned {
            true => Some(Placement::IDENTITY),
            false => Placement::of(transform * own),
        });
        let mut all = placements.map(instance);
        if are_shown[number] && !(is_skinned && std::mem::replace(&mut has_skin[mesh], true)) {
            of_shown[mesh].extend(all);
        } else if of_others[mesh].is_none() {
            of_others[mesh] = all.next();
        }
    }
    Ok(of_shown.into_iter().zip(of_others).map(|(shown, other)| Instances::of(shown, other)).collect())
}

impl Instances {
    /// Of nodes that show a mesh, and one that has it.
    fn of(mut shown: Vec<Instance>, other: Option<Instance>) -> Self {
        let none = || Instance { placement: Placement::IDENTITY, name: String::new() };
        let first = if shown.is_empty() { other.unwrap_or_else(none) } else { shown.remove(largest(&shown)) };
        let from_first = |instance: Instance| {
            instance.placement.from(&first.placement).map(|placement| Instance { placement, ..instance })
        };
        let others = shown.into_iter().filter_map(from_first).collect();
        Self { first, others }
    }
}

/// Which of them shows a mesh largest: the first, but for those that do by more than rounding.
fn largest(shown: &[Instance]) -> usize {
    const LARGER: f64 = 1.001;
    let stretch = |at: usize| shown[at].placement.stretch();
    (1..shown.len()).fold(0, |most, at| if stretch(at) > LARGER * stretch(most) { at } else { most })
}

/// Which nodes the scene shows: the default one or, without, the first; all where there is none.
fn shown(json: &Value, count: usize) -> Vec<bool> {
    let number = |value: &Value| value.as_u64().map(|number| number as usize);
    let list = |value: Option<&Value>| -> Vec<usize> {
        value.and_then(Value::as_array).into_iter().flatten().filter_map(number).collect()
    };
    let chosen = json.get("scene").and_then(number).unwrap_or(0);
    let Some(scene) = json.get("scenes").and_then(|scenes| scenes.get(chosen)) else { return vec![true; count] };
    let mut are_shown = vec![false; count];
    let mut open = list(scene.get("nodes"));
    while let Some(node) = open.pop() {
        if are_shown.get(node) == Some(&false) {
            are_shown[node] = true;
            open.extend(list(json["nodes"][node].get("children")));
        }
    }
    are_shown
}

/// From each node's space to that of the scene.
fn world_transforms(nodes: &[Json<'_>]) -> Result<Vec<DAffine3>> {
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    let mut children = Vec::with_capacity(nodes.len());
    for (parent, node) in nodes.iter().enumerate() {
        let mut own = Vec::new();
        for child in node.elements("children")? {
            let index = child.whole()?;
            match parents.get_mut(index) {
                None => return Err(child.error(format!("has no nodes[{index}]"))),
                Some(Some(other)) => {
                    return Err(child.error(format!("nodes[{index}] is a child of nodes[{other}] too")));
                }
                Some(none) => *none = Some(parent),
            }
            own.push(index);
        }
        children.push(own);
    }
    let mut transforms = vec![None; nodes.len()];
    let mut open: Vec<(usize, DAffine3)> =
        (0..nodes.len()).filter(|&node| parents[node].is_none()).map(|node| (node, DAffine3::IDENTITY)).collect();
    while let Some((node, outer)) = open.pop() {
        let transform = outer * local_transform(&nodes[node])?;
        transforms[node] = Some(transform);
        open.extend(children[node].iter().map(|&child| (child, transform)));
    }
    // With one parent each, what no root leads to goes round in a circle.
    let of_node = |(node, transform): (usize, Option<DAffine3>)| {
        transform.ok_or_else(|| nodes[node].error("is its own descendant, expected a tree"))
    };
    transforms.into_iter().enumerate().map(of_node).collect()
}

fn local_transform(node: &Json<'_>) -> Result<DAffine3> {
    if let Some(matrix) = node.numbers::<16>("matrix")? {
        let matrix = DMat4::from_cols_array(&matrix);
        return Ok(DAffine3 { matrix3: DMat3::from_mat4(matrix), translation: matrix.w_axis.truncate() });
    }
    let translation = node.numbers::<3>("translation")?.map_or(DVec3::ZERO, DVec3::from);
    let scale = node.numbers::<3>("scale")?.map_or(DVec3::ONE, DVec3::from);
    let rotation = node.numbers::<4>("rotation")?.map(DQuat::from_array);
    // A rotation written with few digits is not quite of length 1.
    let rotation =
        rotation.filter(|rotation| rotation.length_squared() > 0.0).map_or(DQuat::IDENTITY, DQuat::normalize);
    let rotated = if rotation == DQuat::IDENTITY { DMat3::IDENTITY } else { DMat3::from_quat(rotation) };
    Ok(DAffine3 { matrix3: rotated * DMat3::from_diagonal(scale), translation })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn of(nodes: Value) -> Result<Vec<Instances>> {
        instances(&json!({ "nodes": nodes, "meshes": [{}, {}] }), |_| Ok(None))
    }

    #[test]
    fn nodes_place_a_mesh() {
        let nodes = json!([
            { "children": [1, 2], "scale": [2, 2, 2] },
            { "mesh": 1, "translation": [1, 0, 0] },
            { "mesh": 1, "translation": [9, 9, 9] },
            { "mesh": 0, "skin": 0, "translation": [9, 9, 9] },
        ]);
        let placements = of(nodes).expect("a tree");
        let Instances { first: Instance { placement: first, .. }, others } = &placements[1];
        assert_eq!(first.point_to_scene(Vec3::Y), DVec3::new(2.0, 2.0, 0.0));
        assert_eq!(first.point_from_scene(DVec3::new(2.0, 2.0, 0.0)), Vec3::Y);
        assert!(first.keeps_directions && !first.is_mirrored);
        assert_eq!(others.len(), 1);
        assert_eq!(others[0].placement.position_to_scene(DVec3::new(2.0, 2.0, 0.0)), DVec3::new(18.0, 20.0, 18.0));
        assert!(placements[0].first.placement.is_identity, "joints place what has a skin");
    }

    #[test]
    fn only_what_is_shown_is_there_again() {
        let shift = |x: f64| json!({ "mesh": 0, "translation": [x, 0, 0] });
        let flat = json!({ "mesh": 0, "scale": [0, 0, 0] });
        let skinned = json!({ "mesh": 0, "skin": 0 });
        let found = |more: Value| {
            let mut file =
                json!({ "nodes": [shift(1.0), shift(2.0), flat, skinned, skinned, shift(7.0)], "meshes": [{}] });
            more.as_object().expect("an object").iter().for_each(|(key, value)| file[key] = value.clone());
            let Instances { first, others } = instances(&file, |_| Ok(None)).expect("a tree").remove(0);
            let place = |at: &Instance| at.placement.position_to_scene(DVec3::ZERO).x;
            let others = others.iter().map(|other| place(other) + place(&first)).collect::<Vec<f64>>();
            (place(&first), others)
        };
        assert_eq!(found(json!({})), (1.0, vec![2.0, 0.0, 7.0]));
        assert_eq!(found(json!({ "scenes": [{ "nodes": [1, 2] }, { "nodes": [5] }] })), (2.0, vec![]));
        assert_eq!(
            found(json!({ "scene": 1, "scenes": [{ "nodes": [1] }, { "nodes": [2, 0, 5] }] })),
            (1.0, vec![7.0])
        );
        assert_eq!(found(json!({ "scenes": [{ "nodes": [99, "x"] }] })), (1.0, vec![]));
        assert_eq!(found(json!({ "scene": 7, "scenes": [{}] })), (1.0, vec![2.0, 0.0, 7.0]));
        assert_eq!(
            found(json!({ "nodes": [{ "children": [1] }, shift(3.0)], "scenes": [{ "nodes": [0] }] })),
            (3.0, vec![])
        );
    }

    #[test]
    fn a_mesh_is_placed_where_it_is_largest() {
        let sized = |sizes: &[[f64; 3]]| {
            let node = |size: &[f64; 3]| json!({ "mesh": 0, "name": size[0].to_string(), "scale": size });
            let Instances { first, others } = of(sizes.iter().map(node).collect()).expect("nodes").remove(0);
            (first.name, others.into_iter().map(|other| other.name).collect::<Vec<String>>())
        };
        let of_three = sized(&[[1.0; 3], [2.0, 0.5, -3.0], [2.5; 3]]);
        assert_eq!(of_three, ("2".into(), vec!["1".into(), "2.5".into()]));
        assert_eq!(sized(&[[1.0; 3], [1.0005, 1.0, 1.0]]).0, "1");
    }

    #[test]
    fn mirrors_turn_normals_and_sides() {
        let placement = &of(json!([{ "mesh": 0, "scale": [-2, 1, 1] }])).expect("a tree")[0].first.placement;
        assert!(placement.is_mirrored);
        let slanted = Vec3::new(0.6, 0.8, 0.0);
        let turned = placement.normal_to_scene(slanted);
        assert!(
            turned.x < 0.0 && turned.is_normalized() && placement.normal_from_scene(turned).distance(slanted) < 1e-6
        );
        assert_eq!(placement.tangent_to_scene([1.0, 0.0, 0.0, 1.0]), [-1.0, 0.0, 0.0, -1.0]);
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        for (nodes, part) in [
            (json!([{ "children": [1] }, { "children": [0] }]), "nodes[0]: is its own descendant"),
            (json!([{ "children": [0] }]), "its own descendant"),
            (
                json!([{ "children": [2] }, { "children": [2] }, {}]),
                "nodes[1].children[0]: nodes[2] is a child of nodes[0]",
            ),
            (json!([{ "children": [7] }]), "has no nodes[7]"),
            (json!([{ "mesh": 2 }]), "has no meshes[2]"),
            (json!([{ "scale": [1, 1] }]), "nodes[0].scale: expected 3 finite numbers"),
        ] {
            let error = of(nodes).expect_err(part).to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    /// Depth is bounded by the file alone: no call stack grows with it.
    #[test]
    fn deep_chains_and_flat_transforms_are_no_trouble() {
        let mut nodes: Vec<Value> = (1..100_000).map(|child| json!({ "children": [child] })).collect();
        nodes.push(json!({ "mesh": 0, "scale": [1, 0, 1] }));
        assert!(of(Value::Array(nodes)).expect("a chain")[0].first.placement.is_identity);
    }
}
