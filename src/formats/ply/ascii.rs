//! Rows as text, one a line.

use super::FORMAT;
use super::color::ColorLayout;
use super::face::{FaceLayout, Faces};
use super::header::{Element, Header, Kind, Role};
use super::vertex::{VertexLayout, Vertices};
use crate::error::Result;
use crate::formats::text::{Lines, Row, Rows};
use crate::mesh::Mesh;

/// Reads the rows after the header.
pub(super) fn read(header: &Header, bytes: &[u8]) -> Result<Mesh> {
    let mut rows = Rows::new(FORMAT, Lines::after(header.lines, &bytes[header.body_start..]), None);
    let mut vertices = Vertices::default();
    for element in &header.elements {
        match &element.role {
            Role::Vertex(layout) => vertices = read_vertices(&mut rows, element, layout)?,
            Role::Face(layout) => read_faces(&mut rows, element, layout, &mut vertices.mesh)?,
            // Rows without values are blank lines, which are skipped anyway.
            Role::Skipped if element.properties.is_empty() => {}
            Role::Skipped => {
                for at in 0..element.count {
                    rows.expect(&element.name, at, element.count)?;
                }
            }
        }
    }
    rows.expect_end()?;
    Ok(vertices.into_mesh())
}

fn read_vertices(rows: &mut Rows<'_>, element: &Element, layout: &VertexLayout) -> Result<Vertices> {
    let mut vertices = layout.no_vertices();
    vertices.mesh.positions.reserve(element.count as usize);
    let mut values = vec![0.0; element.properties.len()];
    for at in 0..element.count {
        let mut row = rows.expect("vertices", at, element.count)?;
        for (place, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::Scalar(_) if layout.position.contains(&place) => values[place] = row.finite(&property.name)?,
                Kind::Scalar(_) => values[place] = row.number(&property.name)?,
                Kind::List { .. } => skip_list(&mut row)?,
            }
        }
        layout.push(&mut vertices, |place| values[place]);
    }
    Ok(vertices)
}

fn read_faces(rows: &mut Rows<'_>, element: &Element, layout: &FaceLayout, mesh: &mut Mesh) -> Result<()> {
    let vertex_count = mesh.positions.len();
    let mut faces = Faces::new(mesh, layout);
    faces.mesh.faces.reserve(element.count as usize);
    let color = layout.color.as_ref();
    let last = layout.texcoords.unwrap_or_default().max(layout.corners).max(color.map_or(0, ColorLayout::last));
    let mut values = vec![0.0; last + 1];
    for at in 0..element.count {
        let mut row = rows.expect("faces", at, element.count)?;
        for (place, property) in element.properties[..=last].iter().enumerate() {
            match property.kind {
                Kind::Scalar(_) if color.is_some_and(|color| color.contains(place)) => {
                    values[place] = row.number(&property.name)?;
                }
                Kind::Scalar(_) => drop(row.expect(&property.name)?),
                Kind::List { .. } if place == layout.corners => {
                    let corner_count = row.count("the number of corners")?;
                    if corner_count < 3 {
                        return Err(row.error(format!("found a face of {corner_count} corners, expected at least 3")));
                    }
                    for _ in 0..corner_count {
                        faces.corners.push(row.index(vertex_count)?);
                    }
                }
                Kind::List { .. } if layout.texcoords == Some(place) => {
                    for _ in 0..row.count("the number of texture coordinates")? {
                        faces.texcoords.push(row.number("a texture coordinate")?);
                    }
                }
                Kind::List { .. } => skip_list(&mut row)?,
            }
        }
        if let Some(color) = color {
            faces.color = color.color(|place| values[place]);
        }
        faces.end_row().map_err(|message| row.error(message))?;
    }
    faces.end();
    Ok(())
}

pub(super) fn skip_list(row: &mut Row<'_>) -> Result<()> {
    for _ in 0..row.count("the length of a list")? {
        row.expect("an item of a list")?;
    }
    Ok(())
}
