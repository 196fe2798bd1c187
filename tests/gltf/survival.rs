//! What is no triangle comes back as it was.

use coarsen::formats::{self, Document, Format, Scene, WriteOptions};
use coarsen::mesh::{Channel, ChannelKind, Materials};
use serde_json::{Value, json};

use crate::models;
use crate::scene::*;

/// A square with a skin, a morph target, an animation, a picture, points, extras and an extension nobody knows.
fn everything() -> Builder {
    let mut builder = square();
    let joints = builder.accessor(&[0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0], U8, 4, "VEC4");
    let weights =
        builder.floats(&[[1.0, 0.0, 0.0, 0.0], [0.25, 0.75, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]);
    let tangents = builder.floats(&[[1.0, 0.0, 0.0, -1.0]; 4]);
    let moved = builder.floats(&[[0.0, 0.0, 0.5], [0.0, 0.0, 0.0], [0.0, 0.0, -0.5], [0.125, 0.0, 0.0]]);
    builder.json["accessors"][moved]["name"] = "smile".into();
    let primitive = &mut builder.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["JOINTS_0"] = joints.into();
    primitive["attributes"]["WEIGHTS_0"] = weights.into();
    primitive["attributes"]["TANGENT"] = tangents.into();
    primitive["targets"] = json!([{ "POSITION": moved }]);
    primitive["extras"] = json!({ "note": "left alone", "big": 1e300, "long": 0.1234567890123456 });
    primitive["extensions"] = json!({ "ACME_tag": { "color": [1, 2, 3] } });
    let times = builder.floats(&[[0.0], [1.0]]);
    let turns = builder.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]]);
    let inverse = builder.floats(&[[1.0_f32; 16], [2.0; 16]]);
    let picture = builder.view(b"\x89PNG not quite a picture");
    let dots = builder.floats(&[[7.0, 8.0, 9.0]]);
    let unused = builder.floats(&[[0.0, 0.0, 0.0]; 50]);
    assert!(unused > dots);
    builder.mesh(json!([{ "mode": 0, "attributes": { "POSITION": dots } }]));
    let more = json!({
        "asset": { "version": "2.0", "generator": "someone", "extras": [1, null] },
        "animations": [{
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": "rotation" } }],
            "samplers": [{ "input": times, "output": turns }],
        }],
        "skins": [{ "joints": [1, 2], "inverseBindMatrices": inverse }],
        "images": [{ "bufferView": picture, "mimeType": "image/png" }],
        "textures": [{ "source": 0 }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }, "alphaCutoff": 0.1 }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.01 } }],
        "nodes": [{ "mesh": 0, "skin": 0, "weights": [0.5] }, { "camera": 0 }, { "mesh": 1, "name": "dots" }],
        "scenes": [{ "nodes": [0, 1, 2] }],
        "scene": 0,
        "extensionsUsed": ["ACME_tag", "KHR_texture_transform"],
        "extensions": { "ACME_tag": { "x": [0.1, -0.0, 12345678901234567890_u64] } },
        "extras": { "deep": { "deeper": [[[]]] } },
    });
    more.as_object().expect("members").iter().for_each(|(key, value)| builder.json[key] = value.clone());
    builder
}

/// The same without the numbers of accessors and views, which are given anew.
fn without_numbers(json: &Value) -> Value {
    let mut json = json.clone();
    for key in ["accessors", "bufferViews", "buffers"] {
        json.as_object_mut().expect("an object").remove(key);
    }
    json["images"][0]["bufferView"] = 0.into();
    json["skins"][0]["inverseBindMatrices"] = 0.into();
    json["animations"][0]["samplers"] = 0.into();
    for mesh in json["meshes"].as_array_mut().expect("meshes") {
        for primitive in mesh["primitives"].as_array_mut().expect("primitives") {
            primitive["attributes"].as_object_mut().expect("some").values_mut().for_each(|number| *number = 0.into());
            primitive["indices"] = 0.into();
            primitive["targets"] = 0.into();
        }
    }
    json
}

fn accessor<'a>(json: &Value, binary: &'a [u8], number: &Value) -> &'a [u8] {
    view(json, binary, &json["accessors"][number.as_u64().expect("a number") as usize]["bufferView"])
}

#[test]
fn what_nobody_understands_survives() {
    let builder = everything();
    let Scene { mesh, document, .. } = builder.scene();
    let (json, binary, warnings) = written(&mesh, &document);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(without_numbers(&json), without_numbers(&builder.json));
    let before = |number: &Value| accessor(&builder.json, &builder.binary, number).to_vec();
    for path in [
        "/animations/0/samplers/0/input",
        "/animations/0/samplers/0/output",
        "/skins/0/inverseBindMatrices",
        "/meshes/1/primitives/0/attributes/POSITION",
    ] {
        let number = |json: &Value| json.pointer(path).expect(path).clone();
        assert_eq!(accessor(&json, &binary, &number(&json)), before(&number(&builder.json)), "{path}");
    }
    assert_eq!(view(&json, &binary, &json["images"][0]["bufferView"]), b"\x89PNG not quite a picture");
    // Three kept, five attributes with the target's, indices, points: what was not used is gone.
    assert_eq!(json["accessors"].as_array().map(Vec::len), Some(3 + 5 + 1 + 1));
    let target = json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"].as_u64().expect("one") as usize;
    assert_eq!(json["accessors"][target]["name"], "smile");
    assert_eq!(json["accessors"][target]["max"], json!([0.125, 0.0, 0.5]));
    assert!(
        json["bufferViews"]
            .as_array()
            .expect("views")
            .iter()
            .all(|view| view["byteOffset"].as_u64().expect("one") % 4 == 0)
    );
    assert_eq!(again(&mesh, &document), mesh);
}

#[test]
fn joints_and_targets_are_channels() {
    let Scene { mesh, document, .. } = everything().scene();
    let channel = |name: &str| mesh.channels.iter().find(|channel| channel.name == name).expect(name);
    let joints = channel("JOINTS");
    assert_eq!((joints.kind, joints.row(1)), (ChannelKind::Joints, &[1.0, 0.0, 0.0, 0.0, 0.25, 0.75, 0.0, 0.0][..]));
    assert_eq!(
        (channel("TANGENT").kind, channel("TANGENT").row(3)),
        (ChannelKind::Tangent, &[1.0, 0.0, 0.0, -1.0][..])
    );
    assert_eq!(channel("target_0.POSITION").row(2), [0.0, 0.0, -0.5]);
    // Small joints stay bytes; a mesh that lost its channels says so, and its target moves nothing.
    let mut bare = mesh.clone();
    bare.channels.clear();
    let (json, _, warnings) = written(&bare, &document);
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    let target = json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"].as_u64().expect("one") as usize;
    assert_eq!(json["accessors"][target].get("bufferView"), None);
    let (json, ..) = written(&mesh, &document);
    let joints = json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"].as_u64().expect("one") as usize;
    assert_eq!(json["accessors"][joints]["componentType"], U8);
}

#[test]
fn whole_numbers_stay_what_they_were() {
    let mut builder = square();
    let classes = builder.accessor(&[200, 0, 0, 0, 3, 0, 0, 0, 3, 0, 0, 0, 7, 0, 0, 0], U8, 4, "SCALAR");
    let view = builder.json["accessors"][classes]["bufferView"].as_u64().expect("a view") as usize;
    builder.json["bufferViews"][view]["byteStride"] = 4.into();
    let features = builder.floats(&[[5.0], [6.0], [6.0], [70_000.0]]);
    let heat = builder.floats(&[[0.5], [1.0], [0.0], [0.25]]);
    let attributes = &mut builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["_CLASS"] = classes.into();
    attributes["_FEATURE_ID_0"] = features.into();
    attributes["_HEAT"] = heat.into();
    let Scene { mesh, document, .. } = builder.scene();
    let kind = |name: &str| mesh.channels.iter().find(|channel| channel.name == name).map(|channel| channel.kind);
    let kinds = ["_CLASS", "_FEATURE_ID_0", "_HEAT"].map(kind);
    assert_eq!(kinds, [ChannelKind::Label, ChannelKind::Label, ChannelKind::Linear].map(Some));
    let (json, ..) = written(&mesh, &document);
    let component = |name: &str| {
        let number = json["meshes"][0]["primitives"][0]["attributes"][name].as_u64().expect(name) as usize;
        json["accessors"][number]["componentType"].as_u64()
    };
    assert_eq!(component("_CLASS"), Some(U8.into()));
    assert_eq!(component("_FEATURE_ID_0"), component("_HEAT"));
    assert_eq!(again(&mesh, &document), mesh);
}

#[test]
fn what_is_an_amount_anywhere_is_one_everywhere() {
    for is_whole_first in [true, false] {
        let mut builder = square();
        let whole = builder.accessor(&[0; 16], U8, 4, "SCALAR");
        let view = builder.json["accessors"][whole]["bufferView"].as_u64().expect("a view") as usize;
        builder.json["bufferViews"][view]["byteStride"] = 4.into();
        let parts = builder.floats(&[[0.5], [1.0], [0.0], [0.25]]);
        let first = builder.json["meshes"][0]["primitives"][0].clone();
        builder.json["meshes"][0]["primitives"] = json!([first, first]);
        let [one, other] = if is_whole_first { [whole, parts] } else { [parts, whole] };
        builder.json["meshes"][0]["primitives"][0]["attributes"]["_HEAT"] = one.into();
        builder.json["meshes"][0]["primitives"][1]["attributes"]["_HEAT"] = other.into();
        assert_eq!(builder.mesh_read().channels[0].kind, ChannelKind::Linear, "{is_whole_first}");
    }
}

#[test]
fn labels_of_other_formats_stay_labels_where_vertices_may_have_them() {
    let kinds = [[-1.0, 5.0], [0.0, 200.0], [-200.0, 7.0], [0.0, 65_535.0], [0.0, 65_536.0]].map(|[low, high]| {
        let mut mesh = square().mesh_read();
        let values = vec![low, high, low, high];
        mesh.channels = vec![Channel { name: "class".into(), kind: ChannelKind::Label, width: 1, values }];
        let mut bytes = Vec::new();
        formats::write_scene_to(&mesh, &Document::None, Format::Glb, &WriteOptions::default(), &mut bytes)
            .expect("written");
        let found = formats::read_bytes(&bytes, Format::Glb).expect("a good file");
        assert_eq!(found.channels[0].values, mesh.channels[0].values);
        found.channels[0].kind
    });
    let mut expected = [ChannelKind::Label; 5];
    expected[4] = ChannelKind::Linear;
    assert_eq!(kinds, expected);
}

#[test]
fn a_primitive_without_faces_goes_and_its_node_stays() {
    let mut builder = square();
    let (positions, indices) = (builder.floats(&SQUARE), builder.indices(&[0, 1, 2]));
    builder.mesh(json!([{ "attributes": { "POSITION": positions }, "indices": indices }]));
    builder.json["nodes"] = json!([{ "mesh": 0, "name": "a" }, { "mesh": 1, "name": "b" }]);
    let Scene { mut mesh, document, .. } = builder.scene();
    mesh.faces.retain(|face| face[0] >= 4);
    mesh.materials = Some(Materials { of_face: vec![1], names: mesh.materials.expect("two").names });
    let (json, _, warnings) = written(&mesh, &document);
    assert_eq!(json["nodes"], json!([{ "name": "a" }, { "mesh": 0, "name": "b" }]));
    assert_eq!(json["meshes"].as_array().map(Vec::len), Some(1));
    assert_eq!(warnings, ["primitives without faces left, which are not written: 1 of 2"]);
}

/// Numbers that an unknown extension may hold cannot be changed, so nothing is given another.
#[test]
fn hidden_numbers_stay_right() {
    let mut builder = square();
    let sound = builder.view(b"a sound");
    builder.json["nodes"][0]["extensions"] = json!({ "ACME_sound": { "clips": [{ "bufferView": sound }] } });
    let Scene { mesh, document, .. } = builder.scene();
    let (json, binary, _) = written(&mesh, &document);
    assert_eq!(json["nodes"], builder.json["nodes"]);
    assert_eq!(view(&json, &binary, &json!(sound)), b"a sound");
    assert_eq!(again(&mesh, &document), mesh);
}

#[test]
fn meshes_of_other_formats_become_a_file_of_their_own() {
    let mut mesh = coarsen::mesh::shapes::cube(1);
    let of_face = (0..mesh.faces.len() as u32).map(|face| face % 2).collect();
    mesh.materials = Some(Materials { of_face, names: vec!["stone\ng wall".into(), "wood".into()] });
    mesh.colors = Some((0..8).map(|i| [i as f32 / 255.0, 1.0, 0.2, 1.0]).collect());
    let values = (0..8).map(|i| i as f32).collect();
    mesh.channels = vec![Channel { name: "quality".into(), kind: ChannelKind::Linear, width: 1, values }];
    mesh.positions.iter_mut().for_each(|position| position.x += 5e6 + 0.1);
    let (json, ..) = written(&mesh, &Document::None);
    assert_eq!(json["materials"], json!([{ "name": "stone" }, { "name": "wood" }]));
    assert_eq!((&json["meshes"][0]["name"], json["meshes"].as_array().map(Vec::len)), (&json!("wall"), Some(2)));
    // Far from the origin the node takes the distance, so that no digit is lost.
    let read = again(&mesh, &Document::None);
    assert_eq!(read.channels[0].name, "_QUALITY");
    let corners = |mesh: &coarsen::Mesh| -> Vec<_> {
        mesh.faces.as_flattened().iter().map(|&v| mesh.positions[v as usize]).collect()
    };
    let order: Vec<usize> = (0..2).flat_map(|part| (part..mesh.faces.len()).step_by(2)).collect();
    mesh.faces = order.iter().map(|&face| mesh.faces[face]).collect();
    for (a, b) in corners(&read).iter().zip(corners(&mesh)) {
        assert!(a.distance(b) < 1e-6, "{a} {b}");
    }
    let colors = |mesh: &coarsen::Mesh| -> Vec<[u8; 4]> {
        let colors = mesh.colors.as_ref().expect("colors");
        mesh.faces.as_flattened().iter().map(|&v| colors[v as usize].map(|x| (255.0 * x).round() as u8)).collect()
    };
    assert_eq!(colors(&read), colors(&mesh));
}

/// A tangent that has no direction is none that a file may have.
#[test]
fn tangents_without_a_direction_are_not_written() {
    let mut mesh = coarsen::mesh::shapes::cube(1);
    let tangents = |last: f32| [[1.0, 0.0, 0.0, 1.0].repeat(7), vec![last, 0.0, 0.0, 1.0]].concat();
    for last in [1.0, 0.0] {
        mesh.channels =
            vec![Channel { name: "TANGENT".into(), kind: ChannelKind::Tangent, width: 4, values: tangents(last) }];
        let (json, ..) = written(&mesh, &Document::None);
        let has_any = json["meshes"][0]["primitives"][0]["attributes"].get("TANGENT").is_some();
        assert_eq!(has_any, last > 0.0);
    }
}

/// An attribute that another part's target shares its name with: numbers, as wide as the widest.
#[test]
fn what_is_two_things_is_numbers() {
    let mut builder = square();
    let (moved, own) = (builder.floats(&[[1.0, 2.0, 3.0]; 4]), builder.floats(&[[4.0, 5.0, 6.0, 7.0]; 4]));
    let first = &mut builder.json["meshes"][0]["primitives"][0];
    let mut second = first.clone();
    first["targets"] = json!([{ "POSITION": moved }]);
    second["attributes"]["target_0.POSITION"] = own.into();
    builder.json["meshes"][0]["primitives"].as_array_mut().expect("a list").push(second);
    let Scene { mesh, document, .. } = builder.scene();
    mesh.check().expect("a valid mesh");
    let channel = &mesh.channels[0];
    assert_eq!((channel.kind, channel.row(0)), (ChannelKind::Linear, &[1.0, 2.0, 3.0, 0.0][..]));
    assert_eq!(channel.row(4), [4.0, 5.0, 6.0, 7.0]);
    assert_eq!(again(&mesh, &document), mesh);
}

/// Read, written, read again: the same mesh; written again: the same bytes.
#[test]
fn real_files_come_back() {
    for path in models::all().iter().filter(|path| path.extension().is_some_and(|e| e == "glb" || e == "gltf")) {
        let name = path.display();
        let Scene { mesh, document, .. } = formats::read_scene(path).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut bytes = Vec::new();
        let warnings = formats::write_scene_to(&mesh, &document, Format::Glb, &WriteOptions::default(), &mut bytes);
        assert!(warnings.expect("written").is_empty());
        let second = formats::read_scene_bytes(&bytes, Format::Glb, None).expect("a scene");
        let Scene { mesh: again, document, .. } = &second;
        assert_eq!((&again.faces, &again.materials, &again.texcoords), (&mesh.faces, &mesh.materials, &mesh.texcoords));
        assert_eq!((&again.channels, &again.colors), (&mesh.channels, &mesh.colors), "{name}");
        let far = |(a, b): (&coarsen::math::DVec3, &coarsen::math::DVec3)| a.distance(*b);
        let moved = again.positions.iter().zip(&mesh.positions).map(far).fold(0.0, f64::max);
        assert!(moved <= 1e-14 * mesh.diagonal(), "{name}: a vertex moved by {moved}");
        let (a, b) = (again.normals.iter().flatten(), mesh.normals.iter().flatten());
        let turned = a.zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(turned < 1e-6, "{name}: a normal turned by {turned}");
        let (json, ..) = written(again, document);
        let untouched = ["nodes", "materials", "textures", "samplers", "scenes", "cameras", "asset"];
        let original = std::fs::read(path).expect("bytes");
        let original = if original.starts_with(b"glTF") {
            parts(&original).0
        } else {
            serde_json::from_slice(&original).expect("JSON")
        };
        for key in untouched {
            assert_eq!(json.get(key), original.get(key), "{name}: {key}");
        }
    }
}
