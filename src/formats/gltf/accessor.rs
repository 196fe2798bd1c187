//! The numbers of an accessor: typed, strided, sparse, none of them outside its buffer.

use std::cell::Cell;

use serde_json::Value;

use super::container::Buffer;
use super::json::Json;
use super::number::Number;
use crate::error::{Error, Result};

/// How many numbers a file may describe for each of its bytes. Accessors may share bytes or have none, so a small file can
/// describe a mesh that no memory holds.
const NUMBERS_A_BYTE: u64 = 64;
/// What any file may.
const NUMBERS_ALWAYS: u64 = 1 << 22;

/// What accessors read from.
pub(super) struct Store<'a> {
    pub(super) json: &'a Value,
    pub(super) buffers: Vec<Buffer<'a>>,
    /// Numbers that may still be read.
    left: Cell<u64>,
    bytes: u64,
}

/// An accessor whose bytes are all there.
#[derive(Debug)]
pub(super) struct Accessor<'a> {
    pub(super) json: Json<'a>,
    pub(super) count: usize,
    /// Numbers an element: rows of each column, and columns.
    rows: usize,
    columns: usize,
    pub(super) number: Number,
    pub(super) is_normalized: bool,
    /// None stand for zeros.
    bytes: Option<&'a [u8]>,
    stride: usize,
    sparse: Option<Sparse<'a>>,
}

/// The elements that differ from what the accessor's bytes say.
#[derive(Debug)]
struct Sparse<'a> {
    places: Vec<u32>,
    values: &'a [u8],
}

impl<'a> Store<'a> {
    pub(super) fn new(json: &'a Value, buffers: Vec<Buffer<'a>>, file_bytes: usize) -> Self {
        let held = |buffer: &Buffer<'_>| buffer.bytes.as_ref().map_or(0, |bytes| bytes.len() as u64);
        let bytes = file_bytes as u64 + buffers.iter().map(held).sum::<u64>();
        Self { json, buffers, left: Cell::new(NUMBERS_ALWAYS + NUMBERS_A_BYTE * bytes), bytes }
    }

    /// Takes `count` numbers from what the file may describe.
    pub(super) fn spend(&self, at: &Json<'_>, count: usize) -> Result<()> {
        match self.left.get().checked_sub(count as u64) {
            Some(left) => {
                self.left.set(left);
                Ok(())
            }
            None => Err(at.error(format!("describes far more numbers than {} bytes can mean", self.bytes))),
        }
    }

    /// The bytes of a view, and its stride where it has one.
    pub(super) fn view(&'a self, user: &Json<'_>, index: usize) -> Result<(&'a [u8], Option<usize>)> {
        let root = Json::root(self.json);
        let view =
            root.element("bufferViews", index).map_err(|_| user.error(format!("has no bufferViews[{index}]")))?;
        let buffer = view.need("buffer")?.whole()?;
        let (offset, length) = (view.optional_whole("byteOffset")?.unwrap_or(0), view.need("byteLength")?.whole()?);
        let Some(held) = self.buffers.get(buffer) else { return Err(view.error(format!("has no buffers[{buffer}]"))) };
        let Some(bytes) = &held.bytes else {
            let meshopt = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
            let extensions = view.get("extensions");
            let by = meshopt.iter().find(|name| extensions.as_ref().is_some_and(|all| all.get(name).is_some()));
            return Err(match by {
                Some(name) => super::unsupported(name),
                None => view.error(format!("buffers[{buffer}] has neither a URI nor a binary chunk")),
            });
        };
        let range = offset.checked_add(length).and_then(|end| bytes.get(offset..end));
        let stride = view.optional_whole("byteStride")?;
        match range {
            Some(_) if stride.is_some_and(|stride| !(4..=252).contains(&stride)) => {
                Err(view.error("the byteStride is not from 4 to 252"))
            }
            Some(range) => Ok((range, stride)),
            None => {
                let (end, held) = (offset.saturating_add(length), bytes.len());
                Err(view.error(format!("ends at byte {end} of buffers[{buffer}], which has {held}")))
            }
        }
    }

    /// The accessor that `user` holds the number of.
    pub(super) fn accessor(&'a self, user: &Json<'_>) -> Result<Accessor<'a>> {
        let index = user.whole()?;
        let json = Json::root(self.json).element("accessors", index);
        let json = json.map_err(|_| user.error(format!("has no accessors[{index}]")))?;
        let count = json.need("count")?.whole()?;
        let code = json.need("componentType")?;
        let number = Number::of(code.whole()?).ok_or_else(|| code.error("expected a type of number"))?;
        let (rows, columns) = match json.text("type")? {
            Some("SCALAR") => (1, 1),
            Some("VEC2") => (2, 1),
            Some("VEC3") => (3, 1),
            Some("VEC4") => (4, 1),
            Some("MAT2") => (2, 2),
            Some("MAT3") => (3, 3),
            Some("MAT4") => (4, 4),
            _ => return Err(json.error("'type' is none of SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3, MAT4")),
        };
        let is_normalized = json.value.get("normalized").and_then(Value::as_bool).unwrap_or(false);
        let mut accessor =
            Accessor { json, count, rows, columns, number, is_normalized, bytes: None, stride: 0, sparse: None };
        accessor.stride = accessor.size();
        if let Some(view) = accessor.json.get("bufferView") {
            let (bytes, stride) = self.view(&view, view.whole()?)?;
            let offset = accessor.json.optional_whole("byteOffset")?.unwrap_or(0);
            accessor.stride = stride.unwrap_or(accessor.stride).max(1);
            let needed = count.saturating_sub(1).saturating_mul(accessor.stride).saturating_add(accessor.size());
            let rest = bytes.get(offset.min(bytes.len())..).unwrap_or_default();
            if count > 0 && needed > rest.len() {
                let message = format!("{count} elements take {needed} bytes, the view has {}", rest.len());
                return Err(accessor.json.error(message));
            }
            accessor.bytes = Some(rest);
        }
        accessor.sparse = self.sparse(&accessor)?;
        Ok(accessor)
    }

    fn sparse(&'a self, accessor: &Accessor<'a>) -> Result<Option<Sparse<'a>>> {
        let Some(sparse) = accessor.json.get("sparse") else { return Ok(None) };
        let count = sparse.need("count")?.whole()?;
        let part = |key: &str| -> Result<(Json<'a>, &'a [u8])> {
            let part = sparse.need(key)?;
            let view = part.need("bufferView")?;
            let (bytes, _) = self.view(&view, view.whole()?)?;
            let offset = part.optional_whole("byteOffset")?.unwrap_or(0);
            Ok((part, bytes.get(offset.min(bytes.len())..).unwrap_or_default()))
        };
        let ((at, indices), (values_at, values)) = (part("indices")?, part("values")?);
        let number =
            Number::of(at.need("componentType")?.whole()?).filter(|number| number.decode_index(&[0; 4]).is_some());
        let Some(number) = number else { return Err(at.error("expected an unsigned type")) };
        for (at, bytes, size) in [(&at, indices, number.size()), (&values_at, values, accessor.size())] {
            if count.saturating_mul(size) > bytes.len() {
                return Err(at.error(format!("{count} elements of {size} bytes, the view has {}", bytes.len())));
            }
        }
        let places = indices.chunks_exact(number.size()).take(count).filter_map(|bytes| number.decode_index(bytes));
        let places: Vec<u32> = places.collect();
        match places.iter().find(|&&place| place as usize >= accessor.count) {
            Some(place) => Err(at.error(format!("has the place {place} of {} elements", accessor.count))),
            None => Ok(Some(Sparse { places, values })),
        }
    }

    /// All numbers of an accessor, an element after the other, fractions where integers stand for them.
    pub(super) fn numbers(&self, accessor: &Accessor<'_>) -> Result<Vec<f32>> {
        let width = accessor.width();
        self.spend(&accessor.json, accessor.count.saturating_mul(width))?;
        let mut numbers = vec![0.0; accessor.count * width];
        if let Some(bytes) = accessor.bytes {
            let rows = numbers.chunks_exact_mut(width).zip(accessor.elements(bytes));
            // Told apart once, not for each element.
            match (accessor.is_floats(), width) {
                (true, 1) => rows.for_each(|(row, bytes)| copy_floats::<1>(bytes, row)),
                (true, 2) => rows.for_each(|(row, bytes)| copy_floats::<2>(bytes, row)),
                (true, 3) => rows.for_each(|(row, bytes)| copy_floats::<3>(bytes, row)),
                (true, 4) => rows.for_each(|(row, bytes)| copy_floats::<4>(bytes, row)),
                _ => rows.for_each(|(row, bytes)| accessor.decode(bytes, row)),
            }
        }
        if let Some(sparse) = &accessor.sparse {
            for (&place, bytes) in sparse.places.iter().zip(sparse.values.chunks_exact(accessor.size())) {
                accessor.decode(bytes, &mut numbers[place as usize * width..][..width]);
            }
        }
        Ok(numbers)
    }

    /// All elements of an accessor of indices.
    pub(super) fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>> {
        let number = accessor.number;
        if accessor.width() != 1 || accessor.is_normalized || number.decode_index(&[0; 4]).is_none() {
            return Err(accessor.json.error("expected whole numbers, one an element, for indices"));
        }
        self.spend(&accessor.json, accessor.count)?;
        let mut indices = vec![0; accessor.count];
        if let Some(bytes) = accessor.bytes {
            let places = indices.iter_mut().zip(accessor.elements(bytes));
            match number {
                Number::U16 => places.for_each(|(index, bytes)| *index = Number::U16.decode_index(bytes).unwrap_or(0)),
                Number::U32 => places.for_each(|(index, bytes)| *index = Number::U32.decode_index(bytes).unwrap_or(0)),
                _ => places.for_each(|(index, bytes)| *index = number.decode_index(bytes).unwrap_or(0)),
            }
        }
        if let Some(sparse) = &accessor.sparse {
            for (&place, bytes) in sparse.places.iter().zip(sparse.values.chunks_exact(number.size())) {
                indices[place as usize] = number.decode_index(bytes).unwrap_or_default();
            }
        }
        Ok(indices)
    }
}

impl Accessor<'_> {
    /// Numbers an element.
    pub(super) fn width(&self) -> usize {
        self.rows * self.columns
    }

    /// Whether an element is a vector or a scalar.
    pub(super) fn is_vector(&self) -> bool {
        self.columns == 1
    }

    /// From each element's first byte to the end of the view.
    fn elements<'a>(&self, bytes: &'a [u8]) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let stride = self.stride;
        (0..self.count).map(move |element| &bytes[element * stride..])
    }

    /// Whether elements are scalars or vectors of floats as they stand, as nearly all are.
    fn is_floats(&self) -> bool {
        self.is_vector() && self.number == Number::F32 && !self.is_normalized
    }

    /// Bytes from a column to the next: they start at multiples of 4.
    fn column_bytes(&self) -> usize {
        let bytes = self.rows * self.number.size();
        if self.is_vector() { bytes } else { bytes.next_multiple_of(4) }
    }

    /// Bytes of an element; the last column needs no padding.
    fn size(&self) -> usize {
        (self.columns - 1) * self.column_bytes() + self.rows * self.number.size()
    }

    fn decode(&self, bytes: &[u8], row: &mut [f32]) {
        let size = self.number.size();
        for (column, numbers) in row.chunks_exact_mut(self.rows).enumerate() {
            let bytes = bytes[column * self.column_bytes()..].chunks_exact(size);
            for (number, bytes) in numbers.iter_mut().zip(bytes) {
                *number = self.number.decode(bytes);
                if self.is_normalized {
                    *number = (*number / self.number.greatest()).max(-1.0);
                }
            }
        }
    }

    /// Refuses elements of another width.
    pub(super) fn expect_width(&self, widths: &[usize], what: &str) -> Result<()> {
        if self.is_vector() && widths.contains(&self.width()) {
            return Ok(());
        }
        let listed: Vec<String> = widths.iter().map(ToString::to_string).collect();
        let message = format!("{what} of {} numbers, expected {}", self.width(), listed.join(" or "));
        Err::<(), Error>(self.json.error(message))
    }
}

/// Copies the numbers at the start of `bytes`.
fn copy_floats<const WIDTH: usize>(bytes: &[u8], row: &mut [f32]) {
    let numbers = bytes.as_chunks::<4>().0.first_chunk::<WIDTH>();
    let numbers = numbers.map_or([0.0; WIDTH], |numbers| numbers.map(f32::from_le_bytes));
    row.copy_from_slice(&numbers);
}
