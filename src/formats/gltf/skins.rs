//! Joints that the skin of a mesh does not have.

use serde_json::Value;

use super::document::Gltf;
use crate::mesh::{ChannelKind, Mesh};

impl Gltf {
    /// A sentence about vertices of `mesh`, which came with this document, that are moved by joints which a skin they are shown
    /// with does not have; none where there are none. They stay as they are: programs differ in what they do with them.
    pub(in crate::formats) fn tell_foreign_joints(&self, mesh: &Mesh) -> Option<String> {
        let (joints, materials) =
            (mesh.channels.iter().find(|channel| channel.kind == ChannelKind::Joints)?, mesh.materials.as_ref()?);
        let counts = self.fewest_joints();
        counts.iter().flatten().next()?;
        // Parts share no vertices.
        let (mut are_known, mut foreign) = (vec![false; mesh.positions.len()], 0);
        for (face, &part) in mesh.faces.iter().zip(&materials.of_face) {
            let Some(count) = self.parts.get(part as usize).and_then(|part| counts.get(part.mesh).copied().flatten())
            else {
                continue;
            };
            for &vertex in face.iter().filter(|&&vertex| !std::mem::replace(&mut are_known[vertex as usize], true)) {
                let (joints, weights) = joints.row(vertex as usize).split_at(joints.width / 2);
                let is_foreign = |(&joint, &weight): (&f32, &f32)| joint as usize >= count && weight > 0.0;
                foreign += usize::from(joints.iter().zip(weights).any(is_foreign));
            }
        }
        (foreign > 0).then(|| format!("vertices with weights of joints that their skin does not have: {foreign}"))
    }

    /// How many joints each mesh may name: those of the smallest skin of a node that has it; none without skins.
    fn fewest_joints(&self) -> Vec<Option<usize>> {
        fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
            value.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
        }
        let number = |node: &Value, key: &str| node.get(key).and_then(Value::as_u64).map(|number| number as usize);
        let skins: Vec<usize> = list(&self.json, "skins").iter().map(|skin| list(skin, "joints").len()).collect();
        let mut fewest = vec![None; list(&self.json, "meshes").len()];
        for node in list(&self.json, "nodes") {
            let (mesh, skin) = (number(node, "mesh"), number(node, "skin"));
            if let (Some(mesh), Some(&count)) = (mesh, skin.and_then(|skin| skins.get(skin)))
                && let Some(least) = fewest.get_mut(mesh)
            {
                *least = Some(least.map_or(count, |least: usize| least.min(count)));
            }
        }
        fewest
    }
}
