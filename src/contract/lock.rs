//! Vertices of the input that stay where they are, by their numbers or by what they carry.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::mesh::Mesh;

use super::Options;

/// Which vertices of the input stay where they are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lock {
    /// These, numbered from 0.
    Vertices(Arc<[u32]>),
    /// Those of which a number in the channel of this name is greater than 0.
    Channel(String),
}

impl Options {
    /// For each vertex of `mesh`, which passed its check, whether it stays; `None` where none has to.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a vertex or a channel that the mesh has not, with the names of those that it has.
    pub(super) fn held(&self, mesh: &Mesh) -> Result<Option<Vec<bool>>> {
        let count = mesh.positions.len();
        let mut held = match &self.locked {
            Some(locked) if locked.len() != count => {
                let given = locked.len();
                return Err(Error::Parameter(format!("{given} locks for a mesh of {count} vertices: give one each")));
            }
            locked => locked.as_deref().map(<[bool]>::to_vec),
        };
        match &self.lock {
            None => {}
            Some(Lock::Vertices(vertices)) => {
                let held = held.get_or_insert_with(|| vec![false; count]);
                for &vertex in vertices.iter() {
                    let unknown =
                        || Error::Parameter(format!("no vertex {vertex} to lock: the mesh has {count}, from 0 on"));
                    *held.get_mut(vertex as usize).ok_or_else(unknown)? = true;
                }
            }
            Some(Lock::Channel(name)) => {
                let channel = mesh.channels.iter().find(|channel| channel.name == *name).ok_or_else(|| {
                    let known = mesh.channel_names();
                    Error::Parameter(format!("no channel '{name}' to lock vertices by: the mesh has {known}"))
                })?;
                let held = held.get_or_insert_with(|| vec![false; count]);
                for (vertex, held) in held.iter_mut().enumerate() {
                    *held |= channel.row(vertex).iter().any(|&number| number > 0.0);
                }
            }
        }
        Ok(held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Channel, ChannelKind, shapes};

    fn held(options: &Options) -> Result<Option<Vec<bool>>> {
        let mut mesh = shapes::tetrahedron();
        let values = vec![0.0, 0.5, f32::NAN, -1.0];
        mesh.channels = vec![Channel { name: "pin".into(), kind: ChannelKind::Linear, width: 1, values }];
        options.held(&mesh)
    }

    #[test]
    fn locks_add_up() {
        let by = |lock: Lock| Options { lock: Some(lock), ..Options::default() };
        assert_eq!(held(&Options::default()).ok(), Some(None));
        let pinned = by(Lock::Channel("pin".into()));
        assert_eq!(held(&pinned).ok(), Some(Some(vec![false, true, false, false])));
        assert_eq!(held(&by(Lock::Vertices([3, 0, 3].into()))).ok(), Some(Some(vec![true, false, false, true])));
        let both = Options { locked: Some([false, false, true, false].into()), ..pinned };
        assert_eq!(held(&both).ok(), Some(Some(vec![false, true, true, false])));
    }

    #[test]
    fn what_is_not_there_is_told() {
        let told = |lock: Lock| {
            let options = Options { lock: Some(lock), ..Options::default() };
            held(&options).expect_err("there is no such thing").to_string()
        };
        assert!(
            told(Lock::Channel("pins".into())).ends_with("no channel 'pins' to lock vertices by: the mesh has pin")
        );
        assert!(told(Lock::Vertices([4].into())).ends_with("no vertex 4 to lock: the mesh has 4, from 0 on"));
    }
}
