//! Meshes that nobody should have to simplify.

use coarsen::Mesh;
use coarsen::math::{DVec3, Vec2, Vec3};
use coarsen::mesh::shapes;
use coarsen::mesh::{Channel, ChannelKind, Materials};

use crate::support::deviation::Random;
use crate::support::shapes::{bumpy, cube, grid, sphere, torus};

pub fn pick<T: Clone>(random: &mut Random, among: &[T]) -> T {
    among[(random.bits() % among.len() as u64) as usize].clone()
}

pub fn below(random: &mut Random, end: usize) -> usize {
    (random.bits() % end.max(1) as u64) as usize
}

// Positions

/// Coordinates that arithmetic finds hard, all finite.
const HARD: [f64; 16] =
    [0.0, -0.0, 1.0, -1.0, 0.5, 5e-324, -2.2e-308, 1e-300, 1e-150, 1e-38, 1e-8, 1e8, 1e38, 1e150, 1e300, 1e307];

pub fn position(random: &mut Random, kind: usize) -> DVec3 {
    let mut unit = || 2.0 * random.unit() - 1.0;
    match kind {
        0 => DVec3::new(unit(), unit(), unit()),
        // A lattice: ties and exact coincidence.
        1 => DVec3::new(unit(), unit(), unit()).map(|c| (c * 2.0).round()),
        2 => DVec3::new(unit(), unit(), 0.0),
        3 => DVec3::new(1.0, 2.0, -3.0) * unit(),
        4 => DVec3::ONE,
        5 => DVec3::new(unit(), unit(), unit()) * 1e-300,
        6 => DVec3::new(unit(), unit(), unit()) * 1e300,
        7 => DVec3::new(unit(), unit(), unit()) * 1e-9 + 1e6,
        8 => DVec3::new(unit(), 1e-12 * unit(), 1e-30 * unit()),
        9 => DVec3::new(unit(), unit(), unit()).map(|c| c * 10f64.powi((300.0 * c) as i32)),
        _ => DVec3::from_array([(); 3].map(|()| pick(random, &HARD))),
    }
}
pub const POSITION_KINDS: usize = 11;

// Faces

/// Any corners at all: repeated ones, duplicates, crowded edges.
pub fn random_faces(random: &mut Random, vertices: usize, faces: usize) -> Vec<[u32; 3]> {
    (0..faces).map(|_| [(); 3].map(|()| below(random, vertices) as u32)).collect()
}

/// Some faces turned, doubled, turned and doubled, left out, or with a corner moved elsewhere.
pub fn damage(mesh: &mut Mesh, random: &mut Random) {
    let share = 1 + below(random, 40);
    for f in 0..mesh.faces.len() {
        let face = mesh.faces[f];
        match below(random, 8 * share) {
            0 => mesh.faces[f].swap(0, 1),
            1 => mesh.faces.push(face),
            2 => mesh.faces.push([face[0], face[2], face[1]]),
            3 => mesh.faces[f] = [face[0]; 3],
            4 => mesh.faces[f][1] = below(random, mesh.positions.len()) as u32,
            5 => mesh.positions[face[0] as usize] = mesh.positions[face[1] as usize],
            _ => {}
        }
    }
}

/// `blades` faces on one edge.
pub fn book(blades: u32) -> Mesh {
    let blade = |i: u32| DVec3::new(f64::from(i).cos(), f64::from(i).sin(), 0.5);
    let positions = [DVec3::ZERO, DVec3::Z].into_iter().chain((0..blades).map(blade)).collect();
    Mesh::new(positions, (0..blades).map(|i| [0, 1, 2 + i]).collect())
}

pub fn mesh(random: &mut Random) -> Mesh {
    let mut mesh = match below(random, 10) {
        0 => shapes::cylinder(3 + random.bits() as u32 % 700),
        1 => book(2 + random.bits() as u32 % 40),
        2 => sphere(1 + random.bits() as u32 % 3),
        3 => torus(3 + random.bits() as u32 % 20, 3 + random.bits() as u32 % 10),
        4 => grid(1 + random.bits() as u32 % 20, 1 + random.bits() as u32 % 9),
        5 => bumpy(cube(1 + random.bits() as u32 % 6), 0.2),
        6 => shapes::moebius(3 + random.bits() as u32 % 30),
        _ => {
            let most = pick(random, &[12, 200]);
            let vertices = 1 + below(random, most);
            let faces = 1 + below(random, 3 * vertices);
            Mesh::new(vec![DVec3::ZERO; vertices], random_faces(random, vertices, faces))
        }
    };
    let blank = mesh.positions.iter().all(|p| *p == DVec3::ZERO);
    if blank || below(random, 3) == 0 {
        let kind = below(random, POSITION_KINDS);
        mesh.positions.iter_mut().for_each(|p| *p = position(random, kind));
    }
    if below(random, 2) == 0 {
        damage(&mut mesh, random);
    }
    if below(random, 3) == 0 {
        mesh.colors = Some(mesh.positions.iter().map(|_| [(); 4].map(|()| random.unit() as f32)).collect());
        mesh.normals = Some(mesh.positions.iter().map(|p| p.as_vec3().normalize_or_zero()).collect());
    }
    if below(random, 3) == 0 {
        mesh.texcoords = Some(texcoords(random, &mesh));
        mesh.face_colors = Some((0..mesh.faces.len()).map(|f| [(f % 7) as f32 / 7.0; 4]).collect());
    }
    if below(random, 4) == 0 {
        let (vertices, faces) = (mesh.positions.len(), mesh.faces.len());
        let mut channel = |name: &str, kind, width: usize| {
            let numbers = [0.0, 1.0, -1.0, f32::NAN, f32::INFINITY, 1e38, 1e-40, 0.3];
            let values = (0..vertices * width).map(|_| pick(random, &numbers)).collect();
            mesh.channels.push(Channel { name: name.into(), kind, width, values });
        };
        channel("heat", ChannelKind::Linear, 1);
        channel("TEXCOORD_1", ChannelKind::Texcoords, 2);
        channel("TANGENT", ChannelKind::Tangent, 4);
        channel("JOINTS_0", ChannelKind::Joints, 8);
        let of_face = (0..faces).map(|_| below(random, 3) as u32).collect();
        mesh.materials = Some(Materials { of_face, names: vec!["a".into(), "b".into(), String::new()] });
    }
    mesh
}

/// Smooth, smooth with some corners elsewhere, all on a line, or anything at all.
fn texcoords(random: &mut Random, mesh: &Mesh) -> Vec<[Vec2; 3]> {
    let kind = below(random, 4);
    let mut corner = |v: u32| {
        let p = mesh.positions[v as usize].as_vec3().clamp(Vec3::splat(-1e30), Vec3::splat(1e30));
        match kind {
            0 => Vec2::new(p.x, p.y),
            1 if below(random, 50) > 0 => Vec2::new(p.x, p.y + p.z),
            2 => Vec2::splat(p.x),
            _ => Vec2::new(pick(random, &[0.0, 1.0, -1e38, 1e-40]), random.unit() as f32),
        }
    };
    mesh.faces.iter().map(|face| face.map(&mut corner)).collect()
}
