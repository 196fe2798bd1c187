//! Procedural meshes with realistic detail, the same bytes on every machine.

mod assembly;
mod lathe;
mod march;
mod noise;
mod part;
mod radiosity;
mod room;
mod scene;
mod statue;
mod terrain;

use super::Mesh;
use crate::error::{Error, Result};

/// Every sample: its name, how many faces it has unless told otherwise, and what it is.
pub const SAMPLES: &[(&str, usize, &str)] = &[
    ("statue", 500_000, "marble bust as scanned: smooth forms, curls, folds, fine noise; closed, vertex colors"),
    ("part", 200_000, "machined flange: flats, sharp edges, a fillet, nine holes; closed, genus 9"),
    ("terrain", 500_000, "mountain range: a height field with ridges and valleys; one open border"),
    ("assembly", 500_000, "tray of 2000 bolts, nuts, washers and blocks: many small closed parts"),
    ("room", 100_000, "closed room with boxes, a table and two lamps: light at faces and vertices, shadows with edges"),
    ("office", 100_000, "desks, cabinets, screens and eight lamps in a closed room: light at faces and vertices"),
];

/// The fewest faces a sample can have: fewer do not hold its shape.
pub const LEAST_FACES: usize = 1000;
/// The most faces a sample can have.
pub const MOST_FACES: usize = 200_000_000;

/// The sample `name` with about `faces` faces (within 2 %), or with its own number.
///
/// # Errors
/// [`Error::Parameter`] when there is no such sample, or `faces` is not in 1000 … 200 million.
pub fn sample(name: &str, faces: Option<usize>) -> Result<Mesh> {
    let (name, faces) = known(name, faces)?;
    Ok(match name {
        "statue" => statue::statue(faces),
        "part" => part::part(faces),
        "terrain" => terrain::terrain(faces),
        "room" => room::room(faces),
        "office" => room::office(faces),
        _ => assembly::assembly(faces),
    })
}

/// Gives the mesh of [`sample`] to `piece`, in pieces where it is a large statue: each has vertices of its own, and faces that
/// name these and earlier ones by their number in the whole. The order of vertices and faces is another then.
///
/// # Errors
/// As [`sample`], and the first of `piece`.
pub fn sample_in_pieces(name: &str, faces: Option<usize>, piece: &mut dyn FnMut(&Mesh) -> Result<()>) -> Result<()> {
    if comes_in_pieces(name, faces) {
        return statue::statue_in_slabs(known(name, faces)?.1, piece);
    }
    piece(&sample(name, faces)?)
}

/// Whether [`sample_in_pieces`] makes more than one piece of it.
pub fn comes_in_pieces(name: &str, faces: Option<usize>) -> bool {
    known(name, faces).is_ok_and(|(name, faces)| name == "statue" && faces >= statue::LEAST_FACES_IN_SLABS)
}

/// The sample and its faces, if they are.
fn known(name: &str, faces: Option<usize>) -> Result<(&'static str, usize)> {
    let Some(&(name, own, _)) = SAMPLES.iter().find(|(known, ..)| *known == name) else {
        let names: Vec<&str> = SAMPLES.iter().map(|(name, ..)| *name).collect();
        return Err(Error::Parameter(format!("no sample '{name}', there are: {}", names.join(", "))));
    };
    let faces = faces.unwrap_or(own);
    if !(LEAST_FACES..=MOST_FACES).contains(&faces) {
        return Err(Error::Parameter(format!("a sample has {LEAST_FACES} to {MOST_FACES} faces, not {faces}")));
    }
    Ok((name, faces))
}

/// Reads `sample:NAME` or `sample:NAME@FACES`, where `500k` and `1.5M` are numbers too; nothing for any other text.
pub fn parse_sample(spec: &str) -> Option<(&str, Option<usize>)> {
    let rest = spec.strip_prefix("sample:")?;
    match rest.split_once('@') {
        None => Some((rest, None)),
        Some((name, faces)) => Some((name, Some(parse_count(faces)?))),
    }
}

fn parse_count(text: &str) -> Option<usize> {
    let (digits, unit) = match text.char_indices().last()? {
        (end, 'k' | 'K') => (&text[..end], 1e3),
        (end, 'm' | 'M') => (&text[..end], 1e6),
        _ => (text, 1.0),
    };
    let plain = digits.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let count = digits.parse::<f64>().ok().filter(|_| plain)? * unit;
    (count.fract() == 0.0 && count <= 1e15).then_some(count as usize)
}

#[cfg(test)]
mod tests {
    use super::super::{topology, validate, weld};
    use super::*;

    #[test]
    fn specs_are_read() {
        assert_eq!(parse_sample("sample:statue"), Some(("statue", None)));
        assert_eq!(parse_sample("sample:part@12345"), Some(("part", Some(12_345))));
        assert_eq!(parse_sample("sample:part@500k"), Some(("part", Some(500_000))));
        assert_eq!(parse_sample("sample:part@1.5M"), Some(("part", Some(1_500_000))));
        for bad in [
            "statue",
            "sample:part@",
            "sample:part@k",
            "sample:part@-3",
            "sample:part@1.5",
            "sample:part@1e9",
            "sample:part@inf",
        ] {
            assert_eq!(parse_sample(bad), None, "{bad}");
        }
    }

    #[test]
    fn unknown_names_and_counts_are_refused() {
        let error = sample("horse", None).expect_err("there is no horse").to_string();
        assert_eq!(
            error,
            "invalid parameter: no sample 'horse', there are: statue, part, terrain, assembly, room, office"
        );
        assert!(sample("part", Some(999)).is_err());
    }

    #[test]
    fn samples_are_clean_and_as_large_as_asked() {
        for (name, _, _) in SAMPLES {
            for faces in [1000, 1777, 5000, 20_000, 60_000] {
                let mesh = sample(name, Some(faces)).expect("a known sample");
                mesh.check().expect("a sample is a valid mesh");
                let off = (mesh.faces.len() as f64 / faces as f64 - 1.0).abs();
                assert!(off <= 0.02, "{name}@{faces} has {} faces", mesh.faces.len());
                let defects = validate(&mesh);
                assert!(defects.is_empty(), "{name}@{faces}: {} defects, first {}", defects.len(), defects[0]);
                assert_eq!(weld(&mesh, 0.0).joined_vertices, 0, "{name}@{faces}");
            }
        }
    }

    #[test]
    fn samples_have_the_topology_they_promise() {
        for faces in [1000, 30_000] {
            let of = |name: &str| topology(&sample(name, Some(faces)).expect("a known sample"));
            let (statue, part, terrain, assembly) = (of("statue"), of("part"), of("terrain"), of("assembly"));
            assert_eq!((statue.components, statue.genus), (1, Some(0)));
            assert_eq!((part.components, part.genus), (1, Some(9)));
            assert_eq!((terrain.components, terrain.euler, terrain.border_loops), (1, 1, 1));
            assert_eq!(assembly.components, faces / 250);
            // Of every six parts the second and the fifth are rings.
            let rings = (0..faces / 250).filter(|i| [1, 4].contains(&(i % 6))).count();
            assert_eq!(assembly.genus, Some(rings as i64));
        }
    }

    #[test]
    fn closed_samples_are_the_right_way_out() {
        for name in ["statue", "part", "assembly"] {
            assert!(sample(name, Some(5000)).expect("a known sample").volume() > 0.0, "{name}");
        }
    }

    #[test]
    fn slabs_are_the_statue_in_another_order() {
        let faces = statue::LEAST_FACES_IN_SLABS;
        let whole = sample("statue", Some(faces)).expect("a known sample");
        let mut joined = Mesh { colors: Some(Vec::new()), ..Mesh::default() };
        let mut pieces = 0;
        let add = &mut |piece: &Mesh| {
            pieces += 1;
            joined.positions.extend_from_slice(&piece.positions);
            joined.colors.iter_mut().zip(&piece.colors).for_each(|(all, rows)| all.extend_from_slice(rows));
            joined.faces.extend_from_slice(&piece.faces);
            Ok(())
        };
        sample_in_pieces("statue", Some(faces), add).expect("a known sample");
        joined.check().expect("faces name vertices of the whole");
        assert!(pieces > 2, "{pieces}");
        let corners = |mesh: &Mesh| {
            let corner = |&v: &u32| mesh.positions[v as usize].to_array().map(f64::to_bits);
            let mut faces: Vec<_> = mesh.faces.iter().map(|face| face.each_ref().map(corner)).collect();
            faces.iter_mut().for_each(|face| face.sort_unstable());
            faces.sort_unstable();
            faces
        };
        assert!(corners(&whole) == corners(&joined));
        assert_eq!(topology(&joined).genus, Some(0));
    }

    #[test]
    fn threads_do_not_show() {
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        for (name, _, _) in SAMPLES {
            let [one, three] =
                [1, 3].map(|threads| pool(threads).install(|| sample(name, Some(9000)).expect("a known sample")));
            assert!(one == three, "{name}");
        }
    }
}
