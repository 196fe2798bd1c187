//! The faces around a vertex. In WGSL: `shaders/shared/stars.wgsl`; [`Spokes`] and [`Rim`] are the host's alone.

use super::rows::{Face, Position};
use crate::backend::Buffer;
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, divide, flush3, scale3};

/// The live mesh as kernels see it.
#[derive(Debug, Clone, Copy)]
pub struct Stars<'a> {
    /// V positions.
    pub positions: &'a [Position],
    /// F faces.
    pub faces: &'a [Face],
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a [u32],
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a [u32],
}

impl<'a> Stars<'a> {
    /// The mesh in these buffers of the host.
    pub fn on_host(
        positions: &'a Buffer<Position>,
        faces: &'a Buffer<Face>,
        ring_starts: &'a Buffer<u32>,
        ring_faces: &'a Buffer<u32>,
    ) -> Self {
        Self {
            positions: positions.host(),
            faces: faces.host(),
            ring_starts: ring_starts.host(),
            ring_faces: ring_faces.host(),
        }
    }

    /// The faces around a vertex.
    #[inline(always)]
    pub fn ring(&self, vertex: u32) -> &'a [u32] {
        &self.ring_faces[self.ring_starts[vertex as usize] as usize..self.ring_starts[vertex as usize + 1] as usize]
    }
}

/// A face seen from one of its corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spoke {
    /// Which corner, from 0 to 2.
    pub corner: u32,
    /// The corner after it.
    pub next: u32,
    /// The corner before it.
    pub last: u32,
}

/// A face from its corner `vertex`.
#[inline(always)]
pub fn spoke(face: Face, vertex: u32) -> Spoke {
    let (is_b, is_c) = (face.b == vertex, face.c == vertex);
    Spoke {
        corner: u32::from(is_b) + 2 * u32::from(is_c),
        next: if is_c {
            face.a
        } else if is_b {
            face.c
        } else {
            face.b
        },
        last: if is_c {
            face.b
        } else if is_b {
            face.a
        } else {
            face.c
        },
    }
}

/// Faces of a ring that [`Spokes`] have room for; few vertices have more.
pub const AROUND: usize = 16;

/// Faces of a ring that are sooner looked at one by one than [`Spokes`] of them are made.
pub const FEW_AROUND: usize = 2;

/// The other corners of the faces of a ring, which are looked up many at a time.
#[derive(Debug)]
pub struct Spokes {
    /// Of each face the corner after the vertex, and that before it; past the ring [`NO_CORNER`].
    next: [u32; AROUND],
    last: [u32; AROUND],
}

/// No vertex has this number.
const NO_CORNER: u32 = u32::MAX;

impl Spokes {
    /// Of a ring of so few faces around a vertex; none of a longer one.
    #[inline(always)]
    pub fn around(vertex: u32, stars: &Stars<'_>) -> Option<Self> {
        let ring = stars.ring(vertex);
        let mut spokes = Self { next: [NO_CORNER; AROUND], last: [NO_CORNER; AROUND] };
        if ring.len() > AROUND {
            return None;
        }
        for ((next, last), &f) in spokes.next.iter_mut().zip(&mut spokes.last).zip(ring) {
            let spoke = spoke(stars.faces[f as usize], vertex);
            (*next, *last) = (spoke.next, spoke.last);
        }
        Some(spokes)
    }

    /// Which faces go on to a corner from the vertex: a bit for each place in the ring.
    #[inline(always)]
    pub fn with_next(&self, corner: u32) -> u32 {
        places_of(corner, &self.next)
    }

    /// Which faces come to the vertex from a corner.
    #[inline(always)]
    pub fn with_last(&self, corner: u32) -> u32 {
        places_of(corner, &self.last)
    }
}

#[inline(always)]
fn places_of(corner: u32, corners: &[u32; AROUND]) -> u32 {
    let mut places = 0;
    for (place, &other) in corners.iter().enumerate() {
        places |= u32::from(other == corner) << place;
    }
    places
}

/// Which of the other corners around a vertex one face alone has: it is on a border with these. No face has a corner twice.
#[derive(Debug)]
pub struct Rim<'a> {
    vertex: u32,
    stars: &'a Stars<'a>,
    known: Option<LoneCorners>,
}

#[derive(Debug)]
struct LoneCorners {
    /// Of each face the corner after the vertex.
    next: [u32; AROUND],
    /// Of each face whether one alone has the corner after the vertex, and that before it: a bit for each place in the ring.
    has_next: u32,
    has_last: u32,
}

impl<'a> Rim<'a> {
    /// Of a vertex.
    #[inline(always)]
    pub fn around(vertex: u32, stars: &'a Stars<'a>) -> Self {
        let count = stars.ring(vertex).len();
        let spokes = if count > FEW_AROUND { Spokes::around(vertex, stars) } else { None };
        let known = spokes.map(|Spokes { next, last }| {
            let (mut next_uses, mut last_uses) = ([0; AROUND], [0; AROUND]);
            for &corner in next[..count].iter().chain(&last[..count]) {
                for place in 0..AROUND {
                    next_uses[place] += u32::from(next[place] == corner);
                    last_uses[place] += u32::from(last[place] == corner);
                }
            }
            LoneCorners { next, has_next: places_of(1, &next_uses), has_last: places_of(1, &last_uses) }
        });
        Self { vertex, stars, known }
    }

    /// Whether [`faces_with`] of a corner is 1: another corner of the face at a place in the ring.
    #[inline(always)]
    pub fn is_lone(&self, place: usize, corner: u32) -> bool {
        match &self.known {
            Some(LoneCorners { next, has_next, has_last }) => {
                let places = if next[place] == corner { has_next } else { has_last };
                places >> place & 1 == 1
            }
            None => faces_with(corner, self.vertex, self.stars) == 1,
        }
    }
}

/// A vector by its length; zero where that is.
#[inline(always)]
pub fn unit(n: Vec3, length: f32) -> Vec3 {
    flush3(scale3(n, divide(1.0, length)), LEAST_FACTOR)
}

/// Whether a face has this vertex as a corner.
#[inline(always)]
pub fn has(face: Face, vertex: u32) -> bool {
    face.a == vertex || face.b == vertex || face.c == vertex
}

/// How many faces of the ring of `around` have this vertex as a corner.
#[inline(always)]
pub fn faces_with(vertex: u32, around: u32, stars: &Stars<'_>) -> u32 {
    let mut count = 0;
    for &f in stars.ring(around) {
        if has(stars.faces[f as usize], vertex) {
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spokes_tell_which_faces_have_a_corner() {
        // A fan of 1 to 17 faces around vertex 0, of any first corner.
        for len in 1..=AROUND as u32 + 1 {
            let turned = |i: u32| match i % 3 {
                0 => Face { a: 0, b: i + 1, c: i + 2 },
                1 => Face { a: i + 1, b: i + 2, c: 0 },
                _ => Face { a: i + 2, b: 0, c: i + 1 },
            };
            let faces: Vec<Face> = (0..len).map(turned).collect();
            let ring_faces: Vec<u32> = (0..len).collect();
            let stars = Stars { positions: &[], faces: &faces, ring_starts: &[0, len], ring_faces: &ring_faces };
            let Some(spokes) = Spokes::around(0, &stars) else {
                assert_eq!(len, AROUND as u32 + 1);
                continue;
            };
            for corner in 1..len + 2 {
                let bit = |place: u32| if place < len { 1 << place } else { 0 };
                let (next, last) = (bit(corner - 1), corner.checked_sub(2).map_or(0, bit));
                assert_eq!([spokes.with_next(corner), spokes.with_last(corner)], [next, last], "{corner} of {len}");
            }
        }
    }

    #[test]
    fn a_rim_tells_which_corners_one_face_has() {
        // Rings of 1 to 20 faces around vertex 0, at random: corners that none, one or several others have, either way around.
        let mut told = [0; 2];
        for seed in 0..400 {
            let corner = |i: u32| 1 + crate::math::tie_hash(i, seed) % 12;
            let face = |i: u32| {
                let (b, c) = (corner(2 * i), corner(2 * i + 1));
                [Face { a: 0, b, c: c + 12 * u32::from(b == c) }, Face { a: c + 12 * u32::from(b == c), b: 0, c: b }]
                    [i as usize % 2]
            };
            let len = 1 + seed % 20;
            let faces: Vec<Face> = (0..len).map(face).collect();
            let ring_faces: Vec<u32> = (0..len).collect();
            let stars = Stars { positions: &[], faces: &faces, ring_starts: &[0, len], ring_faces: &ring_faces };
            let rim = Rim::around(0, &stars);
            for (place, face) in faces.iter().enumerate() {
                for other in face.corners().into_iter().filter(|&corner| corner != 0) {
                    let is_lone = faces_with(other, 0, &stars) == 1;
                    assert_eq!(rim.is_lone(place, other), is_lone, "{other} at {place} of {faces:?}");
                    told[usize::from(is_lone)] += 1;
                }
            }
        }
        assert!(told.iter().all(|&count| count > 1_000), "{told:?}");
    }
}
