//! Contracting the selected pairs of a round one after the other, each on the state that the ones before it left.
//!
//! # Invariants
//! - No vertex is an end of two contractions of a round; rings of unused ends are therefore those of its start.
//! - Faces are renamed in place; a face with two equal corners is dead.

use std::time::{Duration, Instant};

use crate::kernel::contract_quadrics::contracted;
use crate::kernel::contract_vertices::{GONE, KEEPS};
use crate::kernel::pairs::half_edge_corners;
use crate::kernel::plane_costs::PLANE_REGULARIZATION;
use crate::kernel::rows::{BORDER, Candidate, Contraction, LOCKED, PlaneQuadric, Position};
use crate::kernel::stars::Stars;
use crate::kernel::volume_costs::{BORDER_FACTOR, VOLUME_REGULARIZATION};
use crate::math::{DVec3, Vec3};
use crate::simplify::Blocked;

use super::carry::Carried;
use super::filter::{Rejection, ShapeLimits, link_condition, shapes_hold};
use super::placement::Quadric;
use super::star::{Marks, Star};
use super::surface::Surface;
use super::{Metric, Options, Placement};

/// Least height of a changed face over its length. Thinner faces have normals of rounding noise, which the next
/// contraction lays over.
const MIN_HEIGHT: f64 = 1e-3;

/// A pair that came to cost more than this many times what it did waits for the next round.
const OUTDATED: f64 = 2.0;
/// Costs, in the normalized frame, that are not worth waiting for: what rounding leaves on a flat.
const NEGLIGIBLE: f64 = 1e-12;

/// One attempt in this many is timed: a clock takes as long as a tenth of an attempt.
const TIMED: u64 = 16;

/// What stays the same over all rounds of a run.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    metric: Metric,
    placement: Placement,
    border_weight: f64,
    regularization: f64,
    pub limits: ShapeLimits,
    /// Greatest estimated deviation, in the normalized frame.
    max_deviation: f64,
}

impl Rules {
    /// The rules that `options` set, with an error limit in the normalized frame.
    pub fn new(options: &Options, max_deviation: f64) -> Self {
        Self {
            metric: options.metric,
            placement: options.placement,
            border_weight: f64::from(BORDER_FACTOR * options.border_weight),
            regularization: f64::from(match options.metric {
                Metric::Volume => VOLUME_REGULARIZATION,
                Metric::Plane => PLANE_REGULARIZATION,
            }),
            limits: ShapeLimits { min_cos: options.min_cos(), min_height: MIN_HEIGHT },
            max_deviation,
        }
    }
}

/// The live mesh on the host.
#[derive(Debug)]
pub struct Live<'a> {
    pub surface: &'a mut Surface,
    pub carried: &'a mut Carried,
}

/// How many faces a round may remove.
///
/// Interior pairs remove two and border pairs one. Where one is left to remove, only a border pair will do, unless the
/// quota may be overshot by one face because no border pair did.
#[derive(Debug, Clone, Copy)]
pub struct Quota {
    pub faces: usize,
    pub may_overshoot: bool,
}

/// What a round's commit did.
#[derive(Debug, Default)]
pub struct Committed {
    /// The accepted contractions, in order.
    pub contractions: Vec<Contraction>,
    /// Faces they removed.
    pub faces_removed: usize,
    /// Refusals by reason.
    pub blocked: Blocked,
    /// Key of the last accepted candidate.
    pub greatest_key: u32,
}

/// Scratch that outlives a round, and the state that a run accumulates.
#[derive(Debug)]
pub struct Committer {
    pub rules: Rules,
    star: Star,
    marks: Marks,
    /// Whether a pair that became dear may wait for another round.
    pub may_wait: bool,
    /// Greatest estimated deviation of a contraction so far, in the normalized frame.
    pub deviation: f32,
    /// Attempts so far.
    attempts: u64,
    /// Time that every [`TIMED`]th of them spent in the filters.
    timed: Duration,
}

/// A legal contraction.
#[derive(Debug, Clone, Copy)]
struct Accepted {
    x: Vec3,
    /// Where x lies between the ends, for what vertices carry.
    t: f32,
    quadric: PlaneQuadric,
    drift: f32,
    deviation: f32,
}

impl Committer {
    /// For a surface of `vertex_count` vertices.
    pub fn new(rules: Rules, vertex_count: usize) -> Self {
        Self {
            rules,
            star: Star::default(),
            marks: Marks::new(vertex_count),
            may_wait: true,
            deviation: 0.0,
            attempts: 0,
            timed: Duration::ZERO,
        }
    }

    /// Seconds spent in filters and placements so far, by the attempts that were timed.
    pub fn filter_secs(&self) -> f64 {
        self.timed.as_secs_f64() * TIMED as f64
    }

    /// Contracts the legal ones among `candidates`, in order, until the quota is used up; no vertex twice.
    pub fn commit(&mut self, live: &mut Live<'_>, candidates: &[Candidate], quota: Quota, committed: &mut Committed) {
        let mut overshooting = None;
        for (i, candidate) in candidates.iter().enumerate() {
            let left = quota.faces.saturating_sub(committed.faces_removed);
            if left == 0 {
                return;
            }
            if left == 1 && !removes_one(live.surface, *candidate) {
                overshooting = overshooting.or(Some(i));
                continue;
            }
            self.attempt(live, *candidate, committed);
        }
        if let Some(first) = overshooting.filter(|_| quota.may_overshoot) {
            for candidate in &candidates[first..] {
                if committed.faces_removed >= quota.faces {
                    break;
                }
                self.attempt(live, *candidate, committed);
            }
        }
    }

    /// Contracts the legal ones among `selected`, all of which fit the quota and no two of which share an end. Does not
    /// count refusals: [`Committer::commit`] meets them again.
    pub fn commit_all(&mut self, live: &mut Live<'_>, selected: &[Candidate], committed: &mut Committed) {
        for &candidate in selected {
            self.attempt(live, candidate, committed);
        }
        committed.blocked = Blocked::default();
    }

    fn attempt(&mut self, live: &mut Live<'_>, candidate: Candidate, committed: &mut Committed) {
        let [u, w, _] = half_edge_corners(candidate.half_edge, live.surface.faces.host());
        let roles = live.surface.roles.host();
        if u == w || roles[u as usize] | roles[w as usize] != 0 {
            return;
        }
        let clock = self.attempts.is_multiple_of(TIMED).then(Instant::now);
        self.attempts += 1;
        let examined = self.examine(live, [u, w], f32::from_bits(candidate.key));
        self.timed += clock.map_or(Duration::ZERO, |clock| clock.elapsed());
        match examined {
            Err(rejection) => committed.blocked.count(rejection),
            Ok(accepted) => {
                self.deviation = self.deviation.max(accepted.deviation);
                committed.faces_removed += self.star.shared.len();
                committed.contractions.push(contract(live, [u, w], &accepted));
                committed.greatest_key = committed.greatest_key.max(candidate.key);
            }
        }
    }

    /// The contraction of `u` and `w`, which cost `cost` as the round began, if it is legal now.
    fn examine(&mut self, live: &Live<'_>, [u, w]: [u32; 2], cost: f32) -> Result<Accepted, Rejection> {
        let surface = &*live.surface;
        let stars = Stars::on_host(&surface.positions, &surface.faces, &surface.ring_starts, &surface.ring_faces);
        let (pu, pw) = (stars.positions[u as usize], stars.positions[w as usize]);
        self.star.gather(u, w, &stars);
        link_condition(&self.star, [u, w], [pu.flags, pw.flags], &mut self.marks)?;

        let quadrics = surface.quadrics.as_ref().map_or(&[][..], |q| q.host());
        let (qu, qw) = (quadrics[u as usize], quadrics[w as usize]);
        let (a, b) = (pu.xyz().as_dvec3(), pw.xyz().as_dvec3());
        let h = (b - a) * 0.5;
        let middle = a + h;
        self.star.locate(stars.positions, middle);
        let on_border = (pu.flags | pw.flags) & BORDER != 0;
        let quadric = self.quadric([u, w], on_border, h, [&qu, &qw]);
        let x = match (pu.flags & LOCKED, pw.flags & LOCKED, self.rules.placement) {
            (0, 0, Placement::Optimal) => quadric.least(h, self.rules.regularization),
            (0, 0, Placement::Endpoint) => quadric.better_end(h),
            (0, _, _) => h,
            _ => -h,
        };
        let value = quadric.value(x).max(0.0);
        // Accumulated quadrics are the ends' own: no neighbor changes their cost.
        if self.may_wait && self.rules.metric == Metric::Volume && value > OUTDATED * f64::from(cost) + NEGLIGIBLE {
            return Err(Rejection::Outdated);
        }
        // To the bit at the ends, whose difference may have been rounded.
        let at = match x {
            _ if x == h => pw.xyz(),
            _ if x == -h => pu.xyz(),
            _ => (middle + x).as_vec3(),
        };
        shapes_hold(&self.star, at.as_dvec3() - middle, self.rules.limits)?;

        let accumulated = contracted(qu, qw, pu.xyz(), pw.xyz(), at);
        let drift = match self.rules.metric {
            Metric::Plane => f32::INFINITY,
            Metric::Volume => live.carried.drift(u, w) + (value / quadric.weight()).sqrt() as f32,
        };
        let deviation = deviation(&accumulated).min(drift);
        if f64::from(deviation) > self.rules.max_deviation {
            return Err(Rejection::Error);
        }
        let t = match at {
            _ if at == pu.xyz() => 0.0,
            _ if at == pw.xyz() => 1.0,
            // Strictly inside: only a placement exactly at an end takes that end's own rows.
            _ => (((x + h).dot(h) / (2.0 * h.length_squared())) as f32).clamp(f32::EPSILON, 1.0 - f32::EPSILON),
        };
        Ok(Accepted { x: at, t, quadric: accumulated, drift, deviation })
    }

    /// The pair's quadric about its midpoint, on the current state.
    fn quadric(&self, pair: [u32; 2], on_border: bool, h: DVec3, quadrics: [&PlaneQuadric; 2]) -> Quadric {
        let mut quadric = Quadric::default();
        match self.rules.metric {
            Metric::Plane => {
                quadric.add_plane_quadric(quadrics[0], -h);
                quadric.add_plane_quadric(quadrics[1], h);
            }
            Metric::Volume => {
                for face in self.star.faces() {
                    quadric.add_face(face.normal, face.points[0]);
                }
                if on_border {
                    quadric.free_volume();
                    let weight = self.rules.border_weight * 4.0 * h.length_squared();
                    for [from, to] in self.star.border_edges(pair) {
                        quadric.add_border(to - from, from, weight);
                    }
                }
            }
        }
        quadric
    }
}

/// Whether a candidate may be a border pair, which removes one face.
fn removes_one(surface: &Surface, candidate: Candidate) -> bool {
    let positions = surface.positions.host();
    let [u, w, _] = half_edge_corners(candidate.half_edge, surface.faces.host());
    positions[u as usize].flags & positions[w as usize].flags & BORDER != 0
}

/// The root of the weighted mean squared distance of a quadric's own vertex to its planes.
fn deviation(quadric: &PlaneQuadric) -> f32 {
    if quadric.weight > 0.0 { (quadric.c.max(0.0) / quadric.weight).sqrt() } else { 0.0 }
}

/// Writes an accepted contraction into the surface and what it carries.
fn contract(live: &mut Live<'_>, [u, w]: [u32; 2], accepted: &Accepted) -> Contraction {
    let Live { surface, carried } = live;
    let (keep, gone) = (u.min(w), u.max(w));
    let positions = surface.positions.host_mut();
    let flags = positions[u as usize].flags | positions[w as usize].flags;
    let Vec3 { x, y, z } = accepted.x;
    positions[keep as usize] = Position { x, y, z, flags };
    if let Some(quadrics) = &mut surface.quadrics {
        quadrics.host_mut()[keep as usize] = accepted.quadric;
    }
    carried.contract(keep, [u, w], accepted.t, accepted.drift);
    let roles = surface.roles.host_mut();
    roles[keep as usize] = KEEPS | gone;
    roles[gone as usize] = GONE | keep;
    let starts = surface.ring_starts.host();
    let faces = surface.faces.host_mut();
    for &f in &surface.ring_faces.host()[starts[gone as usize] as usize..starts[gone as usize + 1] as usize] {
        let face = &mut faces[f as usize];
        for corner in [&mut face.a, &mut face.b, &mut face.c] {
            if *corner == gone {
                *corner = keep;
            }
        }
    }
    Contraction { keep, gone, x, y, z, flags }
}
