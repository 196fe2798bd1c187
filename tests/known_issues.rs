//! What is known to be wrong, each shown by a test that must fail: mending one makes its test here fail, and it moves to
//! `regression.rs`.

mod support;

use coarsen::Budget;
use coarsen::contract::Options;
use coarsen::math::DVec3;
use support::engine::contract;
use support::shapes::mesh;

/// Coordinates that the frame cannot bring into single precision (an unused vertex lies 1e200 boxes away, and the weight of
/// borders is large) leave a trace with its sign bit set; the exponent taken from it is past what it is subtracted from.
/// A release build wraps, and a shader may do as it likes.
#[test]
#[cfg_attr(not(debug_assertions), ignore = "only debug builds check for overflow")]
#[should_panic(expected = "attempt to subtract with overflow")]
fn a_trace_that_is_no_number_overflows_an_exponent() {
    let mut far = mesh(&[[0.0; 3]; 6], &[[2, 5, 3], [5, 0, 3]]);
    far.positions = [
        [-1.9658153609580605e-59, -2.1738021751594065e-66, -6.716213466724685e-22],
        [5.230282489803305e155, -8.788897629629044e-264, -6.858543207730255e-206],
        [-9.747297842989641e-293, 0.0015092251638708643, 2.9084127848951787e86],
        [-7.652839238994713e-24, -8.59513583237823e-258, -1.9161473449168517e-58],
        [4.683863005588166e139, 9.60160544314914e287, 3.207787680983543e95],
        [-9.258470589165796e-278, -8.705081526238523e-28, -8.63385311021099e-260],
    ]
    .map(DVec3::from)
    .to_vec();
    let options = Options { border_weight: 1e6, weld: None, ..Options::default() };
    contract(&far, &options, Budget::faces(0));
}
