//! How materials of files look: base colors of glTF, libraries of OBJ, textures of PLY, and what is missing or broken.

use std::fs;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use coarsen::formats::{self, Format, Looks};
use coarsen::looks::{Look, Opacity, Wrap};
use coarsen::math::DVec2;
use serde_json::{Value, json};

#[path = "support/pictures.rs"]
mod pictures;
use pictures::png;

#[path = "support/models.rs"]
#[expect(dead_code, clippy::print_stdout, reason = "shared by test crates; a skip must be seen")]
mod models;

/// The color of a look's texture, in 255ths.
fn texel(look: &Look) -> Option<[u8; 3]> {
    let [r, g, b, _] = look.texture.as_ref()?.color(DVec2::splat(0.5), [DVec2::ZERO; 2]);
    Some([r, g, b].map(|light| (light.sqrt() * 255.0).round() as u8))
}

fn of_text(text: &str, format: Format, folder: &Path) -> Looks {
    let scene = formats::read_scene_bytes(text.as_bytes(), format, Some(folder)).expect("a scene");
    formats::looks(&scene, Some(folder))
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn obj_takes_colors_and_textures_from_its_libraries() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("written");
    file("red bricks.png", &png([200, 0, 0]));
    file("grass.png", &png([0, 99, 0]));
    file("one.mtl", b"# none\r\nnewmtl walls\r\nKd 0 0 0\r\nmap_Kd -s 2 4 -o 0.5 -clamp on red bricks.png\r\nnewmtl window\nKd 0.5\nd 0.25\n");
    file("two.mtl", b"newmtl lawn\nKd 1 0.5 1\nTr 0\nmap_Kd ..\\models\\grass.png\nnewmtl walls\nKd 1 0 0\n");
    let text = format!(
        "mtllib one.mtl two.mtl\n{TRIANGLE}f 1 2 3\ng front\nusemtl walls\nf 1 2 3\nusemtl window\nf 1 2 3\nusemtl lawn\nf 1 2 3\n"
    );
    let Looks { of_material, warnings } = of_text(&text, Format::Obj, folder.path());
    assert_eq!(warnings, Vec::<String>::new());
    let [none, walls, window, lawn] = of_material.try_into().expect("four looks");
    assert_eq!(none, Look::default());
    // Black under a texture is no color.
    assert_eq!((walls.color, texel(&walls), walls.opacity), ([1.0; 4], Some([200, 0, 0]), Opacity::Opaque));
    let texture = walls.texture.expect("a texture");
    assert_eq!((texture.wrap, texture.transform[0]), ([Wrap::Clamp; 2], DVec2::new(2.0, 0.0)));
    assert_eq!(texture.transform[2], DVec2::new(0.5, 1.0));
    assert_eq!((window.color, window.opacity), ([0.5, 0.5, 0.5, 0.25], Opacity::Blend));
    assert_eq!((lawn.color, texel(&lawn)), ([1.0, 0.5, 1.0, 1.0], Some([0, 99, 0])));
}

#[test]
fn ply_takes_the_texture_that_a_comment_names() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("skin.png"), png([1, 2, 3])).expect("written");
    let text = "ply\nformat ascii 1.0\ncomment TextureFile skin.png\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\n\
        end_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n";
    let looks = of_text(text, Format::Ply, folder.path());
    assert_eq!(looks.of_material.iter().map(texel).collect::<Vec<_>>(), [Some([1, 2, 3])]);
    let without = of_text(&text.replace("TextureFile", "no texture"), Format::Ply, folder.path());
    assert_eq!(without, Looks::default());
}

/// Two triangles, each with its material, and these members.
fn gltf(materials: Value, rest: Value) -> String {
    let positions: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&positions));
    let primitive = |material| json!({ "attributes": { "POSITION": 0 }, "material": material });
    let mut json = json!({
        "asset": { "version": "2.0" },
        "meshes": [{ "primitives": [primitive(0), primitive(1)] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": positions.len() }],
        "buffers": [{ "byteLength": positions.len(), "uri": uri }],
        "materials": materials,
    });
    let members = rest.as_object().expect("members").clone();
    json.as_object_mut().expect("an object").extend(members);
    json.to_string()
}

#[test]
fn gltf_takes_base_colors_with_their_samplers_and_transforms() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("two words.png"), png([7, 8, 9])).expect("written");
    let materials = json!([
        { "pbrMetallicRoughness": { "baseColorFactor": [1, 0, 1, 0.5], "baseColorTexture": { "index": 0 } }, "alphaMode": "BLEND" },
        {
            "alphaMode": "MASK",
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 1, "texCoord": 1, "extensions": {
                "KHR_texture_transform": { "offset": [0.25, 0.5], "scale": [2, 3], "rotation": std::f64::consts::FRAC_PI_2 },
            } } },
        },
    ]);
    let data = format!("data:image/png;base64,{}", STANDARD.encode(png([40, 50, 60])));
    let rest = json!({
        "textures": [{ "source": 0 }, { "source": 1, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071, "wrapT": 33648 }],
        "images": [{ "uri": "two%20words.png" }, { "uri": data }],
    });
    let Looks { of_material, warnings } = of_text(&gltf(materials, rest), Format::Gltf, folder.path());
    assert_eq!(warnings, Vec::<String>::new());
    let [first, second] = of_material.try_into().expect("two looks");
    assert_eq!((first.color, first.opacity, texel(&first)), ([1.0, 0.0, 1.0, 0.5], Opacity::Blend, Some([7, 8, 9])));
    assert_eq!((second.color, second.opacity, texel(&second)), ([1.0; 4], Opacity::Mask(0.5), Some([40, 50, 60])));
    let texture = second.texture.expect("a texture");
    assert_eq!((texture.wrap, texture.channel.as_deref()), ([Wrap::Clamp, Wrap::Mirror], Some("TEXCOORD_1")));
    // A quarter turn: what lay to the right lies above, at a smaller v.
    let [u, v, origin] = texture.transform;
    assert!(u.distance(DVec2::new(0.0, -2.0)) < 1e-6 && v.distance(DVec2::new(3.0, 0.0)) < 1e-6, "{u} {v}");
    assert_eq!(origin, DVec2::new(0.25, 0.5));
}

#[test]
fn what_is_missing_or_broken_leaves_the_color_and_a_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("text.png"), b"no picture").expect("written");
    let textured = |index: usize| json!({ "pbrMetallicRoughness": { "baseColorFactor": [0, 1, 0, 1], "baseColorTexture": { "index": index } } });
    for (images, reason) in [
        (json!([{ "uri": "gone.png" }, {}]), "cannot read"),
        (json!([{ "uri": "text.png" }, {}]), "neither PNG nor JPEG"),
        (json!([{ "uri": "https://nowhere/a.png" }, {}]), "expected a relative one"),
        (json!([{ "uri": "data:image/png;base64,!" }, {}]), "does not decode"),
        (json!([{ "bufferView": 9 }, {}]), "has no bufferViews[9]"),
        (json!([{ "bufferView": 0 }, {}]), "neither PNG nor JPEG"),
        (json!([]), "has no images[0]"),
    ] {
        let text = gltf(json!([textured(0), textured(1)]), json!({ "textures": [{ "source": 0 }], "images": images }));
        let Ok(scene) = formats::read_scene_bytes(text.as_bytes(), Format::Gltf, Some(folder.path())) else { continue };
        let Looks { of_material, warnings } = formats::looks(&scene, Some(folder.path()));
        assert_eq!(of_material[0], Look { color: [0.0, 1.0, 0.0, 1.0], ..Look::default() }, "{reason}");
        assert!(warnings.len() == 2 && warnings[0].contains(reason), "{reason}: {warnings:?}");
        assert!(warnings[1].contains("has no textures[1]"), "{warnings:?}");
    }
    let text = format!("mtllib gone.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n");
    let looks = of_text(&text, Format::Obj, folder.path());
    assert!(looks.of_material.is_empty() && looks.warnings.len() == 1, "{:?}", looks.warnings);
    let scene = formats::read_scene_bytes(text.as_bytes(), Format::Obj, None).expect("a scene");
    assert!(formats::looks(&scene, None).warnings[0].contains("stream"));
}

#[test]
fn real_files_have_their_textures() {
    for (name, materials, textures) in [
        ("attributes/flight_helmet.glb", 6, 6),
        ("attributes/milk_truck.glb", 4, 2),
        ("attributes/spot/spot.obj", 1, 1),
        ("attributes/peterbilt/peterbilt.obj", 0, 0),
    ] {
        let Some(path) = models::model(name) else { return };
        let scene = formats::read_scene(&path).expect("a scene");
        let Looks { of_material, warnings } = formats::looks(&scene, path.parent());
        assert_eq!(warnings, Vec::<String>::new(), "{name}");
        let of_mesh = scene.mesh.materials.as_ref().map_or(0, |materials| materials.names.len());
        assert_eq!(of_material.len(), of_mesh, "{name}");
        assert!(materials == 0 || of_mesh == materials, "{name}: {of_mesh}");
        assert_eq!(of_material.iter().filter(|look| look.texture.is_some()).count(), textures, "{name}");
    }
}
