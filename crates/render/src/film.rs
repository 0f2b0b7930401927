//! The picture as it is computed: linear colour and, on request, what each pixel saw.
//!
//! Layout: one vector a layer, row 0 on top, `width * height` entries; a layer that was not asked for is empty.
//! Colour is f32 radiance with the primaries of sRGB. Cost: 12 bytes a pixel, plus 4 to 12 for each further layer.
//!
//! Tiles are written in parallel through [`Film::tiles_mut`], which splits every layer into disjoint row
//! segments: no copy, no lock. Splitting costs some 10 ns for each row of each tile and layer.

use std::ops::Range;

use glam::{Vec2, Vec3};

use crate::error::check_size;
use crate::{Part, PixelCost, Result};

/// Which layers a film holds besides its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    /// Coverage, 0 where the background shows, 1 on surfaces.
    pub alpha: bool,
    /// View depth along the camera's forward axis, metres; infinite on the background.
    pub depth: bool,
    /// Length of the ray from its origin to the surface, metres; infinite on the background.
    pub distance: bool,
    /// World-space unit shading normal turned towards the viewer; zero on the background.
    pub normal: bool,
    /// Index of the object; [`NO_ID`] on the background.
    pub object: bool,
    /// Index of the triangle; [`NO_ID`] on the background.
    pub prim: bool,
    /// Barycentric weights of the triangle's corners 1 and 2; zero on the background.
    pub bary: bool,
    /// How far what is seen has come in the picture, pixels to the right and down; see [`crate::add_motion`].
    pub motion: bool,
    /// What the rays of the pixel cost; see [`PixelCost`].
    pub cost: bool,
}

impl Layers {
    /// Every layer that one frame gives at no further cost: all but motion and cost.
    pub const ALL: Self = Self {
        alpha: true,
        depth: true,
        distance: true,
        normal: true,
        object: true,
        prim: true,
        bary: true,
        motion: false,
        cost: false,
    };

    /// Those that are in either.
    pub fn or(self, other: Self) -> Self {
        Self {
            alpha: self.alpha || other.alpha,
            depth: self.depth || other.depth,
            distance: self.distance || other.distance,
            normal: self.normal || other.normal,
            object: self.object || other.object,
            prim: self.prim || other.prim,
            bary: self.bary || other.bary,
            motion: self.motion || other.motion,
            cost: self.cost || other.cost,
        }
    }

    /// Whether this layer is among them; colour always is.
    pub fn has(self, layer: LayerKind) -> bool {
        match layer {
            LayerKind::Color => true,
            LayerKind::Alpha => self.alpha,
            LayerKind::Depth => self.depth,
            LayerKind::Distance => self.distance,
            LayerKind::Normal => self.normal,
            LayerKind::Object => self.object,
            LayerKind::Prim => self.prim,
            LayerKind::Bary => self.bary,
            LayerKind::Motion => self.motion,
            LayerKind::Cost => self.cost,
        }
    }

    /// Those that are in both.
    pub fn and(self, other: Self) -> Self {
        Self {
            alpha: self.alpha && other.alpha,
            depth: self.depth && other.depth,
            distance: self.distance && other.distance,
            normal: self.normal && other.normal,
            object: self.object && other.object,
            prim: self.prim && other.prim,
            bary: self.bary && other.bary,
            motion: self.motion && other.motion,
            cost: self.cost && other.cost,
        }
    }

    /// Memory that a film with these layers takes for a pixel, colour included, in bytes.
    pub fn bytes_a_pixel(self) -> u64 {
        let Self {
            alpha,
            depth,
            distance,
            normal,
            object,
            prim,
            bary,
            motion,
            cost,
        } = self;
        let words = [alpha, depth, distance, object, prim].map(|kept| (kept, 1));
        let vectors = [(true, 3), (normal, 3), (bary, 2), (motion, 2), (cost, 6)];
        let kept = words.iter().chain(&vectors).filter(|(kept, _)| *kept);
        4 * kept.map(|(_, words)| words).sum::<u64>()
    }
}

/// One layer of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LayerKind {
    /// Linear colour.
    Color,
    /// See [`Layers::alpha`].
    Alpha,
    /// See [`Layers::depth`].
    Depth,
    /// See [`Layers::distance`].
    Distance,
    /// See [`Layers::normal`].
    Normal,
    /// See [`Layers::object`].
    Object,
    /// See [`Layers::prim`].
    Prim,
    /// See [`Layers::bary`].
    Bary,
    /// See [`Layers::motion`].
    Motion,
    /// See [`Layers::cost`].
    Cost,
}

impl LayerKind {
    /// Every kind of layer.
    pub const ALL: [Self; 10] = [
        Self::Color,
        Self::Alpha,
        Self::Depth,
        Self::Distance,
        Self::Normal,
        Self::Object,
        Self::Prim,
        Self::Bary,
        Self::Motion,
        Self::Cost,
    ];

    /// The layer's name in files and on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Color => "color",
            Self::Alpha => "alpha",
            Self::Depth => "depth",
            Self::Distance => "distance",
            Self::Normal => "normal",
            Self::Object => "object",
            Self::Prim => "prim",
            Self::Bary => "bary",
            Self::Motion => "motion",
            Self::Cost => "cost",
        }
    }
}

/// The object and triangle index of pixels that see no surface.
pub const NO_ID: u32 = u32::MAX;

/// What one pixel saw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Linear colour.
    pub color: Vec3,
    /// See [`Layers::alpha`].
    pub alpha: f32,
    /// See [`Layers::depth`].
    pub depth: f32,
    /// See [`Layers::distance`].
    pub distance: f32,
    /// See [`Layers::normal`].
    pub normal: Vec3,
    /// See [`Layers::object`].
    pub object: u32,
    /// See [`Layers::prim`].
    pub prim: u32,
    /// See [`Layers::bary`].
    pub bary: Vec2,
}

impl Sample {
    /// A pixel that sees no surface.
    pub fn background(color: Vec3) -> Self {
        Self {
            color,
            alpha: 0.0,
            depth: f32::INFINITY,
            distance: f32::INFINITY,
            normal: Vec3::ZERO,
            object: NO_ID,
            prim: NO_ID,
            bary: Vec2::ZERO,
        }
    }
}

/// A picture with its layers.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    layers: Layers,
    pub(crate) part: Option<Part>,
    /// Linear colour.
    pub color: Vec<Vec3>,
    /// See [`Layers::alpha`].
    pub alpha: Vec<f32>,
    /// See [`Layers::depth`].
    pub depth: Vec<f32>,
    /// See [`Layers::distance`].
    pub distance: Vec<f32>,
    /// See [`Layers::normal`].
    pub normal: Vec<Vec3>,
    /// See [`Layers::object`].
    pub object: Vec<u32>,
    /// See [`Layers::prim`].
    pub prim: Vec<u32>,
    /// See [`Layers::bary`].
    pub bary: Vec<Vec2>,
    /// See [`Layers::motion`].
    pub motion: Vec<Vec2>,
    /// See [`Layers::cost`].
    pub cost: Vec<PixelCost>,
}

impl Film {
    /// A film that sees a black background everywhere.
    ///
    /// # Errors
    /// [`crate::Error::ImageSize`] without pixels, or with more than 2^30 of them.
    pub fn new(width: u32, height: u32, layers: Layers) -> Result<Self> {
        let pixels = check_size(width, height)?;
        let Sample {
            color,
            alpha,
            depth,
            distance,
            normal,
            object,
            prim,
            bary,
        } = Sample::background(Vec3::ZERO);
        Ok(Self {
            width,
            height,
            layers,
            part: None,
            color: vec![color; pixels],
            alpha: layer(layers.alpha, alpha, pixels),
            depth: layer(layers.depth, depth, pixels),
            distance: layer(layers.distance, distance, pixels),
            normal: layer(layers.normal, normal, pixels),
            object: layer(layers.object, object, pixels),
            prim: layer(layers.prim, prim, pixels),
            bary: layer(layers.bary, bary, pixels),
            motion: layer(layers.motion, Vec2::ZERO, pixels),
            cost: layer(layers.cost, PixelCost::default(), pixels),
        })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The layers it holds.
    pub fn layers(&self) -> Layers {
        self.layers
    }

    /// Which part of a picture it is, if it is not all of it.
    pub fn part(&self) -> Option<Part> {
        self.part
    }

    /// Has the film know the layers that were put into it.
    pub(crate) fn note_layers(&mut self) {
        self.layers = Layers {
            alpha: !self.alpha.is_empty(),
            depth: !self.depth.is_empty(),
            distance: !self.distance.is_empty(),
            normal: !self.normal.is_empty(),
            object: !self.object.is_empty(),
            prim: !self.prim.is_empty(),
            bary: !self.bary.is_empty(),
            motion: !self.motion.is_empty(),
            cost: !self.cost.is_empty(),
        };
    }

    /// Leaves out all layers that are not among these.
    pub fn keep(&mut self, layers: Layers) {
        let film = self;
        film.layers = film.layers.and(layers);
        drop_unless(layers.alpha, &mut film.alpha);
        drop_unless(layers.depth, &mut film.depth);
        drop_unless(layers.distance, &mut film.distance);
        drop_unless(layers.normal, &mut film.normal);
        drop_unless(layers.object, &mut film.object);
        drop_unless(layers.prim, &mut film.prim);
        drop_unless(layers.bary, &mut film.bary);
        drop_unless(layers.motion, &mut film.motion);
        drop_unless(layers.cost, &mut film.cost);
    }

    /// Takes over a range of pixels from a film of the same size and layers.
    pub(crate) fn copy_row(&mut self, other: &Self, pixels: Range<usize>) {
        copy(&mut self.color, &other.color, &pixels);
        copy(&mut self.alpha, &other.alpha, &pixels);
        copy(&mut self.depth, &other.depth, &pixels);
        copy(&mut self.distance, &other.distance, &pixels);
        copy(&mut self.normal, &other.normal, &pixels);
        copy(&mut self.object, &other.object, &pixels);
        copy(&mut self.prim, &other.prim, &pixels);
        copy(&mut self.bary, &other.bary, &pixels);
        copy(&mut self.motion, &other.motion, &pixels);
        copy(&mut self.cost, &other.cost, &pixels);
    }

    /// Whether it holds this layer.
    pub fn holds(&self, layer: LayerKind) -> bool {
        self.layers.has(layer)
    }

    /// Splits the film into tiles of at most `tile_width` x `tile_height` pixels, row by row from the top left;
    /// those at the right and bottom edge are cut off. Each tile can be written on its own thread.
    ///
    /// # Panics
    /// If a tile has no pixels.
    pub fn tiles_mut(&mut self, tile_width: u32, tile_height: u32) -> Vec<TileMut<'_>> {
        assert!(tile_width > 0 && tile_height > 0, "a tile without pixels");
        let grid = TileGrid {
            film_width: self.width as usize,
            width: tile_width as usize,
            height: tile_height,
        };
        let columns = self.width.div_ceil(tile_width);
        let rows = self.height.div_ceil(tile_height);
        let mut tiles = Vec::with_capacity((columns * rows) as usize);
        for y in (0..self.height).step_by(tile_height as usize) {
            for x in (0..self.width).step_by(tile_width as usize) {
                let width = tile_width.min(self.width - x);
                tiles.push(TileMut::new(x, y, width, tile_height.min(self.height - y)));
            }
        }
        grid.split(&mut self.color, &mut tiles, |tile| &mut tile.color);
        grid.split(&mut self.alpha, &mut tiles, |tile| &mut tile.alpha);
        grid.split(&mut self.depth, &mut tiles, |tile| &mut tile.depth);
        grid.split(&mut self.distance, &mut tiles, |tile| &mut tile.distance);
        grid.split(&mut self.normal, &mut tiles, |tile| &mut tile.normal);
        grid.split(&mut self.object, &mut tiles, |tile| &mut tile.object);
        grid.split(&mut self.prim, &mut tiles, |tile| &mut tile.prim);
        grid.split(&mut self.bary, &mut tiles, |tile| &mut tile.bary);
        grid.split(&mut self.cost, &mut tiles, |tile| &mut tile.cost);
        tiles
    }
}

fn drop_unless<T>(wanted: bool, layer: &mut Vec<T>) {
    if !wanted {
        *layer = Vec::new();
    }
}

fn copy<T: Copy>(to: &mut [T], from: &[T], pixels: &Range<usize>) {
    if !to.is_empty() {
        to[pixels.clone()].copy_from_slice(&from[pixels.clone()]);
    }
}

fn layer<T: Copy>(wanted: bool, value: T, pixels: usize) -> Vec<T> {
    if wanted { vec![value; pixels] } else { Vec::new() }
}

/// How a film is cut into tiles.
struct TileGrid {
    film_width: usize,
    width: usize,
    height: u32,
}

impl TileGrid {
    /// Hands out the row segments of one layer; an empty layer hands out nothing.
    fn split<'a, T>(
        &self,
        layer: &'a mut [T],
        tiles: &mut [TileMut<'a>],
        rows: impl for<'t> Fn(&'t mut TileMut<'a>) -> &'t mut Vec<&'a mut [T]>,
    ) {
        let columns = self.film_width.div_ceil(self.width);
        for (y, row) in layer.chunks_exact_mut(self.film_width).enumerate() {
            let first = y / self.height as usize * columns;
            for (tile, segment) in tiles[first..].iter_mut().zip(row.chunks_mut(self.width)) {
                let tile_height = tile.height as usize;
                let rows = rows(tile);
                if rows.is_empty() {
                    rows.reserve_exact(tile_height);
                }
                rows.push(segment);
            }
        }
    }
}

/// One tile of a film: the segments of its rows in every layer.
#[derive(Debug)]
pub struct TileMut<'a> {
    /// Column of its left edge in the film.
    pub x: u32,
    /// Row of its top edge in the film.
    pub y: u32,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    color: Vec<&'a mut [Vec3]>,
    alpha: Vec<&'a mut [f32]>,
    depth: Vec<&'a mut [f32]>,
    distance: Vec<&'a mut [f32]>,
    normal: Vec<&'a mut [Vec3]>,
    object: Vec<&'a mut [u32]>,
    prim: Vec<&'a mut [u32]>,
    bary: Vec<&'a mut [Vec2]>,
    cost: Vec<&'a mut [PixelCost]>,
}

impl TileMut<'_> {
    fn new(x: u32, y: u32, width: u32, height: u32) -> Self {
        Self {
            x,
            y,
            width,
            height,
            color: Vec::new(),
            alpha: Vec::new(),
            depth: Vec::new(),
            distance: Vec::new(),
            normal: Vec::new(),
            object: Vec::new(),
            prim: Vec::new(),
            bary: Vec::new(),
            cost: Vec::new(),
        }
    }

    /// Writes what a pixel saw into the layers the film holds, but for motion and cost. The pixel's place is relative to the tile.
    ///
    /// # Panics
    /// If the pixel lies outside of the tile.
    #[inline]
    pub fn put(&mut self, x: u32, y: u32, sample: &Sample) {
        let (x, y) = (x as usize, y as usize);
        self.color[y][x] = sample.color;
        set(&mut self.alpha, x, y, sample.alpha);
        set(&mut self.depth, x, y, sample.depth);
        set(&mut self.distance, x, y, sample.distance);
        set(&mut self.normal, x, y, sample.normal);
        set(&mut self.object, x, y, sample.object);
        set(&mut self.prim, x, y, sample.prim);
        set(&mut self.bary, x, y, sample.bary);
    }

    /// What a pixel has cost so far; `None` if the film does not hold it.
    pub(crate) fn cost(&mut self, x: u32, y: u32) -> Option<&mut PixelCost> {
        Some(&mut self.cost.get_mut(y as usize)?[x as usize])
    }

    /// One row of alpha; `None` if the film does not hold it.
    pub(crate) fn alpha_row(&mut self, y: u32) -> Option<&mut [f32]> {
        Some(self.alpha.get_mut(y as usize)?)
    }

    /// One row of colours, for tiles that are written row by row.
    pub fn color_row(&mut self, y: u32) -> &mut [Vec3] {
        self.color[y as usize]
    }
}

#[inline]
fn set<T>(rows: &mut [&mut [T]], x: usize, y: usize, value: T) {
    if let Some(row) = rows.get_mut(y) {
        row[x] = value;
    }
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    fn sample(x: u32, y: u32) -> Sample {
        let (fx, fy) = (x as f32, y as f32);
        Sample {
            color: Vec3::new(fx, fy, fx * fy),
            alpha: 1.0,
            depth: fx + 1.0,
            distance: fy + 2.0,
            normal: Vec3::Y,
            object: x,
            prim: x + 1000 * y,
            bary: Vec2::new(fx, fy),
        }
    }

    #[test]
    fn tiles_cover_every_pixel_once() {
        let (width, height) = (37, 23);
        for (tw, th) in [(8, 8), (37, 1), (1, 23), (64, 64), (5, 7)] {
            let mut film = Film::new(width, height, Layers::ALL).unwrap();
            film.tiles_mut(tw, th).into_par_iter().for_each(|mut tile| {
                for y in 0..tile.height {
                    for x in 0..tile.width {
                        tile.put(x, y, &sample(tile.x + x, tile.y + y));
                    }
                }
            });
            for y in 0..height {
                for x in 0..width {
                    let (i, want) = ((y * width + x) as usize, sample(x, y));
                    assert_eq!(
                        (film.color[i], film.alpha[i]),
                        (want.color, want.alpha),
                        "tiles {tw}x{th}"
                    );
                    assert_eq!((film.depth[i], film.distance[i]), (want.depth, want.distance));
                    assert_eq!((film.normal[i], film.bary[i]), (want.normal, want.bary));
                    assert_eq!((film.object[i], film.prim[i]), (want.object, want.prim));
                }
            }
        }
    }

    #[test]
    fn layers_that_were_not_asked_for_are_empty() {
        let layers = Layers {
            prim: true,
            ..Layers::default()
        };
        let mut film = Film::new(4, 2, layers).unwrap();
        film.tiles_mut(4, 1)[1].put(3, 0, &sample(3, 1));
        assert_eq!(film.prim, [NO_ID, NO_ID, NO_ID, NO_ID, NO_ID, NO_ID, NO_ID, 1003]);
        assert!(film.depth.is_empty() && film.normal.is_empty() && film.alpha.is_empty());
    }

    #[test]
    fn sizes_without_meaning_are_errors() {
        assert!(Film::new(0, 5, Layers::default()).is_err());
        assert!(Film::new(1 << 20, 1 << 20, Layers::default()).is_err());
    }
}
