//! What named a mesh or moved it, where that is gone: an animation of its weights, a skin without joints.

use serde_json::Value;

use super::json::{array_mut, list_mut, object_mut};

/// The extension by which animations name anything by its path.
const POINTER: &str = "KHR_animation_pointer";

/// Takes out the channels of animations that weigh the targets of meshes which `bereft` nodes have no more, or point to such a mesh;
/// the others point to the new `numbers` of meshes. Animations without a channel go, for they would be an error.
pub(super) fn stop_animations(json: &mut Value, bereft: &[u64], numbers: &[Option<usize>]) {
    let moves = |channel: &mut Value| {
        let Some(target) = channel.get_mut("target") else { return true };
        if target.get("path").and_then(Value::as_str) == Some("weights") {
            return !target.get("node").and_then(Value::as_u64).is_some_and(|node| bereft.contains(&node));
        }
        let Some(pointer) = target.pointer_mut(&format!("/extensions/{POINTER}/pointer")) else { return true };
        match pointer.as_str().and_then(|path| renamed(path, bereft, numbers)) {
            Some(Renamed::To(path)) => *pointer = path.into(),
            Some(Renamed::Gone) => return false,
            None => {}
        }
        true
    };
    let mut has_lost = false;
    for animation in array_mut(json, "animations") {
        let before = array_mut(animation, "channels").len();
        if before == 0 {
            continue;
        }
        list_mut(animation, "channels").retain_mut(moves);
        has_lost |= array_mut(animation, "channels").len() < before;
    }
    if has_lost {
        list_mut(json, "animations").retain_mut(|animation| !array_mut(animation, "channels").is_empty());
        if array_mut(json, "animations").is_empty() {
            object_mut(json).remove("animations");
        }
    }
}

/// Has what extensions name as their `mesh` follow the new `numbers`, whatever they are; where that mesh is gone they name none, and
/// how often is returned.
pub(super) fn follow_in_extensions(json: &mut Value, numbers: &[Option<usize>]) -> usize {
    follow(json, false, numbers)
}

fn follow(json: &mut Value, is_extension: bool, numbers: &[Option<usize>]) -> usize {
    let mut gone = 0;
    match json {
        Value::Array(values) => {
            gone += values.iter_mut().map(|value| follow(value, is_extension, numbers)).sum::<usize>()
        }
        Value::Object(map) => {
            let number = map.get("mesh").and_then(Value::as_u64).filter(|_| is_extension);
            match number.and_then(|number| numbers.get(number as usize)) {
                Some(Some(number)) => drop(map.insert("mesh".into(), (*number).into())),
                Some(None) => {
                    map.remove("mesh");
                    gone += 1;
                }
                None => {}
            }
            // What applications keep for themselves is theirs.
            for (key, value) in map.iter_mut().filter(|(key, _)| *key != "extras") {
                gone += follow(value, is_extension || key == "extensions", numbers);
            }
        }
        _ => {}
    }
    gone
}

enum Renamed {
    To(String),
    Gone,
}

/// What becomes of a path to a mesh, or to the weights of a node; `None` of others.
fn renamed(path: &str, bereft: &[u64], numbers: &[Option<usize>]) -> Option<Renamed> {
    if let Some((node, what)) = path.strip_prefix("/nodes/").and_then(|rest| rest.split_once('/')) {
        let is_weight = what == "weights" || what.starts_with("weights/");
        return (is_weight && node.parse().is_ok_and(|node| bereft.contains(&node))).then_some(Renamed::Gone);
    }
    let (mesh, rest) = path.strip_prefix("/meshes/")?.split_once('/')?;
    let mesh: usize = mesh.parse().ok()?;
    Some(numbers.get(mesh)?.map_or(Renamed::Gone, |number| Renamed::To(format!("/meshes/{number}/{rest}"))))
}

/// Takes the skin off nodes of these meshes where no primitive has joints any more, but for those that are `lost`.
pub(super) fn take_skins_off(json: &mut Value, meshes: &[usize], lost: &[[usize; 2]]) {
    let bare = |&mesh: &usize| {
        let primitives = json["meshes"][mesh]["primitives"].as_array();
        let left = (0..).zip(primitives.into_iter().flatten()).filter(|&(number, _)| !lost.contains(&[mesh, number]));
        !left.map(|(_, primitive)| primitive).any(|primitive| primitive.pointer("/attributes/JOINTS_0").is_some())
    };
    let bare: Vec<u64> = meshes.iter().copied().filter(bare).map(|mesh| mesh as u64).collect();
    for node in array_mut(json, "nodes") {
        if node.get("mesh").and_then(Value::as_u64).is_some_and(|mesh| bare.contains(&mesh)) {
            object_mut(node).remove("skin");
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn channels_of_what_is_gone_are_taken_out_and_others_follow() {
        let weigh = |node: u64| json!({ "sampler": 0, "target": { "node": node, "path": "weights" } });
        let turn = |node: u64| json!({ "sampler": 0, "target": { "node": node, "path": "rotation" } });
        let point = |path: &str| {
            let extensions = json!({ POINTER: { "pointer": path } });
            json!({ "sampler": 0, "target": { "path": "pointer", "extensions": extensions } })
        };
        let mut json = json!({ "animations": [
            { "channels": [weigh(0), turn(0), weigh(1), point("/meshes/0/weights"), point("/meshes/2/weights")] },
            { "channels": [weigh(0), point("/nodes/0/weights")] },
            { "channels": [point("/nodes/0/scale"), point("/materials/0/alphaCutoff"), point("/nodes/1/weights")] },
        ] });
        stop_animations(&mut json, &[0], &[None, Some(0), Some(1)]);
        assert_eq!(
            json["animations"],
            json!([
                { "channels": [turn(0), weigh(1), point("/meshes/1/weights")] },
                { "channels": [point("/nodes/0/scale"), point("/materials/0/alphaCutoff"), point("/nodes/1/weights")] },
            ])
        );
        let mut only = json!({ "animations": [{ "channels": [weigh(0)] }] });
        stop_animations(&mut only, &[0], &[None]);
        assert_eq!(only, json!({}));
    }

    #[test]
    fn extensions_name_the_meshes_that_they_did() {
        let mut json = json!({
            "nodes": [{ "mesh": 2, "extras": { "mesh": 2 }, "extensions": { "A": { "mesh": 2, "extras": { "mesh": 2 } } } }],
            "extensions": { "B": { "colliders": [{ "mesh": 0 }, { "mesh": 1 }, { "mesh": "1", "meshes": 2 }] } },
        });
        assert_eq!(follow_in_extensions(&mut json, &[None, Some(0), Some(1)]), 1);
        let expected = json!({
            "nodes": [{ "mesh": 2, "extras": { "mesh": 2 }, "extensions": { "A": { "mesh": 1, "extras": { "mesh": 2 } } } }],
            "extensions": { "B": { "colliders": [{}, { "mesh": 0 }, { "mesh": "1", "meshes": 2 }] } },
        });
        assert_eq!(json, expected);
    }

    #[test]
    fn skins_stay_where_a_primitive_has_joints() {
        let (plain, moved) = (json!({ "attributes": {} }), json!({ "attributes": { "JOINTS_0": 1 } }));
        let nodes = [0, 1, 2].map(|mesh| json!({ "mesh": mesh, "skin": 0 }));
        let both = json!({ "primitives": [plain, moved] });
        let meshes = json!([{ "primitives": [plain] }, both, { "primitives": [plain] }]);
        let file = json!({ "nodes": nodes, "meshes": meshes });
        let left_with = |lost: &[[usize; 2]]| {
            let mut json = file.clone();
            take_skins_off(&mut json, &[0, 1], lost);
            [0, 1, 2].map(|node| json["nodes"][node].get("skin").is_some())
        };
        assert_eq!(left_with(&[]), [false, true, true]);
        // Of what is written later on without the one that has joints.
        assert_eq!(left_with(&[[1, 1]]), [false, false, true]);
    }
}
