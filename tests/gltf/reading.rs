//! What becomes of accessors, primitives and nodes.

use coarsen::Mesh;
use coarsen::formats::{self, Format, WriteOptions};
use coarsen::math::{DVec3, Vec2, Vec3};
use coarsen::mesh::ChannelKind;
use serde_json::json;

use crate::scene::*;

/// A ladder of six vertices.
const LADDER: [[f32; 3]; 6] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 2.0, 0.0], [1.0, 2.0, 0.0]];

fn ladder(primitive: serde_json::Value, indices: Option<&[u16]>) -> Builder {
    let mut builder = Builder::new();
    let positions = builder.floats(&LADDER);
    let mut primitive = primitive;
    primitive["attributes"] = json!({ "POSITION": positions });
    if let Some(indices) = indices {
        primitive["indices"] = builder.indices(indices).into();
    }
    builder.mesh(json!([primitive]));
    builder
}

#[test]
fn strips_and_fans_become_triangles() {
    let strip = ladder(json!({ "mode": 5 }), None).mesh_read();
    assert_eq!(strip.faces, [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]);
    // All are counter-clockwise; those of two corners only join strips.
    assert!(strip.area() == 2.0 && strip.normals.is_none());
    let joined = ladder(json!({ "mode": 5 }), Some(&[0, 1, 2, 2, 3, 3, 5, 4])).mesh_read();
    assert_eq!(joined.faces, [[0, 1, 2], [3, 4, 5]]);
    let fan = ladder(json!({ "mode": 6 }), Some(&[0, 1, 3, 5])).mesh_read();
    // Vertex 2 and 4 are used by none.
    assert_eq!((fan.faces, fan.positions.len()), (vec![[1, 2, 0], [2, 3, 0]], 4));
    let list = ladder(json!({ "mode": 4 }), None).mesh_read();
    assert_eq!(list.faces, [[0, 1, 2], [3, 4, 5]]);
}

#[test]
fn strips_are_written_as_lists() {
    let scene = ladder(json!({ "mode": 5, "extras": 7 }), None).scene();
    let (json, _, warnings) = written(&scene.mesh, &scene.document);
    let primitive = &json["meshes"][0]["primitives"][0];
    assert_eq!((primitive.get("mode"), &primitive["extras"]), (None, &json!(7)));
    assert_eq!(json["accessors"].as_array().map(Vec::len), Some(2), "no accessor that is not used");
    assert_eq!(again(&scene.mesh, &scene.document), scene.mesh);
    assert!(warnings.is_empty());
}

#[test]
fn indices_may_be_of_any_size() {
    for (component, size) in [(U8, 1), (U16, 2), (U32, 4)] {
        let mut builder = square();
        let bytes: Vec<u8> = [0_u32, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()[..size].to_vec()).collect();
        builder.json["meshes"][0]["primitives"][0]["indices"] = builder.accessor(&bytes, component, 6, "SCALAR").into();
        assert_eq!(builder.mesh_read().faces, [[0, 1, 2], [0, 2, 3]], "{size} bytes");
    }
}

#[test]
fn interleaved_vertices_are_read() {
    let mut builder = square();
    let rows: Vec<u8> =
        SQUARE.iter().flat_map(|p| [p[0], p[1], p[2], p[1], -p[0]]).flat_map(f32::to_le_bytes).collect();
    let view = builder.view(&rows);
    builder.json["bufferViews"][view]["byteStride"] = 20.into();
    let mut of = |offset: u32, shape: &str| {
        let accessor =
            json!({ "bufferView": view, "byteOffset": offset, "componentType": F32, "count": 4, "type": shape });
        push(&mut builder.json["accessors"], accessor)
    };
    let attributes = json!({ "POSITION": of(0, "VEC3"), "TEXCOORD_0": of(12, "VEC2") });
    builder.json["meshes"][0]["primitives"][0]["attributes"] = attributes;
    let mesh = builder.mesh_read();
    assert_eq!(mesh.positions[2], DVec3::new(1.0, 1.0, 0.0));
    let rows = mesh.texcoords.expect("texture coordinates");
    assert_eq!(rows[1], [Vec2::new(0.0, 0.0), Vec2::new(1.0, -1.0), Vec2::new(1.0, 0.0)]);
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut builder = square();
    let (places, values) = (builder.view(&[1, 3]), builder.view(&[0_u8; 24]));
    builder.json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": places, "componentType": U8 },
        "values": { "bufferView": values },
    });
    let mesh = builder.mesh_read();
    assert_eq!(mesh.positions, [[0.0; 3], [0.0; 3], [1.0, 1.0, 0.0], [0.0; 3]].map(DVec3::from));
    // Without a view all others are zeros.
    for key in ["bufferView", "byteOffset"] {
        builder.json["accessors"][0].as_object_mut().expect("an object").remove(key);
    }
    assert_eq!(builder.mesh_read().positions, [DVec3::ZERO; 4]);
}

#[test]
fn quantized_attributes_become_numbers() {
    let mut builder = Builder::new();
    let positions: Vec<u8> = [[0_i16, 0, 0, 0], [1000, 0, 0, 0], [0, -1000, 0, 0]]
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let positions = builder.accessor(&positions, I16, 3, "VEC3");
    builder.json["bufferViews"][0]["byteStride"] = 8.into();
    let normals = builder.accessor(&[0, 0, 127, 0, 0, 127_u8.wrapping_neg(), 0, 0, 0, 0, 0x80, 0], I8, 3, "VEC3");
    builder.json["bufferViews"][normals]["byteStride"] = 4.into();
    builder.json["accessors"][normals]["normalized"] = true.into();
    let texcoords = builder.accessor(&[0, 0, 255, 255, 0, 0, 255, 127, 0, 0, 0, 0], U16, 3, "VEC2");
    builder.json["accessors"][texcoords]["normalized"] = true.into();
    builder.mesh(json!([{ "attributes": { "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": texcoords } }]));
    builder.node(json!({ "mesh": 0, "scale": [0.001, 0.001, 0.001], "translation": [5, 0, 0] }));
    for list in ["extensionsUsed", "extensionsRequired"] {
        builder.json[list] = json!(["KHR_mesh_quantization"]);
    }
    let scene = builder.scene();
    let mesh = &scene.mesh;
    assert_eq!(mesh.positions, [[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, -1.0, 0.0]].map(DVec3::from));
    // The least integer stands for -1 too.
    assert_eq!(mesh.normals.as_deref(), Some(&[Vec3::Z, Vec3::NEG_Y, Vec3::NEG_Z][..]));
    let half = f32::from(0x7fff_u16) / 65535.0;
    assert_eq!(mesh.texcoords.as_deref(), Some(&[[Vec2::Y, Vec2::new(0.0, half), Vec2::ZERO]][..]));
    let (json, ..) = written(mesh, &scene.document);
    assert!(json.get("extensionsUsed").is_none() && json.get("extensionsRequired").is_none(), "{json}");
    assert_eq!(json["nodes"], builder.json["nodes"]);
    assert_eq!(&again(mesh, &scene.document), mesh);
}

#[test]
fn colors_are_light() {
    let mut builder = square();
    let colors = builder.accessor(&[0, 128, 255, 9, 7, 1, 0, 0, 200, 201, 202, 0, 1, 2, 3, 4], U8, 4, "VEC4");
    builder.json["accessors"][colors]["normalized"] = true.into();
    builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colors.into();
    let scene = builder.scene();
    let first = scene.mesh.colors.as_ref().expect("colors")[0].map(|x| (255.0 * x).round());
    assert_eq!(first, [0.0, 188.0, 255.0, 9.0], "light of a half is shown by 188");
    let (json, binary, _) = written(&scene.mesh, &scene.document);
    let accessor =
        &json["accessors"][json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"].as_u64().expect("one") as usize];
    assert_eq!((&accessor["componentType"], &accessor["normalized"]), (&json!(U8), &json!(true)));
    assert_eq!(
        view(&json, &binary, &accessor["bufferView"]),
        [0, 128, 255, 9, 7, 1, 0, 0, 200, 201, 202, 0, 1, 2, 3, 4]
    );
}

#[test]
fn the_first_node_places_a_mesh() {
    let mut builder = square();
    let inner = json!({ "mesh": 0, "rotation": [0, 0, 1, 0], "translation": [0, 0, 3] });
    builder.json["nodes"] =
        json!([{ "children": [1], "scale": [2, 2, 2] }, inner, { "mesh": 0, "translation": [9, 9, 9] }]);
    let normals = builder.floats(&[[0.6, 0.8, 0.0]; 4]);
    let displaced = builder.floats(&[[1.0, 0.0, 0.25]; 4]);
    let primitive = &mut builder.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["NORMAL"] = normals.into();
    primitive["targets"] = json!([{ "POSITION": displaced }]);
    let scene = builder.scene();
    // What is added to a point is turned and doubled, and not moved.
    let target = &scene.mesh.channels[0];
    assert_eq!(target.kind, ChannelKind::Displacement);
    assert!(Vec3::from_slice(target.row(0)).distance(Vec3::new(-2.0, 0.0, 0.5)) < 1e-6);
    // Half a turn about z, then doubled.
    assert!(scene.mesh.positions[2].distance(DVec3::new(-2.0, -2.0, 6.0)) < 1e-12);
    assert!(scene.mesh.normals.as_ref().expect("normals")[0].distance(Vec3::new(-0.6, -0.8, 0.0)) < 1e-6);
    let (json, binary, _) = written(&scene.mesh, &scene.document);
    assert_eq!(json["nodes"], builder.json["nodes"]);
    let accessor = &json["accessors"]
        [json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].as_u64().expect("one") as usize];
    let bytes: Vec<u8> = SQUARE.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    assert_eq!(view(&json, &binary, &accessor["bufferView"]), bytes, "in the space of the mesh, to the bit");
    assert_eq!((&accessor["min"], &accessor["max"]), (&json!([0.0, 0.0, 0.0]), &json!([1.0, 1.0, 0.0])));
    let number = &json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"];
    let target = &json["accessors"][number.as_u64().expect("one") as usize];
    let bytes: Vec<u8> = [1.0_f32, 0.0, 0.25].repeat(4).iter().flat_map(|x| x.to_le_bytes()).collect();
    assert_eq!(view(&json, &binary, &target["bufferView"]), bytes, "displacements, too");
}

#[test]
fn mirrored_meshes_face_outside() {
    let mut builder = square();
    builder.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    let scene = builder.scene();
    assert_eq!(scene.mesh.faces, [[0, 2, 1], [0, 3, 2]]);
    assert!(scene.mesh.faces.iter().all(|face| {
        let [a, b, c] = face.map(|v| scene.mesh.positions[v as usize]);
        (b - a).cross(c - a).z > 0.0
    }));
    let (json, binary, _) = written(&scene.mesh, &scene.document);
    let indices = &json["accessors"][json["meshes"][0]["primitives"][0]["indices"].as_u64().expect("one") as usize];
    let bytes: Vec<u8> = [0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()).collect();
    assert_eq!(view(&json, &binary, &indices["bufferView"]), bytes);
}

#[test]
fn flat_transforms_and_skins_leave_meshes_where_they_are() {
    for node in [json!({ "mesh": 0, "scale": [1, 0, 1] }), json!({ "mesh": 0, "skin": 0, "translation": [1, 2, 3] })] {
        let mut builder = square();
        builder.json["nodes"][0] = node;
        assert_eq!(builder.mesh_read().positions[2], DVec3::new(1.0, 1.0, 0.0));
    }
}

#[test]
fn primitives_are_materials_and_lack_what_others_have() {
    let mut builder = square();
    let (positions, indices) = (builder.floats(&SQUARE), builder.indices(&[0, 1, 2]));
    let (uvs, ids) = (builder.floats(&[[0.25, 0.5]; 4]), builder.floats(&[[1.0], [2.0], [3.0], [4.0]]));
    let colors = builder.floats(&[[0.0_f32, 1.0, 0.0]; 4]);
    let attributes = json!({ "POSITION": positions, "TEXCOORD_1": uvs, "_ID": ids, "COLOR_0": colors });
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
    push(&mut builder.json["meshes"][0]["primitives"], primitive);
    builder.json["materials"] = json!([{ "name": "brass" }]);
    builder.json["meshes"][0]["name"] = "bell".into();
    let scene = builder.scene();
    let mesh = &scene.mesh;
    let materials = mesh.materials.as_ref().expect("materials");
    assert_eq!(materials.of_face, [0, 0, 1]);
    assert_eq!(materials.names, ["0.0 bell", "0.1 bell: brass"]);
    let kinds: Vec<_> =
        mesh.channels.iter().map(|channel| (channel.name.as_str(), channel.kind, channel.width)).collect();
    assert_eq!(kinds, [("TEXCOORD_1", ChannelKind::Texcoords, 2), ("_ID", ChannelKind::Linear, 1)]);
    assert_eq!(mesh.channels[1].values, [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    assert_eq!(mesh.colors.as_ref().map(|colors| (colors[0], colors[4])), Some(([1.0; 4], [0.0, 1.0, 0.0, 1.0])));
    let (json, ..) = written(mesh, &scene.document);
    let keys = |primitive: usize| -> Vec<String> {
        json["meshes"][0]["primitives"][primitive]["attributes"].as_object().expect("some").keys().cloned().collect()
    };
    assert_eq!(keys(0), ["POSITION"]);
    assert_eq!(keys(1), ["POSITION", "TEXCOORD_1", "_ID", "COLOR_0"]);
    assert_eq!(&again(mesh, &scene.document), mesh);
}

/// A square in a node, and twice as large and mirrored in another, where it is simplified: a file with nodes has it once, others show
/// both.
#[test]
fn what_several_nodes_show_is_written_for_each() {
    let mut builder = square();
    builder.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "scale": [-2, 2, 2], "translation": [9, 0, 0] }]);
    let scene = builder.scene();
    assert_eq!(scene.mesh.faces.len(), 2);
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, mesh: &Mesh| {
        let path = folder.path().join(name);
        let told = formats::write_scene(mesh, &scene.document, &path, &WriteOptions::default()).expect("written");
        (formats::read(&path).expect("a mesh"), told.join("; "))
    };
    for name in ["a.obj", "a.ply", "a.stl", "a.off"] {
        let (all, told) = write(name, &scene.mesh);
        assert_eq!((all.positions.len(), all.faces.len()), (8, 4), "{name}");
        assert!(told.contains("2 faces more"), "{told}");
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| all.positions[v as usize]);
            (b - a).cross(c - a).z / 2.0
        };
        assert_eq!(all.faces.iter().map(area).collect::<Vec<_>>(), [2.0, 2.0, 0.5, 0.5], "{name}");
        let (low, high) = all.bounds();
        assert_eq!((low, high), (DVec3::ZERO, DVec3::new(9.0, 2.0, 0.0)), "{name}");
    }
    let (once, told) = write("a.glb", &scene.mesh);
    assert_eq!((once.faces.len(), told.as_str()), (2, ""));
    assert_eq!(builder.scene().with_instances().0.mesh.faces.len(), 4);
    // A file that asks for more than anybody could write has it once, and so has one whose only mesh has a skin.
    let mut many = square();
    many.json["meshes"][0]["primitives"][0]["indices"] = many.indices(&[0, 1, 2].repeat(12_000)).into();
    many.json["nodes"] = (0..3_000).map(|_| json!({ "mesh": 0 })).collect();
    let scene = many.scene();
    let mut out = Vec::new();
    let told = formats::write_scene_to(&scene.mesh, &scene.document, Format::Off, &WriteOptions::default(), &mut out);
    assert!(told.expect("written").join("; ").contains("is there once"));
    assert!(scene.with_instances().1.is_some_and(|why| why.contains("is there once")));
    builder.json["nodes"] = json!([{ "mesh": 0, "skin": 0 }, { "mesh": 0, "skin": 0 }]);
    assert_eq!(builder.scene().with_instances().0.mesh.faces.len(), 2);
}

/// Instances that a node tells by accessors are as those of two nodes.
#[test]
fn instances_of_an_extension_are_shown() {
    let mut builder = square();
    let shifts = builder.floats(&[[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]]);
    let sizes = builder.floats(&[[1.0, 1.0, 1.0], [-2.0, 2.0, 2.0]]);
    let turns = builder.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 2.0]]);
    let told = json!({ "attributes": { "TRANSLATION": shifts, "SCALE": sizes, "ROTATION": turns } });
    builder.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    builder.json["nodes"] =
        json!([{ "mesh": 0, "translation": [0, 0, 1], "extensions": { "EXT_mesh_gpu_instancing": told } }]);
    let mut by_nodes = square();
    by_nodes.json["nodes"] = json!([
        { "mesh": 0, "translation": [0, 0, 1] },
        { "mesh": 0, "scale": [-2, 2, 2], "translation": [9, 0, 1] },
    ]);
    let (all, expected) = (builder.scene().with_instances().0.mesh, by_nodes.scene().with_instances().0.mesh);
    assert_eq!(all.faces.len(), 4);
    assert_eq!(all, expected);
    // As many of each.
    let fewer = builder.floats(&[[1.0; 3]]);
    builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = fewer.into();
    let error = builder.error().to_string();
    assert!(error.contains("has 1 elements, expected 2"), "{error}");
}

/// What a mirrored second node shows of two primitives is what a mesh of its own would be, to rounding.
#[test]
fn instances_are_as_meshes_of_their_own() {
    let mut builder = square();
    let normals = builder.floats(&[[0.6, 0.0, 0.8], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0], [0.8, 0.0, 0.6]]);
    let tangents =
        builder.floats(&[[0.8, 0.0, -0.6, 1.0], [1.0, 0.0, 0.0, -1.0], [0.0, 1.0, 0.0, 1.0], [0.6, 0.0, -0.8, 1.0]]);
    let texcoords = builder.floats(&[[0.0, 0.25], [1.0, 0.0], [0.75, 1.0], [0.0, 1.0]]);
    let colors =
        builder.floats(&[[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0], [0.5, 0.5, 0.5, 1.0]]);
    let displaced = builder.floats(&[[0.0, 0.0, 0.5], [0.0, 1.0, 0.0], [2.0, 0.0, -0.5], [0.125, 0.0, 0.0]]);
    let primitive = &mut builder.json["meshes"][0]["primitives"][0];
    for (semantic, number) in
        [("NORMAL", normals), ("TANGENT", tangents), ("TEXCOORD_0", texcoords), ("COLOR_0", colors)]
    {
        primitive["attributes"][semantic] = number.into();
    }
    primitive["targets"] = json!([{ "POSITION": displaced }]);
    let mut second = primitive.clone();
    second["indices"] = builder.indices(&[0, 1, 3]).into();
    builder.json["meshes"][0]["primitives"].as_array_mut().expect("a list").push(second);
    let moved = json!({ "mesh": 0, "rotation": [0.6, 0, 0, 0.8], "scale": [-2, 1, 3], "translation": [1, 2, 3] });
    builder.json["nodes"] =
        json!([{ "mesh": 0, "rotation": [0, 0.6, 0, 0.8], "scale": [3, 3, 3], "translation": [5, 0, 0] }, moved]);
    let (scene, untold) = builder.scene().with_instances();
    assert_eq!(untold, None);
    let mut alone = builder;
    alone.json["nodes"].as_array_mut().expect("a list").remove(0);
    let (all, expected) = (scene.mesh, alone.scene().mesh);
    all.check().expect("a valid mesh");
    let materials = |mesh: &Mesh| mesh.materials.as_ref().expect("materials").of_face.clone();
    assert_eq!((materials(&all), materials(&expected)), (vec![0, 0, 0, 0, 1, 1], vec![0, 0, 1]));
    // All that the corners of a face have.
    let corners = |mesh: &Mesh, face: usize| -> Vec<f64> {
        let of_corner = |k: usize| {
            let v = mesh.faces[face][k] as usize;
            let [normals, colors] = [
                mesh.normals.as_ref().expect("normals")[v].to_array().to_vec(),
                mesh.colors.as_ref().expect("colors")[v].to_vec(),
            ];
            let texture = mesh.texcoords.as_ref().expect("a texture")[face][k].to_array().to_vec();
            let channels = mesh.channels.iter().flat_map(|channel| channel.row(v).to_vec());
            let numbers = normals.into_iter().chain(colors).chain(texture).chain(channels).map(f64::from);
            mesh.positions[v].to_array().into_iter().chain(numbers).collect::<Vec<f64>>()
        };
        (0..3).flat_map(of_corner).collect()
    };
    for (of_all, of_expected) in [(2, 0), (3, 1), (5, 2)] {
        let (ours, theirs) = (corners(&all, of_all), corners(&expected, of_expected));
        assert!(ours.len() == theirs.len() && ours.len() == 3 * (3 + 3 + 4 + 2 + 4 + 3));
        assert!(ours.iter().zip(&theirs).all(|(a, b)| (a - b).abs() < 1e-5), "{ours:?}\n{theirs:?}");
    }
    // Without materials nobody knows which faces are whose.
    let bare = Mesh { materials: None, ..alone.scene().mesh };
    alone.json["nodes"].as_array_mut().expect("a list").push(json!({ "mesh": 0 }));
    let document = alone.scene().document;
    let mut out = Vec::new();
    let told = formats::write_scene_to(&bare, &document, Format::Off, &WriteOptions::default(), &mut out);
    assert!(told.expect("written").join("; ").contains("without materials"));
}
