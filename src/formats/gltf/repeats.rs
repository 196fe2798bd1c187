//! The instances that a node tells by numbers of accessors, and not by nodes of their own: `EXT_mesh_gpu_instancing`.

use super::accessor::Store;
use super::json::Json;
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DQuat, DVec3};

/// The extension that tells them.
pub(super) const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// Numbers that an instance takes in memory, about.
const OF_INSTANCE: usize = 64;

/// The transforms of a node's instances to its space; `None` where it tells none, and is the only one.
///
/// # Errors
/// [`crate::Error::Format`] for accessors that are wrong, of different lengths, or of far more instances than the file can mean.
pub(super) fn repeats(store: &Store<'_>, node: &Json<'_>) -> Result<Option<Vec<DAffine3>>> {
    let Some(told) = node.get("extensions").and_then(|extensions| extensions.get(INSTANCING)) else { return Ok(None) };
    let attributes = told.need("attributes")?;
    let mut count = None;
    for (_, number) in attributes.members()? {
        let own = store.accessor(&number)?.count;
        if *count.get_or_insert(own) != own {
            return Err(number.error(format!("has {own} elements, another attribute {}", count.unwrap_or_default())));
        }
    }
    let count = count.unwrap_or_default();
    // Each has the name of the node.
    store.spend(&told, count.saturating_mul(OF_INSTANCE + node.text("name")?.map_or(0, str::len)))?;
    let read = |key: &str, width: usize| {
        let of = |number: Json<'_>| {
            let accessor = store.accessor(&number)?;
            accessor.expect_width(&[width], key)?;
            store.numbers(&accessor)
        };
        attributes.get(key).map(of).transpose()
    };
    let (shifts, turns, sizes) = (read("TRANSLATION", 3)?, read("ROTATION", 4)?, read("SCALE", 3)?);
    let row = |rows: &Option<Vec<f32>>, at: usize, width: usize| {
        rows.as_ref()
            .map(|rows| rows[at * width..][..width].iter().map(|&number| f64::from(number)).collect::<Vec<_>>())
    };
    let transform = |at: usize| {
        let shift = row(&shifts, at, 3).map_or(DVec3::ZERO, |row| DVec3::from_slice(&row));
        let size = row(&sizes, at, 3).map_or(DVec3::ONE, |row| DVec3::from_slice(&row));
        let turn = row(&turns, at, 4).map(|row| DQuat::from_slice(&row)).filter(|turn| turn.length_squared() > 0.0);
        let turn = turn.map_or(DMat3::IDENTITY, |turn| DMat3::from_quat(turn.normalize()));
        DAffine3 { matrix3: turn * DMat3::from_diagonal(size), translation: shift }
    };
    Ok(Some((0..count).map(transform).collect()))
}
