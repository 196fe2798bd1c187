//! The number types of PLY, decoded from either byte order.

use ply_rs_bw::ply::ScalarType;

/// The order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    /// Whether it is the machine's own.
    pub(super) fn is_native(self) -> bool {
        (self == Self::Little) == cfg!(target_endian = "little")
    }
}

/// The type of one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl From<&ScalarType> for Scalar {
    fn from(scalar: &ScalarType) -> Self {
        match scalar {
            ScalarType::Char => Self::I8,
            ScalarType::UChar => Self::U8,
            ScalarType::Short => Self::I16,
            ScalarType::UShort => Self::U16,
            ScalarType::Int => Self::I32,
            ScalarType::UInt => Self::U32,
            ScalarType::Float => Self::F32,
            ScalarType::Double => Self::F64,
        }
    }
}

impl Scalar {
    /// Bytes of one number.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Whether it is a floating-point number.
    pub(super) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// Decodes the number at the start of `bytes`, which must hold it. Every type fits f64 exactly.
    #[inline]
    pub(super) fn decode(self, bytes: &[u8], order: Order) -> f64 {
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(u16::from_ne_bytes(native(bytes, order)) as i16),
            Self::U16 => f64::from(u16::from_ne_bytes(native(bytes, order))),
            Self::I32 => f64::from(u32::from_ne_bytes(native(bytes, order)) as i32),
            Self::U32 => f64::from(u32::from_ne_bytes(native(bytes, order))),
            Self::F32 => f64::from(f32::from_ne_bytes(native(bytes, order))),
            Self::F64 => f64::from_ne_bytes(native(bytes, order)),
        }
    }

    /// Decodes a vertex index or a list length; [`NO_INDEX`] for what can be neither.
    #[inline]
    pub(super) fn decode_index(self, bytes: &[u8], order: Order) -> u32 {
        match self {
            Self::U8 => u32::from(bytes[0]),
            Self::U32 => u32::from_ne_bytes(native(bytes, order)),
            // A negative i32 becomes an index above 2³¹, which no mesh has.
            Self::I32 => u32::from_ne_bytes(native(bytes, order)),
            _ => index(self.decode(bytes, order)),
        }
    }

    /// The factor that takes a stored color channel to `[0, 1]`.
    pub(super) const fn color_factor(self) -> f64 {
        match self {
            Self::F32 | Self::F64 => 1.0,
            Self::U16 | Self::I16 => 1.0 / 65535.0,
            _ => 1.0 / 255.0,
        }
    }
}

/// Above every index of a mesh.
pub(super) const NO_INDEX: u32 = u32::MAX;

fn index(value: f64) -> u32 {
    if value >= 0.0 && value < f64::from(NO_INDEX) && value.fract() == 0.0 { value as u32 } else { NO_INDEX }
}

#[inline]
fn native<const N: usize>(bytes: &[u8], order: Order) -> [u8; N] {
    let mut number = [0; N];
    number.copy_from_slice(&bytes[..N]);
    if !order.is_native() {
        number.reverse();
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_orders_decode_to_the_same_number() {
        for (scalar, big, value) in [
            (Scalar::I16, &[0xff, 0xfe][..], -2.0),
            (Scalar::U16, &[0x01, 0x00], 256.0),
            (Scalar::I32, &[0xff, 0xff, 0xff, 0xff], -1.0),
            (Scalar::U32, &[0x00, 0x01, 0x00, 0x01], 65537.0),
            (Scalar::F32, &[0x3f, 0xc0, 0x00, 0x00], 1.5),
            (Scalar::F64, &[0xc0, 0x04, 0, 0, 0, 0, 0, 0], -2.5),
        ] {
            let little: Vec<u8> = big.iter().rev().copied().collect();
            assert_eq!((scalar.decode(big, Order::Big), scalar.decode(&little, Order::Little)), (value, value));
            assert_eq!(scalar.size(), big.len());
        }
    }

    #[test]
    fn what_is_no_index_is_beyond_every_mesh() {
        assert!(Scalar::I32.decode_index(&(-1_i32).to_le_bytes(), Order::Little) > u32::MAX / 2);
        assert_eq!(Scalar::F32.decode_index(&1.5_f32.to_le_bytes(), Order::Little), NO_INDEX);
        assert_eq!(Scalar::F32.decode_index(&f32::NAN.to_le_bytes(), Order::Little), NO_INDEX);
        assert_eq!(Scalar::I8.decode_index(&[0x80], Order::Little), NO_INDEX);
    }
}
