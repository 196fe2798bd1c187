//! Where among a few things the one with a number stands, by the number's last bits.

/// Last bits of which there is a place each: neighbors on a mesh seldom share them.
const SIZE: usize = 1 << 10;

/// A table of places that is never cleared: another number may have left what it finds, or an earlier use of the table. Whoever
/// looks something up has to see whether it is there.
#[derive(Debug)]
pub struct Places {
    table: [u8; SIZE],
}

impl Default for Places {
    fn default() -> Self {
        Self { table: [0; SIZE] }
    }
}

impl Places {
    /// Notes that `number` stands at `place`.
    #[inline(always)]
    pub fn put(&mut self, number: u32, place: u8) {
        self.table[number as usize % SIZE] = place;
    }

    /// Whether one number takes the other's place.
    #[inline(always)]
    pub fn are_alike(first: u32, second: u32) -> bool {
        ((first ^ second) as usize).is_multiple_of(SIZE)
    }

    /// Where `number` stands, if it was put there and no other like it after.
    #[inline(always)]
    pub fn of(&self, number: u32) -> usize {
        usize::from(self.table[number as usize % SIZE])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_until_another_like_them_is_put() {
        let mut places = Places::default();
        (0..9).for_each(|place| places.put(1_000_000 + 3 * u32::from(place), place));
        assert!((0..9).all(|place| places.of(1_000_000 + 3 * place as u32) == place));
        places.put(1_000_003 + 5 * SIZE as u32, 77);
        assert_eq!((places.of(1_000_000), places.of(1_000_003)), (0, 77));
        let are_alike = |number: u32| Places::are_alike(number, 1_000_003 + 5 * SIZE as u32);
        assert!(are_alike(1_000_003) && !are_alike(1_000_000));
    }
}
