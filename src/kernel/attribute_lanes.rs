//! The costs of many pairs off borders and seams at once, in lanes: before their terms, one term after the other, and when all
//! are known.

use bytemuck::{Pod, Zeroable};

use super::attribute_costs::Params;
use super::attribute_terms::{
    Joint, SideWeights, Term, ends_half_exponent, freedom, joint_cost, side_weights, with_side, with_term,
};
use super::pair_quadric::{NO_WEIGHT, cost_key, scale_down};
use super::rows::{AttributeSum, Gradient, Normal, Position, VolumeSum};
use super::volume_costs::{Ends, volume_ends};
use crate::math::Vec3;
use crate::math::exact::{mul, scale3, sub, sub3, sym_add, trace};
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
    pub left_root: f32,
    pub right_root: f32,
}

/// One number of a pair, as it is stored.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub(super) struct Numbers {
    pub first: Gradient,
    pub second: Gradient,
    pub left: Gradient,
    pub right: Gradient,
    pub at_first: f32,
    pub at_second: f32,
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
        let (left_root, right_root) = (mul(head.left.root, s), mul(head.right.root, s));
        let (first, second) = (mul(head.first.weight, s_sq), mul(head.second.weight, s_sq));
        State {
            joint: Joint::default(),
            weights: side_weights(first, second, left_root, right_root),
            h: scale3(sub3(head.pw.xyz(), head.pu.xyz()), 0.5),
            half,
            left_root,
            right_root,
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
        let s_sq = mul(s, s);
        let term = Term {
            first: scale3(numbers.first.xyz(), s_sq),
            second: scale3(numbers.second.xyz(), s_sq),
            left: scale3(numbers.left.xyz(), s),
            right: scale3(numbers.right.xyz(), s),
            left_root: state.left_root,
            right_root: state.right_root,
            half: mul(sub(numbers.at_second, numbers.at_first), 0.5),
        };
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

/// Where the numbers of a pair begin: of its wedges and of the faces on its sides.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Places {
    pub first: usize,
    pub second: usize,
    pub left: usize,
    pub right: Option<usize>,
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
