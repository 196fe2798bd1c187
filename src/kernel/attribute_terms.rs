//! What attributes add to the cost of a pair, number by number. In WGSL: `shaders/shared/attribute_terms.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::attribute_costs::Params;
use super::pair_quadric::{
    AT_ENDS, Freedom, NO_WEIGHT, NOISE, PairQuadric, ROUNDING, half_exponent, pair_cost, scale_down, scale_up, stays,
    value,
};
use super::rows::{AttributeSum, Slope};
use super::volume_costs::{Ends, ends_quadric};
use crate::math::Vec3;
use crate::math::exact::{
    Sym3, add, add3, divide, dot3, mul, outer, scale3, sub, sub3, sym_add, sym_scale, sym_sub, trace,
};

/// What the attributes add about the midpoint.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub(super) struct Joint {
    /// With the means of the ends' numbers.
    pub b: Vec3,
    pub c: f32,
    /// What the least numbers save.
    pub saved: Sym3,
    pub saved_b: Vec3,
    pub saved_c: f32,
    /// What the numbers of either end cost at its place more than the means.
    pub at_first: f32,
    pub at_second: f32,
}

/// The weights of a side: of the wedges of both ends, and of its faces; one over the last.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub(super) struct SideWeights {
    pub first: f32,
    pub second: f32,
    pub all: f32,
    pub inverse: f32,
}

#[inline(always)]
pub(super) fn side_weights(first: f32, second: f32) -> SideWeights {
    let all = add(first, second);
    let inverse = if all > NO_WEIGHT { divide(1.0, all) } else { 0.0 };
    SideWeights { first, second, all, inverse }
}

/// One number of a side: the sums of |n| g of both wedges, half the ends' difference.
#[derive(Debug, Clone, Copy)]
pub(super) struct Term {
    pub first: Vec3,
    pub second: Vec3,
    pub half: f32,
}

/// The term of a number, its sums times `scale`.
#[inline(always)]
pub(super) fn term_of(first: Slope, second: Slope, scale: f32) -> Term {
    Term {
        first: scale3(first.xyz(), scale),
        second: scale3(second.xyz(), scale),
        half: mul(sub(second.at, first.at), 0.5),
    }
}

#[inline(always)]
pub(super) fn with_term(joint: Joint, term: Term, weights: SideWeights, h: Vec3) -> Joint {
    let q = term.half;
    let g = add3(term.first, term.second);
    let first_h = dot3(term.first, h);
    let second_h = dot3(term.second, h);
    let e = sub(sub(first_h, mul(q, weights.first)), sub(second_h, mul(q, weights.second)));
    let q_sq = mul(q, q);
    let across = mul(mul(2.0, q), add(first_h, second_h));
    let scaled = scale3(g, weights.inverse);
    let gh = dot3(g, h);
    let own = mul(q_sq, weights.all);
    let twice = mul(2.0, q);
    Joint {
        b: add3(joint.b, scale3(sub3(term.first, term.second), q)),
        c: add(joint.c, sub(own, across)),
        saved: sym_add(joint.saved, sym_scale(outer(g), weights.inverse)),
        saved_b: add3(joint.saved_b, scale3(scaled, e)),
        saved_c: add(joint.saved_c, mul(mul(e, e), weights.inverse)),
        at_first: add(joint.at_first, add(mul(twice, sub(e, gh)), own)),
        at_second: add(joint.at_second, sub(own, mul(twice, add(gh, e)))),
    }
}

/// Half the exponent that takes the trace of both ends to about 1.
#[inline(always)]
pub(super) fn ends_half_exponent(ends: Ends) -> u32 {
    half_exponent(trace(sym_add(ends.first, ends.second)))
}

/// The cost of a pair from −h to h; the attributes are scaled by the square of `s`, the geometry is not yet.
#[inline(always)]
pub(super) fn joint_cost(ends: Ends, joint: Joint, half: u32, h: Vec3, freedom: Freedom) -> f32 {
    let s = scale_down(half);
    let s_sq = mul(s, s);
    let mut q = ends_quadric(ends, s_sq, h);
    q.b = add3(q.b, joint.b);
    q.c = add(q.c, joint.c);
    let at_first = add(value(q, scale3(h, -1.0)), joint.at_first);
    let at_second = add(value(q, h), joint.at_second);

    let pull = mul(ROUNDING, trace(joint.saved));
    let pulled = Sym3 { xx: pull, xy: 0.0, xz: 0.0, yy: pull, yz: 0.0, zz: pull };
    let least = PairQuadric {
        a: sym_add(sym_sub(q.a, joint.saved), pulled),
        b: add3(q.b, joint.saved_b),
        c: sub(q.c, joint.saved_c),
        n: q.n,
        d: q.d,
    };
    let free = Freedom { first_locked: false, second_locked: false, ..freedom };
    let mut cost = pair_cost(least, h, free);
    cost = if freedom.placement == AT_ENDS { at_first.min(at_second) } else { cost };
    cost = if freedom.first_locked { at_first } else { cost };
    cost = if freedom.second_locked { at_second } else { cost };
    cost = if cost > NOISE { cost } else { 0.0 };
    mul(mul(cost, scale_up(half)), scale_up(half))
}

/// Geometry of both ends, with the outer products of the attributes of one side.
#[inline(always)]
pub(super) fn with_side(ends: Ends, first: AttributeSum, second: AttributeSum) -> Ends {
    Ends { first: sym_add(ends.first, first.matrix()), second: sym_add(ends.second, second.matrix()), ..ends }
}

#[inline(always)]
pub(super) fn freedom(first: u32, second: u32, params: Params) -> Freedom {
    Freedom {
        first_locked: stays(first, second),
        second_locked: stays(second, first),
        placement: params.placement,
        regularization: params.regularization,
    }
}
