//! Libraries of materials (MTL): what they say of colors and pictures, and how rough and metallic things are.
//!
//! Read line by line, and not by `tobj`: files that are broken in one place are common, and what they say elsewhere is still
//! wanted; one bad number would lose the file there, and a `Kd` of fewer than three numbers the program.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rustc_hash::FxHashMap;

use crate::error::Result;
use crate::formats::looks::{paths_beside, read_beside};
use crate::formats::material::{Map, Material, Picture};
use crate::formats::output::push_floats;
use crate::formats::text;
use crate::math::DVec2;

/// The libraries that an OBJ file names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Libraries {
    /// What stands behind each `mtllib`.
    pub names: Vec<String>,
    /// Where they lie; none for a stream.
    pub folder: Option<PathBuf>,
    /// Whether a name in the file was not UTF-8, and was read as Latin-1: an OBJ gets all names back so, as its libraries have them.
    pub in_latin1: bool,
    /// What the file has beside faces, which is not read.
    pub skipped: Vec<&'static str>,
}

impl Libraries {
    /// Whether a library lies beside the input that `output` will not find beside itself.
    pub(in crate::formats) fn leaves_behind(&self, output: &Path) -> bool {
        let Some(from) = &self.folder else { return false };
        let to = output.parent().unwrap_or(Path::new(""));
        let is_left = |name: &str| from.join(name).is_file() && !to.join(name).is_file();
        self.names.iter().any(|library| match from.join(library).is_file() {
            true => is_left(library),
            // As they are read: several names.
            false => library.split_whitespace().any(is_left),
        })
    }

    /// What a user should know of what is lost, whatever the mesh is written as.
    pub(in crate::formats) fn loss(&self) -> Option<String> {
        (!self.skipped.is_empty()).then(|| format!("not read of the OBJ file, and lost: {}", self.skipped.join(", ")))
    }

    /// The materials of all that can be read, and of the others what is wrong.
    pub(in crate::formats) fn read(&self) -> (Vec<Material>, Vec<String>) {
        let (mut known, mut warnings) = (Vec::new(), Vec::new());
        for (library, bytes) in self.names.iter().flat_map(|library| read_libraries(self.folder.as_deref(), library)) {
            let shown = text::quote(library.as_bytes());
            match bytes {
                Ok(bytes) => {
                    let (materials, faults) = materials(&bytes);
                    known.extend(materials);
                    warnings.extend(faults.map(|first| format!("the materials of {shown} are read in part: {first}")));
                }
                Err(error) => warnings.push(format!("the materials of {shown} are missing: {error}")),
            }
        }
        (known, warnings)
    }

    /// The files in which libraries and the pictures of their materials are looked for, some of which may be missing.
    pub(in crate::formats) fn files(&self) -> Vec<PathBuf> {
        let Some(folder) = &self.folder else { return Vec::new() };
        let (described, _) = self.read();
        let picture = |material: &Material| match &material.map {
            Some(Map { picture: Picture::Beside(name), .. }) => Some(name.clone()),
            _ => None,
        };
        let names = self.names.iter().flat_map(|library| std::iter::once(&**library).chain(library.split_whitespace()));
        let names = names.map(String::from).chain(described.iter().filter_map(picture));
        names.flat_map(|name| paths_beside(folder, &name)).collect()
    }
}

/// The materials that go with the first lines of `names`, or nothing where they are not described. As elsewhere, what is said
/// first holds.
pub(in crate::formats) fn described<'a>(known: &'a [Material], names: &[String]) -> Vec<Option<&'a Material>> {
    let mut by_name: FxHashMap<&str, &Material> = FxHashMap::default();
    known.iter().rev().for_each(|material| {
        by_name.insert(&material.name, material);
    });
    names.iter().map(|name| by_name.get(name.lines().next().unwrap_or_default()).copied()).collect()
}

/// The text of what stands behind `mtllib`: a name that may have spaces, or several names, of which some may be missing.
fn read_libraries<'a>(folder: Option<&Path>, library: &'a str) -> Vec<(&'a str, Result<Vec<u8>>)> {
    let whole = read_beside(folder, library);
    if whole.is_err() && library.contains(char::is_whitespace) {
        let parts: Vec<_> = library.split_whitespace().map(|name| (name, read_beside(folder, name))).collect();
        if parts.iter().any(|(_, bytes)| bytes.is_ok()) {
            return parts;
        }
    }
    vec![(library, whole)]
}

/// The materials of a library, and the first line that says what it should not.
fn materials(bytes: &[u8]) -> (Vec<Material>, Option<String>) {
    let (mut materials, mut fault): (Vec<Material>, _) = (Vec::new(), None);
    let bytes = bytes.strip_prefix(text::MARK).unwrap_or(bytes);
    for (number, line) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        let line = line.trim_ascii();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = (&line[..end], line[end..].trim_ascii());
        if keyword == b"newmtl" {
            let name = text::name(rest).into();
            materials.push(Material { name, ..Material::default() });
            continue;
        }
        let Some(material) = materials.last_mut() else { continue };
        let finite = |token| text::number(token).filter(|number| number.is_finite());
        let mut numbers = text::tokens(rest).map_while(finite);
        let mut share = || numbers.next().map(|number| number.clamp(0.0, 1.0));
        let is_told = match keyword {
            b"Kd" => share().map(|red| {
                // A single number stands for all three.
                let [green, blue] = [share(), share()].map(|channel| channel.unwrap_or(red));
                material.color[..3].copy_from_slice(&[red, green, blue].map(|channel| channel as f32));
            }),
            b"d" => share().map(|opacity| material.color[3] = opacity as f32),
            b"Tr" => share().map(|transparency| material.color[3] = 1.0 - transparency as f32),
            b"Pr" => share().map(|roughness| material.roughness = Some(roughness)),
            b"Pm" => share().map(|metallic| material.metallic = Some(metallic)),
            // Said by itself it holds, whatever the order.
            b"Ns" => numbers.next().map(|exponent| {
                material.roughness.get_or_insert(roughness(exponent));
            }),
            b"map_Kd" => {
                material.map = Some(map_of(&text::name(rest)));
                Some(())
            }
            _ => Some(()),
        };
        if is_told.is_none() && fault.is_none() {
            fault = Some(format!("line {number} says {}, expected numbers", text::quote(line)));
        }
    }
    (materials, fault)
}

/// The roughness of a highlight with this exponent, as commonly taken.
fn roughness(exponent: f64) -> f64 {
    (2.0 / (exponent.max(0.0) + 2.0)).sqrt()
}

/// The exponent of a roughness, up to what libraries have.
fn exponent(roughness: f64) -> f64 {
    (2.0 / (roughness * roughness).max(1e-9) - 2.0).clamp(0.0, 1000.0)
}

/// What stands behind `map_Kd`: options, then the name of a picture, which may have spaces.
fn map_of(text: &str) -> Map {
    let (mut scale, mut offset, mut is_clamped) = (DVec2::ONE, DVec2::ZERO, false);
    let mut rest = text.trim();
    while let Some((option, behind)) = rest.split_once(char::is_whitespace).filter(|_| rest.starts_with('-')) {
        rest = behind.trim_start();
        match option {
            "-o" => offset += pair(&mut rest, 0.0),
            "-s" => scale *= pair(&mut rest, 1.0),
            "-clamp" => is_clamped = word(&mut rest) == "on",
            // What nobody here draws is passed over: turbulence, brightness and contrast, a word each.
            "-t" => {
                pair(&mut rest, 0.0);
            }
            "-mm" => {
                word(&mut rest);
                word(&mut rest);
            }
            _ => {
                word(&mut rest);
            }
        }
    }
    Map { picture: Picture::Beside(rest.into()), scale, offset, is_clamped }
}

/// The next word of `rest`.
fn word<'a>(rest: &mut &'a str) -> &'a str {
    let (word, behind) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
    *rest = behind.trim_start();
    word
}

/// Up to three numbers of `rest`, of which the first two count.
fn pair(rest: &mut &str, otherwise: f64) -> DVec2 {
    let mut numbers = [otherwise; 3];
    for number in &mut numbers {
        let mut behind = *rest;
        let Some(found) = text::number(word(&mut behind).as_bytes()).filter(|found| found.is_finite()) else { break };
        (*number, *rest) = (found, behind);
    }
    DVec2::new(numbers[0], numbers[1])
}

/// A name as one line has it.
pub(in crate::formats) fn plain_name(name: &str) -> String {
    name.trim().chars().map(|c| if c.is_control() { '_' } else { c }).collect()
}

/// Writes a library of these materials; pictures lie in files beside it.
pub(in crate::formats) fn write_library(materials: &[Material], out: &mut dyn Write) -> io::Result<()> {
    let mut text = b"# written by coarsen\n".to_vec();
    for Material { name, color: [red, green, blue, opacity], map, roughness, metallic } in materials {
        text.extend_from_slice(format!("\nnewmtl {name}\n").as_bytes());
        let mut numbers = |keyword: &str, numbers: &[f64]| {
            text.extend_from_slice(keyword.as_bytes());
            push_floats(&mut text, numbers);
            text.push(b'\n');
        };
        numbers("Kd", &[red, green, blue].map(|channel| rounded(f64::from(*channel))));
        numbers("d", &[rounded(f64::from(*opacity))]);
        if let Some(roughness) = *roughness {
            numbers("Ns", &[rounded(exponent(roughness))]);
            numbers("Pr", &[rounded(roughness)]);
        }
        metallic.iter().for_each(|&metallic| numbers("Pm", &[rounded(metallic)]));
        let Some(Map { picture: Picture::Beside(file), scale, offset, is_clamped }) = map else { continue };
        text.extend_from_slice(b"map_Kd");
        for (option, pair, usual) in [(" -o", offset, DVec2::ZERO), (" -s", scale, DVec2::ONE)] {
            if *pair != usual {
                text.extend_from_slice(option.as_bytes());
                push_floats(&mut text, &pair.to_array());
                // Three numbers, so that a name that begins with one is not taken for the third.
                push_floats(&mut text, &[if usual == DVec2::ZERO { 0.0 } else { 1.0 }]);
            }
        }
        text.extend_from_slice(if *is_clamped { b" -clamp on " } else { b" " });
        text.extend_from_slice(file.as_bytes());
        text.push(b'\n');
    }
    out.write_all(&text)
}

/// Six digits behind the point, as people read them.
fn rounded(number: f64) -> f64 {
    (number * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_behind_is_told_of_one_name_with_spaces_and_of_several() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("out")).expect("a folder");
        let beside = |names: &[&str]| {
            let names = names.iter().map(|name| (*name).to_string()).collect();
            Libraries { names, folder: Some(folder.path().into()), ..Libraries::default() }
        };
        let is_left = |names: &[&str]| beside(names).leaves_behind(&folder.path().join("out/a.obj"));
        let write = |name: &str| std::fs::write(folder.path().join(name), "newmtl a").expect("a file");
        assert!(!is_left(&["a.mtl b.mtl"]));
        write("b.mtl");
        assert!(is_left(&["a.mtl b.mtl"]) && is_left(&["b.mtl"]) && !is_left(&["a.mtl", "b .mtl"]));
        write("out/b.mtl");
        assert!(!is_left(&["a.mtl b.mtl"]));
        write("a.mtl b.mtl");
        assert!(is_left(&["a.mtl b.mtl"]));
        assert!(!beside(&["b.mtl"]).leaves_behind(&folder.path().join("a.obj")));
    }

    #[test]
    fn libraries_are_read_as_far_as_they_go() {
        let text =
            b"Kd 1 1 1\nnewmtl red paint\nKd 1 0.5 0\nd 0.25\nNs 6\nmap_Kd -s 2 2 -o 0.5 0 1 -clamp on a b.png\n\
                     newmtl grey\nKd 0.5\nTr 0.25\nNs nothing\nPm 1\nPr 0.3\n";
        let (found, fault) = materials(text);
        let map = Map {
            picture: Picture::Beside("a b.png".into()),
            scale: DVec2::splat(2.0),
            offset: DVec2::new(0.5, 0.0),
            is_clamped: true,
        };
        let red = Material {
            name: "red paint".into(),
            color: [1.0, 0.5, 0.0, 0.25],
            map: Some(map),
            roughness: Some(0.5),
            metallic: None,
        };
        let grey = Material {
            name: "grey".into(),
            color: [0.5, 0.5, 0.5, 0.75],
            map: None,
            roughness: Some(0.3),
            metallic: Some(1.0),
        };
        assert_eq!(found, [red, grey]);
        assert_eq!(fault.as_deref(), Some("line 10 says 'Ns nothing', expected numbers"));
        // What is written reads back.
        let mut written = Vec::new();
        write_library(&found, &mut written).expect("memory is writable");
        let again = materials(&written);
        assert_eq!(again.1, None);
        assert_eq!((&again.0[1], &again.0[0].map), (&found[1], &found[0].map), "{}", String::from_utf8_lossy(&written));
        assert!((exponent(roughness(96.0)) - 96.0).abs() < 1e-9);
    }

    /// Of several names the missing are told, and the others read; a mark before the text is none of it.
    #[test]
    fn what_is_there_is_read_beside_what_is_missing() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("here.mtl"), b"\xef\xbb\xbfnewmtl red\nKd 1 0 0\n").expect("a library");
        let names = vec!["here.mtl gone.mtl".into()];
        let (known, warnings) = Libraries { names, folder: Some(folder.path().into()), ..Libraries::default() }.read();
        assert_eq!((known.len(), known[0].name.as_str()), (1, "red"));
        assert!(warnings.len() == 1 && warnings[0].contains("'gone.mtl' are missing"), "{warnings:?}");
    }

    #[test]
    fn what_is_missing_is_told() {
        let libraries =
            Libraries { names: vec!["gone.mtl".into()], folder: Some(std::env::temp_dir()), ..Libraries::default() };
        let (known, warnings) = libraries.read();
        assert!(
            known.is_empty() && warnings.len() == 1 && warnings[0].contains("'gone.mtl' are missing"),
            "{warnings:?}"
        );
        let (known, warnings) = Libraries { folder: None, ..libraries }.read();
        assert!(known.is_empty() && warnings[0].contains("stream"), "{warnings:?}");
    }
}
