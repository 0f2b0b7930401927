//! The parts of one picture, joined.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::picture::SizeCheck;
use super::{exr, file};
use crate::{Error, Film, Part, Result};

/// Joins the parts of a picture, each an OpenEXR file of its own that [`super::write_exr`] has written of a frame with
/// [`crate::RenderOptions::shard`]: the film is that of the frame without it, bit for bit. The files may come in any
/// order; one is read at a time, and `read` is told of each. No picture of more pixels than `limit` is read.
///
/// # Errors
/// [`Error::Read`], [`Error::MalformedImage`] and [`Error::ImageTooLarge`] as of any image; [`Error::MalformedImage`] of
/// a file that is no part or does not belong to those before; [`Error::MissingParts`].
pub fn join_parts(paths: &[PathBuf], limit: u64, mut read: impl FnMut()) -> Result<Film> {
    let mut joined: Option<(Film, Part)> = None;
    let mut of_shard: BTreeMap<u32, &Path> = BTreeMap::new();
    for path in paths {
        let bytes = file::read(path)?;
        let (film, part) = exr::decode_part(SizeCheck::new(path, limit), &bytes)?;
        let (whole, first) = joined.get_or_insert_with(|| (film.clone(), part));
        check(path, &film, part, (&*whole, *first, paths[0].as_path()))?;
        if let Some(other) = of_shard.insert(part.shard.index(), path) {
            let problem = format!("it is part {} as {} is", part.shard, other.display());
            return Err(Error::malformed(path, problem));
        }
        whole.take(&film, part.shard);
        read();
    }
    let Some((mut film, Part { shard, .. })) = joined else {
        return Err(Error::MissingParts {
            missing: 1,
            of: 1,
            first: 1,
        });
    };
    let of = shard.of();
    match (1..=of).find(|index| !of_shard.contains_key(index)) {
        Some(first) => Err(Error::MissingParts {
            missing: of - of_shard.len() as u32,
            of,
            first,
        }),
        None => {
            film.part = None;
            Ok(film)
        }
    }
}

/// Whether a part belongs to those before, of which the first is known.
fn check(path: &Path, film: &Film, part: Part, (whole, first, named): (&Film, Part, &Path)) -> Result<()> {
    let named = named.display();
    let size = |film: &Film| [film.width(), film.height()];
    let problem = if part.shard.of() != first.shard.of() {
        format!("it is part {}, {named} is part {}", part.shard, first.shard)
    } else if part.picture != first.picture || size(film) != size(whole) {
        format!("it is a part of another picture than {named}: of another scene, view or other options")
    } else if film.layers() != whole.layers() {
        format!("its layers are others than those of {named}")
    } else {
        return Ok(());
    };
    Err(Error::malformed(path, problem))
}
