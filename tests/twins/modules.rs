//! The shader modules, without a device: complete, valid, and laid out as Rust says.

use std::collections::BTreeSet;
use std::path::Path;

use coarsen::backend::{Access, Binding, Device, Dialect, Exactness, Member, Packing, PageShape, Signature};

use crate::trials::{Seen, trials};

fn stems(folder: &str, extension: &str) -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let files = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    files
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect()
}

/// Runs every trial on the CPU and shows its kernel to `look`; collects the complaints of all.
fn complaints(look: impl Fn(&Signature<'_>, usize) -> Vec<String> + Copy + 'static) -> Vec<String> {
    let collected = std::rc::Rc::new(std::cell::RefCell::new(Vec::new()));
    let mut looked_at = 0;
    for trial in trials() {
        let (sink, mut seen) = (std::rc::Rc::clone(&collected), Seen::default());
        seen.look = Some(Box::new(move |signature, params_bytes| {
            let found = look(signature, params_bytes);
            sink.borrow_mut().extend(found.into_iter().map(|complaint| format!("{}: {complaint}", signature.name)));
        }));
        (trial.run)(&mut Device::cpu(1).unwrap().cpu_queue(), false, &mut seen).unwrap();
        looked_at += 1;
    }
    assert!(looked_at > 0);
    collected.take()
}

/// The module with all switches off, without guards and loading pairs, once more so with texels for what may be, and with all on,
/// guarded and loading words.
fn modules(signature: &Signature<'_>, pages: u32) -> Result<[naga::Module; 3], String> {
    let parse = |on, exactness, packing, texels| {
        let are_texels = |binding: &Binding<'_>| texels && binding.may_be_texels();
        let shape = |binding| PageShape { count: pages, shift: 12, are_texels: are_texels(binding) };
        let shapes: Vec<_> = signature.bindings.iter().map(shape).collect();
        let switches = signature.switches.iter().map(|(name, _)| (*name, on)).collect();
        let text = Signature { switches, ..signature.clone() }.compose(&shapes, Dialect { exactness, packing });
        naga::front::wgsl::parse_str(&text).map_err(|error| error.emit_to_string_with_path(&text, signature.name))
    };
    Ok([
        parse(false, Exactness::Plain, Packing::Pairs, false)?,
        parse(false, Exactness::Plain, Packing::Pairs, true)?,
        parse(true, Exactness::Guarded, Packing::Words, false)?,
    ])
}

/// The files of `src/kernel` that are no kernel's twin, beside those of shared sources.
const NO_TWINS: [&str; 5] = ["gradient_table", "mod", "split", "volume_rows", "warm"];

#[test]
fn paired() {
    let shaders = stems("shaders", "wgsl");
    let twins = &stems("src/kernel", "rs") - &stems("shaders/shared", "wgsl");
    assert!(!shaders.is_empty());
    assert_eq!(shaders, &twins - &NO_TWINS.map(String::from).into());
    assert_eq!(shaders, trials().map(|trial| trial.name.to_string()).collect());
    let foreign = complaints(|signature, _| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("shaders/{}.wgsl", signature.name));
        let is_own = std::fs::read_to_string(path).is_ok_and(|text| text == signature.source);
        if is_own { vec![] } else { vec!["runs another shader than that of its name".into()] }
    });
    assert!(foreign.is_empty(), "{foreign:#?}");
}

/// A shared source names the file of its twin in its head.
#[test]
fn shared_sources_are_paired() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let shared = stems("shaders/shared", "wgsl");
    assert!(!shared.is_empty());
    let has_no_twin = |stem: &String| {
        let text = std::fs::read_to_string(root.join(format!("shaders/shared/{stem}.wgsl"))).unwrap();
        let twin = text.lines().take(2).find_map(|line| line.split_once("src/").map(|(_, path)| format!("src/{path}")));
        !twin.is_some_and(|path| root.join(path.trim_end_matches('.')).exists())
    };
    assert_eq!(shared.iter().filter(|stem| has_no_twin(stem)).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn valid() {
    let failures = complaints(|signature, _| {
        let validate = |pages| {
            let pairs = naga::valid::Capabilities::SHADER_INT64;
            let needs = [pairs, pairs, naga::valid::Capabilities::empty()];
            modules(signature, pages)?.iter().zip(needs).try_for_each(|(module, capabilities)| {
                let flags = naga::valid::ValidationFlags::all();
                naga::valid::Validator::new(flags, capabilities)
                    .validate(module)
                    .map_err(|error| format!("{pages} pages: {error:?}"))
                    .map(drop)
            })
        };
        [1, 2, 3].into_iter().filter_map(|pages| validate(pages).err()).collect()
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn rows_are_laid_out_as_in_rust() {
    let failures = complaints(|signature, _| {
        let [module, ..] = modules(signature, 1).unwrap();
        let check = |name: &str, members: &[Member], bytes: usize| {
            let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).map(|(_, ty)| &ty.inner);
            let Some(naga::TypeInner::Struct { members: in_wgsl, span }) = found else {
                return Some(format!("no struct {name}"));
            };
            let scalar = |ty| match module.types[ty].inner {
                naga::TypeInner::Scalar(naga::Scalar { kind: naga::ScalarKind::Uint, width: 4 }) => "u32",
                naga::TypeInner::Scalar(naga::Scalar { kind: naga::ScalarKind::Float, width: 4 }) => "f32",
                _ => "",
            };
            let in_wgsl: Vec<_> =
                in_wgsl.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize, scalar(m.ty))).collect();
            let in_rust: Vec<_> = members.iter().map(|m| (m.name, m.offset, m.scalar)).collect();
            (in_wgsl != in_rust || *span as usize != bytes)
                .then(|| format!("{name}: {in_wgsl:?}, {span} bytes in WGSL; {in_rust:?}, {bytes} bytes in Rust"))
        };
        let structs = signature.bindings.iter().filter(|binding| !binding.members.is_empty());
        let mut found: Vec<_> = structs.filter_map(|b| check(b.row, b.members, b.stride)).collect();
        found.extend(check("Sym3", <coarsen::math::exact::Sym3 as coarsen::backend::Row>::MEMBERS, 24));
        found
    });
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn rows_of_other_types_have_their_size() {
    let failures = complaints(|signature, _| {
        let size = |row: &str| match row {
            "u32" | "f32" => 4,
            "vec2u" | "vec2f" => 8,
            "vec4u" | "vec4f" => 16,
            _ => 0,
        };
        let plain = signature.bindings.iter().filter(|binding| binding.members.is_empty());
        plain.filter(|b| size(b.row) != b.stride).map(|b| format!("{}: {}", b.name, b.row)).collect()
    });
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Every binding is used under its name, and the uniform block has the bytes of its fields.
#[test]
fn bound() {
    let failures = complaints(|signature, params_bytes| {
        let text = [signature.shared, &[signature.source]].concat().concat();
        let mut found = Vec::new();
        if params_bytes != signature.params.len() * 4 {
            found.push(format!("{params_bytes} bytes of parameters for {:?}", signature.params));
        }
        let params = signature.params.iter().map(|(name, _)| format!("params.{name}"));
        let switches = signature.switches.iter().map(|(name, _)| (*name).to_string());
        let unread = params.chain(switches).filter(|name| !text.contains(name));
        found.extend(unread.map(|param| format!("does not read {param}")));
        for binding in &signature.bindings {
            let verb = match binding.access {
                Access::Read => "load",
                Access::Write => "store",
                Access::Add => "add",
            };
            let call = format!("{verb}_{}(", binding.name);
            if !text.contains(&call) {
                found.push(format!("does not call {call}…)"));
            }
        }
        found
    });
    assert!(failures.is_empty(), "{failures:#?}");
}
