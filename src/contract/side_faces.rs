//! Which of the faces around a pair are each side's.
//!
//! Sides that vanishing faces tell are two at most, and where a seam ends both have the faces of one wedge. Where seams yield
//! there may be hundreds of others, each with a wedge of one end that no other has.

use rustc_hash::FxHashMap;

use super::sides::{CornerFace, Sides};

/// Most sides of one end's wedge alone that every face is compared with: a table is slower for a few. Hundreds around one vertex
/// made it the square of their number.
pub const MOST_ASKED: usize = 8;

impl Sides {
    /// Deals the faces to the sides, which are found: those of a seam that ends may both have one.
    pub(super) fn deal(&mut self) {
        let Self { faces, sides, own, own_starts, told, alone, .. } = self;
        let are_many = sides.len() - *told > MOST_ASKED;
        let asked = if are_many { *told } else { sides.len() };
        // Of the others each face has one at most.
        let most = (asked + usize::from(are_many)) * faces.len() + 1;
        if own.len() < most {
            own.resize(most, 0);
        }
        own_starts.push(0);
        let mut count = 0;
        for side in &sides[..asked] {
            // Written whether it is one or not: a branch would be misjudged along every seam.
            for (number, face) in faces.iter().enumerate() {
                own[count] = number as u32;
                count += usize::from(side.has(face));
            }
            own_starts.push(count);
        }
        if are_many {
            deal_alone(faces, sides.len(), *told, alone, own, own_starts);
        }
    }

    /// The faces of a side.
    pub fn faces_of(&self, side: usize) -> impl Iterator<Item = &CornerFace> + Clone {
        let own = &self.own[self.own_starts[side]..self.own_starts[side + 1]];
        own.iter().map(|&number| &self.faces[number as usize])
    }

    /// The same without the faces that one of the sides `before` has.
    pub fn faces_first_of(&self, side: usize, before: &[u32]) -> impl Iterator<Item = &CornerFace> + Clone {
        let shared = if side < self.told { before } else { &[] };
        self.faces_of(side).filter(move |face| !shared.iter().any(|&other| self.sides[other as usize].has(face)))
    }
}

/// Deals the faces of one end's own wedges to their sides, after those of the sides that were `told`.
fn deal_alone(
    faces: &[CornerFace],
    sides: usize,
    told: usize,
    alone: &FxHashMap<(u8, u32), u32>,
    own: &mut [u32],
    own_starts: &mut Vec<usize>,
) {
    let side_of = |face: &CornerFace| alone.get(&(face.end, face.wedges[0])).map(|&side| side as usize);
    own_starts.resize(sides + 1, 0);
    faces.iter().filter_map(side_of).for_each(|side| own_starts[side + 1] += 1);
    for side in told..sides {
        own_starts[side + 1] += own_starts[side];
    }
    let mut next = own_starts[told..sides].to_vec();
    for (number, side) in faces.iter().enumerate().filter_map(|(number, face)| Some((number, side_of(face)?))) {
        own[next[side - told]] = number as u32;
        next[side - told] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::super::sides::{ENDS, Side};
    use super::super::wedges::NO_WEDGE;
    use super::*;

    /// Two sides told by vanishing faces, which share a wedge, and few or many of one end's wedges: each has its own faces, whether
    /// they are told one after the other or by the table.
    #[test]
    fn faces_are_dealt_to_few_sides_as_to_many() {
        for alone in [0, 1, MOST_ASKED as u32, MOST_ASKED as u32 + 1, 40] {
            let face = |end: u8, wedge: u32| CornerFace { corners: [0; 3], wedges: [wedge; 3], end, dies: false };
            let mut sides = Sides::default();
            sides.told = 2;
            sides.sides = vec![Side { wedges: [1000, 2000, 1000] }, Side { wedges: [1001, 2000, 1001] }];
            sides.faces = vec![face(0, 1000), face(0, 1001), face(1, 2000)];
            for wedge in 0..alone {
                // Every third has two faces, and the ends have wedges of one number.
                let (end, number) = ((wedge % 2) as u8, wedge / 2);
                let mut wedges = [NO_WEDGE; ENDS];
                wedges[usize::from(end)] = number;
                sides.alone.insert((end, number), sides.sides.len() as u32);
                sides.sides.push(Side { wedges });
                sides.faces.extend((0..=u32::from(wedge % 3 == 0)).map(|_| face(end, number)));
            }
            sides.faces.rotate_left(3);
            sides.deal();
            for (number, side) in sides.sides.iter().enumerate() {
                let of = |face: &CornerFace| (face.end, face.wedges[0]);
                let expected: Vec<_> = sides.faces.iter().filter(|face| side.has(face)).map(of).collect();
                assert_eq!(sides.faces_of(number).map(of).collect::<Vec<_>>(), expected, "{number} of {alone}");
            }
            let first: Vec<_> = sides.faces_first_of(1, &[0]).map(|face| face.wedges[0]).collect();
            assert_eq!(first, [1001], "what both have is the first's");
        }
    }
}
