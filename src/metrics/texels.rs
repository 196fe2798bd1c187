//! Texels over a part of a texture, and the part itself.

use std::sync::atomic::{AtomicU64, Ordering};

use super::atlas::Patch;
use crate::math::DVec2;

/// Samples at texels after which the texels get larger: a texture that repeats on many faces is sampled on each of them.
const MOST_SAMPLES: f64 = (1 << 20) as f64;

/// The part of the texture that faces use.
pub(super) struct Extent {
    low: DVec2,
    high: DVec2,
    /// Of all of them, those that overlap as often as they do.
    area: f64,
}

impl Extent {
    pub fn of(patches: impl Iterator<Item = Option<Patch>>) -> Self {
        let mut extent = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY, area: 0.0 };
        for patch in patches.flatten() {
            let Self { low, high, .. } = extent;
            (extent.low, extent.high) =
                patch.uv.iter().fold((low, high), |(low, high), &uv| (low.min(uv), high.max(uv)));
            extent.area += patch.area();
        }
        extent
    }

    /// The side of a texel.
    pub fn texel(&self, texels: usize) -> f64 {
        ((self.high - self.low).max_element() / texels as f64).max((self.area / MOST_SAMPLES).sqrt())
    }
}

/// Texels over a part of the texture, each with the least distance noted there.
pub(super) struct Grid {
    low: DVec2,
    /// The side of a texel.
    size: f64,
    columns: usize,
    rows: usize,
    /// Bits of a distance, whose order is that of the numbers; infinity where only the first mesh is.
    nearest: Vec<AtomicU64>,
}

/// Marks a texel where nothing was noted: above every distance.
const UNUSED: u64 = u64::MAX;

impl Grid {
    /// A grid over a part of the texture, of texels of this size; `None` where nothing has an area.
    pub fn over(extent: &Extent, size: f64, texels: usize) -> Option<Self> {
        if extent.area <= 0.0 {
            return None;
        }
        let length = extent.high - extent.low;
        let count = |length: f64| ((length / size).ceil() as usize).clamp(1, texels);
        let (columns, rows) = (count(length.x), count(length.y));
        let nearest = (0..columns * rows).map(|_| AtomicU64::new(UNUSED)).collect();
        Some(Self { low: extent.low, size, columns, rows, nearest })
    }

    /// The texels from `from` to `to` whose centers lie between, of `count`.
    fn between(&self, from: f64, to: f64, low: f64, count: usize) -> std::ops::Range<usize> {
        // The casts saturate.
        let first = ((from - low) / self.size - 0.5).ceil().max(0.0) as usize;
        let last = ((to - low) / self.size - 0.5).floor();
        if last >= 0.0 { first..count.min(last as usize + 1) } else { 0..0 }
    }

    /// Calls `each` with the texels whose centers lie in a triangle of the texture, and those centers.
    pub fn for_each_texel(&self, uv: [DVec2; 3], mut each: impl FnMut(usize, DVec2)) {
        let low = uv.iter().fold(f64::INFINITY, |low, corner| low.min(corner.y));
        let high = uv.iter().fold(f64::NEG_INFINITY, |high, corner| high.max(corner.y));
        for row in self.between(low, high, self.low.y, self.rows) {
            let y = self.low.y + (row as f64 + 0.5) * self.size;
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            for [p, q] in [[uv[0], uv[1]], [uv[1], uv[2]], [uv[2], uv[0]]] {
                if p.y != q.y && y >= p.y.min(q.y) && y <= p.y.max(q.y) {
                    let x = p.x + (y - p.y) * (q.x - p.x) / (q.y - p.y);
                    (from, to) = (from.min(x), to.max(x));
                }
            }
            for column in self.between(from, to, self.low.x, self.columns) {
                each(row * self.columns + column, DVec2::new(self.low.x + (column as f64 + 0.5) * self.size, y));
            }
        }
    }

    /// Notes the distance of a point at a texel, `None` where the second mesh has none. The least stays, whatever the order.
    pub fn note(&self, texel: usize, distance: Option<f64>) {
        // Plus zero: a negative zero would be above all.
        let bits = (distance.unwrap_or(f64::INFINITY) + 0.0).to_bits();
        self.nearest[texel].fetch_min(bits, Ordering::Relaxed);
    }

    /// What was noted at the texels of the first mesh, in their order.
    pub fn distances(&self) -> impl Iterator<Item = Option<f64>> {
        let noted = self.nearest.iter().map(|bits| bits.load(Ordering::Relaxed)).filter(|&bits| bits != UNUSED);
        noted.map(|bits| Some(f64::from_bits(bits)).filter(|distance| distance.is_finite()))
    }
}
