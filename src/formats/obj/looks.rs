//! How materials of libraries (MTL) look.

use std::borrow::Cow;
use std::path::Path;

use crate::error::Result;
use crate::formats::looks::{Pictures, read_beside};
use crate::formats::text;
use crate::looks::{Look, Opacity, Texture, Wrap};
use crate::math::DVec2;

/// A look for each of `names`, whose first line is the material's, from the libraries in `folder`.
pub(in crate::formats) fn looks(
    libraries: &[String],
    names: &[String],
    folder: Option<&Path>,
    pictures: &mut Pictures,
) -> Vec<Look> {
    let mut known = Vec::new();
    for library in libraries {
        match read_library(folder, library) {
            Ok(bytes) => known.extend(materials(&bytes)),
            Err(error) => {
                let shown = text::quote(library.as_bytes());
                pictures.warn(format!("the materials of {shown} are not drawn: {error}"));
            }
        }
    }
    if known.is_empty() {
        return Vec::new();
    }
    let look = |name: &String| {
        let name = name.lines().next().unwrap_or_default();
        // As elsewhere, what is said first holds.
        let material = known.iter().find(|material| material.name == name);
        material.map_or_else(Look::default, |material| material.look(folder, pictures))
    };
    names.iter().map(look).collect()
}

/// What a library says of a material.
struct Material {
    name: String,
    color: [f32; 4],
    map: Option<Map>,
}

impl Material {
    fn look(&self, folder: Option<&Path>, pictures: &mut Pictures) -> Look {
        let texture = self.map.as_ref().and_then(|map| {
            let image = pictures.get(&map.name, || read_beside(folder, &map.name).map(Cow::Owned))?;
            Some(Texture { image, channel: None, transform: map.transform, wrap: map.wrap })
        });
        let mut color = self.color;
        // Some programs write black for what only the texture colors.
        if self.map.is_some() && color[..3] == [0.0; 3] {
            color[..3].fill(1.0);
        }
        let opacity = if color[3] < 1.0 { Opacity::Blend } else { Opacity::Opaque };
        Look { color, texture, opacity }
    }
}

/// The text of what stands behind `mtllib`: a name that may have spaces, or several names.
fn read_library(folder: Option<&Path>, library: &str) -> Result<Vec<u8>> {
    let whole = read_beside(folder, library);
    if whole.is_ok() || !library.contains(char::is_whitespace) {
        return whole;
    }
    let parts: Result<Vec<_>> = library.split_whitespace().map(|name| read_beside(folder, name)).collect();
    parts.map_or(whole, |parts| Ok(parts.join(&b'\n')))
}

/// The materials of a library.
fn materials(bytes: &[u8]) -> Vec<Material> {
    let mut materials: Vec<Material> = Vec::new();
    for line in bytes.split(|&byte| byte == b'\n') {
        let line = line.trim_ascii();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = (&line[..end], line[end..].trim_ascii());
        if keyword == b"newmtl" {
            let name = String::from_utf8_lossy(rest).into();
            materials.push(Material { name, color: [1.0; 4], map: None });
            continue;
        }
        let Some(material) = materials.last_mut() else { continue };
        let finite = |token| text::number(token).filter(|number| number.is_finite());
        let mut numbers = text::tokens(rest).map_while(finite).map(|number| number.clamp(0.0, 1.0) as f32);
        match keyword {
            b"Kd" => {
                if let Some(red) = numbers.next() {
                    // A single number stands for all three.
                    let [green, blue] = [numbers.next(), numbers.next()].map(|channel| channel.unwrap_or(red));
                    material.color[..3].copy_from_slice(&[red, green, blue]);
                }
            }
            b"d" => material.color[3] = numbers.next().unwrap_or(1.0),
            b"Tr" => material.color[3] = 1.0 - numbers.next().unwrap_or(0.0),
            b"map_Kd" => material.map = Some(Map::of(&String::from_utf8_lossy(rest))),
            _ => {}
        }
    }
    materials
}

/// What stands behind `map_Kd`: options, then the name of a picture, which may have spaces.
struct Map {
    name: String,
    transform: [DVec2; 3],
    wrap: [Wrap; 2],
}

impl Map {
    fn of(text: &str) -> Self {
        let (mut scale, mut offset, mut wrap) = (DVec2::ONE, DVec2::ZERO, Wrap::Repeat);
        let mut rest = text.trim();
        while let Some((option, behind)) = rest.split_once(char::is_whitespace).filter(|_| rest.starts_with('-')) {
            rest = behind.trim_start();
            match option {
                "-o" => offset += pair(&mut rest, 0.0),
                "-s" => scale *= pair(&mut rest, 1.0),
                "-clamp" if word(&mut rest) == "on" => wrap = Wrap::Clamp,
                "-clamp" => {}
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
        let [u, v, origin] = Texture::UP;
        let transform = [u * scale.x, v * scale.y, origin + u * offset.x + v * offset.y];
        Self { name: rest.into(), transform, wrap: [wrap; 2] }
    }
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
