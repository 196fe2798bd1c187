//! A file as it is put together: JSON, and the bytes of its only buffer.

use serde_json::{Map, Value, json};

use super::json::{list_mut, object_mut};
use super::number::Number;
use super::part::Attribute;

/// What bytes of vertices and of indices are for.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A file as it grows.
pub(super) struct File {
    pub(super) json: Value,
    pub(super) binary: Vec<u8>,
    pub(super) warnings: Vec<String>,
    /// Whether a position is too large for its `f32`.
    pub(super) overflows: bool,
}

impl File {
    /// An accessor of `f32`.
    pub(super) fn floats(
        &mut self,
        numbers: &[f32],
        width: usize,
        shape: &str,
        is_position: bool,
        said: &Map<String, Value>,
    ) -> usize {
        let packed: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let accessor = self.elements(&packed, 4 * width, (Number::F32, false), shape, said);
        if is_position {
            self.overflows |= numbers.iter().any(|number| !number.is_finite());
            self.bound(accessor, numbers, width);
        }
        accessor
    }

    /// Says the least and the greatest of each column.
    fn bound(&mut self, accessor: usize, numbers: &[f32], width: usize) {
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f64> {
            let column = |at| numbers.iter().skip(at).step_by(width).copied().reduce(pick).unwrap_or_default();
            (0..width).map(|at| f64::from(column(at))).collect()
        };
        let (least, greatest) = (bound(f32::min), bound(f32::max));
        let accessor = &mut list_mut(&mut self.json, "accessors")[accessor];
        accessor["min"] = json!(least);
        accessor["max"] = json!(greatest);
    }

    /// An accessor without bytes: zeros.
    pub(super) fn zeros(&mut self, count: usize, attribute: &Attribute) -> usize {
        let Attribute { shape, said, width, .. } = attribute;
        let number = self.accessor(said.clone(), None, Number::F32, count, shape);
        if attribute.semantic == "POSITION" {
            self.bound(number, &[], *width);
        }
        number
    }

    /// An accessor of elements of `size` bytes, each at a multiple of 4.
    pub(super) fn elements(
        &mut self,
        packed: &[u8],
        size: usize,
        (number, is_normalized): (Number, bool),
        shape: &str,
        said: &Map<String, Value>,
    ) -> usize {
        let start = self.align();
        let padded = size.next_multiple_of(4);
        for element in packed.chunks_exact(size) {
            self.binary.extend_from_slice(element);
            self.binary.resize(self.binary.len() + padded - size, 0);
        }
        let view = self.view(start, ARRAY_BUFFER, (padded != size).then_some(padded));
        let accessor = self.accessor(said.clone(), Some(view), number, packed.len() / size, shape);
        if is_normalized {
            list_mut(&mut self.json, "accessors")[accessor]["normalized"] = true.into();
        }
        accessor
    }

    /// An accessor of indices below `count`, as small as they fit.
    pub(super) fn indices(&mut self, indices: &[u32], count: usize, said: &Map<String, Value>) -> usize {
        let start = self.align();
        // The greatest number of a type restarts strips.
        let number = if count < usize::from(u16::MAX) { Number::U16 } else { Number::U32 };
        match number {
            Number::U16 => indices.iter().for_each(|&i| self.binary.extend_from_slice(&(i as u16).to_le_bytes())),
            _ => self.binary.extend_from_slice(&indices.iter().flat_map(|i| i.to_le_bytes()).collect::<Vec<_>>()),
        }
        let view = self.view(start, ELEMENT_ARRAY_BUFFER, None);
        self.accessor(said.clone(), Some(view), number, indices.len(), "SCALAR")
    }

    /// Fills up to a multiple of 4 bytes; where that is.
    fn align(&mut self) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.binary.len()
    }

    /// A view of the bytes from `start` on.
    fn view(&mut self, start: usize, target: u32, stride: Option<usize>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": start, "byteLength": self.binary.len() - start });
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        view["target"] = target.into();
        let views = list_mut(&mut self.json, "bufferViews");
        views.push(view);
        views.len() - 1
    }

    fn accessor(
        &mut self,
        mut said: Map<String, Value>,
        view: Option<usize>,
        number: Number,
        count: usize,
        shape: &str,
    ) -> usize {
        if let Some(view) = view {
            said.insert("bufferView".into(), view.into());
        }
        said.insert("componentType".into(), number.code().into());
        said.insert("count".into(), count.into());
        said.insert("type".into(), shape.into());
        let accessors = list_mut(&mut self.json, "accessors");
        accessors.push(Value::Object(said));
        accessors.len() - 1
    }

    /// The length of the buffer; no empty lists, which glTF does not allow.
    pub(super) fn finish(&mut self) {
        self.align();
        let length = self.binary.len();
        let buffers = list_mut(&mut self.json, "buffers");
        match (length, buffers.first_mut()) {
            (0, _) => buffers.clear(),
            (_, Some(buffer)) => buffer["byteLength"] = length.into(),
            (_, None) => buffers.push(json!({ "byteLength": length })),
        }
        for key in ["buffers", "bufferViews", "accessors", "meshes"] {
            if list_mut(&mut self.json, key).is_empty() {
                object_mut(&mut self.json).remove(key);
            }
        }
    }
}
