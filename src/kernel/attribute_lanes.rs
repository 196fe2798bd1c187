//! The costs of many pairs off borders and seams at once, in lanes: before their terms, one term after the other, and when all
//! are known.

use bytemuck::{Pod, Zeroable};

use super::attribute_costs::Params;
use super::attribute_terms::{
    Joint, SideWeights, ends_half_exponent, freedom, joint_cost, side_weights, term_of, with_side, with_term,
};
use super::pair_quadric::{NO_WEIGHT, cost_key, scale_down};
use super::rows::{AttributeSum, Normal, Position, Slope, VolumeSum};
use super::volume_costs::{Ends, volume_ends};
use crate::math::Vec3;
use crate::math::exact::{mul, scale3, sub3, sym_add, trace};
use crate::math::lanes::{Columns, Pass};

/// A pair off the border and off the seams, without its terms.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub(super) struct Head {
    pub pu: Position,
    pub pw: Position,
    pub sum_u: VolumeSum,
    pub sum_w: VolumeSum,
    pub left: Normal,
    pub right: Normal,
    pub first: AttributeSum,
    pub second: AttributeSum,
}

/// What is known of a pair while its terms are added.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub(super) struct State {
    pub joint: Joint,
    pub weights: SideWeights,
    pub h: Vec3,
    pub half: u32,
}

/// One number of a pair: of the wedges at its ends, as they are stored.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub(super) struct Numbers {
    pub first: Slope,
    pub second: Slope,
}

/// 32-bit scalars of the rows above.
pub(super) const HEAD_WORDS: usize = size_of::<Head>() / 4;
pub(super) const STATE_WORDS: usize = size_of::<State>() / 4;
pub(super) const NUMBER_WORDS: usize = size_of::<Numbers>() / 4;

/// What the ends of a pair sum to.
#[inline(always)]
fn head_ends(head: Head) -> Ends {
    with_side(volume_ends(head.sum_u, head.sum_w, head.left, head.right), head.first, head.second)
}

/// Before the terms of a pair.
pub(super) struct Begin;

impl Pass for Begin {
    type Row = Head;
    type State = ();
    type Params = ();
    type Next = State;

    #[inline(always)]
    fn pass(head: Head, (): (), (): ()) -> State {
        let half = ends_half_exponent(head_ends(head));
        let s = scale_down(half);
        let s_sq = mul(s, s);
        State {
            joint: Joint::default(),
            weights: side_weights(mul(head.first.weight, s_sq), mul(head.second.weight, s_sq)),
            h: scale3(sub3(head.pw.xyz(), head.pu.xyz()), 0.5),
            half,
        }
    }
}

/// One term after the other.
pub(super) struct Accumulate;

impl Pass for Accumulate {
    type Row = Numbers;
    type State = State;
    type Params = ();
    type Next = State;

    #[inline(always)]
    fn pass(numbers: Numbers, state: State, (): ()) -> State {
        let s = scale_down(state.half);
        let term = term_of(numbers.first, numbers.second, mul(s, s));
        State { joint: with_term(state.joint, term, state.weights, state.h), ..state }
    }
}

/// When all terms of a pair are known.
pub(super) struct Finish;

impl Pass for Finish {
    type Row = Head;
    type State = State;
    type Params = Params;
    type Next = u32;

    #[inline(always)]
    fn pass(head: Head, state: State, params: Params) -> u32 {
        let ends = head_ends(head);
        let freedom = freedom(head.pu.flags, head.pw.flags, params);
        let cost = joint_cost(ends, state.joint, state.half, state.h, freedom);
        if trace(sym_add(ends.first, ends.second)) <= NO_WEIGHT { 0 } else { cost_key(cost) }
    }
}

/// Scratch for the keys of pairs.
pub(super) struct Block {
    pub heads: Columns<Head, HEAD_WORDS>,
    pub numbers: Columns<Numbers, NUMBER_WORDS>,
    pub states: [Columns<State, STATE_WORDS>; 2],
    pub keys: Columns<u32, 1>,
}

impl Block {
    pub fn new() -> Self {
        let states = [Columns::new(), Columns::new()];
        Self { heads: Columns::new(), numbers: Columns::new(), states, keys: Columns::new() }
    }
}
