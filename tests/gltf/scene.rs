//! Small glTF files, made by hand.

use coarsen::formats::{self, Document, Format, Scene, WriteOptions};
use coarsen::{Error, Mesh};
use serde_json::{Value, json};

/// A file that grows by accessors.
pub struct Builder {
    pub json: Value,
    pub binary: Vec<u8>,
}

pub const I8: u32 = 5120;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

impl Builder {
    pub fn new() -> Self {
        let json =
            json!({ "asset": { "version": "2.0" }, "accessors": [], "bufferViews": [], "meshes": [], "nodes": [] });
        Self { json, binary: Vec::new() }
    }

    /// A view of these bytes.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        self.binary.extend_from_slice(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    /// An accessor of these bytes.
    pub fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, shape: &str) -> usize {
        let view = self.view(bytes);
        let accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": shape });
        push(&mut self.json["accessors"], accessor)
    }

    /// An accessor of rows of `f32`.
    pub fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let shape = ["", "SCALAR", "VEC2", "VEC3", "VEC4"].get(N).copied().unwrap_or("MAT4");
        self.accessor(&bytes, F32, rows.len(), shape)
    }

    pub fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.accessor(&bytes, U16, indices.len(), "SCALAR")
    }

    /// A mesh of these primitives.
    pub fn mesh(&mut self, primitives: Value) -> usize {
        push(&mut self.json["meshes"], json!({ "primitives": primitives }))
    }

    pub fn node(&mut self, node: Value) -> usize {
        push(&mut self.json["nodes"], node)
    }

    /// The bytes of a GLB.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.binary.is_empty() {
            json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        }
        glb(&json, &self.binary)
    }

    pub fn scene(&self) -> Scene {
        formats::read_scene_bytes(&self.glb(), Format::Glb, None)
            .unwrap_or_else(|error| panic!("{error}: {}", self.json))
    }

    pub fn mesh_read(&self) -> Mesh {
        self.scene().mesh
    }

    pub fn error(&self) -> Error {
        formats::read_scene_bytes(&self.glb(), Format::Glb, None).map(|_| self.json.to_string()).expect_err("an error")
    }
}

/// A square of two triangles as a primitive with positions only: `0 1 2` and `0 2 3`.
pub fn square() -> Builder {
    let mut builder = Builder::new();
    let positions = builder.floats(&SQUARE);
    let indices = builder.indices(&[0, 1, 2, 0, 2, 3]);
    builder.mesh(json!([{ "attributes": { "POSITION": positions }, "indices": indices }]));
    builder.node(json!({ "mesh": 0 }));
    builder
}

pub const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// The number of what is put at the end of an array.
pub fn push(array: &mut Value, value: Value) -> usize {
    let array = array.as_array_mut().expect("an array");
    array.push(value);
    array.len() - 1
}

pub fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + text.len() + if binary.is_empty() { 0 } else { 8 + binary.len() };
    let mut bytes = b"glTF".to_vec();
    let mut words = |words: &[u32], part: &[u8]| {
        words.iter().for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()));
        bytes.extend_from_slice(part);
    };
    words(&[2, total as u32], &[]);
    words(&[text.len() as u32, 0x4E4F_534A], &text);
    if !binary.is_empty() {
        words(&[binary.len() as u32, 0x004E_4942], &binary);
    }
    bytes
}

/// The JSON and the binary chunk of a GLB.
pub fn parts(glb: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().expect("four bytes")) as usize;
    assert_eq!((&glb[..4], word(8)), (&b"glTF"[..], glb.len()));
    let end = 20 + word(12);
    let json = serde_json::from_slice(&glb[20..end]).expect("JSON");
    (json, glb.get(end + 8..).unwrap_or_default().to_vec())
}

/// What is written of a scene: its JSON, its bytes, what is lost.
pub fn written(mesh: &Mesh, document: &Document) -> (Value, Vec<u8>, Vec<String>) {
    let mut bytes = Vec::new();
    let warnings = formats::write_scene_to(mesh, document, Format::Glb, &WriteOptions::default(), &mut bytes);
    let (json, binary) = parts(&bytes);
    (json, binary, warnings.expect("written"))
}

/// The mesh after it was written and read again.
pub fn again(mesh: &Mesh, document: &Document) -> Mesh {
    let mut bytes = Vec::new();
    formats::write_scene_to(mesh, document, Format::Glb, &WriteOptions::default(), &mut bytes).expect("written");
    formats::read_scene_bytes(&bytes, Format::Glb, None).expect("a mesh").mesh
}

/// The bytes of a view.
pub fn view<'a>(json: &Value, binary: &'a [u8], view: &Value) -> &'a [u8] {
    let view = &json["bufferViews"][view.as_u64().expect("a number") as usize];
    let [offset, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap_or(0) as usize);
    &binary[offset..offset + length]
}
