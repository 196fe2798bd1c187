//! What OBJ and PLY files say beside their faces, and what the vertices carry: materials, groups, normals, properties.

use std::fs;
use std::path::Path;

use coarsen::Mesh;
use coarsen::formats::{self, Document, Format, Scene, WriteOptions};
use coarsen::math::{DVec3, Vec3};
use coarsen::mesh::{Channel, ChannelKind, Materials};

/// Two squares that meet in a crease, of two materials and three groups.
const ROOF: &str = "mtllib two words.mtl\nmtllib second.mtl\no roof\nv 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 1 2 0\nv 0 2 0\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvn 0 -1 1\nvn 0 1 1\ng left\nusemtl tiles\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/1/1\n\
    g right\nf 4/1/2 3/2/2 5/3/2\nusemtl moss\nf 4//2 5//2 6//2\n";

fn scene(text: &str, format: Format) -> Scene {
    formats::read_scene_bytes(text.as_bytes(), format, None).expect("a scene")
}

fn text(mesh: &Mesh, document: &Document, format: Format) -> String {
    let mut bytes = Vec::new();
    formats::write_scene_to(mesh, document, format, &WriteOptions { ascii: true }, &mut bytes).expect("written");
    String::from_utf8(bytes).expect("text")
}

#[test]
fn obj_keeps_creases_materials_groups_and_libraries() {
    let Scene { mesh, document, .. } = scene(ROOF, Format::Obj);
    let materials = mesh.materials.as_ref().expect("materials");
    assert_eq!(materials.of_face, [0, 0, 1, 2]);
    assert_eq!(materials.names, ["tiles\no roof\ng left", "tiles\no roof\ng right", "moss\no roof\ng right"]);
    // The ridge, vertices 2 and 3, is there twice, with the same positions and other normals.
    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3], [6, 7, 4], [6, 4, 5]]);
    let normals = mesh.normals.as_ref().expect("normals");
    assert_eq!([mesh.positions[6], mesh.positions[7]], [DVec3::new(0.0, 1.0, 1.0), DVec3::new(1.0, 1.0, 1.0)]);
    assert!(normals[3].distance(Vec3::new(0.0, -1.0, 1.0).normalize()) < 1e-6 && normals[6].y > 0.0);
    let written = text(&mesh, &document, Format::Obj);
    let lines = |word: &str| written.lines().filter(|line| line.split(' ').next() == Some(word)).count();
    assert_eq!(["v", "vt", "vn", "f", "mtllib"].map(lines), [6, 3, 2, 4, 2], "{written}");
    assert!(written.contains("mtllib two words.mtl\nmtllib second.mtl\n"), "{written}");
    let statements: Vec<&str> = written.lines().filter(|line| "ogu".contains(&line[..1])).collect();
    assert_eq!(statements, ["o roof", "g left", "usemtl tiles", "g right", "usemtl moss"]);
    let again = scene(&written, Format::Obj);
    assert_eq!((&again.mesh, &again.warnings[..]), (&mesh, &[][..]));
    assert_eq!(text(&again.mesh, &again.document, Format::Obj), written);
}

/// An OBJ names its libraries wherever it goes; in another folder they are not found, unless they are there too.
#[test]
fn libraries_that_are_left_behind_are_told_of() {
    let folder = tempfile::tempdir().expect("a folder");
    let [input, beside] = ["in.obj", "out.obj"].map(|name| folder.path().join(name));
    let elsewhere = folder.path().join("elsewhere").join("out.obj");
    fs::create_dir(folder.path().join("elsewhere")).expect("a folder");
    fs::write(&input, ROOF).expect("written");
    let told_of = |output: &Path| {
        let Scene { mesh, document, .. } = formats::read_scene(&input).expect("a scene");
        let warnings = formats::write_scene(&mesh, &document, output, &WriteOptions::default()).expect("written");
        warnings.iter().filter(|warning| warning.contains("libraries of materials beside the input")).count()
    };
    // Nor are those that the input has not.
    assert_eq!([told_of(&beside), told_of(&elsewhere)], [0, 0]);
    fs::write(folder.path().join("second.mtl"), "newmtl moss\n").expect("written");
    assert_eq!([told_of(&beside), told_of(&elsewhere)], [0, 1]);
    fs::copy(folder.path().join("second.mtl"), elsewhere.with_file_name("second.mtl")).expect("copied");
    assert_eq!(told_of(&elsewhere), 0);
}

#[test]
fn faces_are_sorted_where_materials_change_all_the_time() {
    let mut mesh = coarsen::mesh::shapes::cube(4);
    let of_face = (0..mesh.faces.len() as u32).map(|face| face % 3).collect();
    mesh.materials = Some(Materials { of_face, names: ["a", "b", "c"].map(Into::into).into() });
    let written = text(&mesh, &Document::None, Format::Obj);
    assert_eq!(written.matches("usemtl").count(), 3);
    let again = scene(&written, Format::Obj).mesh;
    let third: Vec<[u32; 3]> = mesh.faces.iter().step_by(3).copied().collect();
    assert_eq!(again.faces[..third.len()], third);
}

/// What was cut apart on purpose stays apart where nothing says otherwise.
#[test]
fn repeated_positions_stay_repeated_without_attributes() {
    let soup = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 0 1 0\nv -1 0 0\nf 1 2 3\nf 4 5 6\n";
    let Scene { mesh, document, .. } = scene(soup, Format::Obj);
    assert_eq!(mesh.materials, None);
    assert_eq!(scene(&text(&mesh, &document, Format::Obj), Format::Obj).mesh, mesh);
}

const SCAN: &str = "ply\nformat ascii 1.0\ncomment TextureFile skin.png\nobj_info num_cols 512\nelement vertex 3\n\
    property float x\nproperty float confidence\nproperty float y\nproperty list uchar int ids\nproperty float z\n\
    property uchar quality\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
    0 0.5 0 2 7 8 0 200\n1 0.25 0 0 0 1\n0 nan 1 1 9 0 0\n3 0 1 2\n";

#[test]
fn ply_keeps_properties_and_comments() {
    let Scene { mesh, document, warnings } = scene(SCAN, Format::Ply);
    assert_eq!(warnings, ["not finite in single precision, read as zero: 'confidence' 1"]);
    let channels: Vec<_> = mesh.channels.iter().map(|channel| (channel.name.as_str(), &channel.values[..])).collect();
    assert_eq!(channels, [("confidence", &[0.5, 0.25, 0.0][..]), ("quality", &[200.0, 1.0, 0.0])]);
    let written = text(&mesh, &document, Format::Ply);
    assert!(written.contains("format ascii 1.0\ncomment TextureFile skin.png\nobj_info num_cols 512\n"), "{written}");
    assert!(written.contains("property float confidence\nproperty int quality\n"), "{written}");
    let again = scene(&written, Format::Ply);
    assert_eq!(again.mesh, mesh);
    let losses = |format| {
        formats::write_scene_to(&mesh, &document, format, &WriteOptions::default(), &mut Vec::new()).expect("written")
    };
    let told = |losses: Vec<String>| {
        losses.iter().any(|loss| loss == "the picture 'skin.png' that the PLY file names is not written")
    };
    assert!(told(losses(Format::Obj)) && told(losses(Format::Glb)) && !told(losses(Format::Ply)));
    // The same from bytes, through a file.
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scan.ply.gz");
    formats::write_scene(&mesh, &document, &path, &WriteOptions::default()).expect("written");
    let Scene { mesh: found, document, .. } = formats::read_scene(&path).expect("a scene");
    assert_eq!(found, mesh);
    assert!(matches!(document, Document::Ply(notes) if notes.comments().len() == 2));
    // Numbers that are no scalars become several properties, and names words.
    let mut wide = mesh.clone();
    wide.channels[0].name = "two words".into();
    wide.channels[1].width = 2;
    wide.channels[1].values = vec![1.0, 2.0, 3.0, 4.0, 5.0, f32::NAN];
    let names = scene(&text(&wide, &Document::None, Format::Ply), Format::Ply).mesh.channels;
    let names: Vec<String> = names.into_iter().map(|channel| channel.name).collect();
    assert_eq!(names, ["two_words", "quality_0", "quality_1"]);
}

#[test]
fn ply_tells_what_it_does_not_read() {
    let text_of = |vertex: &str, face: &str, more: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{vertex}\
            element face 1\nproperty list uchar int vertex_indices\n{face}{more}end_header\n"
        )
    };
    let rich = text_of(
        "property float s\nproperty int u\nproperty int v\nproperty uchar red\nproperty list uchar int near\n",
        "property int texnumber\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
        "element edge 1\nproperty int vertex1\nproperty int vertex2\nelement camera 0\nproperty float fov\n",
    ) + "0 0 0 1 640 480 9 1 2\n1 0 0 2 641 481 8 0\n0 1 0 3 642 482 7 2 0 1\n3 0 1 2 5 255 0 0\n0 1\n";
    let Scene { mesh, document, .. } = scene(&rich, Format::Ply);
    // Names that mean something else with others only are numbers like any.
    let written = text(&mesh, &document, Format::Ply);
    assert!(written.contains("property float s\nproperty int u\nproperty int v\nproperty int red\n"), "{written}");
    assert_eq!(scene(&written, Format::Ply).mesh, mesh);
    let losses = |text: &str, format: Format| {
        let Scene { mesh, document, .. } = scene(text, Format::Ply);
        formats::write_scene_to(&mesh, &document, format, &WriteOptions::default(), &mut Vec::new()).expect("written")
    };
    for format in [Format::Ply, Format::Obj, Format::Glb] {
        let expected = "not read of the PLY file, and lost: 'near' of the element 'vertex', 'texnumber' of the element 'face', \
            the element 'edge'";
        assert!(losses(&rich, format).iter().any(|warning| warning == expected), "{:?}", losses(&rich, format));
    }
    // Whole numbers that would be taken for a color are not written under its names.
    let mut mesh = mesh;
    for name in ["diffuse_red", "diffuse_green", "diffuse_blue"] {
        let values = vec![1.0, 2.0, 3.0];
        mesh.channels.push(Channel { name: name.into(), kind: ChannelKind::Label, width: 1, values });
    }
    let written = text(&mesh, &Document::None, Format::Ply);
    assert!(!written.contains("diffuse") && scene(&written, Format::Ply).mesh.colors.is_none(), "{written}");
    let plain = text_of("", "", "") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(losses(&plain, Format::Ply), [""; 0]);
}

/// Older programs write names in Latin-1: one letter apart they are two, find their library, and get back as they were.
#[test]
fn names_in_latin1_stay_apart() {
    let text = b"mtllib t\xfcr.mtl\no t\xfcr\nusemtl gr\xfcn\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nusemtl gr\xe4n\nf 2 4 3\n";
    let Scene { mesh, document, .. } = formats::read_scene_bytes(text, Format::Obj, None).expect("a scene");
    let materials = mesh.materials.as_ref().expect("materials");
    assert_eq!(materials.names, ["grün\no tür", "grän\no tür"]);
    let mut written = Vec::new();
    formats::write_scene_to(&mesh, &document, Format::Obj, &WriteOptions::default(), &mut written).expect("written");
    for line in [&b"mtllib t\xfcr.mtl\n"[..], b"o t\xfcr\n", b"usemtl gr\xfcn\n", b"usemtl gr\xe4n\n"] {
        assert!(written.windows(line.len()).any(|window| window == line), "{}", written.escape_ascii());
    }
    // A text without any such name is UTF-8, and stays it.
    let utf8 = "usemtl grün\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let Scene { mesh, document, .. } = scene(utf8, Format::Obj);
    assert!(self::text(&mesh, &document, Format::Obj).contains("usemtl grün\n"));
    // Libraries are read alike, whichever of the two they are in.
    let folder = tempfile::tempdir().expect("a folder");
    for library in [&b"newmtl gr\xfcn\nKd 0 1 0\n"[..], "newmtl grün\nKd 0 1 0\n".as_bytes()] {
        fs::write(folder.path().join("tür.mtl"), library).expect("written");
        let Scene { mesh, document, .. } =
            formats::read_scene_bytes(text, Format::Obj, Some(folder.path())).expect("a scene");
        let mut glb = Vec::new();
        formats::write_scene_to(&mesh, &document, Format::Gltf, &WriteOptions::default(), &mut glb).expect("written");
        let json: serde_json::Value = serde_json::from_slice(&glb).expect("JSON");
        let green = json["materials"].as_array().into_iter().flatten().find(|material| material["name"] == "grün");
        let color = &green.expect("the material")["pbrMetallicRoughness"]["baseColorFactor"];
        assert_eq!(*color, serde_json::json!([0.0, 1.0, 0.0, 1.0]));
    }
}

#[test]
fn losses_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("roof.obj"), ROOF).expect("written");
    let Scene { mesh, document, .. } = formats::read_scene(&folder.path().join("roof.obj")).expect("a scene");
    let losses = |name: &str| {
        formats::write_scene(&mesh, &document, &folder.path().join(name), &WriteOptions::default()).expect("written")
    };
    assert!(losses("same.obj").is_empty());
    assert!(losses("other.ply")[0].contains("libraries"));
    assert_eq!(losses("other.stl")[1], "texture coordinates are not written: STL has none");
}

#[test]
fn what_a_format_lacks_is_told() {
    let groups = ROOF.lines().filter(|line| !line.starts_with("mtllib")).collect::<Vec<_>>().join("\n");
    let painted = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n";
    for (text, format, expected) in [
        (&*groups, Format::Ply, "materials and groups are not written: PLY has none"),
        (&*groups, Format::Off, "materials and groups, texture coordinates are not written: OFF has none"),
        (&*groups, Format::Obj, ""),
        (painted, Format::Stl, "colors are not written: STL has none"),
        (painted, Format::Off, ""),
        (painted, Format::Glb, ""),
    ] {
        let Scene { mesh, document, .. } = scene(text, Format::Obj);
        let losses = formats::write_scene_to(&mesh, &document, format, &WriteOptions::default(), &mut Vec::new())
            .expect("written");
        assert_eq!(losses.join("; "), expected, "{format:?}");
    }
}
