//! Vertex clustering: keys, counts, sums and representatives of cells.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use coarsen::backend::{Buffer, Device, Queue};
use coarsen::kernel::cell_faces::CellFaces;
use coarsen::kernel::cell_keys::{CellKeys, LEAST_STEPS, SITE_BITS, UNUSED};
use coarsen::kernel::cell_sums::CellSums;
use coarsen::kernel::count_spanning::{CountSpanning, SPAN_BLOCK};
use coarsen::kernel::nearest_corners::NearestCorners;
use coarsen::kernel::representatives::Representatives;
use coarsen::kernel::rows::{CellSum, Face, Site};
use coarsen::mesh::{sample, shapes};
use coarsen::{Mesh, Result};

use super::inputs::{Random, flip};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 6] = [
    Trial { name: "cell_keys", run: cell_keys },
    Trial { name: "count_spanning", run: count_spanning },
    Trial { name: "cell_faces", run: cell_faces },
    Trial { name: "cell_sums", run: cell_sums },
    Trial { name: "representatives", run: representatives },
    Trial { name: "nearest_corners", run: nearest_corners },
];

const STEPS: u32 = 1 << SITE_BITS;
/// Faces a piece: few, so that most cells have several.
const PIECE: usize = 7;

/// A mesh on the lattice, its cells, and what the twins make of them.
struct Case {
    name: &'static str,
    steps: u32,
    unit: f32,
    sites: Vec<Site>,
    faces: Vec<Face>,
    keys: Vec<[u32; 2]>,
    vertex_cells: Vec<u32>,
    cell_faces: Vec<Face>,
    origins: Vec<Site>,
    pieces: Vec<[u32; 2]>,
    piece_faces: Vec<u32>,
    cell_pieces: Vec<u32>,
    sums: Vec<CellSum>,
    points: Vec<[f32; 4]>,
}

impl Case {
    fn new(name: &'static str, steps: u32, sites: Vec<Site>, faces: &[[u32; 3]]) -> Self {
        let faces: Vec<Face> = faces.iter().map(|&[a, b, c]| Face { a, b, c }).collect();
        let key = |(v, site): (u32, &Site)| match site.x {
            UNUSED => [v, UNUSED],
            _ => {
                let [x, y, z] = [site.x, site.y, site.z].map(|at| u64::from(at / steps));
                let key = x | y << 21 | z << 42;
                [key as u32, (key >> 32) as u32]
            }
        };
        let keys: Vec<[u32; 2]> = (0..).zip(&sites).map(key).collect();
        let (mut numbers, mut origins) = (BTreeMap::new(), Vec::new());
        let number = |(key, &site): (&[u32; 2], &Site)| {
            *numbers.entry(*key).or_insert_with(|| {
                origins.push(site);
                origins.len() as u32 - 1
            })
        };
        let vertex_cells: Vec<u32> = keys.iter().zip(&sites).map(number).collect();
        let renamed = |face: &Face| {
            let [a, b, c] = face.corners().map(|v| vertex_cells[v as usize]);
            Face { a, b, c }
        };
        let cell_faces: Vec<Face> = faces.iter().map(renamed).collect();
        let (mut pieces, mut piece_faces, mut cell_pieces) = (Vec::new(), Vec::new(), Vec::new());
        for cell in 0..origins.len() as u32 {
            cell_pieces.push(pieces.len() as u32);
            let own = (0..).zip(&cell_faces).filter(|(_, face)| face.corners().contains(&cell)).map(|(f, _)| f);
            for faces in own.collect::<Vec<u32>>().chunks(PIECE) {
                pieces.push([cell, piece_faces.len() as u32]);
                piece_faces.extend(faces);
            }
        }
        cell_pieces.push(pieces.len() as u32);
        pieces.push([0, piece_faces.len() as u32]);
        let unit = 1.0 / steps.next_power_of_two() as f32;
        let (sums, points) = (Vec::new(), Vec::new());
        let mut case = Self {
            name,
            steps,
            unit,
            sites,
            faces,
            keys,
            vertex_cells,
            cell_faces,
            origins,
            pieces,
            piece_faces,
            cell_pieces,
            sums,
            points,
        };
        let (mut queue, mut seen) = (Device::cpu(1).expect("a thread").cpu_queue(), Seen::default());
        let rows = Rows::new(&mut queue, &case).expect("host memory");
        let sums = rows.sums(&mut queue, &mut seen, &case).expect("runs on the host");
        case.sums = sums.host().to_vec();
        let points = rows.points(&mut queue, &mut seen, &case, false).expect("runs on the host");
        case.points = points.host().to_vec();
        case
    }
}

/// A mesh's sites, its box as large as the lattice, with a vertex that no face uses in front.
fn on_lattice(mesh: &Mesh) -> (Vec<Site>, Vec<[u32; 3]>) {
    let (low, high) = mesh.bounds();
    let scale = f64::from(STEPS - 1) / (high - low).max_element();
    let site = |p: &coarsen::math::DVec3| {
        let [x, y, z] = ((*p - low) * scale).to_array().map(|at| at as u32);
        Site { x, y, z }
    };
    let sites = [Site { x: UNUSED, y: 0, z: 0 }].into_iter().chain(mesh.positions.iter().map(site)).collect();
    (sites, mesh.faces.iter().map(|face| face.map(|v| v + 1)).collect())
}

/// Surfaces, ties, corners anywhere, specks, and faces without area.
fn cases() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        let mut random = Random::new();
        let mut anywhere = |count: usize, bound: u32| -> Vec<Site> {
            let mut site = || Site { x: random.below(bound), y: random.below(bound), z: random.below(bound) };
            (0..count).map(|_| site()).collect()
        };
        let (wide, narrow, few) = (anywhere(600, STEPS), anywhere(600, 40), anywhere(60, 3));
        let soup = |sites: &[Site]| -> Vec<[u32; 3]> {
            (0..sites.len() as u32 / 3).map(|f| [0, 1, 2].map(|k| 3 * f + k)).collect()
        };
        let far = |sites: &[Site]| {
            sites
                .iter()
                .enumerate()
                .map(|(i, s)| {
                    let corner = if i / 3 % 2 == 0 { 0 } else { STEPS - 64 };
                    Site { x: s.x + corner, y: s.y, z: s.z + corner }
                })
                .collect::<Vec<_>>()
        };
        let line = |sites: &[Site]| sites.iter().map(|s| Site { x: s.x, y: 0, z: 0 }).collect::<Vec<_>>();
        let (statue, statue_faces) = on_lattice(&sample("statue", Some(6000)).expect("a sample"));
        let (cube, cube_faces) = on_lattice(&shapes::cube(6));
        let hub: Vec<[u32; 3]> = (0..500).map(|f| [0, 1 + f % 7, 1 + (f + 1) % 7]).collect();
        vec![
            Case::new("statue", STEPS / 11, statue.clone(), &statue_faces),
            Case::new("statue, finely", STEPS / 300, statue, &statue_faces),
            Case::new("ties", STEPS / 3, cube, &cube_faces),
            Case::new("corners anywhere", STEPS / 5, wide.clone(), &soup(&wide)),
            Case::new("corners anywhere, smallest cells", LEAST_STEPS, wide.clone(), &soup(&wide)),
            Case::new("specks in one cell", STEPS, far(&narrow), &soup(&narrow)),
            Case::new("specks in the smallest cells", LEAST_STEPS, far(&narrow), &soup(&narrow)),
            Case::new("points and lines", 1 << 20, line(&few), &soup(&few)),
            Case::new("many faces at few vertices", STEPS / 2, wide[..8].to_vec(), &hub),
            Case::new("one face", STEPS / 2, wide[..3].to_vec(), &[[0, 1, 2]]),
        ]
    })
}

/// The cases, and whether each is to be perturbed: only the first.
fn cases_perturbed(perturbed: bool) -> impl Iterator<Item = (&'static Case, bool)> {
    cases().iter().enumerate().map(move |(i, case)| (case, perturbed && i == 0))
}

/// A case on a queue's device.
struct Rows {
    sites: Buffer<Site>,
    faces: Buffer<Face>,
    origins: Buffer<Site>,
    pieces: Buffer<[u32; 2]>,
    piece_faces: Buffer<u32>,
    cell_pieces: Buffer<u32>,
    sums: Buffer<CellSum>,
}

impl Rows {
    fn new(queue: &mut Queue, case: &Case) -> Result<Self> {
        Ok(Self {
            sites: queue.buffer_from(case.sites.clone())?,
            faces: queue.buffer_from(case.faces.clone())?,
            origins: queue.buffer_from(case.origins.clone())?,
            pieces: queue.buffer_from(case.pieces.clone())?,
            piece_faces: queue.buffer_from(case.piece_faces.clone())?,
            cell_pieces: queue.buffer_from(case.cell_pieces.clone())?,
            sums: queue.buffer_from(case.sums.clone())?,
        })
    }

    fn sums(&self, queue: &mut Queue, seen: &mut Seen, case: &Case) -> Result<Buffer<CellSum>> {
        let Self { sites, faces, origins, pieces, piece_faces, .. } = self;
        let mut sums = queue.buffer(case.pieces.len() - 1)?;
        let (piece_count, steps, unit) = (case.pieces.len() as u32 - 1, case.steps, case.unit);
        seen.run(
            queue,
            CellSums { sites, faces, origins, pieces, piece_faces, piece_count, steps, unit, sums: &mut sums },
        )?;
        Ok(sums)
    }

    fn points(&self, queue: &mut Queue, seen: &mut Seen, case: &Case, at_mean: bool) -> Result<Buffer<[f32; 4]>> {
        let mut points = queue.buffer(case.origins.len())?;
        // On the way to a case its sums are not in the rows yet.
        let sums = if self.sums.is_empty() { &queue.buffer_from(case.sums.clone())? } else { &self.sums };
        seen.run(
            queue,
            Representatives {
                origins: &self.origins,
                cell_pieces: &self.cell_pieces,
                sums,
                cell_count: case.origins.len() as u32,
                steps: case.steps,
                unit: case.unit,
                at_mean,
                representatives: &mut points,
            },
        )?;
        Ok(points)
    }
}

fn cell_keys(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, perturbed) in cases_perturbed(perturbed) {
        seen.input(case.name);
        let mut sites = case.sites.clone();
        sites[2].y ^= u32::from(perturbed) << (SITE_BITS - 1);
        let vertex_count = sites.len() as u32;
        let sites = &queue.buffer_from(sites)?;
        let keys = &mut queue.buffer(case.keys.len())?;
        seen.run(queue, CellKeys { sites, vertex_count, steps: case.steps, keys })?;
        seen.output(queue, "keys", keys)?;
    }
    Ok(())
}

fn count_spanning(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, perturbed) in cases_perturbed(perturbed) {
        seen.input(case.name);
        let mut faces = case.faces.clone();
        let spanning = case.cell_faces.iter().position(|face| face.is_live()).unwrap_or(0);
        if perturbed {
            faces[spanning].a = faces[spanning].b;
        }
        let face_count = faces.len() as u32;
        let (faces, keys) = (&queue.buffer_from(faces)?, &queue.buffer_from(case.keys.clone())?);
        let counts = &mut queue.buffer(face_count.div_ceil(SPAN_BLOCK) as usize)?;
        seen.run(queue, CountSpanning { faces, keys, face_count, counts })?;
        seen.output(queue, "counts", counts)?;
    }
    Ok(())
}

fn cell_faces(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, perturbed) in cases_perturbed(perturbed) {
        seen.input(case.name);
        let mut vertex_cells = case.vertex_cells.clone();
        vertex_cells[case.faces[0].b as usize] ^= u32::from(perturbed);
        let face_count = case.faces.len() as u32;
        let (faces, vertex_cells) = (&queue.buffer_from(case.faces.clone())?, &queue.buffer_from(vertex_cells)?);
        let cell_faces = &mut queue.buffer(case.faces.len())?;
        seen.run(queue, CellFaces { faces, vertex_cells, face_count, cell_faces })?;
        seen.output(queue, "cell_faces", cell_faces)?;
    }
    Ok(())
}

fn cell_sums(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, perturbed) in cases_perturbed(perturbed) {
        seen.input(case.name);
        let mut rows = Rows::new(queue, case)?;
        if perturbed {
            let mut sites = case.sites.clone();
            sites[case.faces[0].a as usize].x ^= 1 << 10;
            rows.sites = queue.buffer_from(sites)?;
        }
        let sums = rows.sums(queue, seen, case)?;
        seen.output(queue, "sums", &sums)?;
    }
    Ok(())
}

fn representatives(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, perturbed) in cases_perturbed(perturbed) {
        seen.input(case.name);
        let mut rows = Rows::new(queue, case)?;
        if perturbed {
            let mut sums = case.sums.clone();
            flip(&mut sums[0].bx, true);
            rows.sums = queue.buffer_from(sums)?;
        }
        for at_mean in [false, true] {
            let points = rows.points(queue, seen, case, at_mean)?;
            seen.output(queue, "representatives", &points)?;
        }
    }
    Ok(())
}

fn nearest_corners(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, perturbed) in cases_perturbed(perturbed) {
        seen.input(case.name);
        let Rows { sites, faces, origins, pieces, piece_faces, .. } = &Rows::new(queue, case)?;
        let mut points = case.points.clone();
        flip(&mut points[case.cell_faces[0].a as usize][0], perturbed);
        let representatives = &queue.buffer_from(points)?;
        let piece_count = case.pieces.len() as u32 - 1;
        let nearest = &mut queue.buffer(piece_count as usize)?;
        seen.run(
            queue,
            NearestCorners {
                sites,
                faces,
                origins,
                pieces,
                piece_faces,
                representatives,
                piece_count,
                steps: case.steps,
                unit: case.unit,
                nearest,
            },
        )?;
        seen.output(queue, "nearest", nearest)?;
    }
    Ok(())
}
