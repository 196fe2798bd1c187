//! Looking into JSON, with the path of what is looked at for errors.

use serde_json::{Map, Value};

use super::FORMAT;
use crate::error::{Error, Place, Result};

/// A value and where it stands: `meshes[0].primitives[1]`.
#[derive(Debug, Clone)]
pub(super) struct Json<'a> {
    pub(super) value: &'a Value,
    pub(super) path: String,
}

impl<'a> Json<'a> {
    /// The whole file.
    pub(super) fn root(value: &'a Value) -> Self {
        Self { value, path: String::new() }
    }

    /// An error here.
    pub(super) fn error(&self, message: impl AsRef<str>) -> Error {
        let at = if self.path.is_empty() { "the root" } else { &self.path };
        Error::format(FORMAT, Place::File, format!("{at}: {}", message.as_ref()))
    }

    /// A member of an object.
    pub(super) fn get(&self, key: &str) -> Option<Self> {
        let value = self.value.get(key)?;
        let dot = if self.path.is_empty() { "" } else { "." };
        Some(Self { value, path: format!("{}{dot}{key}", self.path) })
    }

    /// A member that must be there.
    pub(super) fn need(&self, key: &str) -> Result<Self> {
        self.get(key).ok_or_else(|| self.error(format!("lacks '{key}'")))
    }

    /// An element of the array called `key`, which must have it.
    pub(super) fn element(&self, key: &str, index: usize) -> Result<Self> {
        match self.value.get(key).and_then(|array| array.get(index)) {
            Some(value) => {
                let dot = if self.path.is_empty() { "" } else { "." };
                Ok(Self { value, path: format!("{}{dot}{key}[{index}]", self.path) })
            }
            None => Err(self.error(format!("has no {key}[{index}]"))),
        }
    }

    /// The elements of the array called `key`; none where it is not there.
    pub(super) fn elements(&self, key: &str) -> Result<Vec<Self>> {
        let Some(array) = self.get(key) else { return Ok(Vec::new()) };
        array.items()
    }

    /// The elements of this array.
    pub(super) fn items(&self) -> Result<Vec<Self>> {
        let Value::Array(values) = self.value else { return Err(self.error("expected an array")) };
        let item = |(index, value)| Self { value, path: format!("{}[{index}]", self.path) };
        Ok(values.iter().enumerate().map(item).collect())
    }

    /// The members of this object.
    pub(super) fn members(&self) -> Result<Vec<(&'a str, Self)>> {
        let Value::Object(map) = self.value else { return Err(self.error("expected an object")) };
        let member = |(key, value): (&'a String, &'a Value)| {
            (key.as_str(), Self { value, path: format!("{}.{key}", self.path) })
        };
        Ok(map.iter().map(member).collect())
    }

    /// This as a whole number.
    pub(super) fn whole(&self) -> Result<usize> {
        let whole = self.value.as_u64().or_else(|| {
            // Some writers give whole numbers a fraction of zero.
            let number = self.value.as_f64().filter(|number| number.fract() == 0.0 && (0.0..9e15).contains(number));
            number.map(|number| number as u64)
        });
        whole
            .and_then(|whole| usize::try_from(whole).ok())
            .ok_or_else(|| self.error(format!("found {}, expected a whole number", shown(self.value))))
    }

    /// The member `key` as a whole number, where it is there.
    pub(super) fn optional_whole(&self, key: &str) -> Result<Option<usize>> {
        self.get(key).map(|member| member.whole()).transpose()
    }

    /// The member `key` as `N` finite numbers, where it is there.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>> {
        let Some(member) = self.get(key) else { return Ok(None) };
        let numbers: Option<Vec<f64>> =
            member.value.as_array().map(|values| values.iter().filter_map(Value::as_f64).collect());
        let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        match numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite())) {
            Some(numbers) => Ok(Some(numbers)),
            None => Err(member.error(format!("expected {N} finite numbers"))),
        }
    }

    /// The member `key` as a text, where it is there.
    pub(super) fn text(&self, key: &str) -> Result<Option<&'a str>> {
        match self.value.get(key) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text)),
            Some(other) => Err(self.error(format!("'{key}' is {}, expected a text", shown(other)))),
        }
    }
}

/// A value as messages show it.
fn shown(value: &Value) -> String {
    match value {
        Value::Array(_) => "an array".into(),
        Value::Object(_) => "an object".into(),
        Value::String(text) => crate::formats::text::quote(text.as_bytes()),
        other => other.to_string(),
    }
}

/// The elements of the array `key`, to be changed; none where there is no such array.
pub(super) fn array_mut<'a>(object: &'a mut Value, key: &str) -> &'a mut [Value] {
    match object.get_mut(key) {
        Some(Value::Array(values)) => values,
        _ => &mut [],
    }
}

/// The object `value`, to be changed; anything else becomes an empty one first.
pub(super) fn object_mut(value: &mut Value) -> &mut Map<String, Value> {
    if !value.is_object() {
        *value = Value::Object(Map::new());
    }
    match value {
        Value::Object(map) => map,
        _ => unreachable!("it was made one"),
    }
}

/// The array `key` of an object, to be changed; made where there is none.
pub(super) fn list_mut<'a>(object: &'a mut Value, key: &str) -> &'a mut Vec<Value> {
    let entry = object_mut(object).entry(key).or_insert_with(|| Value::Array(Vec::new()));
    if !entry.is_array() {
        *entry = Value::Array(Vec::new());
    }
    match entry {
        Value::Array(values) => values,
        _ => unreachable!("it was made one"),
    }
}
