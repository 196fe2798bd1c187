// Formats of average quadrics: how the ten entries, in −1 ..= 1, become codes of 8, 16 or 32 bits and numbers again.
// Twin: src/kernel/quadric_format.rs

// Codes to a quadric.
fn code_count(format: u32) -> u32 {
    if format == RGBA8 {
        return 16u;
    }
    return select(10u, 6u, is_local(format));
}

// Bits to a code.
fn code_width(format: u32) -> u32 {
    if format == RGBA8 || format == LOCAL8 {
        return 8u;
    }
    return select(16u, 32u, format == F32);
}

fn is_local(format: u32) -> bool {
    return format == LOCAL16 || format == LOCAL8;
}

// Which of the ten entries a code is of.
fn code_entry(format: u32, k: u32) -> u32 {
    if format == RGBA8 {
        var of_pixels = array<u32, 16>(0u, 1u, 2u, 3u, 1u, 4u, 5u, 6u, 2u, 5u, 7u, 8u, 3u, 6u, 8u, 9u);
        return of_pixels[k];
    }
    if is_local(format) {
        var of_matrix = array<u32, 6>(0u, 1u, 2u, 4u, 5u, 7u);
        return of_matrix[k];
    }
    return k;
}

// The nearest integer to a number from 0, the even one of two.
fn nearest_even(x: f32) -> u32 {
    let below = u32(x);
    let over = sub(x, f32(below));
    return below + select(0u, 1u, over > 0.5 || (over == 0.5 && (below & 1u) == 1u));
}

// 0 ..= 1 in steps of 1/most.
fn to_unorm(x: f32, most: f32) -> u32 {
    let y = mul(clamp(x, 0.0, 1.0), most);
    let below = u32(y);
    return below + select(0u, 1u, sub(y, f32(below)) >= 0.5);
}

fn from_unorm(code: u32, most: f32) -> f32 {
    return divide(f32(code), most);
}

// −1 ..= 1 in steps of 1/most, in two's complement.
fn to_snorm(x: f32, most: f32) -> u32 {
    let steps = to_unorm(abs(x), most);
    return select(steps, 0u - steps, x < 0.0);
}

fn from_snorm(code: u32, width: u32, most: f32) -> f32 {
    let shift = 32u - width;
    return divide(f32(bitcast<i32>(code << shift) >> shift), most);
}

// To half precision: the nearest, the even one of two, never infinite.
fn to_half(x: f32) -> u32 {
    let sign = (bitcast<u32>(x) >> 16u) & 0x8000u;
    let bits = bitcast<u32>(x) & 0x7fffffffu;
    // Below 2⁻¹⁴ steps of 2⁻²⁴.
    if bits < 0x38800000u {
        return sign | nearest_even(mul(bitcast<f32>(bits), 16777216.0));
    }
    let shifted = bits - (112u << 23u);
    return sign | min((shifted + 0xfffu + ((shifted >> 13u) & 1u)) >> 13u, 0x7bffu);
}

fn from_half(code: u32) -> f32 {
    let sign = (code & 0x8000u) << 16u;
    let bits = code & 0x7fffu;
    let small = bitcast<u32>(mul(f32(bits), 0x1p-24f));
    return bitcast<f32>(sign | select((bits << 13u) + (112u << 23u), small, bits < 0x400u));
}

// A diagonal entry is not below 0, and another, n_x·n_y with n a unit vector, not beyond ±½.
fn to_local(entry: u32, x: f32, most_unsigned: f32, most_signed: f32) -> u32 {
    if is_diagonal(entry) {
        return to_unorm(x, most_unsigned);
    }
    return to_snorm(mul(2.0, x), most_signed);
}

fn from_local(entry: u32, code: u32, width: u32, most_unsigned: f32, most_signed: f32) -> f32 {
    if is_diagonal(entry) {
        return from_unorm(code, most_unsigned);
    }
    return mul(0.5, from_snorm(code, width, most_signed));
}

fn is_diagonal(entry: u32) -> bool {
    return entry == 0u || entry == 4u || entry == 7u;
}

// The code of an entry, in the lowest bits.
fn to_code(format: u32, entry: u32, x: f32) -> u32 {
    switch format {
        case F16: { return to_half(x); }
        case SNORM16: { return to_snorm(x, 32767.0) & 0xffffu; }
        case RGBA8: { return to_unorm(mul(0.5, add(x, 1.0)), 255.0); }
        case LOCAL16: { return to_local(entry, x, 65535.0, 32767.0) & 0xffffu; }
        case LOCAL8: { return to_local(entry, x, 255.0, 127.0) & 0xffu; }
        default: { return bitcast<u32>(x); }
    }
}

fn from_code(format: u32, entry: u32, code: u32) -> f32 {
    switch format {
        case F16: { return from_half(code); }
        case SNORM16: { return from_snorm(code, 16u, 32767.0); }
        case RGBA8: { return sub(mul(2.0, from_unorm(code, 255.0)), 1.0); }
        case LOCAL16: { return from_local(entry, code, 16u, 65535.0, 32767.0); }
        case LOCAL8: { return from_local(entry, code, 8u, 255.0, 127.0); }
        default: { return bitcast<f32>(code); }
    }
}

// What an average quadric was divided by.
fn divisor(format: u32, bound: QuadricBound) -> f32 {
    return select(mul(bound.weight, max(bound.offset_sq, 1.0)), bound.weight, is_local(format));
}
