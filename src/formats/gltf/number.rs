//! The types of the numbers in buffers.

/// A type of number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Number {
    /// The type with this code.
    pub(super) fn of(code: usize) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    pub(super) const fn code(self) -> u32 {
        match self {
            Self::I8 => 5120,
            Self::U8 => 5121,
            Self::I16 => 5122,
            Self::U16 => 5123,
            Self::U32 => 5125,
            Self::F32 => 5126,
        }
    }

    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number that stands for 1 where integers stand for fractions.
    pub(super) const fn greatest(self) -> f32 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::U32 | Self::F32 => 1.0,
        }
    }

    /// The number at the start of `bytes`, which hold it.
    pub(super) fn decode(self, bytes: &[u8]) -> f32 {
        match self {
            Self::I8 => f32::from(bytes[0] as i8),
            Self::U8 => f32::from(bytes[0]),
            Self::I16 => f32::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U16 => f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32,
            Self::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }

    /// The smallest type for whole numbers of a vertex; that of fractions where none has room for all.
    pub(super) fn of_whole(numbers: &[f32]) -> Self {
        let has_room = |number: &Self| number.pack_whole(numbers.iter().copied()).is_some();
        [Self::U8, Self::I8, Self::U16, Self::I16].into_iter().find(has_room).unwrap_or(Self::F32)
    }

    /// Whole numbers as bytes; `None` where one is none that this type has, or the type is none that vertices may have whole.
    pub(super) fn pack_whole(self, numbers: impl Iterator<Item = f32>) -> Option<Vec<u8>> {
        let (least, greatest) = match self {
            Self::I8 => (-128.0, 127.0),
            Self::U8 => (0.0, 255.0),
            Self::I16 => (-32768.0, 32767.0),
            Self::U16 => (0.0, 65535.0),
            Self::U32 | Self::F32 => return None,
        };
        let mut bytes = Vec::new();
        for number in numbers {
            if number.fract() != 0.0 || !(least..=greatest).contains(&number) {
                return None;
            }
            bytes.extend_from_slice(&(number as i32).to_le_bytes()[..self.size()]);
        }
        Some(bytes)
    }

    /// The same as a whole number; `None` where this is no unsigned type.
    pub(super) fn decode_index(self, bytes: &[u8]) -> Option<u32> {
        match self {
            Self::U8 => Some(bytes[0].into()),
            Self::U16 => Some(u16::from_le_bytes([bytes[0], bytes[1]]).into()),
            Self::U32 => Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            _ => None,
        }
    }
}
