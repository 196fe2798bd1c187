//! What the trials run on: rounds of real and hostile meshes, worked out plainly on the host.

use std::sync::OnceLock;

use coarsen::backend::Device;
use coarsen::kernel::contract_faces::renamed;
use coarsen::kernel::contract_quadrics::contracted;
use coarsen::kernel::contract_vertices::{GONE, KEEPS};
use coarsen::kernel::face_normals::FaceNormals;
use coarsen::kernel::pairs::{Special, pairs_at};
use coarsen::kernel::plane_sums::PlaneSums;
use coarsen::kernel::rows::{
    BORDER, BorderSum, Contraction, Edge, Face, HUB, JOINED, LOCKED, Normal, PlaneQuadric, Position, VolumeSum,
    with_hub,
};
use coarsen::kernel::stars::Stars;
use coarsen::kernel::volume_sums::VolumeSums;
use coarsen::mesh::adjacency::Rings;
use coarsen::mesh::shapes;
use coarsen::mesh::topology::complex_vertices;

/// Xorshift.
pub struct Random(u32);

impl Random {
    pub fn new() -> Self {
        Self(0x9e37_79b9)
    }

    pub fn bits(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    pub fn below(&mut self, bound: u32) -> u32 {
        (self.bits() >> 8) % bound
    }

    /// In −½ .. ½.
    pub fn centered(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / 16_777_216.0 - 0.5
    }
}

/// A live mesh, the contractions of a round, and what follows from them.
pub struct Round {
    pub name: &'static str,
    pub positions: Vec<Position>,
    pub faces: Vec<Face>,
    pub ring_starts: Vec<u32>,
    pub ring_faces: Vec<u32>,
    pub has_border: bool,
    pub pairs: Vec<Edge>,
    pub normals: Vec<Normal>,
    pub volume_sums: Vec<VolumeSum>,
    pub border_sums: Vec<BorderSum>,
    pub quadrics: Vec<PlaneQuadric>,
    pub contractions: Vec<Contraction>,
    pub roles: Vec<u32>,
    pub renamed_faces: Vec<Face>,
    pub face_live: Vec<u32>,
    pub new_face: Vec<u32>,
    pub new_vertex: Vec<u32>,
    pub new_starts: Vec<u32>,
}

impl Round {
    /// What beside ordinary vertices there is.
    pub fn special(&self) -> Special {
        let has = |flags| self.positions.iter().any(|position| position.flags & flags != 0);
        Special { has_border: has(BORDER), has_held: has(LOCKED | HUB) }
    }
}

/// The rounds, the same for every trial, and whether each is to be perturbed: only the first, which has vertices of all
/// kinds: free, on a border, locked.
pub fn rounds(perturbed: bool) -> impl Iterator<Item = (&'static Round, bool)> {
    static ROUNDS: OnceLock<Vec<Round>> = OnceLock::new();
    let rounds = ROUNDS.get_or_init(|| {
        let torus = shapes::torus(40, 24);
        let mut fan = shapes::cylinder(700);
        fan.faces.pop();
        let mut flat = shapes::plane(20, 20).faces;
        flat.truncate(777);
        vec![
            Round::new("sheet", noisy(&shapes::plane(30, 20)), shapes::plane(30, 20).faces),
            Round::new("torus", noisy(&torus), torus.faces.clone()),
            Round::new("tetrahedron", noisy(&shapes::tetrahedron()), shapes::tetrahedron().faces),
            Round::new("ties", exact(&shapes::cube(6)), shapes::cube(6).faces),
            Round::new("hubs", noisy(&fan), fan.faces),
            Round::new("points and lines", degenerate(21 * 21), flat.clone()),
            Round::new("poison", poison(21 * 21), flat),
            Round::new("specks", noisy(&torus).into_iter().map(speck).collect(), torus.faces),
            Round::new("noise on a flat", flat_noise(31 * 21), shapes::plane(30, 20).faces),
            soup(),
            pages(),
        ]
    });
    rounds.iter().enumerate().map(move |(i, round)| (round, perturbed && i == 0))
}

/// Flips a bit in the middle of the digits.
pub fn flip(x: &mut f32, perturbed: bool) {
    *x = f32::from_bits(x.to_bits() ^ u32::from(perturbed) << 12);
}

fn exact(mesh: &coarsen::Mesh) -> Vec<[f32; 3]> {
    mesh.positions.iter().map(|p| p.as_vec3().to_array()).collect()
}

fn noisy(mesh: &coarsen::Mesh) -> Vec<[f32; 3]> {
    let mut random = Random::new();
    exact(mesh).into_iter().map(|p| p.map(|x| x + 0.25 * random.centered())).collect()
}

/// Along one line, many at one point: faces without area, edges without length.
fn degenerate(count: u32) -> Vec<[f32; 3]> {
    (0..count).map(|i| [(i / 3 % 7) as f32, (i / 3 % 7) as f32 * 0.5, 0.0]).collect()
}

/// Coordinates of all magnitudes that leave sums finite.
fn poison(count: u32) -> Vec<[f32; 3]> {
    const COORDINATES: [f32; 16] = [
        0.0,
        -0.0,
        1e-45,
        -1e-39,
        1.2e-38,
        1e-30,
        -1e-25,
        1e-19,
        -1e-15,
        1e-9,
        1e-3,
        -1.0,
        1.000_000_1,
        1e2,
        -1e4,
        1e6,
    ];
    let mut random = Random::new();
    let mut coordinate = || COORDINATES[random.below(16) as usize];
    (0..count).map(|_| [coordinate(), coordinate(), coordinate()]).collect()
}

/// Smaller and smaller along x, down to where squares of areas underflow.
fn speck([x, y, z]: [f32; 3]) -> [f32; 3] {
    let scale = 10f32.powf(-5.0 - (x + 4.0));
    [x * scale, y * scale, z * scale]
}

/// A grid as a turn by a right angle in double precision leaves it: what should be zero is not.
fn flat_noise(count: u32) -> Vec<[f32; 3]> {
    let mut random = Random::new();
    (0..count)
        .map(|i| {
            let magnitude = [1e-16, 1e-20, 1e-30][random.below(3) as usize];
            [(i % 31) as f32, (i / 31) as f32 + magnitude * random.centered(), magnitude * random.centered()]
        })
        .collect()
}

/// Faces of random corners: edges of many faces, faces over each other.
fn soup() -> Round {
    let mut random = Random::new();
    let mut faces = Vec::new();
    while faces.len() < 1500 {
        let a = random.below(600);
        // Near corners, so that some edges have two faces.
        let [b, c] = [(a + 1 + random.below(4)) % 600, (a + 5 + random.below(4)) % 600];
        faces.push([a, b, c]);
    }
    let positions = (0..600).map(|_| [0; 3].map(|_| 8.0 * random.centered())).collect();
    Round::new("soup", positions, faces)
}

/// Every buffer is longer than a small page; every other vertex has no face.
fn pages() -> Round {
    let plane = shapes::plane(131, 131);
    let positions = noisy(&plane).into_iter().flat_map(|p| [p, [0.0; 3]]).collect();
    Round::new("pages", positions, plane.faces.into_iter().map(|face| face.map(|corner| 2 * corner)).collect())
}

impl Round {
    fn new(name: &'static str, positions: Vec<[f32; 3]>, faces: Vec<[u32; 3]>) -> Self {
        let rings = Rings::new(&faces, positions.len());
        let positions = with_flags(&positions, &faces, &rings);
        let has_border = positions.iter().any(|p| p.flags & BORDER != 0);
        let faces: Vec<Face> = faces.into_iter().map(|[a, b, c]| Face { a, b, c }).collect();
        let Rings { starts: ring_starts, faces: ring_faces } = rings;
        let stars = Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
        let mut pairs = Vec::new();
        (0..positions.len() as u32).for_each(|u| pairs_at(u, &stars, |pair| pairs.push(pair)));
        let contractions = contractions(&pairs, &stars);

        let mut roles = vec![0; positions.len()];
        for c in &contractions {
            roles[c.keep as usize] = KEEPS | c.gone;
            roles[c.gone as usize] = GONE | c.keep;
        }
        let rename = |corner: u32| renamed(corner, roles[corner as usize]);
        let renamed_faces: Vec<Face> =
            faces.iter().map(|f| Face { a: rename(f.a), b: rename(f.b), c: rename(f.c) }).collect();
        let face_live: Vec<u32> = renamed_faces.iter().map(|face| u32::from(face.is_live())).collect();
        let mut ring_lengths = vec![0; positions.len()];
        for face in renamed_faces.iter().filter(|face| face.is_live()) {
            face.corners().iter().for_each(|&corner| ring_lengths[corner as usize] += 1);
        }
        Self {
            name,
            has_border,
            pairs,
            new_face: scanned(&face_live),
            new_vertex: scanned(&roles.iter().map(|role| u32::from(role & GONE == 0)).collect::<Vec<_>>()),
            new_starts: scanned(&ring_lengths),
            contractions,
            roles,
            renamed_faces,
            face_live,
            normals: Vec::new(),
            volume_sums: Vec::new(),
            border_sums: Vec::new(),
            quadrics: Vec::new(),
            positions,
            faces,
            ring_starts,
            ring_faces,
        }
        .with_sums()
    }

    /// Fills the sums by the kernels that write them, on the host.
    fn with_sums(mut self) -> Self {
        let mut queue = Device::cpu(1).unwrap().cpu_queue();
        let vertex_count = self.positions.len() as u32;
        let positions = &queue.buffer_from(self.positions.clone()).unwrap();
        let faces = &queue.buffer_from(self.faces.clone()).unwrap();
        let ring_starts = &queue.buffer_from(self.ring_starts.clone()).unwrap();
        let ring_faces = &queue.buffer_from(self.ring_faces.clone()).unwrap();
        let sums = &mut queue.buffer(self.positions.len()).unwrap();
        let borders = &mut queue.buffer(if self.has_border { self.positions.len() } else { 1 }).unwrap();
        let quadrics = &mut queue.buffer(self.positions.len()).unwrap();
        let normals = &mut queue.buffer(self.faces.len()).unwrap();
        let face_count = self.faces.len() as u32;
        queue.run(FaceNormals { positions, faces, face_count, normals }).unwrap();
        queue
            .run(VolumeSums { positions, faces, ring_starts, ring_faces, normals, vertex_count, sums, borders })
            .unwrap();
        queue
            .run(PlaneSums {
                positions,
                faces,
                ring_starts,
                ring_faces,
                normals,
                vertex_count,
                border_weight: 0.5,
                by_area: 1,
                quadrics,
            })
            .unwrap();
        self.normals = normals.host().to_vec();
        self.volume_sums = sums.host().to_vec();
        self.border_sums = borders.host().to_vec();
        // Each as if it had taken in the next: with linear and constant terms.
        let quadric = |[v, w]: [usize; 2]| {
            let [a, b] = [v, w].map(|vertex| self.positions[vertex].xyz());
            contracted(quadrics.host()[v], quadrics.host()[w], a, b, a)
        };
        let count = self.positions.len();
        self.quadrics = (0..count).map(|v| quadric([v, (v + 1) % count])).collect();
        self
    }
}

/// The border and what is not manifold by their edges; one vertex in sixteen is locked as well, and parts met at one of the border in four.
fn with_flags(positions: &[[f32; 3]], faces: &[[u32; 3]], rings: &Rings) -> Vec<Position> {
    let complex = complex_vertices(faces, rings);
    let (mut random, mut uses) = (Random::new(), Vec::new());
    let row = |(vertex, &[x, y, z]): (u32, &[f32; 3])| {
        let on_border = rings.edges_at(faces, vertex, &mut uses).any(|uses| uses.len() == 1);
        let locked = complex[vertex as usize] || random.below(16) == 0;
        let joined = on_border && random.below(4) == 0;
        let flags = [(on_border, BORDER), (locked, LOCKED), (joined, JOINED)]
            .into_iter()
            .fold(0, |all, (is_set, flag)| if is_set { all | flag } else { all });
        Position { x, y, z, flags: with_hub(flags, rings.ring(vertex).len() as u32) }
    };
    (0..).zip(positions).map(row).collect()
}

/// Pairs in random order of which no two share an end, contracted near their middle or onto a locked end.
fn contractions(pairs: &[Edge], stars: &Stars<'_>) -> Vec<Contraction> {
    let mut random = Random::new();
    let mut order: Vec<(u32, u32)> = pairs.iter().map(|pair| (random.bits(), pair.half_edge)).collect();
    order.sort_unstable();
    let mut used = vec![false; stars.positions.len()];
    let mut contractions = Vec::new();
    for (bits, pair) in order {
        let corners = stars.faces[pair as usize / 3].corners();
        let ends = [corners[pair as usize % 3], corners[(pair as usize + 1) % 3]];
        if ends.iter().any(|&end| used[end as usize]) {
            continue;
        }
        ends.iter().for_each(|&end| used[end as usize] = true);
        let [p, q] = ends.map(|end| stars.positions[end as usize]);
        let swap = q.flags & LOCKED != 0 || (p.flags & LOCKED == 0 && bits & 1 != 0);
        let [keep, gone] = if swap { [ends[1], ends[0]] } else { ends };
        let middle = (p.xyz() + q.xyz()) * 0.5;
        let locked = [p, q].into_iter().find(|end| end.flags & LOCKED != 0);
        let at = locked.map_or(middle, Position::xyz);
        contractions.push(Contraction { keep, gone, x: at.x, y: at.y, z: at.z, flags: p.flags | q.flags });
    }
    contractions
}

/// The sum of the values before each, and of all.
pub fn scanned(values: &[u32]) -> Vec<u32> {
    let mut sum = 0;
    let before = values.iter().map(|value| {
        sum += value;
        sum - value
    });
    let mut sums: Vec<u32> = before.collect();
    sums.push(sum);
    sums
}
