//! The buffers of a round in the middle of its work: every kernel can run on them, in any order and again and again.

use coarsen::backend::{Buffer, Queue, Row};
use coarsen::kernel::block_maxima::MAXIMUM_BLOCK;
use coarsen::kernel::block_sums::SUM_BLOCK;
use coarsen::kernel::contract_vertices::{GONE, KEEPS};
use coarsen::kernel::cost_histogram::BUCKETS;
use coarsen::kernel::encode_quadrics::word_count;
use coarsen::kernel::quadric_format::LOCAL16;
use coarsen::kernel::rows::{
    BorderSum, Candidate, Contraction, Corners, Edge, Face, Normal, PlaneQuadric, Position, QuadricBound, Threshold,
    VolumeSum,
};
use coarsen::kernel::scan_blocks::SCAN_BLOCK;
use coarsen::mesh::{Rings, sample};

use crate::stages;

/// Faces of the statue.
const FACES: usize = 1_000_000;
/// Of so many vertices one vanishes, about as in a round of the `volume` metric.
const VERTICES_A_CONTRACTION: usize = 6;

macro_rules! scene {
    ($($(#[$attribute:meta])* $buffer:ident: $row:ty),+ $(,)?) => {
        /// Buffers on one device. What kernels change in place they change to the same again.
        pub struct Scene {
            pub vertex_count: u32,
            pub face_count: u32,
            pub pair_count: u32,
            pub contraction_count: u32,
            $($(#[$attribute])* pub $buffer: Buffer<$row>),+
        }

        impl Scene {
            /// The same on the device of `queue`; this one is on the host.
            pub fn copy(&self, queue: &mut Queue) -> Self {
                Self { $($buffer: upload(queue, self.$buffer.host().to_vec()),)+ vertex_count: self.vertex_count, face_count: self.face_count, pair_count: self.pair_count, contraction_count: self.contraction_count }
            }
        }
    };
}

scene! {
    positions: Position,
    faces: Face,
    ring_starts: u32,
    ring_faces: u32,
    normals: Normal,
    sums: VolumeSum,
    borders: BorderSum,
    quadrics: PlaneQuadric,
    corners: Corners,
    areas: f32,
    curvatures: f32,
    curvature_sums: f32,
    weights: f32,
    weighed_quadrics: PlaneQuadric,
    quadric_bounds: QuadricBound,
    quadric_maxima: QuadricBound,
    /// The quadrics in 16 bits about their vertices.
    quadric_words: u32,
    restored_quadrics: PlaneQuadric,
    /// Zeros, which weights leave as they are.
    weighed_keys: u32,
    /// Pairs of every block of vertices.
    pair_counts: u32,
    /// Pairs before every block.
    pair_starts: u32,
    pairs: Edge,
    keys: u32,
    /// Keys by the other metric.
    plane_keys: u32,
    buckets: u32,
    /// At the median key.
    threshold: Threshold,
    threshold_out: Threshold,
    /// Candidates of every block of keys.
    candidate_counts: u32,
    /// Candidates before every block.
    candidate_starts: u32,
    candidates: Candidate,
    contractions: Contraction,
    roles: u32,
    /// Zeros, which a scan leaves as they are.
    values: u32,
    block_sums: u32,
    face_live: u32,
    vertex_live: u32,
    ring_lengths: u32,
    /// The three above, scanned.
    new_face: u32,
    new_vertex: u32,
    new_starts: u32,
    positions_out: Position,
    starts_out: u32,
    rings_out: u32,
    faces_out: Face,
    quadrics_out: PlaneQuadric,
    /// Where contractions write: not what the other kernels read.
    moved_positions: Position,
    moved_roles: u32,
    moved_quadrics: PlaneQuadric,
    renamed_faces: Face,
}

impl Scene {
    /// On the host: the statue, what the kernels up to the gate make of it, and contractions of independent edges.
    pub fn new(queue: &mut Queue) -> Self {
        let mesh = sample("statue", Some(FACES)).expect("a size that samples have");
        let rings = Rings::new(&mesh.faces, mesh.positions.len());
        let faces: Vec<Face> = mesh.faces.iter().map(|&[a, b, c]| Face { a, b, c }).collect();
        // The mean edge is about 1, as in a run.
        let scale = (mesh.faces.len() as f64 / mesh.area()).sqrt() * 0.66;
        let row = |p: &coarsen::math::DVec3| {
            let [x, y, z] = (*p * scale).as_vec3().to_array();
            Position { x, y, z, flags: 0 }
        };
        let positions: Vec<Position> = mesh.positions.iter().map(row).collect();
        let (v, f) = (positions.len(), faces.len());
        let (contractions, roles) = contractions(&positions, &faces);
        let pairs = upload(queue, vec![Edge::default(); 3 * f]);
        let mut zeros = |len| upload(queue, vec![0_u32; len]);
        let mut scene = Self {
            vertex_count: v as u32,
            face_count: f as u32,
            pair_count: 0,
            contraction_count: contractions.len() as u32,
            ring_starts: zeros(0),
            ring_faces: zeros(0),
            pair_counts: zeros(f),
            pair_starts: zeros(0),
            pairs,
            keys: zeros(3 * f),
            plane_keys: zeros(3 * f),
            buckets: zeros(BUCKETS as usize),
            candidate_counts: zeros(3 * f),
            candidate_starts: zeros(0),
            roles: zeros(0),
            values: zeros(f + 1),
            block_sums: zeros((f + 1).div_ceil(SCAN_BLOCK as usize)),
            face_live: zeros(f + 1),
            vertex_live: zeros(v + 1),
            ring_lengths: zeros(v + 1),
            new_face: zeros(0),
            new_vertex: zeros(1),
            new_starts: zeros(0),
            starts_out: zeros(v + 1),
            rings_out: zeros(3 * f),
            moved_roles: zeros(v),
            normals: rows(queue, f),
            sums: rows(queue, v),
            borders: rows(queue, 1),
            quadrics: rows(queue, v),
            corners: rows(queue, f),
            areas: rows(queue, v),
            curvatures: rows(queue, v),
            curvature_sums: rows(queue, v.div_ceil(SUM_BLOCK as usize)),
            weights: rows(queue, v),
            weighed_quadrics: rows(queue, v),
            quadric_bounds: rows(queue, v),
            quadric_maxima: rows(queue, v.div_ceil(MAXIMUM_BLOCK as usize)),
            quadric_words: rows(queue, word_count(LOCAL16, v)),
            restored_quadrics: rows(queue, v),
            weighed_keys: rows(queue, 3 * f),
            candidates: rows(queue, 3 * f),
            threshold: rows(queue, 1),
            threshold_out: rows(queue, 1),
            positions_out: rows(queue, v),
            faces_out: rows(queue, f),
            quadrics_out: rows(queue, v),
            moved_positions: upload(queue, positions.clone()),
            moved_quadrics: rows(queue, v),
            renamed_faces: upload(queue, faces.clone()),
            positions: upload(queue, positions),
            faces: upload(queue, faces),
            contractions: upload(queue, contractions),
        };
        scene.ring_starts = upload(queue, rings.starts);
        scene.ring_faces = upload(queue, rings.faces);
        scene.roles = upload(queue, roles);
        scene.fill(queue);
        scene
    }

    /// Runs what later kernels read the results of; the scans are plain sums.
    fn fill(&mut self, queue: &mut Queue) {
        self.run(
            queue,
            &[
                "face_normals",
                "volume_sums",
                "plane_sums",
                "quadric_bounds",
                "block_maxima",
                "encode_quadrics",
                "face_corners",
                "curvatures",
                "feature_weights",
                "count_pairs",
            ],
        );
        self.pair_starts = upload(queue, sums_before(self.pair_counts.host()));
        self.pair_count = self.pair_starts.host().last().copied().unwrap_or(0);
        self.run(queue, &["gather_pairs", "volume_costs"]);
        let mut keys = self.keys.host()[..self.pair_count as usize].to_vec();
        let middle = keys.len() / 2;
        let key = *keys.select_nth_unstable(middle).1;
        self.threshold = upload(queue, vec![Threshold { pairs: self.pair_count, key, passing: middle as u32 }]);
        self.run(queue, &["count_candidates", "contract_faces", "live_vertices"]);
        self.candidate_starts = upload(queue, sums_before(self.candidate_counts.host()));
        self.new_face = upload(queue, sums_before(self.face_live.host()));
        self.new_vertex = upload(queue, sums_before(self.vertex_live.host()));
        self.new_starts = upload(queue, sums_before(self.ring_lengths.host()));
    }

    fn run(&mut self, queue: &mut Queue, names: &[&str]) {
        for name in names {
            let stage = stages::STAGES.iter().find(|stage| stage.name == *name).expect("a stage's name");
            (stage.run)(self, queue).expect("runs on the host");
        }
    }
}

/// Edges that share no vertex, contracted to their midpoints, and the roles they give to vertices.
fn contractions(positions: &[Position], faces: &[Face]) -> (Vec<Contraction>, Vec<u32>) {
    let mut roles = vec![0; positions.len()];
    let mut contractions = Vec::new();
    // A stride spreads them over the mesh.
    for face in faces.iter().step_by(3) {
        let (keep, gone) = (face.a.min(face.b), face.a.max(face.b));
        if roles[keep as usize] | roles[gone as usize] == 0 && contractions.len() * VERTICES_A_CONTRACTION < roles.len()
        {
            roles[keep as usize] = KEEPS | gone;
            roles[gone as usize] = GONE | keep;
            let middle = (positions[keep as usize].xyz() + positions[gone as usize].xyz()) * 0.5;
            contractions.push(Contraction { keep, gone, x: middle.x, y: middle.y, z: middle.z, flags: 0 });
        }
    }
    (contractions, roles)
}

fn sums_before(values: &[u32]) -> Vec<u32> {
    let before = |sum: &mut u32, &value: &u32| Some(std::mem::replace(sum, *sum + value));
    values.iter().scan(0, before).collect()
}

fn upload<T: Row>(queue: &mut Queue, rows: Vec<T>) -> Buffer<T> {
    queue.buffer_from(rows).expect("memory for the statue")
}

fn rows<T: Row>(queue: &Queue, len: usize) -> Buffer<T> {
    queue.buffer(len).expect("memory for the statue")
}
