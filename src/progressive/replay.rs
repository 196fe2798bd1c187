//! A mesh anywhere along its log.

use super::rings::{Rings, Splice};
use super::{CollapseLog, Contraction, NONE, malformed};
use crate::error::Result;
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;
use crate::mesh::topology::has_repeated_corner;
use crate::mesh::weld::joined_attributes;

/// A mesh with its log, and how many of the contractions are done.
///
/// A step either way costs as much as the faces around its vertex; [`mesh`](Self::mesh) passes over the input.
#[derive(Debug)]
pub struct Replay<'a> {
    input: &'a Mesh,
    log: &'a CollapseLog,
    rings: Rings,
    /// Input faces that are not part of any state, beside those that the log drops.
    faces_at_start: usize,
    /// By input vertex, as they are now.
    rows: Rows,
    /// By contraction: what its vertex has on the other side of it.
    others: Rows,
    /// Of the contractions that are done.
    splices: Vec<Splice>,
}

/// What vertices have.
#[derive(Debug, Clone)]
struct Rows {
    positions: Vec<DVec3>,
    normals: Option<Vec<Vec3>>,
    colors: Option<Vec<[f32; 4]>>,
}

impl<'a> Replay<'a> {
    /// At the start of the log: `input` welded and pruned as it was for the run.
    ///
    /// Normals and colors are followed where both have them; texture coordinates and colors of faces are not, as in a run.
    ///
    /// # Errors
    /// What [`Mesh::check`] finds, [`Error::Parameter`](crate::Error::Parameter) for another mesh than the log's,
    /// [`Error::Format`](crate::Error::Format) for a log that contradicts itself.
    pub fn new(input: &'a Mesh, log: &'a CollapseLog) -> Result<Self> {
        input.check()?;
        let representative = log.start_on(input)?;
        let mut dropped = vec![false; input.faces.len()];
        log.dropped_faces.iter().for_each(|&face| dropped[face as usize] = true);
        let mut faces = input.faces.clone();
        for (f, face) in faces.iter_mut().enumerate().filter(|&(f, _)| !dropped[f]) {
            *face = face.map(|v| representative[v as usize]);
            if face.contains(&NONE) || has_repeated_corner(face) {
                return Err(malformed(format!("face {f} is kept without three corners")));
            }
        }
        let vertices: Vec<u32> = (0..).zip(&representative).filter(|&(v, &to)| v == to).map(|(v, _)| v).collect();
        Ok(Self {
            rings: Rings::new(faces, representative.len(), |f| !dropped[f]),
            faces_at_start: input.faces.len() - log.dropped_faces.len(),
            rows: Rows::at_start(input, log, representative, &vertices),
            others: Rows {
                positions: log.contractions.iter().map(|contraction| contraction.position).collect(),
                normals: log.normals.clone(),
                colors: log.colors.clone(),
            },
            splices: Vec::new(),
            input,
            log,
        })
    }

    /// Contractions done.
    pub fn step(&self) -> usize {
        self.splices.len()
    }

    /// Faces now.
    pub fn face_count(&self) -> usize {
        self.faces_at_start - self.rings.dead_count()
    }

    /// Vertices now: those that a face uses.
    pub fn vertex_count(&self) -> usize {
        self.rings.used_count()
    }

    /// Contracts the next pair; false at the end of the log.
    pub fn forward(&mut self) -> bool {
        let step = self.step();
        let Some(&Contraction { keep, gone, .. }) = self.log.contractions.get(step) else { return false };
        self.splices.push(self.rings.contract(keep, gone, self.log.cancelled_by(step)));
        self.rows.swap(keep, &mut self.others, step);
        true
    }

    /// Splits the last vertex; false at the start of the log.
    pub fn back(&mut self) -> bool {
        let Some(splice) = self.splices.pop() else { return false };
        let step = self.step();
        let Contraction { keep, gone, .. } = self.log.contractions[step];
        self.rings.split(keep, gone, splice);
        self.rows.swap(keep, &mut self.others, step);
        true
    }

    /// Goes to where this many contractions are done, or to the end of the log.
    pub fn seek(&mut self, step: usize) {
        while self.step() > step && self.back() {}
        while self.step() < step && self.forward() {}
    }

    /// Goes to the first state with at most this many faces, or to the end of the log; returns how many there are.
    pub fn to_faces(&mut self, faces: usize) -> usize {
        while self.face_count() <= faces && self.back() {}
        while self.face_count() > faces && self.forward() {}
        self.face_count()
    }

    /// The mesh as it is now, vertices and faces in the order of the input; vertices without a face are left out.
    pub fn mesh(&self) -> Mesh {
        let mut faces: Vec<[u32; 3]> = self.rings.live_faces().collect();
        let mut new_vertex = vec![NONE; self.input.positions.len()];
        faces.as_flattened().iter().for_each(|&v| new_vertex[v as usize] = v);
        let vertices: Vec<u32> = new_vertex.iter().copied().filter(|&v| v != NONE).collect();
        (0..).zip(&vertices).for_each(|(new, &v)| new_vertex[v as usize] = new);
        faces.iter_mut().for_each(|face| *face = face.map(|v| new_vertex[v as usize]));
        Mesh {
            positions: take(&self.rows.positions, &vertices),
            faces,
            normals: self.rows.normals.as_ref().map(|rows| take(rows, &vertices)),
            colors: self.rows.colors.as_ref().map(|rows| take(rows, &vertices)),
            texcoords: None,
            face_colors: None,
            ..Mesh::default()
        }
    }
}

impl Rows {
    /// What the vertices of the start have, averaged over those that were joined, by input vertex.
    fn at_start(input: &Mesh, log: &CollapseLog, mut representative: Vec<u32>, vertices: &[u32]) -> Self {
        let mut rows = Self {
            positions: input.positions.clone(),
            normals: input.normals.clone().filter(|_| log.normals.is_some()),
            colors: input.colors.clone().filter(|_| log.colors.is_some()),
        };
        if !log.joined.is_empty() {
            // A vertex that went without a trace stands for itself.
            (0..).zip(&mut representative).filter(|(_, to)| **to == NONE).for_each(|(v, to)| *to = v);
            let (normals, colors) = joined_attributes(input, Some(&representative), vertices);
            put(&mut rows.normals, normals, vertices);
            put(&mut rows.colors, colors, vertices);
        }
        rows
    }

    /// Exchanges the rows of `vertex` and those of `others` at `step`.
    fn swap(&mut self, vertex: u32, others: &mut Self, step: usize) {
        let vertex = vertex as usize;
        std::mem::swap(&mut self.positions[vertex], &mut others.positions[step]);
        if let (Some(rows), Some(others)) = (&mut self.normals, &mut others.normals) {
            std::mem::swap(&mut rows[vertex], &mut others[step]);
        }
        if let (Some(rows), Some(others)) = (&mut self.colors, &mut others.colors) {
            std::mem::swap(&mut rows[vertex], &mut others[step]);
        }
    }
}

/// Puts the rows of `vertices` into their places, where there are any.
fn put<T: Copy>(rows: &mut Option<Vec<T>>, of_vertices: Option<Vec<T>>, vertices: &[u32]) {
    if let (Some(rows), Some(of_vertices)) = (rows, of_vertices) {
        vertices.iter().zip(of_vertices).for_each(|(&v, row)| rows[v as usize] = row);
    }
}

fn take<T: Copy>(rows: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&row| rows[row as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Identity;
    use super::*;
    use crate::error::Error;
    use crate::mesh::shapes;

    /// A square of two faces, and a log that contracts an edge of it.
    fn log_of_a_square() -> (Mesh, CollapseLog) {
        let mesh = shapes::plane(1, 1);
        let contraction = Contraction { keep: 2, gone: 1, position: DVec3::splat(0.5) };
        let log = CollapseLog {
            identity: Identity::of(&mesh),
            joined: Vec::new(),
            dropped_faces: Vec::new(),
            contractions: vec![contraction],
            cancelled: Vec::new(),
            normals: None,
            colors: None,
        };
        (mesh, log)
    }

    #[test]
    fn a_log_that_contradicts_itself_is_refused() {
        let (mesh, log) = log_of_a_square();
        assert!(Replay::new(&mesh, &log).is_ok());
        let refuses = |change: &dyn Fn(&mut CollapseLog), part: &str| {
            let mut log = log.clone();
            change(&mut log);
            match Replay::new(&mesh, &log) {
                Err(Error::Format { message, .. }) => assert!(message.contains(part), "{message}"),
                other => panic!("{part}: {other:?}"),
            }
        };
        for (keep, gone) in [(2, 2), (2, 4), (4, 2), (NONE, 0)] {
            let bad = Contraction { keep, gone, position: DVec3::ZERO };
            refuses(&|log| log.contractions[0] = bad, &format!("contraction 0 joins {gone} to {keep}"));
        }
        refuses(&|log| log.contractions.push(log.contractions[0]), "contraction 1");
        refuses(&|log| log.contractions[0].position.x = f64::NAN, "contraction 0");
        for row in [[4, 0], [2, 3], [2, 2], [NONE, NONE]] {
            refuses(&|log| log.joined.push(row), "is joined to");
        }
        refuses(&|log| log.joined = vec![[1, 0], [1, NONE]], "vertex 1 is joined");
        refuses(&|log| log.joined = vec![[1, 0], [2, 1]], "vertex 2 is joined to 1");
        let joined = CollapseLog { joined: vec![[1, 0]], contractions: Vec::new(), ..log.clone() };
        refuses(&|log| *log = joined.clone(), "kept without three corners");
        refuses(&|log| log.joined.push([3, NONE]), "kept without three corners");
        refuses(&|log| log.dropped_faces = vec![2], "not in order");
        refuses(&|log| log.dropped_faces = vec![1, 1], "not in order");
        refuses(&|log| log.cancelled = vec![[1, 0]], "cancelled faces are not in order");
        refuses(&|log| log.cancelled = vec![[0, 2]], "cancelled faces are not in order");
    }

    #[test]
    fn steps_count_what_is_left() {
        let (mesh, log) = log_of_a_square();
        let mut replay = Replay::new(&mesh, &log).expect("its own mesh");
        assert_eq!((replay.step(), replay.vertex_count(), replay.face_count()), (0, 4, 2));
        assert!(replay.forward() && !replay.forward());
        let after = replay.mesh();
        assert_eq!((replay.step(), replay.vertex_count(), replay.face_count()), (1, 3, after.faces.len()));
        assert_eq!(after.positions[1], DVec3::splat(0.5));
        assert!(replay.back() && !replay.back());
        assert_eq!(replay.mesh(), mesh);
    }
}
