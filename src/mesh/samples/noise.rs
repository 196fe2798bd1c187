//! Gradient noise from an integer hash: sums and products only, so the same bits on every machine.

use crate::math::DVec3;

/// Gradient noise (Perlin 2002) over the unit lattice, about -1 to 1, zero at lattice points.
pub fn noise(p: DVec3) -> f64 {
    let cell = p.floor();
    let t = p - cell;
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let [x, y, z] = cell.to_array().map(|c| c as i64 as u32);
    let corner = |dx: u32, dy: u32, dz: u32| {
        let h = hash(x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz));
        let d = t - DVec3::new(f64::from(dx), f64::from(dy), f64::from(dz));
        // One of the twelve edge directions of a cube.
        let (u, v) = match h % 3 {
            0 => (d.x, d.y),
            1 => (d.y, d.z),
            _ => (d.z, d.x),
        };
        (if h & 0x100 == 0 { u } else { -u }) + (if h & 0x200 == 0 { v } else { -v })
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let along_x = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), fade.x);
    let along_y = |dz| mix(along_x(0, dz), along_x(1, dz), fade.y);
    mix(along_y(0), along_y(1), fade.z)
}

/// `octaves` of noise, each of twice the frequency and half the height of the one before.
pub fn fractal(p: DVec3, octaves: u32) -> f64 {
    let mut sum = 0.0;
    let (mut at, mut height) = (p, 1.0);
    for _ in 0..octaves {
        sum += noise(at) * height;
        // The shift keeps the zeros of the octaves from falling together.
        at = at * 2.0 + DVec3::new(17.3, -8.1, 5.7);
        height *= 0.5;
    }
    sum
}

/// A number from 0 to 1 for each integer.
pub fn random(seed: u32) -> f64 {
    f64::from(hash(seed, 0x9e37, 0x79b9)) / f64::from(u32::MAX)
}

/// Multiply and shift, three lattice coordinates to 32 well-mixed bits.
fn hash(x: u32, y: u32, z: u32) -> u32 {
    let mut h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ z.wrapping_mul(0xcb1a_b31f);
    h = (h ^ h >> 16).wrapping_mul(0x7feb_352d);
    h = (h ^ h >> 15).wrapping_mul(0x846c_a68b);
    h ^ h >> 16
}

/// From 0 to 1 with level ends, as `t` goes from `low` to `high`.
pub fn smoothstep(low: f64, high: f64, t: f64) -> f64 {
    let t = ((t - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A wave of period 1 between 0 and 1, with round crests and troughs.
pub fn wave(t: f64) -> f64 {
    let t = t - t.floor();
    let up = t * (1.0 - t);
    16.0 * up * up
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_bounded_continuous_and_not_flat() {
        let at = |i: i32| DVec3::new(f64::from(i) * 0.37, f64::from(i) * -0.71, 3.3);
        let values: Vec<f64> = (-2000..2000).map(|i| noise(at(i))).collect();
        assert!(values.iter().all(|v| v.abs() <= 1.2));
        assert!(values.iter().any(|v| *v > 0.4) && values.iter().any(|v| *v < -0.4));
        assert!((values.iter().sum::<f64>() / 4000.0).abs() < 0.03);
        for i in -50..50 {
            let step = DVec3::splat(1e-7);
            assert!((noise(at(i) + step) - noise(at(i))).abs() < 1e-6);
        }
    }

    #[test]
    fn waves_and_steps_have_level_ends() {
        assert_eq!([wave(0.0), wave(0.5), wave(3.5), wave(-1.0)], [0.0, 1.0, 1.0, 0.0]);
        assert_eq!([smoothstep(1.0, 3.0, 0.0), smoothstep(1.0, 3.0, 2.0), smoothstep(1.0, 3.0, 9.0)], [0.0, 0.5, 1.0]);
    }
}
