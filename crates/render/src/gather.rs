//! How the samples of a picture become its pixels: one alone, the mean of several, or shares of pixels.

use rayon::prelude::*;

use crate::mean::Mean;
use crate::tile::coverage::{self, Sharing, TileShares};
use crate::tile::{TileCounts, TileShader, TileWork};
use crate::{Antialias, Error, Film, Layers, RenderOptions, Result, ShadowStructure};

/// What has been gathered of a picture's samples.
pub(crate) enum Gather {
    /// One sample is the picture.
    One,
    /// Their mean, each shaded.
    Mean(Mean),
    /// What several show is shaded once.
    Shares {
        sharing: Sharing,
        tiles: Vec<TileShares>,
        /// What is shaded after the first sample.
        later: Box<Film>,
    },
}

impl Gather {
    /// Of no samples yet, for a film.
    pub(crate) fn new(
        options: &RenderOptions,
        film: &Film,
        sharing: impl FnOnce() -> Sharing,
    ) -> Result<Self> {
        if options.pixel_samples <= 1 {
            return Ok(Self::One);
        }
        if options.antialias == Antialias::Samples {
            return Ok(Self::Mean(Mean::new(film)));
        }
        let layers = Layers {
            alpha: options.layers.alpha,
            ..Layers::default()
        };
        Ok(Self::Shares {
            sharing: sharing(),
            tiles: Vec::new(),
            later: Box::new(Film::new(options.width, options.height, layers)?),
        })
    }

    /// The samples in the order in which they are to come. The film's other layers are those of the centres: these come
    /// last where each sample overwrites them, and first where they stand for later ones.
    pub(crate) fn order(&self, options: &RenderOptions) -> Vec<u32> {
        let samples = 0..options.pixel_samples.max(1);
        match self {
            Self::Shares { .. } => samples.collect(),
            _ => samples.rev().collect(),
        }
    }

    /// Renders one sample of all pixels.
    pub(crate) fn render(
        &mut self,
        shader: &TileShader,
        film: &mut Film,
        told: &(impl Fn() + Sync),
    ) -> TileCounts {
        let eye = &shader.structures.eye;
        match self {
            Self::Shares {
                sharing,
                tiles,
                later,
            } => {
                let first = shader.sample == 0;
                if first {
                    let indices = 0..eye.tile_count();
                    *tiles = indices.map(|index| TileShares::new(&eye.tile(index))).collect();
                }
                let film = if first { film } else { &mut **later };
                let sharing = &*sharing;
                let shares = tiles.par_iter_mut().map(|tile| Some((sharing, tile)));
                render_tiles(shader, film, shares, told)
            }
            Self::One | Self::Mean(_) => {
                let alone = (0..eye.tile_count() as usize).into_par_iter().map(|_| None);
                let counts = render_tiles(shader, film, alone, told);
                if let Self::Mean(mean) = self {
                    mean.add(film);
                }
                counts
            }
        }
    }

    /// Makes the film what all samples say together; `side` is that of the tiles.
    pub(crate) fn finish(self, film: &mut Film, side: u32) {
        match self {
            Self::One => (),
            Self::Mean(mean) => mean.finish(film),
            Self::Shares { tiles, .. } => coverage::finish(&tiles, film, side),
        }
    }
}

/// Checks that what is asked of a frame can be had together.
pub(crate) fn check(options: &RenderOptions, distributed: bool) -> Result<()> {
    let other = [
        (distributed, "a lens or a shutter"),
        (options.paper, "the papers' parameters"),
        (options.reference, "a reference"),
        (
            matches!(
                options.shadow_structure,
                ShadowStructure::Grid | ShadowStructure::Tree
            ),
            "a structure of casters for all shadows",
        ),
    ];
    match other.into_iter().find(|(asked, _)| *asked) {
        Some((_, with)) if options.antialias == Antialias::Coverage => Err(Error::Antialias { with }),
        _ => Ok(()),
    }
}

/// Renders all tiles of one sample of the pixels.
fn render_tiles<'a>(
    shader: &TileShader,
    film: &mut Film,
    shares: impl IndexedParallelIterator<Item = Option<(&'a Sharing, &'a mut TileShares)>>,
    told: &(impl Fn() + Sync),
) -> TileCounts {
    let side = shader.structures.eye.tile_side();
    film.tiles_mut(side, side)
        .par_iter_mut()
        .zip(shares)
        .enumerate()
        .map_init(TileWork::default, |work, (index, (out, shares))| {
            let index = index as u32;
            let wanted = shader.options.renders(&shader.structures.eye.tile(index));
            let counts = if wanted {
                shader.render(index, work, shares, out)
            } else {
                TileCounts::default()
            };
            told();
            counts
        })
        .reduce(TileCounts::default, TileCounts::sum)
}
