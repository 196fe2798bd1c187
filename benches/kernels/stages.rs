//! The kernels in the order of a round, each with what it reads and writes in the scene.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::block_maxima::BlockMaxima;
use coarsen::kernel::block_sums::BlockSums;
use coarsen::kernel::compact_faces::CompactFaces;
use coarsen::kernel::compact_quadrics::CompactQuadrics;
use coarsen::kernel::compact_rings::CompactRings;
use coarsen::kernel::compact_vertices::CompactVertices;
use coarsen::kernel::contract_faces::ContractFaces;
use coarsen::kernel::contract_quadrics::ContractQuadrics;
use coarsen::kernel::contract_vertices::ContractVertices;
use coarsen::kernel::cost_histogram::{BUCKETS, CostHistogram};
use coarsen::kernel::count_candidates::CountCandidates;
use coarsen::kernel::count_pairs::CountPairs;
use coarsen::kernel::curvatures::Curvatures;
use coarsen::kernel::decode_quadrics::DecodeQuadrics;
use coarsen::kernel::encode_quadrics::EncodeQuadrics;
use coarsen::kernel::face_corners::FaceCorners;
use coarsen::kernel::face_normals::FaceNormals;
use coarsen::kernel::feature_weights::{FeatureWeights, Params};
use coarsen::kernel::find_threshold::{FindThreshold, Gate};
use coarsen::kernel::format_frame::FormatFrame;
use coarsen::kernel::gather_candidates::GatherCandidates;
use coarsen::kernel::gather_pairs::GatherPairs;
use coarsen::kernel::live_vertices::LiveVertices;
use coarsen::kernel::pairs::{PAIR_BLOCK, Special};
use coarsen::kernel::plane_costs::PlaneCosts;
use coarsen::kernel::plane_sums::PlaneSums;
use coarsen::kernel::quadric_bounds::QuadricBounds;
use coarsen::kernel::quadric_format::LOCAL16;
use coarsen::kernel::scan_add::ScanAdd;
use coarsen::kernel::scan_blocks::ScanBlocks;
use coarsen::kernel::volume_costs::{BORDER_FACTOR, VolumeCosts};
use coarsen::kernel::volume_sums::VolumeSums;
use coarsen::kernel::weigh_keys::WeighKeys;
use coarsen::kernel::weigh_quadrics::WeighQuadrics;

use crate::scene::Scene;

/// The statue is closed.
const ORDINARY: Special = Special { has_border: false, has_held: false };

/// A kernel on a scene.
pub struct Stage {
    /// The kernel's name.
    pub name: &'static str,
    /// Rows it works through.
    pub rows: fn(&Scene) -> u64,
    /// Issues it.
    pub run: fn(&mut Scene, &mut Queue) -> Result<()>,
}

fn vertices(scene: &Scene) -> u64 {
    scene.vertex_count.into()
}

fn faces(scene: &Scene) -> u64 {
    scene.face_count.into()
}

fn pairs(scene: &Scene) -> u64 {
    scene.pair_count.into()
}

fn buckets(_: &Scene) -> u64 {
    BUCKETS.into()
}

fn contractions(scene: &Scene) -> u64 {
    scene.contraction_count.into()
}

/// A [`Stage`] that issues one kernel.
macro_rules! stage {
    ($name:literal, $rows:ident, |$scene:ident| $kernel:expr) => {
        Stage { name: $name, rows: $rows, run: |$scene, queue| queue.run($kernel) }
    };
}

/// 1 + 4 times the feature degree.
const AFFINE: Params =
    Params { floor_share: 2e-6, least_sum: 1.0, gated: 0, base: 1.0, slope: 4.0, least: 0.0, of_fixed: 5.0 };

/// In a thousandth of a mean edge, about half of the statue's diagonal.
const ABOUT_THE_MIDDLE: FormatFrame = FormatFrame { origin_x: 0.0, origin_y: 0.0, origin_z: 0.0, unit: 1e-3 };

/// All kernels of a round.
pub const STAGES: &[Stage] = &[
    stage!("face_normals", faces, |s| FaceNormals {
        positions: &s.positions,
        faces: &s.faces,
        face_count: s.face_count,
        normals: &mut s.normals,
    }),
    stage!("volume_sums", vertices, |s| VolumeSums {
        positions: &s.positions,
        faces: &s.faces,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        normals: &s.normals,
        vertex_count: s.vertex_count,
        sums: &mut s.sums,
        borders: &mut s.borders,
    }),
    stage!("plane_sums", vertices, |s| PlaneSums {
        positions: &s.positions,
        faces: &s.faces,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        normals: &s.normals,
        vertex_count: s.vertex_count,
        border_weight: 1.0,
        by_area: 1,
        quadrics: &mut s.quadrics,
    }),
    stage!("face_corners", faces, |s| FaceCorners {
        positions: &s.positions,
        faces: &s.faces,
        face_count: s.face_count,
        corners: &mut s.corners,
    }),
    stage!("curvatures", vertices, |s| Curvatures {
        positions: &s.positions,
        faces: &s.faces,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        corners: &s.corners,
        vertex_count: s.vertex_count,
        areas: &mut s.areas,
        curvatures: &mut s.curvatures,
    }),
    stage!("block_sums", vertices, |s| BlockSums {
        values: &s.curvatures,
        value_count: s.vertex_count,
        sums: &mut s.curvature_sums,
    }),
    stage!("feature_weights", vertices, |s| FeatureWeights {
        positions: &s.positions,
        faces: &s.faces,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        curvatures: &s.curvatures,
        curvature_sum: &s.curvature_sums,
        vertex_count: s.vertex_count,
        params: AFFINE,
        weights: &mut s.weights,
    }),
    stage!("weigh_quadrics", vertices, |s| WeighQuadrics {
        quadrics: &s.quadrics,
        weights: &s.weights,
        vertex_count: s.vertex_count,
        weighed_quadrics: &mut s.weighed_quadrics,
    }),
    stage!("quadric_bounds", vertices, |s| QuadricBounds {
        positions: &s.positions,
        faces: &s.faces,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        normals: &s.normals,
        quadrics: &s.quadrics,
        vertex_count: s.vertex_count,
        frame: ABOUT_THE_MIDDLE,
        bounds: &mut s.quadric_bounds,
    }),
    stage!("block_maxima", vertices, |s| BlockMaxima {
        bounds: &s.quadric_bounds,
        bound_count: s.vertex_count,
        maxima: &mut s.quadric_maxima,
    }),
    stage!("encode_quadrics", vertices, |s| EncodeQuadrics {
        positions: &s.positions,
        quadrics: &s.quadrics,
        bound: &s.quadric_maxima,
        vertex_count: s.vertex_count,
        frame: ABOUT_THE_MIDDLE,
        format: LOCAL16,
        words: &mut s.quadric_words,
    }),
    stage!("decode_quadrics", vertices, |s| DecodeQuadrics {
        positions: &s.positions,
        words: &s.quadric_words,
        bound: &s.quadric_maxima,
        vertex_count: s.vertex_count,
        frame: ABOUT_THE_MIDDLE,
        format: LOCAL16,
        quadrics: &mut s.restored_quadrics,
    }),
    stage!("count_pairs", faces, |s| CountPairs {
        positions: &s.positions,
        faces: &s.faces,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        vertex_count: s.vertex_count,
        special: ORDINARY,
        face_count: s.face_count,
        counts: &mut s.pair_counts,
    }),
    stage!("scan_blocks", faces, |s| ScanBlocks {
        values: &mut s.values,
        count: s.face_count + 1,
        sums: &mut s.block_sums,
    }),
    stage!("scan_add", faces, |s| ScanAdd { sums: &s.block_sums, values: &mut s.values, count: s.face_count + 1 }),
    stage!("gather_pairs", vertices, |s| GatherPairs {
        positions: &s.positions,
        faces: &s.faces,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        vertex_count: s.vertex_count,
        special: ORDINARY,
        starts: &s.pair_starts,
        pairs: &mut s.pairs,
    }),
    stage!("volume_costs", pairs, |s| VolumeCosts {
        positions: &s.positions,
        faces: &s.faces,
        normals: &s.normals,
        sums: &s.sums,
        borders: &s.borders,
        pairs: &s.pairs,
        pair_count: s.pair_count,
        border_weight: BORDER_FACTOR,
        placement: 0,
        keys: &mut s.keys,
    }),
    stage!("plane_costs", pairs, |s| PlaneCosts {
        positions: &s.positions,
        faces: &s.faces,
        quadrics: &s.quadrics,
        pairs: &s.pairs,
        pair_count: s.pair_count,
        placement: 0,
        keys: &mut s.plane_keys,
    }),
    stage!("weigh_keys", pairs, |s| WeighKeys {
        faces: &s.faces,
        pairs: &s.pairs,
        weights: &s.weights,
        pair_count: s.pair_count,
        keys: &mut s.weighed_keys,
    }),
    stage!("cost_histogram", pairs, |s| CostHistogram {
        keys: &s.keys,
        pair_starts: &s.pair_starts,
        block_count: s.vertex_count.div_ceil(PAIR_BLOCK),
        most_keys: s.pair_count,
        buckets: &mut s.buckets,
    }),
    stage!("find_threshold", buckets, |s| FindThreshold {
        pair_starts: &s.pair_starts,
        block_count: s.vertex_count.div_ceil(PAIR_BLOCK),
        buckets: &s.buckets,
        gate: Gate { share: 1 << 31, most: u32::MAX, wide_share: 3 << 30, wide_most: u32::MAX },
        threshold: &mut s.threshold_out,
    }),
    stage!("count_candidates", pairs, |s| CountCandidates {
        keys: &s.keys,
        threshold: &s.threshold,
        most_keys: s.pair_count,
        counts: &mut s.candidate_counts,
    }),
    stage!("gather_candidates", pairs, |s| GatherCandidates {
        keys: &s.keys,
        pairs: &s.pairs,
        threshold: &s.threshold,
        most_keys: s.pair_count,
        starts: &s.candidate_starts,
        candidates: &mut s.candidates,
    }),
    stage!("contract_quadrics", contractions, |s| ContractQuadrics {
        contractions: &s.contractions,
        contraction_count: s.contraction_count,
        positions: &s.positions,
        quadrics: &mut s.moved_quadrics,
    }),
    stage!("contract_vertices", contractions, |s| ContractVertices {
        contractions: &s.contractions,
        contraction_count: s.contraction_count,
        positions: &mut s.moved_positions,
        roles: &mut s.moved_roles,
    }),
    stage!("contract_faces", faces, |s| ContractFaces {
        roles: &s.roles,
        faces: &mut s.renamed_faces,
        face_count: s.face_count,
        live: &mut s.face_live,
    }),
    stage!("live_vertices", vertices, |s| LiveVertices {
        roles: &s.roles,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        face_live: &s.face_live,
        vertex_count: s.vertex_count,
        live: &mut s.vertex_live,
        ring_lengths: &mut s.ring_lengths,
    }),
    stage!("compact_vertices", vertices, |s| CompactVertices {
        new_vertex: &s.new_vertex,
        new_starts: &s.new_starts,
        positions: &s.positions,
        vertex_count: s.vertex_count,
        positions_out: &mut s.positions_out,
        starts_out: &mut s.starts_out,
    }),
    stage!("compact_rings", vertices, |s| CompactRings {
        roles: &s.roles,
        ring_starts: &s.ring_starts,
        ring_faces: &s.ring_faces,
        new_face: &s.new_face,
        new_vertex: &s.new_vertex,
        new_starts: &s.new_starts,
        vertex_count: s.vertex_count,
        rings_out: &mut s.rings_out,
    }),
    stage!("compact_faces", faces, |s| CompactFaces {
        new_face: &s.new_face,
        new_vertex: &s.new_vertex,
        faces: &s.renamed_faces,
        face_count: s.face_count,
        faces_out: &mut s.faces_out,
    }),
    stage!("compact_quadrics", vertices, |s| CompactQuadrics {
        new_vertex: &s.new_vertex,
        quadrics: &s.quadrics,
        vertex_count: s.vertex_count,
        quadrics_out: &mut s.quadrics_out,
    }),
];
