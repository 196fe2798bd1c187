//! glTF through the program: what is no triangle goes from input to output.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::Dir;
use super::models;

/// The JSON of a glTF or a GLB.
fn json_of(path: &Path) -> Value {
    let bytes = fs::read(path).expect("a file");
    let text = match bytes.strip_prefix(b"glTF") {
        Some(rest) => &rest[16..16 + u32::from_le_bytes(rest[8..12].try_into().expect("four bytes")) as usize],
        None => &bytes[..],
    };
    serde_json::from_slice(text).expect("JSON")
}

/// A sphere-like sheet of 200 faces with a node, an animation, extras, and a picture beside it.
fn write_sheet(dir: &Dir) -> Value {
    let side = 11_u16;
    let mut binary: Vec<u8> = Vec::new();
    for vertex in 0..side * side {
        let (x, y) = (f32::from(vertex % side), f32::from(vertex / side));
        [x, y, (x * y / 30.0).sin()].iter().for_each(|x| binary.extend_from_slice(&x.to_le_bytes()));
    }
    let indices_start = binary.len();
    for cell in (0..side * (side - 1)).filter(|cell| cell % side < side - 1) {
        let corners = [cell, cell + 1, cell + side + 1, cell, cell + side + 1, cell + side];
        corners.iter().for_each(|corner| binary.extend_from_slice(&corner.to_le_bytes()));
    }
    let end = binary.len();
    binary.extend_from_slice(&[0; 8]);
    let json = json!({
        "asset": { "version": "2.0", "copyright": "nobody" },
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [{ "mesh": 0, "translation": [1, 2, 3], "extras": { "keep": [1, 2.5] } }, { "name": "empty" }],
        "meshes": [{ "name": "sheet", "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "materials": [{ "name": "cloth", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }],
        "images": [{ "uri": "cloth.png" }],
        "animations": [{
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": "scale" } }],
            "samplers": [{ "input": 2, "output": 2 }],
        }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 121, "type": "VEC3", "min": [0, 0, -1], "max": [10, 10, 1] },
            { "bufferView": 1, "componentType": 5123, "count": 600, "type": "SCALAR" },
            { "bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": indices_start },
            { "buffer": 0, "byteOffset": indices_start, "byteLength": end - indices_start },
            { "buffer": 0, "byteOffset": end, "byteLength": 8 },
        ],
        "buffers": [{ "byteLength": binary.len(), "uri": "sheet.bin" }],
    });
    dir.file("sheet.bin", binary).file("sheet.gltf", json.to_string());
    json
}

const UNTOUCHED: [&str; 6] = ["asset", "scenes", "nodes", "materials", "textures", "images"];

#[test]
fn every_verb_carries_what_is_no_triangle() {
    let dir = Dir::new();
    let json = write_sheet(&dir);
    dir.run("simplify sheet.gltf one.glb -f 50 -g cpu -q").succeeds();
    dir.run("simplify sheet.gltf two.gltf -f 50 -g cpu -q").succeeds();
    dir.run("lod sheet.gltf level{level}.glb --levels 2 --ratio-step 50% -g cpu -q").succeeds();
    dir.run("batch sheet.gltf -d out --ratios 25% -g cpu -q").succeeds();
    assert_eq!(json_of(&dir.path("two.gltf"))["buffers"][0]["uri"], "two.bin");
    let batched = fs::read_dir(dir.path("out")).expect("a folder").map(|entry| entry.expect("an entry").path());
    let batched = batched.filter(|path| path.extension().is_some_and(|extension| extension == "gltf"));
    let outputs = ["one.glb", "two.gltf", "level1.glb", "level2.glb"].map(|name| dir.path(name));
    let outputs: Vec<_> = outputs.into_iter().chain(batched).collect();
    assert_eq!(outputs.len(), 5);
    for path in outputs {
        let written = json_of(&path);
        for key in UNTOUCHED {
            assert_eq!(written[key], json[key], "{}: {key}", path.display());
        }
        assert_eq!(written["meshes"][0]["name"], "sheet");
        assert_eq!(written["animations"][0]["channels"], json["animations"][0]["channels"]);
    }
    let found = dir.run("inspect two.gltf --json").succeeds().json();
    assert_eq!(found["materials"], json!([{ "name": "0.0 sheet: cloth", "faces": 50 }]));
    assert_eq!(found["shown"], json!(null));
    // Its place in the scene is what is measured and compared.
    assert_eq!(found["bounds"]["low"][0], 1.0);
    let ran = dir.run("simplify sheet.gltf out.ply -f 50 -g cpu").succeeds();
    assert!(
        ran.err
            .contains("warning: 'sheet.gltf': nodes, animations, materials and textures are not written: PLY has none"),
        "{}",
        ran.err
    );
    let ran = dir.run("simplify sheet.gltf out/far.glb -f 50 -g cpu").succeeds();
    assert!(ran.err.contains("pictures beside the input are not copied"), "{}", ran.err);
}

/// The materials of a glTF go to a library beside an OBJ, which is replaced as unwillingly as the OBJ itself.
#[test]
fn an_obj_gets_a_library_beside() {
    let dir = Dir::new();
    write_sheet(&dir);
    let ran = dir.run("simplify sheet.gltf out.obj -f 50 -g cpu").succeeds();
    assert!(ran.err.contains("nodes, animations and all of materials but base colors"), "{}", ran.err);
    let text = |name: &str| fs::read_to_string(dir.path(name)).expect("text");
    assert!(text("out.obj").contains("mtllib out.mtl\n") && text("out.obj").contains("usemtl cloth\n"));
    assert!(text("out.mtl").contains("newmtl cloth\n") && text("out.mtl").contains("map_Kd cloth.png\n"));
    fs::remove_file(dir.path("out.obj")).expect("removed");
    dir.run("simplify sheet.gltf out.obj -f 50").fails(8, &["'out.mtl', where the materials", "give -w"]);
    dir.run("simplify sheet.gltf out.obj -f 50 -w -q -g cpu").succeeds();
    dir.run("lod sheet.gltf level{level}.obj --levels 2 --ratio-step 50% -g cpu -q").succeeds();
    assert!(text("level2.obj").contains("mtllib level2.mtl\n"));
    // Coplanar regions carry the texture too: a sheet that is bent keeps its faces.
    dir.run("simplify sheet.gltf flat.glb --method coplanar -g cpu -q").succeeds();
    assert_eq!(json_of(&dir.path("flat.glb"))["materials"][0]["name"], "cloth");
    dir.run("compare sheet.gltf flat.glb -v -q").fails(2, &["cannot be used with"]);
}

#[test]
fn what_is_not_understood_is_an_exit_code() {
    let dir = Dir::new();
    let mut json = write_sheet(&dir);
    json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    dir.file("draco.gltf", json.to_string()).file("cut.glb", b"glTF\x02\0\0\0");
    dir.run("simplify draco.gltf out.glb -f 4").fails(5, &["KHR_draco_mesh_compression"]);
    dir.run("simplify cut.glb out.glb -f 4").fails(4, &["'cut.glb': glTF byte 8"]);
    fs::remove_file(dir.path("sheet.bin")).expect("removed");
    dir.run("simplify sheet.gltf out.glb -f 4").fails(4, &["sheet.bin"]);
    dir.file("there.bin", b"mine");
    dir.run("simplify sample:part@1k there.gltf -f 100").fails(8, &["'there.bin'", "give -w"]);
    dir.run("lod sheet.gltf out.glb --shared-vertices").fails(2, &["--shared-vertices in GLB"]);
}

/// Half of the faces of every real file; what is no triangle is as it was.
#[test]
fn real_files_are_halved() {
    let dir = Dir::new();
    for path in models::all().iter().filter(|path| path.extension().is_some_and(|e| e == "glb" || e == "gltf")) {
        let name = path.display();
        let ran = dir.run(&format!("simplify {name} out.glb -w --ratio 50% -g cpu")).succeeds();
        let written = json_of(&dir.path("out.glb"));
        let half = dir.run("inspect out.glb --json").succeeds().json();
        let whole = dir.run(&format!("inspect {name} --json")).succeeds().json();
        let faces = |record: &Value| record["stored"]["faces"].as_u64().expect("a number");
        // Creases and materials hold some at a little more than half, which is told.
        let is_half = 2 * faces(&half) <= faces(&whole) + 1;
        let is_stuck = ran.err.contains("stop=stuck, blocked by seam") && 10 * faces(&half) <= 6 * faces(&whole);
        assert!(is_half || is_stuck, "{name}: {}", ran.err);
        let before = json_of(path);
        // Views of pictures have other numbers, and what is no view is as it was.
        let rest = |json: &Value, key: &str| {
            let mut rest = json.get(key).cloned();
            if let (Some(images), "images") = (rest.as_mut().and_then(Value::as_array_mut), key) {
                images.iter_mut().filter_map(Value::as_object_mut).for_each(|image| {
                    image.remove("bufferView");
                });
            }
            rest
        };
        for key in UNTOUCHED.iter().chain(&["samplers", "cameras", "extras"]) {
            assert_eq!(rest(&written, key), rest(&before, key), "{name}: {key}");
        }
    }
}

/// What two nodes show is there twice in whatever has no nodes, and where nobody could tell afterwards what they show.
#[test]
fn what_two_nodes_show_is_there_twice() {
    let dir = Dir::new();
    let mut json = write_sheet(&dir);
    json["nodes"][1] = json!({ "mesh": 0, "name": "again", "translation": [0, 50, 0] });
    // A second primitive, so that faces are told apart by their materials alone.
    let primitives = json["meshes"][0]["primitives"].as_array_mut().expect("a list");
    primitives.push(json!({ "attributes": { "POSITION": 0 }, "indices": 3 }));
    json["accessors"]
        .as_array_mut()
        .expect("a list")
        .push(json!({ "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" }));
    dir.file("two.gltf", json.to_string());
    let height = |name: &str| {
        let bounds = dir.run(&format!("inspect {name} --json")).succeeds().json()["bounds"].clone();
        bounds["high"][1].as_f64().expect("a number")
    };
    let found = dir.run("inspect two.gltf --json").succeeds().json();
    assert_eq!((&found["stored"]["faces"], &found["shown"]["faces"]), (&json!(201), &json!(402)));
    dir.run("lod two.gltf two-{level}.glb --levels 1 --manifest two.json -g cpu -q").succeeds();
    let manifest: Value = serde_json::from_slice(&fs::read(dir.path("two.json")).expect("a file")).expect("JSON");
    let [low, high] = [0, 1].map(|end| manifest["bounds"][end].as_array().expect("a point")[..2].to_vec());
    assert_eq!(
        (&manifest["faces"], low, high),
        (&json!(201), vec![json!(0.0), json!(2.0)], vec![json!(11.0), json!(60.0)])
    );
    let ran = dir.run("simplify two.gltf out.obj -f 50 -g cpu --json").succeeds();
    let warnings = ran.json()["warnings"].to_string();
    assert!(warnings.contains("is written for each of them") && warnings.contains("but base colors"), "{warnings}");
    assert!(fs::read_to_string(dir.path("out.obj")).expect("text").contains("o again\n"));
    dir.run("simplify two.gltf bare.glb -f 80 -g cpu -q --drop material").succeeds();
    dir.run("simplify two.gltf removed.ply -f 80 -g cpu -q --method removal").succeeds();
    dir.run("batch two.gltf -d bare --ratios 25% -g cpu -q --drop material").succeeds();
    let batched = fs::read_dir(dir.path("bare")).expect("a folder").map(|entry| entry.expect("an entry").path());
    let batched = batched.filter(|path| path.extension().is_some_and(|extension| extension == "gltf"));
    let batched: Vec<String> = batched.map(|path| path.display().to_string()).collect();
    assert_eq!(batched.len(), 1);
    for name in ["out.obj", "bare.glb", "removed.ply", &batched[0]] {
        assert!(height(name) > 55.0, "{name}: {}", height(name));
    }
    let ran = dir.run("lod two.gltf shared.obj --levels 2 --shared-vertices -g cpu").succeeds();
    assert!(ran.err.contains("are written without nodes, materials and groups"), "{}", ran.err);
    let found = dir.run("compare two.gltf out.obj --json").succeeds().json();
    assert!(found["relative"]["max"].as_f64().is_some_and(|most| most < 0.05), "{}", found["relative"]);
}
