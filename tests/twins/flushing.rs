//! A device may take numbers below the least normal one for zero, as GPUs do and software Vulkan does not: here the
//! processor does, so that what depends on it shows without such a device.

use coarsen::backend::Device;

use crate::trials::{Around, first_difference, trials};

/// Bits of the control register of floating-point arithmetic: what comes out below the least normal number is zero, and what
/// goes in.
#[cfg(target_arch = "x86_64")]
const FLUSHES: u32 = (1 << 15) | (1 << 6);
#[cfg(target_arch = "aarch64")]
const FLUSHES: u64 = 1 << 24;

/// Has this thread's arithmetic flush, or not.
#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "there is no other way to what the processor does with such numbers")]
fn set_flushing(flushes: bool) {
    use std::arch::asm;

    let mut control = 0_u32;
    // Safety: the register is read and written in 4 bytes that are this function's; exceptions stay masked and rounding as it is.
    // The compiler takes it that nobody flushes: at worst it finds a result itself, and not as the processor would, which is why
    // the test looks whether a number is flushed.
    unsafe {
        asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack, preserves_flags));
        control = if flushes { control | FLUSHES } else { control & !FLUSHES };
        asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack, readonly, preserves_flags));
    }
}

/// Has this thread's arithmetic flush, or not.
#[cfg(target_arch = "aarch64")]
#[expect(unsafe_code, reason = "there is no other way to what the processor does with such numbers")]
fn set_flushing(flushes: bool) {
    use std::arch::asm;

    let mut control: u64;
    // Safety: the register is read and written; exceptions and rounding stay as they are. For the rest see above.
    unsafe {
        asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack, preserves_flags));
        control = if flushes { control | FLUSHES } else { control & !FLUSHES };
        asm!("msr fpcr, {}", in(reg) control, options(nomem, nostack, preserves_flags));
    }
}

/// Runs `work` with arithmetic that flushes.
fn flushing(work: &mut dyn FnMut()) {
    set_flushing(true);
    work();
    set_flushing(false);
}

#[test]
fn flushed_numbers_change_nothing() {
    // One thread, so that it is the one whose arithmetic flushes.
    let device = Device::cpu(1).expect("a thread");
    let least = std::hint::black_box(f32::MIN_POSITIVE);
    let mut halves = [least / 2.0; 2];
    device.install(|| flushing(&mut || halves[1] = least / std::hint::black_box(2.0)));
    assert_eq!(halves.map(|half| half == 0.0), [false, true], "nothing is flushed");

    let differences = trials().filter_map(|trial| {
        let [kept, flushed] = [None, Some(flushing as Around)]
            .map(|around| device.install(|| trial.outputs(device.cpu_queue(), around, false)));
        first_difference(&kept, &flushed).map(|at| format!("{}: {at} where such numbers are zero", trial.name))
    });
    assert_eq!(differences.collect::<Vec<_>>(), [""; 0]);
}
