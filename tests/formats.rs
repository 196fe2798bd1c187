//! Round trips, the corpus of good and bad files, prefixes and mutations, real models, failing writes.

use std::env;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use coarsen::formats::{self, Compression, Format, WriteOptions};
use coarsen::math::{DVec3, Vec2, Vec3};
use coarsen::mesh::ChannelKind;
use coarsen::{Error, Mesh};

const SUFFIXES: [&str; 3] = ["", ".gz", ".zst"];

/// A bumpy sheet of `2·n²` faces whose coordinates are f32 numbers with long decimals.
fn sheet(n: u32) -> Mesh {
    let place = |i: u32| {
        let (x, y) = ((i % (n + 1)) as f32 * 0.1, (i / (n + 1)) as f32 / 3.0);
        Vec3::new(x, y, (7.0 * x).sin() * y.cos())
    };
    let faces = (0..n * n).flat_map(|cell| {
        let a = cell / n * (n + 1) + cell % n;
        [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
    });
    Mesh::new((0..(n + 1) * (n + 1)).map(|i| place(i).as_dvec3()).collect(), faces.collect())
}

fn with_attributes(mut mesh: Mesh) -> Mesh {
    let unit = |p: &DVec3| (p.as_vec3() + Vec3::new(0.3, 0.2, 1.0)).normalize();
    mesh.normals = Some(mesh.positions.iter().map(unit).collect());
    let shade = |i: usize| (i % 97) as f32 / 96.0;
    mesh.colors = Some((0..mesh.positions.len()).map(|i| [shade(i), shade(3 * i), 1.0, shade(5 * i)]).collect());
    mesh.face_colors = Some((0..mesh.faces.len()).map(|f| [shade(7 * f), 0.0, shade(f), shade(2 * f)]).collect());
    // Every seventh face is a chart of its own, every eleventh has none.
    let place = |f: usize, v: u32| match f {
        f if f % 11 == 0 => Vec2::ZERO,
        // Halves and eighths: glTF has v the other way up, which rounds others.
        f => Vec2::new(v as f32 / 7.0, -0.125 * (v % 10) as f32) + if f % 7 == 0 { Vec2::X } else { Vec2::ZERO },
    };
    mesh.texcoords = Some(mesh.faces.iter().enumerate().map(|(f, face)| face.map(|v| place(f, v))).collect());
    mesh
}

/// The corner positions of every face: what survives a format without shared vertices.
fn corners(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    mesh.faces.iter().map(|face| face.map(|vertex| mesh.positions[vertex as usize])).collect()
}

/// Rows of vertices, one a corner.
fn at_corners<'a, T: Copy>(mesh: &'a Mesh, rows: &'a Option<Vec<T>>) -> impl Iterator<Item = T> + 'a {
    rows.iter().flat_map(|rows| mesh.faces.as_flattened().iter().map(|&vertex| rows[vertex as usize]))
}

fn assert_same(read: &Mesh, written: &Mesh, format: Format, name: &str) {
    let traits = format.traits();
    read.check().unwrap();
    assert_eq!(corners(read), corners(written), "{name}: corners");
    // Its texture coordinates are the vertices' own.
    let repeats_vertices = matches!(format, Format::Gltf | Format::Glb);
    if !repeats_vertices {
        assert_eq!(read.positions.len(), written.positions.len(), "{name}: vertices");
    }
    if format != Format::Stl && !repeats_vertices {
        assert_eq!(read.positions, written.positions, "{name}: positions");
        assert_eq!(read.faces, written.faces, "{name}: faces");
    }
    let normals = written.normals.as_ref().filter(|_| traits.normals);
    assert_eq!(read.normals.is_some(), normals.is_some(), "{name}: normals");
    for (corner, (a, b)) in at_corners(read, &read.normals).zip(at_corners(written, &written.normals)).enumerate() {
        assert!(normals.is_none() || a.distance(b) < 1e-6, "{name}: normal of corner {corner} is {a}, expected {b}");
    }
    let colors = written.colors.as_ref().filter(|_| !traits.colors.is_empty());
    assert_eq!(read.colors.is_some(), colors.is_some(), "{name}: colors");
    for (corner, (a, b)) in at_corners(read, &read.colors).zip(at_corners(written, &written.colors)).enumerate() {
        let expected = if traits.colors == "rgb" { [b[0], b[1], b[2], 1.0] } else { b };
        let far = a.iter().zip(expected).any(|(a, b)| (a - b).abs() > 1.0 / 255.0);
        assert!(colors.is_none() || !far, "{name}: color of corner {corner} is {a:?}, expected {expected:?}");
    }
    let face_colors = written.face_colors.as_ref().filter(|_| !traits.face_colors.is_empty());
    assert_eq!(read.face_colors.is_some(), face_colors.is_some(), "{name}: face colors");
    for (face, (a, b)) in read.face_colors.iter().flatten().zip(face_colors.into_iter().flatten()).enumerate() {
        let far = a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1.0 / 255.0);
        assert!(!far, "{name}: color of face {face} is {a:?}, expected {b:?}");
    }
    assert_eq!(read.texcoords.as_ref(), written.texcoords.as_ref().filter(|_| traits.texcoords), "{name}: texture");
}

#[test]
fn every_format_survives_a_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let mut cases = 0;
    for (kind, mesh) in [("plain", sheet(9)), ("rich", with_attributes(sheet(9)))] {
        for (format, ascii, suffix) in every_output() {
            let name = format!("{kind}-{ascii}.{}{suffix}", format.traits().extension);
            let path = folder.path().join(&name);
            formats::write(&mesh, &path, &WriteOptions { ascii }).unwrap();
            assert_same(&formats::read(&path).unwrap(), &mesh, format, &name);
            cases += 1;
        }
    }
    assert_eq!(cases, 2 * 6 * 2 * 3);
    // A glTF has its bytes beside it, where it is not compressed.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), cases + 2 * 2, "temporary files are left behind");
}

#[test]
fn whole_numbers_of_ply_are_labels_and_stay_whole() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar class\nproperty int id\nproperty float heat\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n";
    let text = format!("{header}0 0 0 200 -7 1\n1 0 0 3 16777216 2\n0 1 0 0 12 0.5\n3 0 1 2\n");
    let mesh = formats::read_bytes(text.as_bytes(), Format::Ply).expect("a good file");
    let kinds: Vec<_> = mesh.channels.iter().map(|channel| channel.kind).collect();
    assert_eq!(kinds, [ChannelKind::Label, ChannelKind::Label, ChannelKind::Linear]);
    for ascii in [false, true] {
        let mut bytes = Vec::new();
        formats::write_to(&mesh, Format::Ply, &WriteOptions { ascii }, &mut bytes).expect("it is written");
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("property int class\nproperty int id\nproperty float heat\n"), "{text}");
        assert_eq!(formats::read_bytes(&bytes, Format::Ply).expect("a good file"), mesh);
    }
    // One that is none any more, or larger than an `int`, is a number like others.
    for value in [0.5, 3e9] {
        let mut mesh = mesh.clone();
        mesh.channels[0].values[1] = value;
        let mut bytes = Vec::new();
        formats::write_to(&mesh, Format::Ply, &WriteOptions { ascii: true }, &mut bytes).expect("it is written");
        assert!(String::from_utf8_lossy(&bytes).contains("property float class\nproperty int id\n"));
        assert_eq!(formats::read_bytes(&bytes, Format::Ply).expect("a good file").channels[0].values[1], value);
    }
}

fn every_output() -> impl Iterator<Item = (Format, bool, &'static str)> {
    let forms = Format::ALL.into_iter().flat_map(|format| [(format, false), (format, true)]);
    forms.flat_map(|(format, ascii)| SUFFIXES.map(|suffix| (format, ascii, suffix)))
}

/// Map coordinates: rounding them to f32 would move vertices by a quarter of a unit.
#[test]
fn positions_far_from_the_origin_keep_their_bits() {
    let mut mesh = sheet(4);
    for position in &mut mesh.positions {
        *position += DVec3::new(500_000.123_456_789, 4_649_776.25, 0.1);
    }
    for (format, ascii) in
        [(Format::Obj, true), (Format::Off, true), (Format::Stl, true), (Format::Ply, true), (Format::Ply, false)]
    {
        let mut bytes = Vec::new();
        formats::write_to(&mesh, format, &WriteOptions { ascii }, &mut bytes).unwrap();
        let name = format!("{} ascii={ascii}", format.name());
        assert_same(&formats::read_bytes(&bytes, format).unwrap(), &mesh, format, &name);
    }
}

#[test]
fn ply_is_single_precision_where_that_loses_nothing_visible() {
    let header = |mesh: &Mesh| {
        let mut bytes = Vec::new();
        formats::write_to(mesh, Format::Ply, &WriteOptions::default(), &mut bytes).unwrap();
        String::from_utf8_lossy(&bytes[..200]).into_owned()
    };
    let mut mesh = sheet(4);
    mesh.positions[0].x += 1e-12;
    assert!(header(&mesh).contains("property float x\n"));
    mesh.positions.iter_mut().for_each(|position| position.x += 1e5 + 1e-3);
    assert!(header(&mesh).contains("property double x\n"));
    mesh.positions[0].x = 1e300;
    assert!(header(&mesh).contains("property double x\n"));
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() {
    let mesh = with_attributes(sheet(150));
    for (format, ascii, _) in every_output().filter(|(.., suffix)| suffix.is_empty()) {
        let bytes = |threads| {
            let mut bytes = Vec::new();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| formats::write_to(&mesh, format, &WriteOptions { ascii }, &mut bytes)).unwrap();
            let read = pool.install(|| formats::read_bytes(&bytes, format)).unwrap();
            (bytes, read)
        };
        assert!(bytes(1) == bytes(3), "{} ascii={ascii}", format.name());
    }
}

// The corpus.

struct Case {
    name: String,
    format: Format,
    bytes: Vec<u8>,
    expect: String,
}

/// The files of a corpus folder in the order of their names, with what their `.expect` files say.
fn corpus(kind: &str) -> Vec<Case> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(kind);
    let mut paths: Vec<PathBuf> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension != "expect"));
    paths.sort();
    let case = |path: PathBuf| Case {
        name: path.file_name().unwrap().to_string_lossy().into_owned(),
        format: Format::from_path(&path).unwrap().0,
        bytes: fs::read(&path).unwrap(),
        expect: fs::read_to_string(path.with_extension("expect"))
            .unwrap_or_else(|error| panic!("{} has no .expect file: {error}", path.display())),
    };
    paths.into_iter().map(case).collect()
}

#[test]
fn good_files_are_read() {
    let cases = corpus("good");
    assert_eq!(cases.len(), 35);
    for case in cases {
        let mesh = formats::read_bytes(&case.bytes, case.format).unwrap_or_else(|e| panic!("{}: {e}", case.name));
        mesh.check().unwrap();
        let area: f64 = corners(&mesh).iter().map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum();
        let line = |key: &str| case.expect.lines().find_map(|line| line.strip_prefix(key)?.trim().parse().ok());
        let expected = |key: &str| -> f64 { line(key).unwrap_or_else(|| panic!("{}: no {key}", case.name)) };
        assert_eq!(mesh.positions.len() as f64, expected("vertices"), "{}: vertices", case.name);
        assert_eq!(mesh.faces.len() as f64, expected("faces"), "{}: faces", case.name);
        assert!((area - expected("area")).abs() < 1e-9, "{}: the area is {area}, {}", case.name, case.expect);
        let covered = |[a, b, c]: &[Vec2; 3]| f64::from((b - a).perp_dot(c - a).abs()) / 2.0;
        let texture: Option<f64> = mesh.texcoords.as_ref().map(|rows| rows.iter().map(covered).sum());
        assert_eq!(texture, line("texture"), "{}: the area in the texture", case.name);
        // Of red, green, blue and alpha.
        let light = |colors: &Vec<[f32; 4]>| (0..4).map(|i| colors.iter().map(|color| color[i]).sum()).collect();
        let listed = case.expect.lines().find_map(|line| line.strip_prefix("face colors"));
        let listed: Option<Vec<f32>> = listed.map(|sums| sums.split_whitespace().flat_map(str::parse).collect());
        assert_eq!(mesh.face_colors.as_ref().map(light), listed, "{}: the sums of face colors", case.name);
    }
}

#[test]
fn bad_files_are_refused_with_the_place() {
    let cases = corpus("bad");
    assert_eq!(cases.len(), 56);
    for case in cases {
        let start = Instant::now();
        let error = formats::read_bytes(&case.bytes, case.format)
            .err()
            .unwrap_or_else(|| panic!("{} was read, expected: {}", case.name, case.expect));
        assert!(matches!(error, Error::Format { .. }), "{}: {error:?}", case.name);
        assert!(
            error.to_string().starts_with(case.expect.trim_end()),
            "{}\n found    {error}\n expected {}",
            case.name,
            case.expect
        );
        assert!(start.elapsed() < Duration::from_millis(100), "{} took {:?}", case.name, start.elapsed());
    }
}

#[test]
fn every_prefix_gives_a_mesh_or_an_error() {
    for case in corpus("good").iter().chain(&corpus("bad")) {
        for end in 0..=case.bytes.len() {
            if let Ok(mesh) = formats::read_bytes(&case.bytes[..end], case.format) {
                mesh.check().unwrap_or_else(|error| panic!("{} cut at {end}: {error}", case.name));
            }
        }
    }
}

#[test]
fn every_prefix_of_a_compressed_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (suffix, compression) in [(".gz", Compression::Gzip), (".zst", Compression::Zstd)] {
        let path = folder.path().join(format!("a.off{suffix}"));
        formats::write(&sheet(3), &path, &WriteOptions::default()).unwrap();
        let bytes = fs::read(&path).unwrap();
        for end in 0..bytes.len() {
            let error = formats::read_from(&mut &bytes[..end], Format::Off, compression).unwrap_err();
            assert!(matches!(error, Error::Format { .. }), "{suffix} cut at {end}: {error:?}");
        }
        assert!(formats::read_from(&mut bytes.as_slice(), Format::Off, compression).is_ok());
        fs::write(&path, "OFF not compressed").unwrap();
        let message = formats::read(&path).unwrap_err().to_string();
        assert!(message.contains("found OFF data, expected"), "{message}");
    }
}

/// SplitMix64: the mutations are the same on every run.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % bound.max(1) as u64) as usize
    }
}

/// Runs a few thousand mutations; `COARSEN_FUZZ_SECONDS` runs them for that long.
#[test]
fn mutated_files_give_a_mesh_or_an_error() {
    let seconds = env::var("COARSEN_FUZZ_SECONDS").ok().and_then(|seconds| seconds.parse().ok()).unwrap_or(0);
    let mut cases = corpus("good");
    cases.extend(corpus("bad"));
    let start = Instant::now();
    let mut seed = 0;
    while seed < 6000 || start.elapsed() < Duration::from_secs(seconds) {
        let mut random = Random(seed);
        let case = &cases[random.below(cases.len())];
        let bytes = mutate(&case.bytes, &mut random);
        let result = std::panic::catch_unwind(|| formats::read_bytes(&bytes, case.format));
        match result {
            Ok(Ok(mesh)) => mesh.check().unwrap_or_else(|error| panic!("{} with seed {seed}: {error}", case.name)),
            Ok(Err(_)) => {}
            Err(_) => panic!("{} with seed {seed} panicked on {:?}", case.name, String::from_utf8_lossy(&bytes)),
        }
        seed += 1;
    }
}

fn mutate(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    const WORDS: [&str; 14] = [
        "nan",
        "-inf",
        "1e999",
        "-1",
        "0",
        "4294967295",
        "9223372036854775807",
        "//",
        "\n",
        " ",
        "f ",
        "v ",
        "\\",
        "3",
    ];
    let mut bytes = bytes.to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        match random.below(5) {
            0 if at < bytes.len() => bytes[at] = random.below(256) as u8,
            1 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            2 => bytes.truncate(at),
            3 => {
                let end = bytes.len().min(at + random.below(12));
                let piece = bytes[at..end].to_vec();
                let to = random.below(bytes.len() + 1);
                bytes.splice(to..to, piece);
            }
            _ => {
                let end = bytes.len().min(at + random.below(3));
                bytes.splice(at..end, WORDS[random.below(WORDS.len())].bytes());
            }
        }
    }
    bytes
}

// Real models.

/// Reads every model whose format this crate has and compares the counts with the table beside them.
#[test]
#[expect(clippy::print_stdout, reason = "a skip must be seen, and the times are of interest")]
fn real_models_have_the_listed_counts() {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/models");
    let folder = PathBuf::from(env::var("COARSEN_MODELS").unwrap_or_else(|_| beside.into()));
    let Ok(facts) = fs::read_to_string(folder.join("facts.tsv")) else {
        println!("skipped: no models in {}", folder.display());
        return;
    };
    let mut read = 0;
    for line in facts.lines().filter(|line| line.starts_with("stored\t")) {
        let cells: Vec<&str> = line.split('\t').collect();
        let path = cells[1];
        // The file that lies in its header has no counts.
        let (Ok(vertices), Ok(faces)) = (cells[4].parse::<usize>(), cells[5].parse::<usize>()) else { continue };
        let Ok((format, _)) = Format::from_path(Path::new(path)) else { continue };
        if path.ends_with("inf_nan.obj") {
            let message = formats::read(&folder.join(path)).unwrap_err().to_string();
            assert!(message.starts_with("OBJ line 1: found a vertex at"), "{message}");
            continue;
        }
        let start = Instant::now();
        let mesh = formats::read(&folder.join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
        println!("{path}: {} faces in {:.0?}", mesh.faces.len(), start.elapsed());
        mesh.check().unwrap();
        assert_eq!(mesh.faces.len(), faces, "{path}: faces");
        match format {
            Format::Stl => {}
            // A vertex with several normals is repeated.
            Format::Obj => assert!(mesh.positions.len() >= vertices, "{path}: vertices"),
            _ => assert_eq!(mesh.positions.len(), vertices, "{path}: vertices"),
        }
        read += 1;
    }
    assert!(read >= 40, "only {read} models were read");
    let start = Instant::now();
    let message = formats::read(&folder.join("dirty/tiny/lying_header.off")).unwrap_err().to_string();
    assert!(message.starts_with("OFF line 2: the header promises 353535235358 vertices"), "{message}");
    assert!(start.elapsed() < Duration::from_millis(100), "{:?}", start.elapsed());
}

// What the system refuses.

#[test]
fn what_cannot_be_opened_is_a_read_error_with_the_path() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("directory.ply");
    fs::create_dir(&directory).unwrap();
    for path in [directory, folder.path().join("missing.obj"), folder.path().join("missing/a.stl.gz")] {
        let error = formats::read(&path).unwrap_err();
        assert!(matches!(&error, Error::Read { path: named, .. } if *named == path), "{error:?}");
    }
    assert!(matches!(formats::read(Path::new("a.xyz")), Err(Error::Unsupported(_))));
}

#[test]
fn a_failed_write_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.stl");
    fs::write(&path, "precious").unwrap();
    let mut mesh = sheet(2);
    mesh.positions[0].x = 1e300;
    let error = formats::write(&mesh, &path, &WriteOptions::default()).unwrap_err();
    assert!(matches!(&error, Error::Write { path: named, .. } if *named == path), "{error:?}");
    assert!(error.to_string().contains("too large for the f32 of binary STL"), "{error}");
    mesh.positions[0].x = f64::NAN;
    assert!(matches!(formats::write(&mesh, &path, &WriteOptions::default()), Err(Error::Mesh(_))));
    assert_eq!(fs::read_to_string(&path).unwrap(), "precious");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "a temporary file is left behind");

    let error = formats::write(&sheet(2), &folder.path().join("none/a.ply"), &WriteOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Write { .. }), "{error:?}");
    let directory = folder.path().join("directory.ply");
    fs::create_dir(&directory).unwrap();
    let error = formats::write(&sheet(2), &directory, &WriteOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Write { .. }), "{error:?}");
}

#[cfg(unix)]
#[test]
fn links_and_devices_stay_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("a.ply"), folder.path().join("link.ply"));
    formats::write(&sheet(2), &file, &WriteOptions::default()).unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    formats::write(&sheet(3), &link, &WriteOptions::default()).unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(formats::read(&file).unwrap().faces.len(), 18);

    let full = folder.path().join("full.ply");
    std::os::unix::fs::symlink("/dev/full", &full).unwrap();
    let error = formats::write(&sheet(2), &full, &WriteOptions::default()).unwrap_err();
    assert!(matches!(&error, Error::Write { source, .. } if source.kind() == io::ErrorKind::StorageFull), "{error:?}");
    assert!(!fs::metadata("/dev/full").unwrap().is_file());
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_a_write_error() {
    for format in Format::ALL {
        let mut full = File::options().write(true).open("/dev/full").unwrap();
        let error = formats::write_to(&sheet(2), format, &WriteOptions::default(), &mut full).unwrap_err();
        assert!(
            matches!(&error, Error::Write { source, .. } if source.kind() == io::ErrorKind::StorageFull),
            "{error:?}"
        );
    }
}

/// A stream that fails after some bytes must not pass as its end.
#[test]
fn a_broken_stream_is_an_error_not_an_end() {
    struct Broken(usize);
    impl Read for Broken {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            let text = &b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"[self.0..];
            if text.is_empty() {
                return Err(io::ErrorKind::ConnectionReset.into());
            }
            self.0 += 1;
            (&text[..1]).read(out)
        }
    }
    impl Write for Broken {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Err(io::ErrorKind::BrokenPipe.into())
        }
    }
    let error = formats::read_from(&mut Broken(0), Format::Off, Compression::None).unwrap_err();
    assert_eq!(error.to_string().split(':').next(), Some("cannot read '-'"));
    let error = formats::write_to(&sheet(1), Format::Off, &WriteOptions::default(), &mut Broken(0)).unwrap_err();
    assert!(matches!(&error, Error::Write { source, .. } if source.kind() == io::ErrorKind::BrokenPipe), "{error:?}");
}
