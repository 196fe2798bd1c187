//! Materials from OBJ to glTF and back, with their pictures; what is missing or broken is told and stops nothing.

use std::fs;
use std::path::Path;

use coarsen::formats::{self, Document, Scene, WriteOptions};
use coarsen::math::DVec2;
use coarsen::mesh::{Channel, ChannelKind};
use serde_json::{Value, json};

#[path = "support/pictures.rs"]
mod pictures;
use pictures::png;

/// The JSON of a GLB or a glTF, and the bytes behind it.
fn parts_of(path: &Path) -> (Value, Vec<u8>) {
    let bytes = fs::read(path).expect("a file");
    if !bytes.starts_with(b"glTF") {
        let binary = fs::read(path.with_extension("bin")).unwrap_or_default();
        return (serde_json::from_slice(&bytes).expect("JSON"), binary);
    }
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let binary = bytes.get(28 + length..).unwrap_or_default().to_vec();
    (serde_json::from_slice(&bytes[20..20 + length]).expect("JSON"), binary)
}

/// Six faces of four materials, one of them in two groups and one that no library describes.
const OBJ: &str = "mtllib things.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 0 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
    f 1/1 2/2 3/3\nusemtl red paint\ng door\nf 2/1 4/2 3/3\ng roof\nf 2/1 5/2 4/3\nusemtl bricks\nf 5/1 6/2 4/3\n\
    usemtl glass\nf 1/1 3/3 2/2\nusemtl unknown\nf 5/3 4/1 6/2\n";
const MTL: &str = "newmtl red paint\nKd 1 0 0\nNs 6\nnewmtl bricks\nKd 0 0 0\nmap_Kd -s 2 4 -o 0.5 0.25 -clamp on bricks.png\n\
    newmtl glass\nKd 0.5 0.5 0.5\nTr 0.75\nPm 1\nmap_Kd wall.tga\n";

fn write_inputs(folder: &Path) {
    fs::write(folder.join("things.obj"), OBJ).expect("written");
    fs::write(folder.join("things.mtl"), MTL).expect("written");
    fs::write(folder.join("bricks.png"), png([200, 80, 60])).expect("written");
    fs::write(folder.join("wall.tga"), b"no picture that a glTF can have").expect("written");
}

fn converted(scene: &Scene, path: &Path) -> Vec<String> {
    formats::write_scene(&scene.mesh, &scene.document, path, &WriteOptions::default()).expect("written")
}

#[test]
fn libraries_become_materials_of_a_glb() {
    let folder = tempfile::tempdir().expect("a folder");
    write_inputs(folder.path());
    let scene = formats::read_scene(&folder.path().join("things.obj")).expect("a scene");
    for name in ["things.glb", "apart.gltf"] {
        let path = folder.path().join(name);
        let warnings = converted(&scene, &path);
        assert!(
            warnings.len() == 1 && warnings[0].contains("'wall.tga' is not written: it is neither"),
            "{warnings:?}"
        );
        let (json, binary) = parts_of(&path);
        let names: Vec<&str> =
            json["materials"].as_array().expect("a list").iter().flat_map(|m| m["name"].as_str()).collect();
        assert_eq!(names, ["red paint", "bricks", "glass", "unknown"]);
        let surface = |material: usize| &json["materials"][material]["pbrMetallicRoughness"];
        assert_eq!(
            surface(0),
            &json!({ "baseColorFactor": [1.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5 })
        );
        // Black under a texture is no color.
        assert_eq!(surface(1)["baseColorFactor"], json!([1.0, 1.0, 1.0, 1.0]));
        // v points down there: what began a quarter above the lower side of four pictures ends a quarter below the upper one.
        let moved = json!({ "offset": [0.5, -3.25], "scale": [2.0, 4.0] });
        assert_eq!(surface(1)["baseColorTexture"]["extensions"]["KHR_texture_transform"], moved);
        assert_eq!(
            (&json["extensionsUsed"], &json["samplers"][0]["wrapS"]),
            (&json!(["KHR_texture_transform"]), &json!(33071))
        );
        let view = &json["bufferViews"][json["images"][0]["bufferView"].as_u64().expect("a number") as usize];
        let [start, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().expect("a number") as usize);
        assert_eq!(
            (&binary[start..start + length], &json["images"][0]["mimeType"]),
            (&png([200, 80, 60])[..], &json!("image/png"))
        );
        let light = surface(2)["baseColorFactor"][0].as_f64().expect("a number");
        assert!((light - 0.214_041_14).abs() < 1e-6 && surface(2)["baseColorFactor"][3] == 0.25, "{light}");
        assert_eq!((&json["materials"][2]["alphaMode"], &surface(2)["metallicFactor"]), (&json!("BLEND"), &json!(1.0)));
        assert_eq!(json["materials"][3], json!({ "name": "unknown" }));
        let meshes = json["meshes"].as_array().expect("a list");
        let primitives = |mesh: &Value| mesh["primitives"].as_array().cloned().expect("a list");
        let numbers = |mesh| primitives(mesh).iter().map(|primitive| primitive["material"].as_u64()).collect();
        let numbers: Vec<Vec<Option<u64>>> = meshes.iter().map(numbers).collect();
        assert_eq!(numbers, [vec![None], vec![Some(0)], vec![Some(0), Some(1), Some(2), Some(3)]]);
    }
}

/// There and back: the colors, the picture and where it lies.
#[test]
fn materials_of_a_glb_become_a_library() {
    let folder = tempfile::tempdir().expect("a folder");
    write_inputs(folder.path());
    let at = |name: &str| folder.path().join(name);
    let first = formats::read_scene(&at("things.obj")).expect("a scene");
    converted(&first, &at("things.glb"));
    let second = formats::read_scene(&at("things.glb")).expect("a scene");
    let warnings = converted(&second, &at("back.obj"));
    assert!(
        warnings.len() == 1 && warnings[0].starts_with("nodes and all of materials but base colors are not written"),
        "{warnings:?}"
    );
    let text = fs::read_to_string(at("back.obj")).expect("text");
    assert!(text.contains("\nmtllib back.mtl\n") && text.contains("\nusemtl red paint\n"), "{text}");
    let library = fs::read_to_string(at("back.mtl")).expect("text");
    assert!(library.contains("newmtl red paint\nKd 1 0 0\nd 1\nNs 6\nPr 0.5\nPm 0\n"), "{library}");
    let file =
        library.lines().find_map(|line| line.strip_prefix("map_Kd -o 0.5 0.25 0 -s 2 4 1 -clamp on ")).expect("a map");
    assert!(file.starts_with("bricks-") && fs::read(at(file)).is_ok_and(|bytes| bytes == png([200, 80, 60])), "{file}");
    // Both look the same.
    let third = formats::read_scene(&at("back.obj")).expect("a scene");
    let [before, after] = [&first, &third].map(|scene| formats::looks(scene, Some(folder.path())));
    assert_eq!(after.warnings, [""; 0]);
    let names = |scene: &Scene| scene.materials().expect("materials").names;
    let place = |scene: &Scene, name: &str| {
        let full = &scene.mesh.materials.as_ref().expect("materials").names;
        full.iter().position(|full| full.lines().next().unwrap_or_default() == name).expect("a name")
    };
    for name in names(&first) {
        let [one, two] =
            [(&first, &before), (&third, &after)].map(|(scene, looks)| &looks.of_material[place(scene, &name)]);
        let near = one.color.iter().zip(two.color).all(|(x, y)| (x - y).abs() < 1e-5);
        assert!(near && one.opacity == two.opacity, "'{name}': {one:?} {two:?}");
        if let (Some(one), Some(two)) = (&one.texture, &two.texture) {
            assert_eq!((one.transform, one.wrap), (two.transform, two.wrap), "'{name}'");
            assert_eq!(one.color(DVec2::splat(0.5), [DVec2::ZERO; 2]), two.color(DVec2::splat(0.5), [DVec2::ZERO; 2]));
        }
    }
    // To a stream there is nothing to lie beside: names alone.
    let mut bytes = Vec::new();
    let options = WriteOptions::default();
    formats::write_scene_to(&second.mesh, &second.document, formats::Format::Obj, &options, &mut bytes)
        .expect("written");
    let text = String::from_utf8(bytes).expect("text");
    assert!(!text.contains("mtllib") && text.contains("usemtl glass"), "{text}");
}

#[test]
fn pictures_that_go_on_in_mirror_images_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    write_inputs(folder.path());
    let at = |name: &str| folder.path().join(name);
    converted(&formats::read_scene(&at("things.obj")).expect("a scene"), &at("things.gltf"));
    let text = fs::read_to_string(at("things.gltf")).expect("text");
    let told = |wrap: &str| {
        fs::write(at("things.gltf"), text.replacen("33071", wrap, 1)).expect("written");
        converted(&formats::read_scene(&at("things.gltf")).expect("a scene"), &at("back.obj")).join("; ")
    };
    assert!(text.matches("33071").count() == 2 && !told("10497").contains("mirror"));
    let mirrored = told("33648");
    assert!(mirrored.contains("goes on in mirror images, which a library cannot say"), "{mirrored}");
}

/// What libraries are made of, and what breaks them.
const ALPHABET: &[u8] = b"newmtl KdTrNs map_-osc\n\n 0.1e9-\xff/\\.";

#[test]
fn what_is_missing_or_broken_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("things.obj"), OBJ).expect("written");
    let warnings = || {
        let scene = formats::read_scene(&at("things.obj")).expect("a scene");
        let warnings = converted(&scene, &at("out.glb"));
        assert_eq!(formats::read(&at("out.glb")).expect("a mesh").faces.len(), 6);
        warnings
    };
    let told = warnings();
    assert!(told.len() == 1 && told[0].starts_with("the materials of 'things.mtl' are missing"), "{told:?}");
    fs::write(at("things.mtl"), "newmtl bricks\nKd one two\nd nan\nmap_Kd bricks.png\nmap_Kd\nnewmtl glass\nKd\n")
        .expect("written");
    let told = warnings();
    let part = "the materials of 'things.mtl' are read in part: line 2 says 'Kd one two', expected numbers";
    assert!(told.contains(&part.to_string()), "{told:?}");
    // Any bytes do no harm.
    let mut state = 7_u32;
    for _ in 0..300 {
        let bytes: Vec<u8> = (0..200)
            .map(|_| {
                state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                ALPHABET[(state >> 16) as usize % ALPHABET.len()]
            })
            .collect();
        fs::write(at("things.mtl"), [b"newmtl bricks\n", &bytes[..]].concat()).expect("written");
        warnings();
    }
}

/// What a glTF carries that an OBJ or an STL cannot is told by its name.
#[test]
fn skins_and_targets_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    write_inputs(folder.path());
    let mut mesh = formats::read(&folder.path().join("things.obj")).expect("a mesh");
    let channel = |name: &str, kind: ChannelKind, width: usize| {
        let values = vec![0.0; width * mesh.positions.len()];
        Channel { name: name.into(), kind, width, values }
    };
    mesh.channels = vec![
        channel("JOINTS", ChannelKind::Joints, 8),
        channel("target_0.POSITION", ChannelKind::Displacement, 3),
        channel("target_1.NORMAL", ChannelKind::Linear, 3),
        channel("TANGENT", ChannelKind::Tangent, 4),
    ];
    let losses = |name: &str| {
        let options = WriteOptions::default();
        formats::write_scene(&mesh, &Document::None, &folder.path().join(name), &options).expect("written").join("; ")
    };
    let skinned = "joints of skins, displacements of morph targets";
    assert_eq!(losses("a.obj"), format!("{skinned}, tangents are not written: OBJ has none"));
    assert_eq!(losses("a.stl"), format!("texture coordinates, {skinned}, tangents are not written: STL has none"));
    assert_eq!(losses("a.glb"), format!("{skinned} are not written: the input has no nodes for them"));
    assert_eq!(losses("a.ply"), "");
}

/// Objects of an OBJ are nodes of a glTF by their names, and nodes objects.
#[test]
fn objects_are_nodes() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let square =
        |first: u32| format!("f {} {} {}\nf {} {} {}\n", first, first + 1, first + 2, first, first + 2, first + 3);
    let vertices = |z: u32| format!("v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\n");
    let text = format!(
        "{}{}{}o door left\nusemtl wood\n{}usemtl red\n{}g lamp\no\nusemtl wood\n{}",
        vertices(0),
        vertices(1),
        vertices(2),
        square(1),
        square(5),
        square(9)
    );
    fs::write(at("house.obj"), text).expect("written");
    let write = |from: &str, to: &str| {
        let scene = formats::read_scene(&at(from)).expect("a mesh");
        formats::write_scene(&scene.mesh, &scene.document, &at(to), &WriteOptions::default()).expect("written");
    };
    write("house.obj", "house.gltf");
    let json: Value = serde_json::from_slice(&fs::read(at("house.gltf")).expect("read")).expect("JSON");
    let names =
        |list: &str| json[list].as_array().expect(list).iter().map(|one| one["name"].clone()).collect::<Vec<_>>();
    assert_eq!((names("nodes"), names("meshes")), (vec!["door left".into(), "lamp".into()], names("nodes")));
    assert_eq!(json["meshes"][0]["primitives"].as_array().map(Vec::len), Some(2));
    assert_eq!(json["scenes"][0]["nodes"], json!([0, 1]));
    write("house.gltf", "back.obj");
    let back = fs::read_to_string(at("back.obj")).expect("read");
    let told: Vec<&str> = back.lines().filter(|line| line.starts_with(['o', 'u'])).collect();
    assert_eq!(told, ["o door left", "usemtl wood", "usemtl red", "o lamp", "usemtl wood"], "{back}");
    // Each node that shows a mesh is an object, by its own name or the mesh's.
    let mut json = json;
    let nodes = json["nodes"].as_array_mut().expect("nodes");
    nodes.extend([json!({ "mesh": 0, "name": "door right" }), json!({ "mesh": 1 })]);
    json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    fs::write(at("house.gltf"), json.to_string()).expect("written");
    write("house.gltf", "all.obj");
    let all = fs::read_to_string(at("all.obj")).expect("read");
    let told: Vec<&str> = all.lines().filter(|line| line.starts_with(['o', 'u'])).collect();
    // A material holds until the next.
    let right = ["o door right", "usemtl red", "o lamp.2", "usemtl wood"];
    assert_eq!(told, [&["o door left", "usemtl wood", "usemtl red", "o lamp", "usemtl wood"][..], &right].concat());
    assert_eq!(formats::read(&at("all.obj")).expect("a mesh").faces.len(), 12);
    assert_eq!(formats::read(&at("back.obj")).expect("a mesh").faces.len(), 6);
}

#[test]
fn lines_of_an_obj_that_are_no_faces_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    // The second is not plain: an index from the end, past a line that goes on.
    for face in ["f 1 2 3", "f 1 2 \\\n-1"] {
        let input = folder.path().join("a.obj");
        fs::write(&input, format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{face}\nl 1 2\np 1\nl 2 3\n")).expect("written");
        let scene = formats::read_scene(&input).expect("a mesh");
        for name in ["b.obj", "b.ply"] {
            let output = folder.path().join(name);
            let told =
                formats::write_scene(&scene.mesh, &scene.document, &output, &WriteOptions::default()).expect("written");
            assert_eq!(told, ["not read of the OBJ file, and lost: lines, points"], "{face}");
        }
    }
}

/// Materials of one name keep it with their numbers, which make no name of another.
#[test]
fn materials_of_one_name_are_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    write_inputs(folder.path());
    let at = |name: &str| folder.path().join(name);
    let scene = formats::read_scene(&at("things.obj")).expect("a scene");
    converted(&scene, &at("things.gltf"));
    let (mut json, _) = parts_of(&at("things.gltf"));
    for (number, name) in ["paint", "paint", "paint[0]", ""].iter().enumerate() {
        json["materials"][number]["name"] = (*name).into();
    }
    fs::write(at("things.gltf"), json.to_string()).expect("written");
    let scene = formats::read_scene(&at("things.gltf")).expect("a scene");
    let names = scene.materials().expect("materials").names;
    assert_eq!(names, ["paint[0]_", "paint[1]", "paint[0]", "materials[3]", ""]);
}
