//! Materials on their way from one format to another: a color, a picture, how rough and how metallic.

use crate::math::DVec2;

/// What both libraries of OBJ and glTF say of a material.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Material {
    pub name: String,
    /// Red, green, blue, opacity in `[0, 1]`, as screens take them (sRGB).
    pub color: [f32; 4],
    pub map: Option<Map>,
    pub roughness: Option<f64>,
    pub metallic: Option<f64>,
}

impl Default for Material {
    /// White and opaque.
    fn default() -> Self {
        Self { name: String::new(), color: [1.0; 4], map: None, roughness: None, metallic: None }
    }
}

impl Material {
    /// The color, by which that of the picture is multiplied. Some programs write black for what only the picture colors.
    pub fn seen_color(&self) -> [f32; 4] {
        let [red, green, blue, opacity] = self.color;
        let is_black = self.map.is_some() && [red, green, blue] == [0.0; 3];
        if is_black { [1.0, 1.0, 1.0, opacity] } else { self.color }
    }

    /// Whether it has a picture that can be put into a file.
    pub fn has_picture(&self) -> bool {
        matches!(&self.map, Some(Map { picture: Picture::Inside(bytes), .. }) if kind_of(bytes).is_some())
    }
}

/// A picture on a surface.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Map {
    pub picture: Picture,
    /// From texture coordinates, v up, to places in the picture, up as well.
    pub scale: DVec2,
    pub offset: DVec2,
    /// Whether its last row goes on beside it.
    pub is_clamped: bool,
}

impl Map {
    /// The offset where v is down, or up where this is that.
    pub fn turned_offset(&self) -> DVec2 {
        DVec2::new(self.offset.x, 1.0 - self.scale.y - self.offset.y)
    }
}

/// Where a picture is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Picture {
    /// In a file, by its name from the folder of the file that names it.
    Beside(String),
    /// These bytes.
    Inside(Vec<u8>),
}

/// What the bytes of a picture are: the extension and the type of files of the kind; `None` but for PNG and JPEG.
pub(super) fn kind_of(picture: &[u8]) -> Option<(&'static str, &'static str)> {
    if picture.starts_with(b"\x89PNG\r\n\x1a\n") {
        return Some(("png", "image/png"));
    }
    picture.starts_with(&[0xff, 0xd8, 0xff]).then_some(("jpg", "image/jpeg"))
}
