//! Everything about two meshes side by side.

use super::texture::{MaterialTexture, TEXELS, TextureDeviation, texture_by_material};
use super::{Deviation, Options, Quality, deviation, quality};
use crate::backend::Device;
use crate::error::Result;
use crate::mesh::{Mesh, Topology, survey};

/// Two meshes side by side; pairs have the first mesh first.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// How far their surfaces are apart.
    pub deviation: Deviation,
    /// The shape of their triangles.
    pub quality: [Quality; 2],
    /// What kind of surfaces they are once equal positions are joined, as [`survey()`] tells it.
    pub topology: [Topology; 2],
    /// How far a texture has moved, where both have texture coordinates; on a grid of [`TEXELS`].
    pub texture: Option<TextureDeviation>,
    /// The same of every material, where both tell materials.
    pub texture_materials: Vec<MaterialTexture>,
}

/// Compares `a` with `b`.
///
/// # Errors
/// As [`deviation()`].
pub fn compare(a: &Mesh, b: &Mesh, options: &Options, device: &Device) -> Result<Comparison> {
    // All by one thread of the pool: an allocator that keeps freed memory for each thread then keeps it once.
    device.install(|| {
        let deviation = deviation(a, b, options, device)?;
        let topology = [a, b].map(|mesh| survey(mesh).topology);
        let (texture, texture_materials) = texture_by_material(a, b, TEXELS)?.unzip();
        let texture_materials = texture_materials.unwrap_or_default();
        Ok(Comparison { deviation, quality: [a, b].map(quality), topology, texture, texture_materials })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::mesh::shapes::{icosphere, tetrahedron};

    #[test]
    fn a_soup_is_compared_as_the_surface_it_is() {
        let ball = icosphere(2);
        let mut soup = Mesh::default();
        for (i, face) in (0..).zip(&ball.faces) {
            soup.positions.extend(face.map(|v| ball.positions[v as usize]));
            soup.faces.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let device = Device::cpu(1).expect("the CPU");
        let comparison = compare(&ball, &soup, &Options::default(), &device).expect("a comparison");
        assert_eq!(comparison.topology[0], comparison.topology[1]);
        assert_eq!(comparison.quality[0], comparison.quality[1]);
        assert!(comparison.deviation.symmetric().max < 1e-12);
    }

    #[test]
    fn nothing_cannot_be_compared() {
        let device = Device::cpu(1).expect("the CPU");
        let result = compare(&tetrahedron(), &Mesh::default(), &Options::default(), &device);
        assert!(matches!(result, Err(Error::Mesh(_))), "{result:?}");
    }
}
