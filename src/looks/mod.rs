//! How materials look: a color, and a picture for each point of a texture.
//!
//! Files name materials, readers make [`Look`]s of them ([`formats::looks`](crate::formats::looks())), and what draws takes
//! them. A look is what a picture of a mesh needs and no more: roughness, bumps and reflections are left out.

mod decode;
pub mod image;

use std::sync::Arc;

use crate::math::DVec2;

pub use image::{Image, LONGEST_SIDE};

/// How a material looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// Red, green, blue, opacity in `[0, 1]`, as screens take them (sRGB); the texture's are multiplied by it.
    pub color: [f32; 4],
    /// What lies on the surface, where it has texture coordinates.
    pub texture: Option<Texture>,
    /// What opacity means.
    pub opacity: Opacity,
}

/// What the opacity of a color does.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Opacity {
    /// Nothing.
    #[default]
    Opaque,
    /// Less than this leaves a hole.
    Mask(f32),
    /// The share of what lies behind that is hidden.
    Blend,
}

/// A picture on a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// The picture.
    pub image: Arc<Image>,
    /// The channel that has its coordinates; those of the mesh itself where there is none.
    pub channel: Option<String>,
    /// From texture coordinates to the picture, whose upper left corner is 0, 0 and lower right one 1, 1: the images of both
    /// axes, then of the origin.
    pub transform: [DVec2; 3],
    /// What is beside the picture, to the right and below.
    pub wrap: [Wrap; 2],
}

/// How a picture goes on beside its sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// It starts again.
    #[default]
    Repeat,
    /// It goes back, as in a mirror.
    Mirror,
    /// Its last row goes on.
    Clamp,
}

impl Default for Look {
    /// White and opaque.
    fn default() -> Self {
        Self { color: [1.0; 4], texture: None, opacity: Opacity::Opaque }
    }
}

impl Texture {
    /// Where coordinates lie as they are: `v` points down, as in glTF.
    pub const DOWN: [DVec2; 3] = [DVec2::X, DVec2::Y, DVec2::ZERO];
    /// Where `v` points up, as in OBJ.
    pub const UP: [DVec2; 3] = [DVec2::X, DVec2::NEG_Y, DVec2::Y];

    /// The light and opacity at texture coordinates, over as much of the picture as lies between neighbors that are `steps`
    /// off; light is the square of what screens take.
    pub fn color(&self, at: DVec2, steps: [DVec2; 2]) -> [f32; 4] {
        let [u, v, origin] = self.transform;
        let turned = |p: DVec2| u * p.x + v * p.y;
        self.image.color(turned(at) + origin, steps.map(turned), self.wrap)
    }
}

impl Wrap {
    /// A place along a side of length 1, moved by whole lengths to where no number of texels is too large.
    fn near(self, x: f64) -> f64 {
        match self {
            Self::Repeat => x - x.floor(),
            Self::Mirror => x - 2.0 * (x / 2.0).floor(),
            Self::Clamp => x.clamp(-1.0, 2.0),
        }
    }

    /// The texel that stands for number `i` of `count`.
    fn texel(self, i: i64, count: usize) -> usize {
        let count = count as i64;
        let texel = match self {
            Self::Repeat => i.rem_euclid(count),
            Self::Mirror => {
                let there_and_back = i.rem_euclid(2 * count);
                there_and_back.min(2 * count - 1 - there_and_back)
            }
            Self::Clamp => i.clamp(0, count - 1),
        };
        texel as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_go_on_beside_their_sides() {
        let row = |wrap: Wrap| (-4..7).map(|i| wrap.texel(i, 3)).collect::<Vec<_>>();
        assert_eq!(row(Wrap::Repeat), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0]);
        assert_eq!(row(Wrap::Mirror), [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
        assert_eq!(row(Wrap::Clamp), [0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2]);
        assert_eq!([Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|wrap| wrap.near(-2.75)), [0.25, 1.25, -1.0]);
    }

    #[test]
    fn up_is_up() {
        // White above black.
        let image = Arc::new(Image::new(1, 2, vec![[255; 4], [0, 0, 0, 255]]).expect("a picture"));
        let light = |transform| {
            let texture = Texture { image: image.clone(), channel: None, transform, wrap: [Wrap::Clamp; 2] };
            [0.0, 1.0].map(|v| texture.color(DVec2::new(0.5, v), [DVec2::ZERO; 2])[0])
        };
        assert_eq!((light(Texture::DOWN), light(Texture::UP)), ([1.0, 0.0], [0.0, 1.0]));
    }
}
