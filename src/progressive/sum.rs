//! A 64-bit sum that tells one mesh and one file from another: the same on every machine, no defense against malice.

use rayon::prelude::*;

use crate::mesh::Mesh;

/// Rows that a thread sums at a time; part of the definition.
const CHUNK: usize = 1 << 14;

/// A running sum of words. Each step is a bijection of the sum and of the word, so no single change of a word is missed.
#[derive(Debug, Clone, Copy)]
pub struct Sum(u64);

impl Sum {
    /// Of no words.
    pub const EMPTY: Self = Self(0x243f_6a88_85a3_08d3);

    /// With one word more.
    #[inline(always)]
    pub fn with(self, word: u64) -> Self {
        // The golden ratio's bits, as a multiplier; the shift brings the upper half, which is well mixed, down.
        let mixed = (self.0 ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Self(mixed ^ mixed >> 32)
    }

    /// The sum.
    pub fn get(self) -> u64 {
        self.0
    }
}

/// The sum of positions and corners.
pub fn of_mesh(mesh: &Mesh) -> u64 {
    let positions = rows(&mesh.positions, |sum, p| p.to_array().into_iter().fold(sum, |sum, x| sum.with(x.to_bits())));
    let faces = rows(&mesh.faces, |sum, face| face.iter().fold(sum, |sum, &v| sum.with(u64::from(v))));
    Sum::EMPTY.with(positions).with(faces).get()
}

/// The sum of bytes, eight a word; what is missing to the last word is zero.
pub fn of_bytes(bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    let sum = words.iter().fold(Sum::EMPTY.with(bytes.len() as u64), |sum, &word| sum.with(u64::from_le_bytes(word)));
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    sum.with(u64::from_le_bytes(last)).get()
}

/// The sum of the sums of all chunks, in their order whatever the threads.
fn rows<T: Sync>(rows: &[T], add: impl Fn(Sum, &T) -> Sum + Sync) -> u64 {
    let chunks: Vec<u64> = rows.par_chunks(CHUNK).map(|rows| rows.iter().fold(Sum::EMPTY, &add).get()).collect();
    chunks.iter().fold(Sum::EMPTY.with(rows.len() as u64), |sum, &chunk| sum.with(chunk)).get()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::mesh::shapes;

    #[test]
    fn it_is_the_same_everywhere() {
        assert_eq!((of_bytes(b""), of_bytes(b"a log of a mesh")), (0xea4c_db56_9647_9cdf, 0x25a6_6377_c70d_295d));
        let triangle = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
        assert_eq!(of_mesh(&triangle), 0x508f_3437_c66d_84d8);
    }

    #[test]
    fn every_change_shows() {
        let mesh = shapes::plane(200, 100);
        let sum = of_mesh(&mesh);
        let changed = |change: &dyn Fn(&mut Mesh)| {
            let mut other = mesh.clone();
            change(&mut other);
            of_mesh(&other)
        };
        assert_ne!(sum, changed(&|mesh| mesh.positions[20_000].z = -0.0));
        assert_ne!(sum, changed(&|mesh| mesh.positions.swap(3, 4)));
        assert_ne!(sum, changed(&|mesh| mesh.faces[39_999].rotate_left(1)));
        assert_ne!(sum, changed(&|mesh| mesh.faces.swap(0, 1)));
        assert_ne!(sum, changed(&|mesh| mesh.positions.extend([DVec3::ZERO])));

        let bytes: Vec<u8> = (0..37).collect();
        let mut sums = vec![of_bytes(&bytes), of_bytes(&bytes[..36]), of_bytes(&[&bytes[..], &[0]].concat())];
        sums.extend((0..bytes.len()).map(|i| {
            let mut bytes = bytes.clone();
            bytes[i] ^= 4;
            of_bytes(&bytes)
        }));
        let count = sums.len();
        sums.sort_unstable();
        sums.dedup();
        assert_eq!(sums.len(), count);
    }
}
