//! What the planes of the metric `plane` count and how its initial quadrics are stored: policies as data.

use crate::error::{Error, Result};
use crate::kernel::quadric_format as codes;

/// The initial quadrics of the metric `plane`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Quadrics {
    /// What a plane counts.
    pub planes: PlaneWeight,
    /// What they are stored as before the first round; `None` keeps them as they were found.
    pub format: Option<QuadricFormat>,
    /// The coordinates that stored quadrics are about.
    pub frame: QuadricFrame,
}

/// What the plane of a face counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PlaneWeight {
    /// The area of the face; of a border edge its squared length.
    #[default]
    Area,
    /// 1 \[GH97\].
    One,
}

impl PlaneWeight {
    /// Its number in the kernel.
    pub(super) fn by_area(self) -> u32 {
        u32::from(self == Self::Area)
    }
}

/// How the average quadric of a vertex is stored \[Yu14\].
///
/// With the planes p = (n, d) of a vertex, n·x + d = 0 with unit normals, it is the symmetric 4×4 matrix
/// Q' = Σ p pᵀ / (m·max(1, D)), where m is the greatest number of planes at a vertex (or the greatest sum of their weights)
/// and D the greatest d². Every entry is in −1 ..= 1, and the squared distances are m·max(1, D)·vᵀQ'v for v = (x, 1). Rounding
/// an entry by up to [`QuadricFormat::entry_bound`] changes them by at most m·max(1, D)·(|x| + |y| + |z| + 1)² times that.
///
/// The local formats store the 3×3 block alone, over m, for a quadric about its own vertex u, on all of whose planes that lies:
/// m·(x − u)ᵀA'(x − u). It is 0 at u, and rounding changes it by no more than m·(|x| + |y| + |z|)² of x − u.
///
/// What rounding leaves may be below zero somewhere: costs count that as 0. The estimated deviation of a run is found from
/// stored quadrics, and is as far off as they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuadricFormat {
    /// Ten numbers in single precision, 40 bytes a vertex.
    F32,
    /// Ten numbers in half precision, 20 bytes a vertex.
    F16,
    /// Ten numbers of 16 bits in even steps, 20 bytes a vertex.
    Snorm16,
    /// The patent's four pixels of four times 8 bits, 16 bytes a vertex.
    Rgba8,
    /// Six numbers of 16 bits, 12 bytes a vertex.
    Local16,
    /// Six numbers of 8 bits, 6 bytes a vertex.
    Local8,
}

impl QuadricFormat {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::F32, Self::F16, Self::Snorm16, Self::Rgba8, Self::Local16, Self::Local8];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F16 => "f16",
            Self::Snorm16 => "snorm16",
            Self::Rgba8 => "rgba8",
            Self::Local16 => "local16",
            Self::Local8 => "local8",
        }
    }

    /// Its number in the kernels.
    pub(super) fn code(self) -> u32 {
        match self {
            Self::F32 => codes::F32,
            Self::F16 => codes::F16,
            Self::Snorm16 => codes::SNORM16,
            Self::Rgba8 => codes::RGBA8,
            Self::Local16 => codes::LOCAL16,
            Self::Local8 => codes::LOCAL8,
        }
    }

    /// Bytes a vertex.
    pub fn bytes(self) -> u32 {
        codes::code_count(self.code()) * codes::code_width(self.code()) / 8
    }

    /// Whether quadrics are about their own vertices.
    pub fn is_local(self) -> bool {
        codes::is_local(self.code())
    }

    /// How far off a stored entry of an average quadric may be: half a step.
    pub fn entry_bound(self) -> f64 {
        match self {
            Self::F32 => 1.0 / 33_554_432.0,
            Self::F16 => 1.0 / 4096.0,
            Self::Snorm16 => 1.0 / 65_534.0,
            Self::Rgba8 => 1.0 / 255.0,
            Self::Local16 => 1.0 / 131_068.0,
            Self::Local8 => 1.0 / 508.0,
        }
    }
}

/// The coordinates of stored quadrics, which the bound of their rounding grows with. The local formats need none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum QuadricFrame {
    /// About the middle of the bounding box, with half its diagonal as the unit: no plane is farther off than 1.
    #[default]
    Normalized,
    /// The model's own, as in \[Yu14\].
    Raw,
}

/// How the initial quadrics of a run were stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadricRecord {
    /// The format.
    pub format: QuadricFormat,
    /// m, the greatest weight of the planes at a vertex: their greatest number where each counts 1.
    pub max_num: f32,
    /// D, the greatest squared distance of a plane from the origin, in the coordinates of [`QuadricFrame`].
    pub max_d2: f32,
    /// The greatest |x| + |y| + |z| within the bounding box, and its diagonal, in these coordinates.
    pub reach: f64,
    /// See [`QuadricRecord::reach`].
    pub diagonal: f64,
    /// Seconds that the host took for the quadrics: normals, sums, greatest values, codes and back.
    pub secs: f64,
}

impl QuadricRecord {
    /// How far off the squared distances of a quadric may be where |x| + |y| + |z| is `reach`, in the coordinates of
    /// [`QuadricFrame`]; in the local formats from the vertex on. Arithmetic in single precision comes on top.
    pub fn cost_bound(&self, reach: f64) -> f64 {
        let (reach, offset) = if self.format.is_local() { (reach, 1.0) } else { (reach + 1.0, self.max_d2.max(1.0)) };
        f64::from(self.max_num) * f64::from(offset) * reach * reach * self.format.entry_bound()
    }

    /// How far off a distance may be where planes are m, the root of [`QuadricRecord::cost_bound`] over m: anywhere in the
    /// bounding box, as a fraction of its diagonal; in the local formats as a fraction of the distance to the vertex.
    pub fn deviation_bound(&self) -> f64 {
        let (reach, length) = if self.format.is_local() { (3.0_f64.sqrt(), 1.0) } else { (self.reach, self.diagonal) };
        (self.cost_bound(reach) / f64::from(self.max_num)).sqrt() / length
    }
}

impl Quadrics {
    /// Whether the metric can do with it; `is_plane` for `plane`.
    pub(super) fn check(&self, is_plane: bool) -> Result<()> {
        if *self != Self::default() && !is_plane {
            return Err(Error::Parameter(
                "the format of quadrics and what planes count are for the metric 'plane': 'volume' accumulates none"
                    .into(),
            ));
        }
        if self.frame == QuadricFrame::Raw && self.format.is_none_or(QuadricFormat::is_local) {
            return Err(Error::Parameter(
                "raw coordinates are for formats about one origin: f32, f16, snorm16 and rgba8".into(),
            ));
        }
        Ok(())
    }
}
