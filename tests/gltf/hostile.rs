//! Files that lie: an error with the place, in no time, and never a panic.

use std::time::{Duration, Instant};

use coarsen::Error;
use coarsen::formats::{self, Format};
use serde_json::{Value, json};

use crate::scene::*;

/// The square with something at a path of the JSON.
fn with(path: &str, value: Value) -> Builder {
    let mut builder = square();
    let (parent, key) = path.rsplit_once('/').expect("a path");
    let parent = builder.json.pointer_mut(parent).expect("a place");
    match (parent, key.parse::<usize>()) {
        (Value::Array(values), Ok(index)) => values[index] = value,
        (parent, _) => parent[key] = value,
    }
    builder
}

#[test]
fn lies_are_refused_with_their_place() {
    let huge = 4_000_000_000_u64;
    for (path, value, expected) in [
        ("/accessors/0/count", json!(huge), "accessors[0]: 4000000000 elements take"),
        ("/accessors/0/count", json!(5), "accessors[0]: 5 elements take 60 bytes, the view has 48"),
        ("/accessors/0/count", json!(3), "accessors[1]: index 5 is 3, expected less than 3"),
        ("/accessors/0/count", json!(-1), "accessors[0].count: found -1, expected a whole number"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "accessors[0]"),
        ("/accessors/0/componentType", json!(7), "accessors[0].componentType"),
        ("/accessors/0/type", json!("VEC2"), "accessors[0]: POSITION of 2 numbers, expected 3"),
        ("/accessors/0/type", json!("VEC7"), "accessors[0]: 'type' is none of"),
        ("/accessors/0/bufferView", json!(9), "accessors[0].bufferView: has no bufferViews[9]"),
        ("/accessors/0", json!(3), "accessors[0]: lacks 'count'"),
        ("/accessors/1/type", json!("VEC2"), "accessors[1]"),
        ("/accessors/1/componentType", json!(I16), "accessors[1]: expected whole numbers"),
        ("/bufferViews/0/byteLength", json!(huge), "bufferViews[0]: ends at byte 4000000000 of buffers[0]"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "bufferViews[0]: ends at byte"),
        ("/bufferViews/0/byteStride", json!(0), "bufferViews[0]: the byteStride is not from 4 to 252"),
        ("/bufferViews/0/buffer", json!(1), "bufferViews[0]: has no buffers[1]"),
        ("/meshes/0/primitives/0/mode", json!(8), "meshes[0].primitives[0]: has the mode 8"),
        ("/meshes/0/primitives/0/attributes", json!([]), "no faces"),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(4),
            "meshes[0].primitives[0].attributes.POSITION: has no accessors[4]",
        ),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(1), "accessors[1]: NORMAL of 1 numbers, expected 3"),
        (
            "/meshes/0/primitives/0/attributes/_ID",
            json!(1),
            "meshes[0].primitives[0]: 6 elements of _ID for 4 positions",
        ),
        ("/meshes/0/primitives/0/targets", json!([{ "POSITION": 1 }]), "accessors[1]: POSITION of 1 numbers"),
        ("/meshes/0/primitives/0/targets", json!(5), "meshes[0].primitives[0].targets: expected an array"),
        ("/meshes/0/primitives/0/material", json!(0), "meshes[0].primitives[0]: has no materials[0]"),
        ("/meshes/0/primitives", json!({}), "meshes[0].primitives: expected an array"),
        ("/nodes/0/children", json!([0]), "nodes[0]: is its own descendant"),
        ("/nodes/0/mesh", json!(1), "nodes[0]: has no meshes[1]"),
        ("/nodes/0/matrix", json!([1]), "nodes[0].matrix: expected 16 finite numbers"),
        ("/images", json!([{ "bufferView": 99 }]), "the root: something names bufferViews[99]"),
        ("/skins", json!([{ "inverseBindMatrices": 99 }]), "the root: something names accessors[99]"),
        ("/asset", json!({}), "unsupported: glTF of version ''"),
        ("/meshes", json!([]), "nodes[0]: has no meshes[0]"),
    ] {
        let start = Instant::now();
        let error = with(path, value.clone()).error().to_string();
        assert!(error.contains(expected), "{path} = {value}: {error}");
        assert!(start.elapsed() < Duration::from_millis(200), "{path} took {:?}", start.elapsed());
    }
}

#[test]
fn compressed_meshes_are_refused_by_their_extension() {
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression"] {
        let error = with("/extensionsRequired", json!([name])).error();
        assert!(matches!(&error, Error::Unsupported(message) if message.contains(name)), "{error}");
    }
    let mut builder = with("/meshes/0/primitives/0/extensions", json!({ "KHR_draco_mesh_compression": {} }));
    for accessor in builder.json["accessors"].as_array_mut().expect("some") {
        accessor.as_object_mut().expect("an object").remove("bufferView");
    }
    assert!(matches!(builder.error(), Error::Unsupported(message) if message.contains("draco")));
    // What is required and changes no vertex is no reason.
    with("/extensionsRequired", json!(["KHR_texture_basisu"])).scene();
}

/// Accessors without bytes and shared ones describe what no memory holds.
#[test]
fn small_files_stay_small() {
    let mut builder = square();
    builder.json["accessors"][0].as_object_mut().expect("an object").remove("bufferView");
    builder.json["accessors"][0]["count"] = json!(2_000_000_000);
    builder.json["meshes"][0]["primitives"][0].as_object_mut().expect("an object").remove("indices");
    assert!(builder.error().to_string().contains("describes far more numbers than"));
    let mut builder = square();
    let one = builder.json["meshes"][0]["primitives"][0].clone();
    let bytes = vec![0_u8; 300_000];
    builder.json["meshes"][0]["primitives"] = vec![one; 2000].into();
    let indices = builder.accessor(&bytes, U8, bytes.len(), "SCALAR");
    for primitive in builder.json["meshes"][0]["primitives"].as_array_mut().expect("some") {
        primitive["indices"] = indices.into();
    }
    let start = Instant::now();
    assert!(builder.error().to_string().contains("describes far more numbers than"));
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
}

#[test]
fn positions_are_finite() {
    for bad in [f32::NAN, f32::INFINITY] {
        let mut builder = square();
        builder.binary[16..20].copy_from_slice(&bad.to_le_bytes());
        assert!(builder.error().to_string().contains("accessors[0]: position 1 is not finite"));
    }
}

#[test]
fn broken_containers_are_refused() {
    let good = square().glb();
    for end in 0..good.len() {
        let error = formats::read_bytes(&good[..end], Format::Glb).expect_err("cut");
        assert!(matches!(error, Error::Format { .. }), "{end}: {error}");
    }
    let mut old = good.clone();
    old[4] = 1;
    assert!(matches!(formats::read_bytes(&old, Format::Glb), Err(Error::Unsupported(_))));
    let text = formats::read_bytes(b"{ \"asset\": {\n \"version\": 2.0 ", Format::Gltf).expect_err("cut").to_string();
    assert!(text.starts_with("glTF line 2: the JSON does not parse"), "{text}");
    let error = formats::read_bytes(b"PK\x03\x04", Format::Glb).expect_err("a zip").to_string();
    assert_eq!(error, "GLB byte 0: found a zip archive, expected the letters 'glTF'");
    let error = formats::read_bytes(&good, Format::Gltf).expect_err("a GLB").to_string();
    assert_eq!(error, "glTF byte 0: found GLB data, expected a JSON object");
}

/// SplitMix64.
fn next(state: &mut u64, bound: usize) -> usize {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) % bound.max(1) as u64) as usize
}

/// The places of a JSON value, deepest too.
fn places(value: &Value, path: &str, found: &mut Vec<String>) {
    found.push(path.into());
    match value {
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(i, value)| places(value, &format!("{path}/{i}"), found));
        }
        Value::Object(map) => map.iter().for_each(|(key, value)| places(value, &format!("{path}/{key}"), found)),
        _ => {}
    }
}

/// Values of the JSON and bytes replaced at random: a mesh that can be written, or an error.
#[test]
fn mutated_files_give_a_mesh_or_an_error() {
    let mut base = square();
    let (uvs, moved) = (base.floats(&[[0.5, 0.5]; 4]), base.floats(&[[0.1, 0.0, 0.0]; 4]));
    let joints = base.accessor(&[0; 16], U8, 4, "VEC4");
    let primitive = &mut base.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = uvs.into();
    primitive["attributes"]["JOINTS_0"] = joints.into();
    primitive["attributes"]["WEIGHTS_0"] = joints.into();
    primitive["targets"] = json!([{ "POSITION": moved }]);
    base.json["nodes"] =
        json!([{ "children": [1], "scale": [1, 2, 1] }, { "mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 1,2,3,1] }]);
    let (sparse, values) = (base.view(&[1, 2]), base.view(&[0; 24]));
    base.json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": sparse, "componentType": U8 },
        "values": { "bufferView": values },
    });
    assert_eq!(base.mesh_read().faces.len(), 2);
    let mut all = Vec::new();
    places(&base.json, "", &mut all);
    let start = Instant::now();
    let (mut read, mut refused) = (0, 0);
    for seed in 0..4000 {
        let mut state = seed;
        let mut mutant = Builder { json: base.json.clone(), binary: base.binary.clone() };
        for _ in 0..=next(&mut state, 2) {
            let value = match next(&mut state, 12) {
                0 => json!(null),
                1 => json!(-1),
                2 => json!(u64::MAX),
                3 => json!(1e300),
                4 => json!([]),
                5 => json!({}),
                6 => json!("VEC4"),
                7 => json!(5121 + next(&mut state, 6)),
                8 => json!([0, 1]),
                9 => base.json.pointer(&all[next(&mut state, all.len())]).cloned().unwrap_or_default(),
                _ => json!(next(&mut state, 12)),
            };
            if let Some(place) = mutant.json.pointer_mut(&all[next(&mut state, all.len())]) {
                *place = value;
            }
        }
        if seed % 2 == 0 {
            let at = next(&mut state, mutant.binary.len());
            mutant.binary[at] = next(&mut state, 256) as u8;
        }
        let mut bytes = match &mutant.json {
            Value::Object(_) => mutant.glb(),
            other => glb(other, &mutant.binary),
        };
        if seed % 4 == 0 {
            let at = next(&mut state, bytes.len());
            bytes[at] = next(&mut state, 256) as u8;
        }
        let result = std::panic::catch_unwind(|| {
            let Ok(scene) = formats::read_scene_bytes(&bytes, Format::Glb, None) else { return false };
            scene.mesh.check().expect("a mesh that holds what it promises");
            let mut out = Vec::new();
            formats::write_scene_to(
                &scene.mesh,
                &scene.document,
                Format::Glb,
                &formats::WriteOptions::default(),
                &mut out,
            )
            .expect("written");
            formats::read_bytes(&out, Format::Glb).expect("what was written can be read");
            true
        });
        match result {
            Ok(true) => read += 1,
            Ok(false) => refused += 1,
            Err(_) => panic!("seed {seed} panicked on {}", mutant.json),
        }
    }
    assert!(read > 200 && refused > 1000, "{read} read, {refused} refused");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
}

#[test]
fn numbers_that_are_not_finite_are_zero_and_told() {
    let mut builder = square();
    let (nan, far) = (f32::NAN, f32::INFINITY);
    let rows = |bad: f32| [[bad, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
    let of_four = |bad: f32| [[1.0, 0.0, 0.0, 0.0], [bad, 0.0, 0.0, 1.0], [1.0; 4], [1.0; 4]];
    let [normals, moved] = [builder.floats(&rows(nan)), builder.floats(&rows(far))];
    let places = builder.floats(&[[nan, 0.5], [1.0, far], [1.0, 1.0], [0.0, 1.0]]);
    let [colors, weights, tangents] = [nan, nan, -far].map(|bad| builder.floats(&of_four(bad)));
    let joints = builder.accessor(&[0; 16], U8, 4, "VEC4");
    let primitive = &mut builder.json["meshes"][0]["primitives"][0];
    for (name, accessor) in [
        ("NORMAL", normals),
        ("TEXCOORD_0", places),
        ("COLOR_0", colors),
        ("JOINTS_0", joints),
        ("WEIGHTS_0", weights),
        ("TANGENT", tangents),
    ] {
        primitive["attributes"][name] = json!(accessor);
    }
    primitive["targets"] = json!([{ "POSITION": moved }]);
    // Turned, so that directions are not taken as they are.
    builder.json["nodes"][0]["rotation"] = json!([0.0, 0.6, 0.0, 0.8]);
    let scene = builder.scene();
    let [told] = scene.warnings.as_slice() else { panic!("one warning: {:?}", scene.warnings) };
    // The first vertex of the square is in both triangles, the second in one.
    for part in ["zero: normals 1, texture coordinates of corners 3, colors 1, ", "'JOINTS' 1", "'TANGENT' 1"] {
        assert!(told.contains(part), "{told}");
    }
    assert_eq!(told.matches('\'').count(), 6, "and the target: {told}");
    let mesh = scene.into_mesh();
    mesh.check().expect("a mesh");
    let channels = mesh.channels.iter().flat_map(|channel| &channel.values);
    assert!(channels.chain(mesh.colors.expect("colors").as_flattened()).all(|number| number.is_finite()));
}

/// Only where a weight moves something, and by the smallest skin that the mesh is shown with.
#[test]
fn joints_that_a_skin_does_not_have_are_told() {
    let told_with = |skin: usize, first_weight: f32| {
        let mut builder = square();
        let joints = builder.accessor(&[2, 9, 0, 0, 0, 9, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0], U8, 4, "VEC4");
        let weights = builder.floats(&[[first_weight, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [1.0; 4], [1.0; 4]]);
        let attributes = &mut builder.json["meshes"][0]["primitives"][0]["attributes"];
        (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(joints), json!(weights));
        builder.json["skins"] = json!([{ "joints": [0, 0, 0] }, { "joints": [0, 0] }]);
        builder.json["nodes"][0]["skin"] = json!(0);
        builder.node(json!({ "mesh": 0, "skin": skin }));
        builder.scene().warnings
    };
    let told = |count: usize| vec![format!("vertices with weights of joints that their skin does not have: {count}")];
    assert_eq!(told_with(0, 1.0), Vec::<String>::new());
    assert_eq!(told_with(7, 1.0), Vec::<String>::new());
    assert_eq!(told_with(1, 1.0), told(2));
    assert_eq!(told_with(1, 0.0), told(1));
}
