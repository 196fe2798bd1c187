//! Where real meshes lie, if any do.

use std::path::{Path, PathBuf};

/// The folder of real meshes: `COARSEN_MODELS`, else beside the repository. Says so where there is none.
pub fn folder() -> Option<PathBuf> {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/models"));
    let folder = std::env::var_os("COARSEN_MODELS").map_or_else(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no real meshes at {} (COARSEN_MODELS names another folder)", folder.display());
    None
}

/// One real mesh by its path inside the folder, such as `papers/cow.obj`.
pub fn model(name: &str) -> Option<PathBuf> {
    let path = folder()?.join(name);
    if path.is_file() {
        return Some(path);
    }
    println!("skipped: no {}", path.display());
    None
}

/// Every mesh file under the folder, sorted by path.
pub fn all() -> Vec<PathBuf> {
    let mut found = Vec::new();
    if let Some(folder) = folder() {
        collect(&folder, &mut found);
    }
    found.sort();
    found
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for path in std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            collect(&path, found);
        } else if is_mesh(&path) {
            found.push(path);
        }
    }
}

fn is_mesh(path: &Path) -> bool {
    const EXTENSIONS: [&str; 6] = ["obj", "off", "ply", "stl", "glb", "gltf"];
    let name = path.to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    EXTENSIONS.iter().any(|extension| name.ends_with(&format!(".{extension}")))
}
