//! Lit pixels from answers about all receivers at once, for structures that take arrays of rays.

use rayon::prelude::*;

use super::{LightQuery, LitCounts, LitPixels, LitTile};
use crate::{Receiver, Triangles, Visibility};

impl LitPixels {
    /// As [`Self::find`], where `shadowed` tells of all receivers at once whether any triangle lies between them and
    /// the light: every triangle casts with both of its sides. `None` if it does not.
    pub fn asked(
        visibility: &Visibility,
        triangles: &Triangles,
        query: &LightQuery,
        shadowed: impl FnOnce(&[Receiver]) -> Option<Vec<bool>>,
    ) -> Option<Self> {
        // Of each tile its receivers, with their blocks and lanes.
        let asked: Vec<Vec<(u32, u32, Receiver)>> = visibility
            .tiles()
            .par_iter()
            .map(|tile| {
                let places = (0..tile.prims.len() as u32).flat_map(|b| (0..16).map(move |lane| (b, lane)));
                places
                    .filter_map(|(block, lane)| {
                        let receiver = tile.receiver(visibility.view(), triangles, block, lane)?;
                        query
                            .faces(triangles, receiver.prim)
                            .then_some((block, lane, receiver))
                    })
                    .collect()
            })
            .collect();
        let receivers: Vec<Receiver> = asked.iter().flatten().map(|a| a.2).collect();
        let dark = shadowed(&receivers)?;
        let mut next = dark.iter();
        let tiles = visibility
            .tiles()
            .iter()
            .zip(&asked)
            .map(|(tile, asked)| {
                let mut lit = vec![0; tile.prims.len()];
                for ((block, lane, _), dark) in asked.iter().zip(&mut next) {
                    lit[*block as usize] |= u16::from(!dark) << lane;
                }
                LitTile {
                    stride: tile.stride,
                    lit,
                }
            })
            .collect();
        Some(Self {
            tiles,
            counts: LitCounts {
                receivers: receivers.len() as u64,
                bytes: size_of_val(&*receivers) + asked.iter().map(|a| size_of_val(&**a)).sum::<usize>(),
                ..LitCounts::default()
            },
        })
    }
}
