//! How the faces around a vertex hang together.

use rayon::prelude::*;

use crate::math::places::Places;

use super::adjacency::{Rings, from_corner};
use super::topology::has_repeated_corner;

/// What is told of vertices that are neither, with their number behind it.
pub(crate) const NOT_MANIFOLD: &str = "vertices that stay where they are, as the surface is not manifold there";

/// The faces around a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fan {
    /// One consistently oriented fan all around, or no face.
    Closed,
    /// One consistently oriented fan between two border edges.
    Open,
    /// Anything else: bow ties, both ends of an edge with more than two faces or with two that disagree in orientation,
    /// the corners of a face that repeats one.
    Complex,
}

/// Vertices of a task at least: those where a surface touches itself take many times as long, and stand side by side.
pub const VERTICES_EACH: usize = 1 << 8;

/// The fan of every vertex.
pub fn fans(faces: &[[u32; 3]], rings: &Rings) -> Vec<Fan> {
    (0..rings.vertex_count() as u32)
        .into_par_iter()
        .with_min_len(VERTICES_EACH)
        .map_init(Scratch::default, |scratch, v| scratch.fan(faces, rings.ring(v), v))
        .collect()
}

/// Finds those fans that were complex anew, after the `turned` of `faces` were turned over. All or none of another fan's must have
/// been.
pub fn find_complex_again(fans: &mut [Fan], faces: &[[u32; 3]], rings: &Rings, turned: &[bool]) {
    let has_changed = |v: usize| rings.ring(v as u32).iter().any(|&f| turned[f as usize]);
    // A filter before it would move the scratch for every vertex.
    let rows = fans.par_iter_mut().enumerate().with_min_len(VERTICES_EACH);
    rows.for_each_init(Scratch::default, |scratch, (v, fan)| {
        if *fan == Fan::Complex && has_changed(v) {
            *fan = scratch.fan(faces, rings.ring(v as u32), v as u32);
        }
    });
}

/// Room to look at the faces around a vertex.
#[derive(Default)]
pub struct Scratch {
    places: Places,
    walk: Walk,
}

impl Scratch {
    /// The fan of a vertex.
    pub fn fan(&mut self, faces: &[[u32; 3]], ring: &[u32], vertex: u32) -> Fan {
        if closes(faces, ring, vertex, &mut self.places) { Fan::Closed } else { self.walk.fan(faces, ring, vertex) }
    }
}

/// Faces around a vertex that [`closes`] looks at; few vertices have more.
const AROUND: usize = 16;

/// Whether the arrows from the next corner to the last of the faces around a vertex form one cycle, as almost everywhere. False
/// also where there are many, and where the last bits of two corners are the same.
fn closes(faces: &[[u32; 3]], ring: &[u32], vertex: u32, places: &mut Places) -> bool {
    if ring.len() > AROUND {
        return false;
    }
    let (mut begins, mut ends) = ([0; AROUND], [0; AROUND]);
    let mut repeats = false;
    for (i, (&f, (begin, end))) in ring.iter().zip(begins.iter_mut().zip(&mut ends)).enumerate() {
        let [a, b, c] = faces[f as usize];
        repeats |= has_repeated_corner(&[a, b, c]);
        let (next, last) = if a == vertex { (b, c) } else { (c, a) };
        let is_last = c == vertex;
        *begin = if is_last { a } else { next };
        *end = if is_last { b } else { last };
        places.put(*begin, i as u8);
    }
    if repeats || ring.is_empty() {
        return !repeats;
    }
    // The arrow that follows each, before any step: then the steps are all that waits for another. What is found is the same
    // for the same end, so a cycle through all arrows has no two that begin alike.
    let (mut next, mut has_next) = ([0_u8; AROUND], true);
    for (&end, next) in ends[..ring.len()].iter().zip(&mut next) {
        let place = places.of(end) % AROUND;
        *next = place as u8;
        has_next &= (place < ring.len()) & (begins[place] == end);
    }
    let mut at = 0;
    for walked in 1..=ring.len() {
        at = usize::from(next[at]) % AROUND;
        if at == 0 {
            return has_next && walked == ring.len();
        }
    }
    false
}

const NONE: u32 = u32::MAX;

/// Room to walk around one vertex, whatever is there.
#[derive(Default)]
struct Walk {
    /// For every face around the vertex its next corner (above) and its last (below): an arrow of the link, sorted.
    arrows: Vec<u64>,
    /// The arrow that begins where this one ends.
    after: Vec<u32>,
    entered: Vec<bool>,
}

impl Walk {
    /// Whether the arrows next → last of the faces around a vertex form one path or one cycle through distinct corners.
    ///
    /// An edge of three faces, or of two that disagree, has two arrows that begin or two that end in its far corner.
    fn fan(&mut self, faces: &[[u32; 3]], ring: &[u32], vertex: u32) -> Fan {
        self.arrows.clear();
        for &f in ring {
            let Some([_, next, last]) = from_corner(faces[f as usize], vertex) else { return Fan::Complex };
            self.arrows.push(u64::from(next) << 32 | u64::from(last));
        }
        if self.arrows.is_empty() {
            return Fan::Closed;
        }
        self.arrows.sort_unstable();
        let begin = |arrow: &u64| arrow >> 32;
        if self.arrows.windows(2).any(|pair| begin(&pair[0]) == begin(&pair[1])) {
            return Fan::Complex;
        }

        let count = self.arrows.len();
        self.entered.clear();
        self.entered.resize(count, false);
        self.after.clear();
        let mut ends = 0;
        for arrow in &self.arrows {
            let last = arrow & u64::from(u32::MAX);
            match self.arrows.binary_search_by_key(&last, begin) {
                Ok(after) if self.entered[after] => return Fan::Complex,
                Ok(after) => {
                    self.entered[after] = true;
                    self.after.push(after as u32);
                }
                Err(_) => {
                    ends += 1;
                    self.after.push(NONE);
                }
            }
        }
        // One end: a path, from the one arrow that is not entered. No end: a cycle, from anywhere.
        if ends > 1 {
            return Fan::Complex;
        }
        let first = self.entered.iter().position(|entered| !entered).unwrap_or(0) as u32;
        let mut walked = 1;
        let mut at = self.after[first as usize];
        while at != NONE && at != first {
            walked += 1;
            at = self.after[at as usize];
        }
        match (walked == count, ends) {
            (true, 0) => Fan::Closed,
            (true, _) => Fan::Open,
            _ => Fan::Complex,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::shapes;
    use super::*;

    fn fans_of(faces: &[[u32; 3]], vertex_count: usize) -> Vec<Fan> {
        fans(faces, &Rings::new(faces, vertex_count))
    }

    #[test]
    fn fans_of_shapes() {
        // A wheel of n faces about vertex 0, closed and with a face missing, on either side of every limit.
        for n in [3_u32, 7, 8, 9, 16, 17, 40] {
            let mut wheel: Vec<[u32; 3]> = (0..n).map(|i| [i % 3, (i + 1) % 3, (i + 2) % 3]).collect();
            for (i, face) in (0..n).zip(&mut wheel) {
                let corners = [0, 1 + i, 1 + (i + 1) % n];
                *face = face.map(|corner| corners[corner as usize]);
            }
            let fans = fans_of(&wheel, n as usize + 2);
            assert_eq!((fans[0], fans[1], fans[n as usize + 1]), (Fan::Closed, Fan::Open, Fan::Closed), "{n}");
            assert_eq!(fans_of(&wheel[1..], n as usize + 1)[0], Fan::Open, "{n}");
            wheel[1].swap(0, 1);
            assert_eq!(fans_of(&wheel, n as usize + 1)[0], Fan::Complex, "{n}");
        }
        assert!(fans_of(&shapes::torus(6, 4).faces, 24).iter().all(|&fan| fan == Fan::Closed));
        // Two cones on one tip: each closes.
        let cones = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 4, 5], [0, 5, 6], [0, 6, 4]];
        assert_eq!(fans_of(&cones, 7)[0], Fan::Complex);
    }

    proptest! {
        /// What is looked up of a few faces against the walk around them.
        #[test]
        fn closed_fans_are_found(faces in prop::collection::vec([0u32..6, 0u32..6, 0u32..6], 0..14)) {
            let (rings, mut places) = (Rings::new(&faces, 6), Places::default());
            for v in (0..6).filter(|&v| rings.ring(v).len() <= AROUND) {
                let closed = Walk::default().fan(&faces, rings.ring(v), v) == Fan::Closed;
                prop_assert_eq!(closes(&faces, rings.ring(v), v, &mut places), closed);
            }
        }
    }
}
