//! temp
#![allow(missing_docs)]
use bytemuck::{Pod, Zeroable};
pub use glam::Vec3;
#[inline(always)]
pub fn add(a: f32, b: f32) -> f32 {
    a + b
}
#[inline(always)]
pub fn sub(a: f32, b: f32) -> f32 {
    a - b
}
#[inline(always)]
pub fn mul(a: f32, b: f32) -> f32 {
    a * b
}
#[inline(always)]
pub fn divide(a: f32, b: f32) -> f32 {
    a / b
}
#[inline(always)]
pub fn root(a: f32) -> f32 {
    a.sqrt()
}
#[inline(always)]
pub fn add3(a: Vec3, b: Vec3) -> Vec3 {
    a + b
}
#[inline(always)]
pub fn sub3(a: Vec3, b: Vec3) -> Vec3 {
    a - b
}
#[inline(always)]
pub fn scale3(a: Vec3, s: f32) -> Vec3 {
    a * s
}
#[inline(always)]
pub fn dot3(a: Vec3, b: Vec3) -> f32 {
    add(add(mul(a.x, b.x), mul(a.y, b.y)), mul(a.z, b.z))
}
#[inline(always)]
pub fn cross3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(sub(mul(a.y, b.z), mul(a.z, b.y)), sub(mul(a.z, b.x), mul(a.x, b.z)), sub(mul(a.x, b.y), mul(a.y, b.x)))
}
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Sym3 {
    pub xx: f32,
    pub xy: f32,
    pub xz: f32,
    pub yy: f32,
    pub yz: f32,
    pub zz: f32,
}
#[inline(always)]
pub fn outer(n: Vec3) -> Sym3 {
    Sym3 {
        xx: mul(n.x, n.x),
        xy: mul(n.x, n.y),
        xz: mul(n.x, n.z),
        yy: mul(n.y, n.y),
        yz: mul(n.y, n.z),
        zz: mul(n.z, n.z),
    }
}
#[inline(always)]
pub fn sym_add(a: Sym3, b: Sym3) -> Sym3 {
    Sym3 {
        xx: add(a.xx, b.xx),
        xy: add(a.xy, b.xy),
        xz: add(a.xz, b.xz),
        yy: add(a.yy, b.yy),
        yz: add(a.yz, b.yz),
        zz: add(a.zz, b.zz),
    }
}
#[inline(always)]
pub fn sym_sub(a: Sym3, b: Sym3) -> Sym3 {
    Sym3 {
        xx: sub(a.xx, b.xx),
        xy: sub(a.xy, b.xy),
        xz: sub(a.xz, b.xz),
        yy: sub(a.yy, b.yy),
        yz: sub(a.yz, b.yz),
        zz: sub(a.zz, b.zz),
    }
}
#[inline(always)]
pub fn sym_scale(a: Sym3, s: f32) -> Sym3 {
    Sym3 { xx: mul(a.xx, s), xy: mul(a.xy, s), xz: mul(a.xz, s), yy: mul(a.yy, s), yz: mul(a.yz, s), zz: mul(a.zz, s) }
}
#[inline(always)]
pub fn sym_mul(m: Sym3, v: Vec3) -> Vec3 {
    Vec3::new(
        add(add(mul(m.xx, v.x), mul(m.xy, v.y)), mul(m.xz, v.z)),
        add(add(mul(m.xy, v.x), mul(m.yy, v.y)), mul(m.yz, v.z)),
        add(add(mul(m.xz, v.x), mul(m.yz, v.y)), mul(m.zz, v.z)),
    )
}
#[inline(always)]
pub fn trace(m: Sym3) -> f32 {
    add(add(m.xx, m.yy), m.zz)
}
