//! Whether a region stays in one piece where the faces around do not tell.

use super::scene::Scene;

/// Faces that a search meets before it gives up: the same moves fail in every pass, and long ways around are rare.
const MOST_MET: usize = 256;

/// Searches through a region, and remembers those in vain until a label nearby changes.
#[derive(Debug)]
pub struct Detours {
    /// The search that met each face last.
    met: Vec<u32>,
    searches: u32,
    queue: Vec<u32>,
    /// Whether the last search from each face was in vain.
    is_in_vain: Vec<bool>,
    /// Whether any of those was remembered since [`Detours::forget`].
    remembers: bool,
}

impl Detours {
    pub fn new(face_count: usize) -> Self {
        Self {
            met: vec![0; face_count],
            searches: 0,
            queue: Vec::new(),
            is_in_vain: vec![false; face_count],
            remembers: false,
        }
    }

    /// Whether the neighbors of a face in its region are reached from one of them without it, by a way of bounded length.
    pub fn stays_connected(&mut self, scene: &Scene<'_>, labels: &[u32], face: u32) -> bool {
        if self.is_in_vain[face as usize] {
            self.remembers = true;
            return false;
        }
        let label = labels[face as usize];
        let mut own = scene.around(face).filter(|&other| labels[other as usize] == label);
        let Some(first) = own.next() else { return false };
        let mut left = own.filter(|&other| other != first).count();
        self.searches += 1;
        self.met[face as usize] = self.searches;
        self.met[first as usize] = self.searches;
        self.queue.clear();
        self.queue.push(first);
        let mut at = 0;
        while left > 0 && at < self.queue.len() && self.queue.len() <= MOST_MET {
            let met = self.queue[at];
            at += 1;
            for other in scene.around(met) {
                if labels[other as usize] == label && self.met[other as usize] != self.searches {
                    self.met[other as usize] = self.searches;
                    self.queue.push(other);
                    left -= usize::from(scene.around(face).any(|wanted| wanted == other));
                }
            }
        }
        self.is_in_vain[face as usize] = left > 0;
        left == 0
    }

    /// Takes note of a face with another label.
    pub fn changed(&mut self, scene: &Scene<'_>, face: u32) {
        let surface = scene.surface;
        for corner in surface.faces[face as usize] {
            surface.rings.ring(corner).iter().for_each(|&other| self.is_in_vain[other as usize] = false);
        }
    }

    /// Forgets what was in vain; whether nothing that was remembered counted.
    pub fn forget(&mut self) -> bool {
        self.is_in_vain.fill(false);
        !std::mem::take(&mut self.remembers)
    }
}

/// Whether the rest of a face's region is in one piece, by a search without bounds.
#[cfg(test)]
pub fn is_free_to_leave(scene: &Scene<'_>, regions: &super::labeling::Labeling, face: u32) -> bool {
    let label = regions.labels[face as usize];
    let own: Vec<u32> = scene.around(face).filter(|&other| regions.labels[other as usize] == label).collect();
    let Some(&first) = own.first() else { return false };
    let mut seen = std::collections::BTreeSet::from([face, first]);
    let mut stack = vec![first];
    while let Some(met) = stack.pop() {
        stack.extend(scene.around(met).filter(|&other| regions.labels[other as usize] == label && seen.insert(other)));
    }
    own.iter().all(|other| seen.contains(other))
}
