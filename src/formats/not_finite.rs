//! Numbers of attributes that are none, or infinite: read as zero, for others are added to them, and told.

use rayon::prelude::*;

use crate::mesh::Mesh;

/// Rows that are looked at by one task.
const ROWS: usize = 1 << 12;

/// Takes every normal and every place in a texture of which a number is not finite to zero, of colors and other properties that
/// number; returns a sentence about how many rows that were.
pub(super) fn to_zero(mesh: &mut Mesh) -> Option<String> {
    let mut told: Vec<String> = Vec::new();
    let mut tell = |name: &str, rows: usize| {
        if rows > 0 {
            told.push(format!("{name} {rows}"));
        }
    };
    let normals = mesh.normals.as_deref_mut().unwrap_or_default();
    tell("normals", whole_rows(bytemuck::cast_slice_mut(normals), 3));
    let texcoords = mesh.texcoords.as_deref_mut().unwrap_or_default();
    tell("texture coordinates of corners", whole_rows(bytemuck::cast_slice_mut(texcoords), 2));
    for (name, colors) in [("colors", &mut mesh.colors), ("face colors", &mut mesh.face_colors)] {
        tell(name, numbers(colors.as_deref_mut().unwrap_or_default().as_flattened_mut(), 4));
    }
    for channel in &mut mesh.channels {
        tell(&format!("'{}'", channel.name), numbers(&mut channel.values, channel.width));
    }
    (!told.is_empty()).then(|| format!("not finite in single precision, read as zero: {}", told.join(", ")))
}

/// Takes rows of so many numbers to zero where one is not finite; returns how many.
fn whole_rows(values: &mut [f32], width: usize) -> usize {
    rows_that_are_not_finite(values, width, |row| row.fill(0.0))
}

/// Takes the numbers of such rows to zero that are not finite; returns how many rows.
fn numbers(values: &mut [f32], width: usize) -> usize {
    rows_that_are_not_finite(values, width, |row| {
        row.iter_mut().filter(|number| !number.is_finite()).for_each(|number| *number = 0.0);
    })
}

fn rows_that_are_not_finite(values: &mut [f32], width: usize, put_right: impl Fn(&mut [f32]) + Sync) -> usize {
    let width = width.max(1);
    let of_task = |values: &mut [f32]| {
        // All of them, without a branch: nearly all files have none.
        if values.iter().fold(true, |all, number| all & number.is_finite()) {
            return 0;
        }
        let rows = values.chunks_mut(width).filter(|row| !row.iter().all(|number| number.is_finite()));
        rows.map(&put_right).count()
    };
    values.par_chunks_mut(width * ROWS).map(of_task).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Vec2, Vec3};
    use crate::mesh::{Channel, ChannelKind, shapes};

    #[test]
    fn what_is_not_finite_is_zero_and_told() {
        let mut mesh = shapes::plane(100, 100);
        let (vertices, faces) = (mesh.positions.len(), mesh.faces.len());
        mesh.normals = Some(vec![Vec3::Z; vertices]);
        mesh.colors = Some(vec![[0.5; 4]; vertices]);
        mesh.texcoords = Some(vec![[Vec2::ONE; 3]; faces]);
        let channel =
            Channel { name: "quality".into(), kind: ChannelKind::Linear, width: 2, values: vec![1.0; 2 * vertices] };
        mesh.channels = vec![channel];
        let whole = mesh.clone();
        assert_eq!(to_zero(&mut mesh), None);
        assert_eq!(mesh, whole);

        let far = vertices - 1;
        mesh.normals.as_mut().expect("normals")[far] = Vec3::new(f32::NAN, 0.0, 1.0);
        mesh.colors.as_mut().expect("colors")[7][2] = f32::NAN;
        mesh.texcoords.as_mut().expect("a texture")[faces - 1][2].x = f32::INFINITY;
        mesh.texcoords.as_mut().expect("a texture")[3][0] = Vec2::NAN;
        mesh.channels[0].values[2 * far + 1] = f32::NEG_INFINITY;
        let told = to_zero(&mut mesh);
        let expected = "not finite in single precision, read as zero: normals 1, texture coordinates of corners 2, colors 1, 'quality' 1";
        assert_eq!(told.as_deref(), Some(expected));
        assert_eq!(mesh.normals.as_ref().expect("normals")[far - 1..], [Vec3::Z, Vec3::ZERO]);
        assert_eq!(mesh.colors.as_ref().expect("colors")[7], [0.5, 0.5, 0.0, 0.5]);
        let texcoords = mesh.texcoords.as_ref().expect("a texture");
        assert_eq!(
            [texcoords[faces - 1][1], texcoords[faces - 1][2], texcoords[3][0]],
            [Vec2::ONE, Vec2::ZERO, Vec2::ZERO]
        );
        assert_eq!(mesh.channels[0].values[2 * far..], [1.0, 0.0]);
        assert_eq!(to_zero(&mut mesh), None);
    }
}
