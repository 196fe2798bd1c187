//! One property of the vertices, whatever it is called.

use super::FORMAT;
use super::ascii::skip_list;
use super::binary::{Cursor, skip};
use super::header::{Body, Element, Header, Kind, Role};
use super::scalar::Order;
use crate::error::{Error, Result};
use crate::formats::text::{Lines, Rows};

/// The numbers of the property `name` at the vertices.
pub(in crate::formats) fn read_property(bytes: &[u8], name: &str) -> Result<Vec<f64>> {
    let header = Header::parse(bytes)?;
    match header.body {
        Body::Text => of_text(&header, bytes, name),
        Body::Binary(order) => of_bytes(&header, order, bytes, name),
    }
}

/// Where the property stands among those of the vertices.
fn place(element: &Element, name: &str) -> Result<usize> {
    let is_number = |kind: Kind| matches!(kind, Kind::Scalar(_));
    let found = element.properties.iter().position(|property| property.name == name && is_number(property.kind));
    found.ok_or_else(|| {
        let numbers = element.properties.iter().filter(|property| is_number(property.kind));
        let names: Vec<&str> = numbers.map(|property| property.name.as_str()).collect();
        Error::Parameter(format!("the vertices have no number '{name}', they have: {}", names.join(", ")))
    })
}

fn of_text(header: &Header, bytes: &[u8], name: &str) -> Result<Vec<f64>> {
    let mut rows = Rows::new(FORMAT, Lines::after(header.lines, &bytes[header.body_start..]), None);
    let mut values = Vec::new();
    for element in &header.elements {
        if !matches!(element.role, Role::Vertex(_)) {
            // Rows without values are blank lines, which are skipped anyway.
            for at in 0..if element.properties.is_empty() { 0 } else { element.count } {
                rows.expect(&element.name, at, element.count)?;
            }
            continue;
        }
        let place = place(element, name)?;
        for at in 0..element.count {
            let mut row = rows.expect("vertices", at, element.count)?;
            for property in &element.properties[..place] {
                match property.kind {
                    Kind::Scalar(_) => drop(row.expect(&property.name)?),
                    Kind::List { .. } => skip_list(&mut row)?,
                }
            }
            values.push(row.number(name)?);
        }
        break;
    }
    Ok(values)
}

fn of_bytes(header: &Header, order: Order, bytes: &[u8], name: &str) -> Result<Vec<f64>> {
    let mut cursor = Cursor::new(bytes, header.body_start, order);
    let mut values = Vec::new();
    for element in &header.elements {
        if !matches!(element.role, Role::Vertex(_)) {
            skip(&mut cursor, element)?;
            continue;
        }
        let place = place(element, name)?;
        for _ in 0..element.count {
            for (at, property) in element.properties.iter().enumerate() {
                match property.kind {
                    Kind::Scalar(scalar) if at == place => values.push(cursor.scalar(scalar)?),
                    kind => cursor.skip(kind)?,
                }
            }
        }
        break;
    }
    Ok(values)
}
