//! The instances that a node tells by numbers of accessors, and not by nodes of their own: `EXT_mesh_gpu_instancing`.

use super::accessor::Store;
use super::json::Json;
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DQuat, DVec3};

/// The extension that tells them.
const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// Numbers that an instance takes in memory, about.
const OF_INSTANCE: usize = 32;

/// The transforms of a node's instances to its space; `None` where it tells of none, and shows its mesh once.
///
/// # Errors
/// [`crate::Error::Format`] for accessors that are wrong or not finite, of different lengths, or of far more instances than the file can
/// mean.
pub(super) fn instance_transforms(store: &Store<'_>, node: &Json<'_>) -> Result<Option<Vec<DAffine3>>> {
    let Some(extension) = node.get("extensions").and_then(|extensions| extensions.get(INSTANCING)) else {
        return Ok(None);
    };
    let attributes = extension.need("attributes")?;
    let mut count = None;
    for (_, number) in attributes.members()? {
        let own = store.accessor(&number)?.count;
        let first = *count.get_or_insert(own);
        if own != first {
            return Err(number.error(format!("has {own} elements, expected {first}, as the first attribute has")));
        }
    }
    let Some(count) = count else { return Ok(None) };
    // Each has the name of the node.
    store.spend(&extension, count.saturating_mul(OF_INSTANCE + node.text("name")?.map_or(0, str::len)))?;
    let shifts = rows::<3>(store, &attributes, "TRANSLATION")?;
    let turns = rows::<4>(store, &attributes, "ROTATION")?;
    let sizes = rows::<3>(store, &attributes, "SCALE")?;
    let transform = |at: usize| {
        let translation = shifts.as_ref().map_or(DVec3::ZERO, |rows| DVec3::from_array(rows[at]));
        let size = sizes.as_ref().map_or(DVec3::ONE, |rows| DVec3::from_array(rows[at]));
        let turn = turns.as_ref().map(|rows| DQuat::from_array(rows[at])).filter(|turn| turn.length_squared() > 0.0);
        let turn = turn.map_or(DMat3::IDENTITY, |turn| DMat3::from_quat(turn.normalize()));
        DAffine3 { matrix3: turn * DMat3::from_diagonal(size), translation }
    };
    Ok(Some((0..count).map(transform).collect()))
}

/// The rows of an attribute; `None` without it.
fn rows<const N: usize>(store: &Store<'_>, attributes: &Json<'_>, key: &str) -> Result<Option<Vec<[f64; N]>>> {
    let Some(number) = attributes.get(key) else { return Ok(None) };
    let accessor = store.accessor(&number)?;
    accessor.expect_width(&[N], key)?;
    let numbers = store.numbers(&accessor)?;
    match numbers.iter().position(|number| !number.is_finite()) {
        Some(at) => Err(accessor.json.error(format!("element {} is not finite", at / N))),
        None => Ok(Some(numbers.as_chunks().0.iter().map(|row: &[f32; N]| row.map(f64::from)).collect())),
    }
}
