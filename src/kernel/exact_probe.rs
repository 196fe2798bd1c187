//! Every function of [`math::exact`](crate::math::exact) on hostile operands. Twin: `shaders/exact_probe.wgsl`, line for
//! line.
//!
//! The self-test of a device: one that does not return these bits would contract other pairs than the CPU.

use crate::backend::{Access, Binding, Buffer, Kernel, Queue, params};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::exact::*;

/// Results of one row of operands.
pub const RESULTS: usize = 52;

params! {
    /// The probe's uniform block.
    pub struct ExactProbeParams {
        /// [`RESULTS`].
        results: u32,
    }
}

/// The probe's kernel.
///
/// # Layout
/// `operands`: N rows of four numbers as bits; writes `results`: 51 N, as bits.
#[derive(Debug)]
pub struct ExactProbe<'a> {
    /// Four numbers a row; any bits, infinities and NaN are made finite.
    pub operands: &'a Buffer<[u32; 4]>,
    /// [`RESULTS`] numbers a row.
    pub results: &'a mut Buffer<u32>,
}

impl Kernel for ExactProbe<'_> {
    const NAME: &'static str = "exact_probe";
    const SOURCE: &'static str = include_str!("../../shaders/exact_probe.wgsl");
    type Params = ExactProbeParams;
    const PARAMS: &'static [(&'static str, &'static str)] = ExactProbeParams::FIELDS;

    fn params(&self) -> ExactProbeParams {
        ExactProbeParams { results: RESULTS as u32 }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("operands", Access::Read, self.operands),
            Binding::new("results", Access::Write, self.results),
        ]
    }

    fn invocations(&self) -> u32 {
        self.operands.len() as u32
    }

    fn run_cpu(&mut self) {
        for (bits, results) in self.operands.host().iter().zip(self.results.host_mut().chunks_exact_mut(RESULTS)) {
            exact_probe(*bits, results);
        }
    }
}

fn ranged(bits: u32, span: u32) -> f32 {
    let exponent = (bits >> 23) & 0xff;
    if exponent == 0 {
        return 0.0;
    }
    let near = 127 - span + exponent % (2 * span + 1);
    f32::from_bits((bits & 0x807f_ffff) | (near << 23))
}

fn finite(bits: u32) -> f32 {
    f32::from_bits(if (bits >> 23) & 0xff == 0xff { bits & 0xbfff_ffff } else { bits })
}

fn significand(x: f32) -> u32 {
    (x.to_bits() & 0x7f_ffff) | 0x80_0000
}

fn put_raw(results: &mut [u32], result: usize, x: f32) {
    results[result] = x.to_bits();
}

fn put(results: &mut [u32], result: usize, x: f32) {
    put_raw(results, result, flush(x, LEAST));
}

fn put3(results: &mut [u32], first: usize, v: Vec3) {
    put(results, first, v.x);
    put(results, first + 1, v.y);
    put(results, first + 2, v.z);
}

fn put_sym(results: &mut [u32], first: usize, m: Sym3) {
    put3(results, first, Vec3::new(m.xx, m.xy, m.xz));
    put3(results, first + 3, Vec3::new(m.yy, m.yz, m.zz));
}

/// One row of operands: the [`RESULTS`] numbers that the kernel writes for it, as bits.
pub fn exact_probe(bits: [u32; 4], results: &mut [u32]) {
    let [x, y, z, w] = bits;
    put_raw(results, 0, divide(finite(x), finite(y)));
    put_raw(results, 1, root(finite(x)));

    // Products of two stay within the range.
    let a = ranged(x, 60);
    let b = ranged(y, 60);
    let c = ranged(z, 60);
    let d = ranged(w, 60);
    put(results, 2, add(a, b));
    put(results, 3, sub(a, b));
    put(results, 4, mul(a, b));
    put(results, 5, add(mul(a, b), c));
    put(results, 6, sub(mul(a, b), mul(c, d)));
    put(results, 7, sub(mul(a, b), mul(b, a)));
    put(results, 8, sub(add(a, b), a));
    put(results, 9, add(add(add(a, b), c), d));
    put(results, 10, divide(mul(a, b), b));
    put(results, 11, root(mul(a, a)));

    // Products of three as well.
    let v = Vec3::new(ranged(x, 20), ranged(y, 20), ranged(z, 20));
    let w = Vec3::new(ranged(w, 20), ranged(x, 20), ranged(y, 20));
    put(results, 12, dot3(v, w));
    put3(results, 13, cross3(v, w));
    put3(results, 16, add3(v, w));
    put3(results, 19, sub3(v, w));
    put3(results, 22, scale3(mul3(v, w), v.x));
    let m = sym_sub(sym_add(Sym3::new(v.x, v.y, v.z, w.x, w.y, w.z), sym_scale(outer(v), 0.5)), outer(w));
    put_sym(results, 25, m);
    put3(results, 31, sym_mul(m, v));
    put(results, 34, trace(m));
    let k = Sym3::new(v.x, w.y, v.z, w.x, v.y, w.z);
    let cofactors_of_k = cofactors(k);
    put_sym(results, 35, cofactors_of_k);
    put(results, 41, sym_det(k, cofactors_of_k));
    put(results, 42, flush(a, 1.0));
    put3(results, 43, flush3(v, 1.0 / 1024.0));
    put(results, 46, divide(1.0, root(dot3(v, v))));
    put(results, 47, keep(b));

    // The shader starts from guesses that are up to 3 units off, and must end here all the same.
    let (x, y) = (significand(a), significand(b));
    let n = (x << u32::from(x < y)) as f32;
    put(results, 48, (n / y as f32) * 8_388_608.0);
    put(results, 49, (n * 8_388_608.0).sqrt());
    put_raw(results, 50, log2(finite(bits[2])));
    put_raw(results, 51, arccot(finite(bits[2])));
}

/// Operands that make rounding, fusing, reordering, the ends of the range and cancellation show: `count` rows.
pub fn hostile_operands(count: usize) -> Vec<[u32; 4]> {
    const ENDS: [u32; 16] = [
        0,           // zero
        1,           // the least denormal number
        0x007f_ffff, // the greatest
        0x0080_0000, // the least normal one
        0x0100_0000, // LEAST
        0x00ff_ffff, // just below
        0x3f80_0000, // one
        0x3f80_0001, // just above
        0x3f7f_ffff, // just below
        0x4b00_0001, // 2²³ + 1
        0x4b7f_ffff, // 2²⁴ − 1
        0x3fb5_04f3, // √2
        0x3eaa_aaab, // ⅓
        0x4040_0000, // three
        0x7f7f_ffff, // the greatest
        0x3fff_ffff, // just below two
    ];
    let mut state = 0x9e37_79b9u32;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state
    };
    let row = |k: usize| {
        let [x, y, z, w] = [random(), random(), random(), random()];
        let end = |bits: u32| ENDS[bits as usize % ENDS.len()] | bits & 1 << 31;
        // Ordinary magnitudes: 2⁻⁴ … 2³.
        let ordinary = |bits: u32| (bits & 0x807f_ffff) | (0x3d80_0000 + ((bits >> 8 & 7) << 23));
        match k % 6 {
            0 => [x, y, z, w],
            1 => [end(x), end(y), end(z), end(w)],
            2 => [ordinary(x), ordinary(y), ordinary(z), ordinary(w)],
            // Neighbors: sums and differences that cancel, quotients about one.
            3 => [x, x ^ (y & 1 << 31) ^ (y & 3), x ^ (z & 3), x ^ (1 << 31) ^ (w & 7)],
            // A square of 12 digits and its neighbors: exact roots, exact and nearly exact quotients.
            4 => {
                let digits = (x & 0xfff | 0x800) as f32;
                let square = (digits * digits).to_bits();
                [square + (y & 1), digits.to_bits(), square - (z & 1), end(w)]
            }
            // Few digits: halves in the last place.
            _ => [ordinary(x) & 0xffff_f000, ordinary(y) & 0xffff_f800, ordinary(z), ordinary(w) & 0xfff0_0000],
        }
    };
    (0..count).map(row).collect()
}

/// Rows of operands in the self-test.
const SELF_TEST_ROWS: usize = 2_400;

/// Runs the probe on `queue` and compares it bit for bit with the twin.
///
/// # Errors
/// [`Error::Device`] when a bit differs or the device fails.
pub fn self_test(queue: &mut Queue) -> Result<()> {
    let operands = hostile_operands(SELF_TEST_ROWS);
    let operand_buffer = queue.buffer_from(operands.clone())?;
    let mut results = queue.buffer::<u32>(operands.len() * RESULTS)?;
    queue.run(ExactProbe { operands: &operand_buffer, results: &mut results })?;
    let mut got = Vec::new();
    queue.read(&results, 0..results.len(), &mut got)?;
    compare(&operands, &got)
}

fn compare(operands: &[[u32; 4]], got: &[u32]) -> Result<()> {
    let mut want = [0; RESULTS];
    for (bits, got) in operands.iter().zip(got.chunks_exact(RESULTS)) {
        exact_probe(*bits, &mut want);
        if let Some(result) = (0..RESULTS).find(|&result| want[result] != got[result]) {
            return Err(Error::Device(format!(
                "its arithmetic is not exact: result {result} of {bits:08x?} is {:08x}, not {:08x}",
                got[result], want[result]
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_off_by_one_bit_is_refused() {
        let operands = hostile_operands(600);
        let mut results = vec![0; operands.len() * RESULTS];
        for (bits, results) in operands.iter().zip(results.chunks_exact_mut(RESULTS)) {
            exact_probe(*bits, results);
        }
        assert!(compare(&operands, &results).is_ok());
        results[599 * RESULTS + 46] ^= 1;
        let message = compare(&operands, &results).unwrap_err().to_string();
        assert!(message.starts_with("device: its arithmetic is not exact: result 46 of"), "{message}");
    }

    /// A driver that fuses `a·b + c` or `a·b − b·a` differs on many of the rows.
    #[test]
    fn a_fusing_device_is_refused() {
        let operands = hostile_operands(600);
        let fused = operands.iter().filter(|&&[x, y, z, _]| {
            let (a, b, c) = (ranged(x, 60), ranged(y, 60), ranged(z, 60));
            a.mul_add(b, c) != a * b + c || a.mul_add(b, -(b * a)) != 0.0
        });
        assert!(fused.count() > 100);
    }

    #[test]
    fn no_result_is_an_infinity() {
        let mut results = [0; RESULTS];
        for bits in hostile_operands(60_000) {
            exact_probe(bits, &mut results);
            assert!(results.iter().all(|&result| f32::from_bits(result).is_finite()), "{bits:08x?}: {results:08x?}");
        }
    }
}
