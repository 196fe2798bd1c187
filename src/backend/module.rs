//! The text of a kernel's shader module, composed from the shared sources, generated declarations and its own source.

use std::fmt::Write;

use super::buffer::Member;
use super::gpu_buffer::stride;
use super::gpu_texels::{LINE_SHIFT, TEXEL_BYTES, format};
use super::{Access, Binding, Constant, Kernel, Switch};

/// The sources that every module begins with, of `shaders/shared/*.wgsl`.
const SHARED: &[&str] =
    &[include_str!("../../shaders/shared/exact.wgsl"), include_str!("../../shaders/shared/rows.wgsl")];

/// How a module keeps its arithmetic exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Exactness {
    /// Against fusing, reordering and inexact division, for any device.
    Guarded,
    /// Not at all, for a device that rounds every operation correctly and in order.
    Plain,
}

impl Exactness {
    fn source(self) -> &'static str {
        match self {
            Self::Guarded => include_str!("../../shaders/shared/arithmetic_guarded.wgsl"),
            Self::Plain => include_str!("../../shaders/shared/arithmetic_plain.wgsl"),
        }
    }
}

/// What the rows of buffers that are structs are loaded and stored by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Packing {
    /// 32-bit words, in vectors of up to four.
    Words,
    /// Pairs of them in 64 bits, in vectors of up to two: for software, which loads every element of every lane by itself.
    Pairs,
}

/// How modules suit a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Dialect {
    /// Its arithmetic.
    pub exactness: Exactness,
    /// Its loads and stores.
    pub packing: Packing,
}

/// What the entry of a kernel does when its source has none: finds its index in the tight two-dimensional grid.
const ENTRY: &str = "
@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = (group.y * groups.x + group.x) * WORKGROUP + lane;
    if i < params.invocations {
        run(i);
    }
}
";

/// The fields that follow a kernel's own in its uniform block: how many invocations do the work, and a zero that no
/// compiler knows.
const HIDDEN: [(&str, &str); 2] = [("invocations", "u32"), ("zero", "u32")];

/// The bytes of a uniform block whose own fields are `own`.
pub(super) fn uniform_block(own: &[u8], invocations: u32) -> Vec<u8> {
    [own, &invocations.to_le_bytes(), &0u32.to_le_bytes()].concat()
}

/// Declares a uniform block: a `repr(C)` struct of `u32` and `f32` with its `FIELDS` for [`Kernel::PARAMS`].
macro_rules! params {
    ($(#[$attribute:meta])* $visibility:vis struct $name:ident {
        $($(#[$field_attribute:meta])* $field_visibility:vis $field:ident: $scalar:ident),+ $(,)?
    }) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(C)]
        $visibility struct $name {
            $($(#[$field_attribute])* $field_visibility $field: $scalar),+
        }

        impl $name {
            /// The fields' names and types.
            pub const FIELDS: &'static [(&'static str, &'static str)] =
                &[$((stringify!($field), stringify!($scalar))),+];
        }
    };
}
pub(crate) use params;

/// How a buffer is cut into bindings: all hold `1 << shift` rows, the last one up to that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PageShape {
    /// Bindings.
    pub count: u32,
    /// Binary logarithm of the rows in each.
    pub shift: u32,
    /// Whether rows are texels of textures, as [`Binding::may_be_texels`] allows.
    pub are_texels: bool,
}

/// All of a kernel that its module and its pipeline depend on.
#[derive(Debug, Clone)]
pub struct Signature<'a> {
    /// [`Kernel::NAME`].
    pub name: &'static str,
    /// [`Kernel::PARAMS`].
    pub params: &'static [(&'static str, &'static str)],
    /// [`Kernel::bindings`].
    pub bindings: Vec<Binding<'a>>,
    /// [`Kernel::CONSTANTS`].
    pub constants: &'static [(&'static str, Constant)],
    /// [`Kernel::switches`].
    pub switches: Vec<Switch>,
    /// [`Kernel::SHARED`].
    pub shared: &'static [&'static str],
    /// [`Kernel::SOURCE`].
    pub source: &'static str,
    /// [`Kernel::WORKGROUP`].
    pub workgroup: u32,
}

impl<'a> Signature<'a> {
    /// The signature of `kernel`.
    pub fn of<K: Kernel>(kernel: &'a K) -> Self {
        Self {
            name: K::NAME,
            params: K::PARAMS,
            bindings: kernel.bindings(),
            constants: K::CONSTANTS,
            switches: kernel.switches(),
            shared: K::SHARED,
            source: K::SOURCE,
            workgroup: K::WORKGROUP,
        }
    }

    /// Bytes of the uniform block, the hidden fields included.
    pub fn uniform_bytes(&self) -> usize {
        (self.params.len() + HIDDEN.len()) * 4
    }

    /// The module's text, with one of `pages` for each binding.
    pub fn compose(&self, pages: &[PageShape], dialect: Dialect) -> String {
        let mut text = SHARED.concat();
        text.push_str(dialect.exactness.source());
        write_declarations(&mut text, self, pages, dialect.packing);
        for source in self.shared {
            text.push_str(source);
        }
        text.push_str(self.source);
        if !self.source.contains("@compute") {
            text.push_str(ENTRY);
        }
        text
    }
}

fn write_declarations(text: &mut String, signature: &Signature<'_>, pages: &[PageShape], packing: Packing) {
    let mut lines = vec![format!("const WORKGROUP: u32 = {}u;", signature.workgroup)];
    lines.extend(signature.constants.iter().map(|(name, constant)| match constant {
        Constant::U32(value) => format!("const {name}: u32 = {value}u;"),
        // Rust prints the fewest digits that read back as the same number, here as in WGSL.
        Constant::F32(value) => format!("const {name}: f32 = {value:?}f;"),
    }));
    lines.extend(signature.switches.iter().map(|(name, value)| format!("const {name}: bool = {value};")));
    lines.push("struct Params {".into());
    lines.extend(signature.params.iter().chain(&HIDDEN).map(|(name, scalar)| format!("    {name}: {scalar},")));
    lines.extend(["}".into(), "@group(0) @binding(0) var<uniform> params: Params;".into()]);
    if pages.iter().any(|shape| shape.are_texels) {
        let mask = (1 << LINE_SHIFT) - 1;
        lines.push(format!("fn texel_at(i: u32) -> vec2u {{ return vec2u(i & {mask}u, i >> {LINE_SHIFT}u); }}"));
    }
    let mut slot = 1;
    for (binding, &shape) in signature.bindings.iter().zip(pages) {
        let Binding { name, row, access, .. } = binding;
        let (space, ty) = match access {
            Access::Read if shape.are_texels => ("", texture(binding, "read")),
            Access::Write if shape.are_texels => ("", texture(binding, "read_write")),
            Access::Read => ("<storage, read>", format!("array<{}>", element(binding, packing))),
            Access::Write => ("<storage, read_write>", format!("array<{}>", element(binding, packing))),
            Access::Add => ("<storage, read_write>", format!("array<atomic<{row}>>")),
        };
        for page in 0..shape.count {
            lines.push(format!("@group(0) @binding({slot}) var{space} {name}_page{page}: {ty};"));
            slot += 1;
        }
        lines.extend(accessors(binding, shape, packing));
    }
    for line in lines {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{line}");
    }
}

fn accessors(binding: &Binding<'_>, shape: PageShape, packing: Packing) -> Vec<String> {
    let Binding { name, row, .. } = binding;
    let load = || {
        let body = in_page(name, shape, |page, index| match shape.are_texels {
            true => unpacked(binding, &fetched(binding, page, index), Packing::Words),
            false => unpacked(binding, &format!("{page}[{index}]"), packing),
        });
        format!("fn load_{name}(i: u32) -> {row} {{ {body} }}")
    };
    let store = || {
        let body = in_page(name, shape, |page, index| match shape.are_texels {
            true => stored(binding, page, index),
            false => format!("{page}[{index}] = {};", packed(binding, packing)),
        });
        format!("fn store_{name}(i: u32, row: {row}) {{ {body} }}")
    };
    let add = || {
        let body = in_page(name, shape, |page, index| format!("atomicAdd(&{page}[{index}], n);"));
        format!("fn add_{name}(i: u32, n: u32) {{ {body} }}")
    };
    match binding.access {
        Access::Read => vec![load()],
        Access::Write => vec![load(), store()],
        Access::Add => vec![add()],
    }
}

/// The names of a vector's elements.
const ELEMENTS: [&str; 4] = ["x", "y", "z", "w"];

/// The type of an element of a page: a row that is a struct is packed in vectors.
fn element(binding: &Binding<'_>, packing: Packing) -> String {
    let words = stride(binding.stride) / 4;
    match (packing, binding.members.len(), words) {
        (_, 0, _) => binding.row.into(),
        (_, _, 1) => "u32".into(),
        (Packing::Words, _, 2 | 4) => format!("vec{words}u"),
        (Packing::Words, ..) => format!("array<vec4u, {}>", words / 4),
        (Packing::Pairs, _, 2) => "u64".into(),
        (Packing::Pairs, _, 4) => "vec2<u64>".into(),
        (Packing::Pairs, ..) => format!("array<vec2<u64>, {}>", words / 4),
    }
}

/// The type of a page of texels.
fn texture(binding: &Binding<'_>, access: &str) -> String {
    let (_, format) = format(stride(binding.stride));
    format!("texture_storage_2d<{format}, {access}>")
}

/// Where the texels of the row at an index are, for each of its vectors of four words.
fn texel_places(binding: &Binding<'_>, index: &str) -> Vec<String> {
    match stride(binding.stride).div_ceil(TEXEL_BYTES) {
        1 => vec![format!("texel_at({index})")],
        count => (0..count).map(|i| format!("texel_at({count}u * ({index}) + {i}u)")).collect(),
    }
}

/// The element that a page of texels has at an index, in words.
fn fetched(binding: &Binding<'_>, page: &str, index: &str) -> String {
    let loads: Vec<_> =
        texel_places(binding, index).iter().map(|texel| format!("textureLoad({page}, {texel})")).collect();
    let words = match (loads.as_slice(), stride(binding.stride)) {
        ([load], 4) => format!("{load}.x"),
        ([load], 8) => format!("{load}.xy"),
        ([load], _) => load.clone(),
        (loads, _) => format!("array({})", loads.join(", ")),
    };
    // WGSL's own types of floats, which stand in no struct.
    match binding.row {
        "f32" | "vec2f" | "vec4f" => format!("bitcast<{}>({words})", binding.row),
        _ => words,
    }
}

/// Stores `row`, of more than two words, in a page of texels.
fn stored(binding: &Binding<'_>, page: &str, index: &str) -> String {
    let words = match binding.row {
        "vec4f" => "bitcast<vec4u>(row)".into(),
        _ => packed(binding, Packing::Words),
    };
    let store = |texel: &str, vector: &str| format!("textureStore({page}, {texel}, {vector});");
    match texel_places(binding, index).as_slice() {
        [texel] => store(texel, &words),
        texels => {
            let each = texels.iter().enumerate().map(|(i, texel)| store(texel, &format!("packed[{i}]")));
            format!("let packed = {words}; {}", each.collect::<Vec<_>>().join(" "))
        }
    }
}

/// Returns the row that is in an element.
fn unpacked(binding: &Binding<'_>, element: &str, packing: Packing) -> String {
    let words = stride(binding.stride) as usize / 4;
    if binding.members.is_empty() {
        return format!("return {element};");
    }
    let vector = |i: usize| if words > 4 { format!("packed[{}]", i / 4) } else { "packed".into() };
    let word = |i: usize| match packing {
        _ if words == 1 => "packed".into(),
        Packing::Words => format!("{}.{}", vector(i), ELEMENTS[i % 4]),
        Packing::Pairs => {
            let pair = if words == 2 { "packed".into() } else { format!("{}.{}", vector(i), ELEMENTS[i % 4 / 2]) };
            if i.is_multiple_of(2) { format!("u32({pair})") } else { format!("u32({pair} >> 32u)") }
        }
    };
    let members = binding.members.iter().enumerate().map(|(i, member)| match member.scalar {
        "f32" => format!("bitcast<f32>({})", word(i)),
        _ => word(i),
    });
    format!("let packed = {element}; return {}({});", binding.row, members.collect::<Vec<_>>().join(", "))
}

/// `row` as an element holds it.
fn packed(binding: &Binding<'_>, packing: Packing) -> String {
    if binding.members.is_empty() {
        return "row".into();
    }
    let mut words: Vec<String> = binding
        .members
        .iter()
        .map(|Member { name, scalar, .. }| match *scalar {
            "f32" => format!("bitcast<u32>(row.{name})"),
            _ => format!("row.{name}"),
        })
        .collect();
    words.resize(stride(binding.stride) as usize / 4, "0u".into());
    if words.len() == 1 {
        return words.remove(0);
    }
    let vector = |words: &[String]| match packing {
        Packing::Words => format!("vec{}u({})", words.len(), words.join(", ")),
        Packing::Pairs => {
            let pair = |pair: &[String]| format!("(u64({}) | (u64({}) << 32u))", pair[0], pair[1]);
            let pairs: Vec<String> = words.chunks_exact(2).map(pair).collect();
            if pairs.len() == 1 { pairs.concat() } else { format!("vec2<u64>({})", pairs.join(", ")) }
        }
    };
    let mut vectors: Vec<String> = words.chunks(4).map(vector).collect();
    if vectors.len() == 1 { vectors.remove(0) } else { format!("array({})", vectors.join(", ")) }
}

/// `statement` on row `i`, with the page where it is and its index there.
fn in_page(name: &str, shape: PageShape, statement: impl Fn(&str, &str) -> String) -> String {
    if shape.count == 1 {
        return statement(&format!("{name}_page0"), "i");
    }
    let last = shape.count - 1;
    let mask = (1u64 << shape.shift) - 1;
    let index = format!("i & {mask}u");
    let cases = (0..=last).map(|page| {
        let label = if page == last { "default".into() } else { format!("case {page}u") };
        format!("{label}: {{ {} }}", statement(&format!("{name}_page{page}"), &index))
    });
    format!("switch i >> {}u {{ {} }}", shape.shift, cases.collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::{Device, row};

    /// A row of nine words, which leave the last of its three texels in part empty.
    #[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
    #[repr(C)]
    struct Nine {
        a: f32,
        b: f32,
        c: f32,
        d: f32,
        e: f32,
        f: f32,
        g: f32,
        h: f32,
        last: f32,
    }
    row!(Nine { a, b, c, d, e, f, g, h, last: f32 });

    #[test]
    fn rows_are_whole_texels() {
        let queue = Device::cpu(1).unwrap().cpu_queue();
        let numbers = queue.buffer::<f32>(1).unwrap();
        let sums = queue.buffer::<Nine>(1).unwrap();
        let shape = |count| PageShape { count, shift: 12, are_texels: true };
        assert_eq!(
            accessors(&Binding::new("numbers", Access::Read, &numbers), shape(2), Packing::Pairs),
            ["fn load_numbers(i: u32) -> f32 { switch i >> 12u { \
              case 0u: { return bitcast<f32>(textureLoad(numbers_page0, texel_at(i & 4095u)).x); } \
              default: { return bitcast<f32>(textureLoad(numbers_page1, texel_at(i & 4095u)).x); } } }"]
        );
        let [load, store] = accessors(&Binding::new("sums", Access::Write, &sums), shape(1), Packing::Pairs)
            .try_into()
            .expect("two functions");
        let third = "textureLoad(sums_page0, texel_at(3u * (i) + 2u)))";
        assert!(load.contains(third) && load.contains("bitcast<f32>(packed[2].x)"), "{load}");
        assert!(store.ends_with("textureStore(sums_page0, texel_at(3u * (i) + 2u), packed[2]); }"), "{store}");
    }

    #[test]
    fn a_row_is_found_in_its_page() {
        let queue = Device::cpu(1).unwrap().cpu_queue();
        let buffer = queue.buffer::<u32>(1).unwrap();
        let binding = Binding::new("ids", Access::Write, &buffer);
        assert_eq!(
            accessors(&binding, PageShape { count: 1, shift: 20, are_texels: false }, Packing::Words),
            [
                "fn load_ids(i: u32) -> u32 { return ids_page0[i]; }",
                "fn store_ids(i: u32, row: u32) { ids_page0[i] = row; }"
            ]
        );
        assert_eq!(
            accessors(
                &Binding::new("ids", Access::Add, &buffer),
                PageShape { count: 3, shift: 12, are_texels: false },
                Packing::Pairs
            ),
            ["fn add_ids(i: u32, n: u32) { switch i >> 12u { case 0u: { atomicAdd(&ids_page0[i & 4095u], n); } \
              case 1u: { atomicAdd(&ids_page1[i & 4095u], n); } default: { atomicAdd(&ids_page2[i & 4095u], n); } } }"]
        );
    }
}
