//! Files and what lies beside them.

use std::fs;

use base64::Engine as _;
use coarsen::Error;
use coarsen::formats::{self, Document, Scene, WriteOptions};
use serde_json::{Value, json};

use crate::scene::*;

fn json_of(path: &std::path::Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a file")).expect("JSON")
}

/// The square as a glTF whose buffer has this URI.
fn text(uri: &str) -> String {
    let mut builder = square();
    builder.json["buffers"] = json!([{ "byteLength": builder.binary.len(), "uri": uri }]);
    builder.json.to_string()
}

#[test]
fn buffers_lie_beside_and_are_written_beside() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("in.gltf"), text("the%20bytes.bin")).expect("written");
    let missing = formats::read(&at("in.gltf")).expect_err("no bytes");
    assert!(matches!(&missing, Error::Read { path, .. } if path.ends_with("the bytes.bin")), "{missing}");
    fs::write(at("the bytes.bin"), &square().binary).expect("written");
    let Scene { mesh, document, .. } = formats::read_scene(&at("in.gltf")).expect("a scene");
    assert_eq!(mesh.faces.len(), 2);
    formats::write_scene(&mesh, &document, &at("the output.gltf"), &WriteOptions::default()).expect("written");
    assert_eq!(json_of(&at("the output.gltf"))["buffers"][0]["uri"], "the%20output.bin");
    assert_eq!(formats::read(&at("the output.gltf")).expect("a mesh"), mesh);
    // A GLB takes the bytes in.
    formats::write_scene(&mesh, &document, &at("all.glb"), &WriteOptions::default()).expect("written");
    assert_eq!(
        formats::read_bytes(&fs::read(at("all.glb")).expect("bytes"), formats::Format::Glb).expect("a mesh"),
        mesh
    );
    // So does what is compressed, where a second file would not be.
    formats::write_scene(&mesh, &document, &at("small.gltf.gz"), &WriteOptions::default()).expect("written");
    assert_eq!(formats::read(&at("small.gltf.gz")).expect("a mesh"), mesh);
    assert!(!at("small.bin").exists() && !at("small.gltf.bin").exists());
}

#[test]
fn bytes_of_the_input_are_not_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("in.gltf"), text("shared.bin")).expect("written");
    fs::write(at("shared.bin"), &square().binary).expect("written");
    let Scene { mesh, document, .. } = formats::read_scene(&at("in.gltf")).expect("a scene");
    let write = |name: &str| formats::write_scene(&mesh, &document, &at(name), &WriteOptions::default());
    let refused = write("shared.gltf").expect_err("the input's buffer");
    assert!(matches!(&refused, Error::Parameter(text) if text.contains("shared.bin'")), "{refused}");
    assert!(!at("shared.gltf").exists());
    assert_eq!(fs::read(at("shared.bin")).expect("bytes"), square().binary);
    // These write no such file.
    for name in ["shared.glb", "shared.gltf.gz", "other.gltf"] {
        write(name).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
    assert_eq!(fs::read(at("shared.bin")).expect("bytes"), square().binary);
}

#[test]
fn data_uris_stay_data_uris() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let encoded = base64::engine::general_purpose::STANDARD.encode(&square().binary);
    for (name, uri) in [
        ("octets", format!("data:application/octet-stream;base64,{encoded}")),
        ("capitals", format!("DATA:application/octet-stream;BASE64,{encoded}")),
        ("buffer", format!("data:application/gltf-buffer;base64,{}", encoded.trim_end_matches('='))),
    ] {
        fs::write(at("in.gltf"), text(&uri)).expect("written");
        let Scene { mesh, document, .. } =
            formats::read_scene(&at("in.gltf")).unwrap_or_else(|e| panic!("{name}: {e}"));
        formats::write_scene(&mesh, &document, &at("out.gltf"), &WriteOptions::default()).expect("written");
        assert!(!at("out.bin").exists());
        assert_eq!(formats::read(&at("out.gltf")).expect("a mesh"), mesh);
    }
}

#[test]
fn uris_lead_nowhere_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("in.gltf");
    for (uri, part) in [
        ("/etc/passwd", "expected a relative one"),
        ("https://example.com/a.bin", "expected a relative one"),
        ("", "expected a relative one"),
        ("%00", "expected a relative one"),
        ("data:text/plain,hello", "not base64"),
        ("data:application/octet-stream;base64,?", "does not decode"),
        ("data:application/octet-stream;base64,AAAA", "promises 60 bytes, there are 3"),
    ] {
        fs::write(&path, text(uri)).expect("written");
        let error = formats::read(&path).expect_err(uri).to_string();
        assert!(error.starts_with("glTF file: buffers[0]: ") && error.contains(part), "{uri}: {error}");
    }
    fs::write(&path, text("a.bin")).expect("written");
    let stream = formats::read_from(
        &mut fs::File::open(&path).expect("a file"),
        formats::Format::Gltf,
        formats::Compression::None,
    );
    assert!(matches!(stream, Err(Error::Unsupported(message)) if message.contains("give a path")));
}

#[test]
fn pictures_left_behind_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("out")).expect("a folder");
    let mut builder = square();
    builder.json["images"] = json!([{ "uri": "wood.png" }]);
    fs::write(folder.path().join("in.glb"), builder.glb()).expect("written");
    let Scene { mesh, document, .. } = formats::read_scene(&folder.path().join("in.glb")).expect("a scene");
    let warnings = |name: &str, document: &Document| {
        formats::write_scene(&mesh, document, &folder.path().join(name), &WriteOptions::default()).expect("written")
    };
    assert!(warnings("out.glb", &document).is_empty());
    assert!(warnings("out/out.glb", &document)[0].contains("pictures"));
    assert_eq!(warnings("out.ply", &document), ["textures are not written: PLY has none"]);
    builder.json["meshes"][0]["primitives"]
        .as_array_mut()
        .expect("primitives")
        .push(json!({ "mode": 0, "attributes": {} }));
    let with_points = builder.scene().document;
    let told = ["textures are not written: PLY has none", "points and lines of the glTF are not written"];
    assert_eq!(warnings("out.ply", &with_points), told);
    assert!(warnings("out.ply", &Document::None).is_empty());
}
