//! Skins (glTF 2.0 §3.7.3): joints and inverse bind matrices.

use std::collections::HashMap;

use glam::Mat4;
use gltf::json::accessor::{ComponentType, Type};

use super::place;
use super::source::Source;
use crate::{Error, Skin};

/// The skins that the scene's nodes use, in order of first use.
#[derive(Default)]
pub(super) struct Used {
    skins: Vec<usize>,
    position: HashMap<usize, usize>,
}

impl Used {
    /// Adds a skin of the file.
    pub(super) fn add(&mut self, skin: usize) {
        let next = self.skins.len();
        if *self.position.entry(skin).or_insert(next) == next {
            self.skins.push(skin);
        }
    }

    /// Index of a file's skin in the scene.
    pub(super) fn position(&self, skin: usize) -> Option<usize> {
        self.position.get(&skin).copied()
    }

    /// The joints of all used skins, as nodes of the file.
    pub(super) fn joints(&self, source: &Source<'_>) -> Result<Vec<usize>, Error> {
        let mut joints = Vec::new();
        for &i in &self.skins {
            let skin = &source.root.skins[i];
            let place = place("skin", i, skin.name.as_ref());
            if skin.joints.is_empty() {
                return Err(source.malformed(place, "it has no joints"));
            }
            for &joint in &skin.joints {
                joints.push(source.index(joint, source.root.nodes.len(), "joint node", &place)?);
            }
        }
        Ok(joints)
    }

    /// Reads the used skins; `index` gives the scene's node for each of the file's.
    pub(super) fn read(&self, source: &Source<'_>, index: &[Option<usize>]) -> Result<Vec<Skin>, Error> {
        self.skins.iter().map(|&i| read(source, i, index)).collect()
    }
}

fn read(source: &Source<'_>, i: usize, index: &[Option<usize>]) -> Result<Skin, Error> {
    let skin = &source.root.skins[i];
    let place = place("skin", i, skin.name.as_ref());
    let joints: Vec<usize> = skin
        .joints
        .iter()
        .filter_map(|joint| index[joint.value()])
        .collect();
    let mut inverse_bind = vec![Mat4::IDENTITY; joints.len()];
    if let Some(accessor) = skin.inverse_bind_matrices {
        let matrices = source.elements(accessor, &[Type::Mat4], &place)?;
        if matrices.kind != ComponentType::F32 || matrices.count < joints.len() {
            let (count, kind) = (matrices.count, matrices.kind);
            let problem = format!(
                "{count} {kind:?} matrices for {} joints, F32 are needed",
                joints.len()
            );
            return Err(source.malformed(matrices.place, problem));
        }
        for (k, matrix) in inverse_bind.iter_mut().enumerate() {
            *matrix = Mat4::from_cols_array(&matrices.floats(k));
        }
    }
    Ok(Skin {
        name: skin.name.clone().unwrap_or_default(),
        joints,
        inverse_bind,
    })
}
