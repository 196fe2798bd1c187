//! Rows as text, one a line.

use super::FORMAT;
use super::header::{Element, Header, Kind, Role};
use super::vertex::VertexLayout;
use crate::error::Result;
use crate::formats::polygon::Triangulator;
use crate::formats::text::{Lines, Row, Rows};
use crate::mesh::Mesh;

/// Reads the rows after the header.
pub(super) fn read(header: &Header, bytes: &[u8]) -> Result<Mesh> {
    let mut rows = Rows::new(FORMAT, Lines::after(header.lines, &bytes[header.body_start..]), None);
    let mut mesh = Mesh::default();
    for element in &header.elements {
        match &element.role {
            Role::Vertex(layout) => mesh = read_vertices(&mut rows, element, layout)?,
            Role::Face(list) => read_faces(&mut rows, element, *list, &mut mesh)?,
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
    Ok(mesh)
}

fn read_vertices(rows: &mut Rows<'_>, element: &Element, layout: &VertexLayout) -> Result<Mesh> {
    let mut mesh = layout.empty_mesh();
    mesh.positions.reserve(element.count as usize);
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
        layout.push(&mut mesh, |place| values[place]);
    }
    Ok(mesh)
}

fn read_faces(rows: &mut Rows<'_>, element: &Element, list: usize, mesh: &mut Mesh) -> Result<()> {
    let mut triangulator = Triangulator::new();
    let mut corners = Vec::new();
    mesh.faces.reserve(element.count as usize);
    for at in 0..element.count {
        let mut row = rows.expect("faces", at, element.count)?;
        for property in &element.properties[..list] {
            match property.kind {
                Kind::Scalar(_) => drop(row.expect(&property.name)?),
                Kind::List { .. } => skip_list(&mut row)?,
            }
        }
        let corner_count = row.count("the number of corners")?;
        if corner_count < 3 {
            return Err(row.error(format!("found a face of {corner_count} corners, expected at least 3")));
        }
        corners.clear();
        for _ in 0..corner_count {
            corners.push(row.index(mesh.positions.len())?);
        }
        triangulator.append(&corners, &mesh.positions, &mut mesh.faces);
    }
    Ok(())
}

fn skip_list(row: &mut Row<'_>) -> Result<()> {
    for _ in 0..row.count("the length of a list")? {
        row.expect("an item of a list")?;
    }
    Ok(())
}
