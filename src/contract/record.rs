//! The log of a run: every round's contractions under the names that input vertices have.

use crate::kernel::rows::{Contraction, Position};
use crate::mesh::Mesh;
use crate::mesh::frame::Frame;
use crate::mesh::orient::TURNED;
use crate::progressive::{self, CollapseLog};

use super::carry::{Carried, MOVED_FROM};
use super::committed::Committed;
use super::layout::Origin;
use super::prepare::Prepared;
use super::restore::model_position;

/// Rounds number vertices anew; the origins that these carry are names that last.
#[derive(Debug)]
pub struct Recorder<'a> {
    input: &'a Mesh,
    frame: Frame,
    log: CollapseLog,
}

impl<'a> Recorder<'a> {
    /// At the start of a run on `input`.
    pub fn new(input: &'a Mesh, prepared: &Prepared) -> Self {
        let Prepared { frame, carried, lowest, .. } = prepared;
        let faces = carried.face_origin.iter().map(|origin| origin & !TURNED);
        let carries = |origin| {
            carried.wedges.as_ref().is_some_and(|w| w.layout.layers.iter().any(|layer| layer.origin == origin))
        };
        let carries = [Origin::Normals, Origin::Colors].map(carries);
        let log = CollapseLog::new(input, lowest.as_deref(), &carried.origin, faces, carries);
        Self { input, frame: *frame, log }
    }

    /// Notes a round before it is compacted: `before` are the origins as it began, which follow it.
    pub fn record(&mut self, committed: &Committed, before: &mut [u32], carried: &Carried) {
        // Both in order: the faces of a contraction follow those of the ones before it.
        let mut cancelled = committed.cancelled.iter().peekable();
        for &Contraction { keep, gone, x, y, z, flags } in &committed.contractions {
            // The new vertex goes by the name of one of the ends, not always by that of its row.
            let origin = carried.origin[keep as usize];
            let [own, other] = [keep, gone].map(|v| before[v as usize] & !MOVED_FROM);
            let (kept, lost) = if origin & !MOVED_FROM == own { (own, other) } else { (other, own) };
            // Of a triangle, the vertex goes on to its second contraction under the name that it has by then.
            before[keep as usize] = kept;
            let position = model_position(self.input, self.frame, origin, Position { x, y, z, flags });
            let contraction = progressive::Contraction { keep: kept, gone: lost, position };
            let (normal, color) = carried.wedges.as_ref().map_or((None, None), |wedges| wedges.of_vertex(keep));
            self.log.push(contraction, normal, color);
            while let Some(face) = cancelled.next_if(|cancelled| cancelled.keep == keep) {
                self.log.cancel(carried.face_origin[face.face as usize] & !TURNED);
            }
        }
    }

    /// The log of what was noted.
    pub fn into_log(self) -> CollapseLog {
        self.log
    }
}
