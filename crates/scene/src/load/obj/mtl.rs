//! MTL material libraries, mapped to the metallic-roughness model.
//!
//! MTL describes a Phong surface, so this is an interpretation:
//!
//! | MTL | here |
//! |---|---|
//! | `Kd`, `map_Kd` | base colour, linear; a black `Kd` does not darken its texture |
//! | `Ks`, `Ns` | dielectric reflection of that hue and roughness (2 / (Ns + 2))^1/4; none without `Ks` |
//! | `illum 3`, `5` | mirror of colour `Ks`: metallic 1, roughness 0 |
//! | `illum 4`, `6`, `7`, `9` | glass of colour `Tf` and index `Ni` |
//! | `d`, `Tr` (= 1 - d; `d` wins) | alpha, blended |
//! | `map_d`, or alpha in `map_Kd` | alpha, cut out at one half |
//! | `Ke`, `map_Ke` | emission |
//! | `norm` | normal map |
//! | `Pr`, `Pm` | roughness, metallic |
//! | `bump`, `disp`, `map_Ks`, ... | skipped with a notice |
//!
//! Only materials that faces use are looked at: a texture that such a material names has to exist.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};

use super::{decode, float, logical_lines, words};
use crate::load::plain::{Source, counted, default_material};
use crate::{AlphaMode, Error, Image, Material, Notice, Sampler, Scene, TextureRef, TextureTransform, Wrap};

/// Largest width and height of a texture, and the memory it may take.
const MAX_TEXTURE_SIDE: u32 = 16384;
const MAX_TEXTURE_BYTES: u64 = 4 << 30;

/// All materials of the libraries of one OBJ file.
#[derive(Default)]
pub(super) struct Library {
    entries: Vec<Entry>,
    /// Index in the scene of each image that was loaded, by file.
    images: Vec<(PathBuf, usize)>,
    /// Statements without a counterpart here, and in how many materials.
    skipped: BTreeMap<String, usize>,
}

/// One `newmtl` block, as it is in the file.
#[derive(Default)]
struct Entry {
    name: String,
    folder: PathBuf,
    /// Statements: keyword and the rest of the line.
    statements: Vec<(String, String)>,
    /// Index in the scene, once a face asked for it.
    used_as: Option<usize>,
}

impl Library {
    /// Reads a library that `mtllib` names: one file whose name may have spaces, or several files.
    pub(super) fn read(
        &mut self,
        source: Source,
        names: &str,
        notices: &mut Vec<Notice>,
    ) -> Result<(), Error> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let whole = find(folder, names, notices);
        let files: Vec<&str> = if whole.is_some() {
            vec![names]
        } else {
            names.split_whitespace().collect()
        };
        for name in files {
            let place = || format!("mtllib {name:?}");
            let Some(path) = find(folder, name, notices) else {
                let message = "the file is not there; its materials are white".into();
                notices.push(Notice {
                    place: place(),
                    message,
                });
                continue;
            };
            let library = Source { path: &path };
            let bytes = library.read()?;
            let text = decode(library, &bytes)?;
            for (line, text) in logical_lines(&text) {
                let text = text.trim();
                let (keyword, rest) = text.split_once([' ', '\t']).unwrap_or((text, ""));
                let statement = (keyword.to_owned(), rest.trim().to_owned());
                match (keyword, self.entries.last_mut()) {
                    ("newmtl", _) => self.entries.push(Entry {
                        name: statement.1,
                        folder: path.parent().unwrap_or(Path::new("")).into(),
                        ..Entry::default()
                    }),
                    ("", _) => {}
                    (comment, _) if comment.starts_with('#') => {}
                    (_, Some(entry)) => entry.statements.push(statement),
                    (_, None) => {
                        return Err(library.malformed(format!("line {line}"), "comes before any newmtl"));
                    }
                }
            }
        }
        Ok(())
    }

    /// Index in the scene of the material with this name, made when first asked for.
    pub(super) fn material(
        &mut self,
        source: Source,
        name: &str,
        scene: &mut Scene,
        notices: &mut Vec<Notice>,
    ) -> Result<usize, Error> {
        let Some(entry) = self.entries.iter().position(|e| e.name == name) else {
            let message = "no library has it; it is white".into();
            notices.push(Notice {
                place: format!("material {name:?}"),
                message,
            });
            return Ok(0);
        };
        if let Some(index) = self.entries[entry].used_as {
            return Ok(index);
        }
        let mut builder = Builder {
            source,
            library: self,
            entry,
            scene,
            notices,
        };
        let material = builder.build()?;
        scene.materials.push(material);
        self.entries[entry].used_as = Some(scene.materials.len() - 1);
        Ok(scene.materials.len() - 1)
    }

    /// What was left out of the materials asked for.
    pub(super) fn notices(&self) -> impl Iterator<Item = Notice> {
        let say = |(keyword, &n): (&String, &usize)| counted(n, "materials", &format!("{keyword} skipped"));
        self.skipped.iter().filter_map(say)
    }
}

/// The values of one entry, before they are interpreted.
struct Phong {
    diffuse: Vec3,
    specular: Vec3,
    emission: Vec3,
    filter: Vec3,
    exponent: f32,
    index: f32,
    opacity: Option<f32>,
    transparency: Option<f32>,
    model: i32,
    roughness: Option<f32>,
    metallic: Option<f32>,
}

impl Default for Phong {
    fn default() -> Self {
        Self {
            diffuse: Vec3::ONE,
            specular: Vec3::ZERO,
            emission: Vec3::ZERO,
            filter: Vec3::ONE,
            exponent: 0.0,
            index: 1.5,
            opacity: None,
            transparency: None,
            model: 2,
            roughness: None,
            metallic: None,
        }
    }
}

impl Phong {
    fn set(&mut self, keyword: &str, rest: &str) -> Result<(), String> {
        match keyword {
            "Kd" => self.diffuse = color(rest)?,
            "Ks" => self.specular = color(rest)?,
            "Ke" => self.emission = color(rest)?,
            "Tf" => self.filter = color(rest)?,
            "Ns" => self.exponent = scalar(rest)?,
            "Ni" => self.index = scalar(rest)?,
            "d" => self.opacity = Some(scalar(rest.trim_start_matches("-halo"))?),
            "Tr" => self.transparency = Some(scalar(rest)?),
            "illum" => self.model = scalar(rest)? as i32,
            "Pr" => self.roughness = Some(scalar(rest)?),
            "Pm" => self.metallic = Some(scalar(rest)?),
            _ => {}
        }
        Ok(())
    }

    fn material(&self, name: &str) -> Material {
        let mut material = Material {
            name: name.to_owned(),
            specular: 0.0,
            ..default_material()
        };
        let alpha = self
            .opacity
            .or(self.transparency.map(|t| 1.0 - t))
            .unwrap_or(1.0)
            .clamp(0.0, 1.0);
        material.emissive = self.emission.max(Vec3::ZERO);
        let strength = self.specular.max_element();
        match self.model {
            3 | 5 if strength > 0.0 => {
                material.base_color = self.specular.extend(alpha);
                (material.metallic, material.roughness) = (1.0, 0.0);
            }
            4 | 6 | 7 | 9 => {
                let tint = if self.filter.max_element() > 0.0 {
                    self.filter
                } else {
                    Vec3::ONE
                };
                material.base_color = tint.extend(1.0);
                (material.transmission, material.roughness, material.specular) = (1.0, 0.0, 1.0);
                // Not measured in the file; above zero so that light is refracted, not only passed on.
                material.thickness = 1.0;
                material.ior = self.index.max(1.0);
                return material;
            }
            _ => {
                material.base_color = self.diffuse.extend(alpha);
                if strength > 0.0 && self.model != 0 && self.model != 1 {
                    material.specular = (strength / 0.04).min(1.0);
                    material.specular_color = self.specular / strength;
                    material.roughness = (2.0 / (self.exponent.max(0.0) + 2.0)).sqrt().sqrt();
                }
            }
        }
        material.roughness = self.roughness.unwrap_or(material.roughness).clamp(0.0, 1.0);
        material.metallic = self.metallic.unwrap_or(material.metallic).clamp(0.0, 1.0);
        if alpha < 1.0 {
            material.alpha_mode = AlphaMode::Blend;
        }
        material
    }
}

/// Makes one material and its textures.
struct Builder<'a, 's> {
    source: Source<'s>,
    library: &'a mut Library,
    entry: usize,
    scene: &'a mut Scene,
    notices: &'a mut Vec<Notice>,
}

impl Builder<'_, '_> {
    fn build(&mut self) -> Result<Material, Error> {
        let entry = &mut self.library.entries[self.entry];
        let (name, statements) = (entry.name.clone(), std::mem::take(&mut entry.statements));
        let place = format!("material {name:?}");
        let mut phong = Phong::default();
        let mut maps = Vec::new();
        for (keyword, rest) in &statements {
            phong
                .set(keyword, rest)
                .map_err(|problem| self.source.malformed(format!("{place}, {keyword}"), problem))?;
            match keyword.as_str() {
                "map_Kd" | "map_d" | "map_Ke" | "norm" | "map_norm" => {
                    maps.push((
                        keyword.as_str(),
                        self.texture(&format!("{place}, {keyword}"), rest)?,
                    ));
                }
                // Height and displacement would need derivatives; the others have no counterpart here.
                "bump" | "map_bump" | "map_Bump" | "disp" | "map_disp" | "decal" | "refl" | "map_Ks"
                | "map_Ns" | "map_Pr" | "map_Pm" | "map_Tr" | "map_refl" => {
                    *self.library.skipped.entry(keyword.clone()).or_default() += 1;
                }
                _ => {}
            }
        }
        let find = |name: &str| maps.iter().rev().find(|(k, _)| *k == name).map(|&(_, t)| t);
        let mut material = phong.material(&name);
        material.normal_texture = find("norm").or(find("map_norm"));
        material.emissive_texture = find("map_Ke");
        if material.emissive_texture.is_some() && material.emissive == Vec3::ZERO {
            material.emissive = Vec3::ONE;
        }
        material.base_color_texture = find("map_Kd");
        if material.base_color_texture.is_some() && material.base_color.truncate() == Vec3::ZERO {
            material.base_color = Vec3::ONE.extend(material.base_color.w);
        }
        if let Some(mask) = find("map_d") {
            material.base_color_texture = Some(self.with_mask(material.base_color_texture, mask));
        }
        let has_alpha = |t: TextureRef| self.scene.images[t.image].texels.iter().any(|t| t[3] < 255);
        if material.base_color_texture.is_some_and(has_alpha) {
            material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        }
        Ok(material)
    }

    /// A texture statement: options, then a file name that may have spaces.
    fn texture(&mut self, place: &str, statement: &str) -> Result<TextureRef, Error> {
        let (options, name) = Options::parse(statement).map_err(|p| self.source.malformed(place, p))?;
        let folder = self.library.entries[self.entry].folder.clone();
        let found = find(&folder, name, self.notices);
        let path = found.unwrap_or_else(|| folder.join(name.replace('\\', "/")));
        let known = self
            .library
            .images
            .iter()
            .find(|(p, _)| *p == path)
            .map(|&(_, i)| i);
        let image = match known {
            Some(image) => image,
            None => {
                self.scene.images.push(self.read_image(place, &path, name)?);
                self.library.images.push((path, self.scene.images.len() - 1));
                self.scene.images.len() - 1
            }
        };
        let sampler = if options.clamp {
            clamping_sampler(&mut self.scene.samplers)
        } else {
            0
        };
        Ok(TextureRef {
            image,
            sampler,
            uv_set: 0,
            transform: options.transform(),
        })
    }

    fn read_image(&self, place: &str, path: &Path, name: &str) -> Result<Image, Error> {
        let unreadable = |source| Error::Reference {
            path: self.source.path.into(),
            place: place.into(),
            target: path.into(),
            source,
        };
        let file = std::fs::File::open(path).map_err(unreadable)?;
        let reader = image::ImageReader::new(std::io::BufReader::new(file)).with_guessed_format();
        let mut reader = reader.map_err(unreadable)?;
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(MAX_TEXTURE_SIDE);
        limits.max_image_height = Some(MAX_TEXTURE_SIDE);
        limits.max_alloc = Some(MAX_TEXTURE_BYTES);
        reader.limits(limits);
        let decoded = reader.decode().map_err(|e| match e {
            image::ImageError::Unsupported(e) => Error::Unsupported {
                path: path.into(),
                what: format!("a texture that is neither PNG nor JPEG ({e})"),
            },
            image::ImageError::IoError(e) => unreadable(e),
            other => Error::Malformed {
                path: path.into(),
                place: "image".into(),
                problem: other.to_string(),
            },
        })?;
        let rgba = decoded.into_rgba8();
        let (width, height) = rgba.dimensions();
        let texels = rgba.pixels().map(|p| p.0).collect();
        Ok(Image {
            name: name.to_owned(),
            width,
            height,
            texels,
        })
    }

    /// A base colour texture whose alpha is that of a mask: the mask's own alpha, or its brightness.
    fn with_mask(&mut self, base: Option<TextureRef>, mask: TextureRef) -> TextureRef {
        if base.is_some_and(|b| b.image == mask.image) && self.has_varying_alpha(mask.image) {
            return mask;
        }
        let by_alpha = self.has_varying_alpha(mask.image);
        let images = &self.scene.images;
        let mask_image = &images[mask.image];
        let base_image = base.map(|b| &images[b.image]);
        let size = base_image.unwrap_or(mask_image);
        let (width, height) = (size.width, size.height);
        let mut texels = Vec::with_capacity(size.texels.len());
        for y in 0..height {
            for x in 0..width {
                let [r, g, b, _] = base_image.map_or([255; 4], |i| i.texels[(y * width + x) as usize]);
                let scaled =
                    |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(from)) as u32;
                let row = scaled(y, height, mask_image.height) as usize * mask_image.width as usize;
                let m = mask_image.texels[row + scaled(x, width, mask_image.width) as usize];
                let brightness = (u32::from(m[0]) + u32::from(m[1]) + u32::from(m[2])) / 3;
                texels.push([r, g, b, if by_alpha { m[3] } else { brightness as u8 }]);
            }
        }
        let name = match base_image {
            Some(base) => format!("{} with alpha of {}", base.name, mask_image.name),
            None => format!("alpha of {}", mask_image.name),
        };
        self.scene.images.push(Image {
            name,
            width,
            height,
            texels,
        });
        TextureRef {
            image: self.scene.images.len() - 1,
            ..base.unwrap_or(mask)
        }
    }

    fn has_varying_alpha(&self, image: usize) -> bool {
        self.scene.images[image].texels.iter().any(|t| t[3] < 255)
    }
}

/// Options of a texture statement that have a meaning here.
struct Options {
    offset: Vec2,
    scale: Vec2,
    clamp: bool,
}

impl Options {
    /// Splits a statement into options and the file name.
    fn parse(statement: &str) -> Result<(Self, &str), String> {
        let mut options = Self {
            offset: Vec2::ZERO,
            scale: Vec2::ONE,
            clamp: false,
        };
        let mut rest = statement.trim();
        while rest.starts_with('-') {
            let (option, mut after) = split_word(rest);
            match option {
                "-o" | "-s" | "-t" => {
                    let mut values = Vec::new();
                    while let (word, tail) = split_word(after)
                        && values.len() < 3
                        && !tail.is_empty()
                        && let Ok(value) = float(word)
                    {
                        values.push(value);
                        after = tail;
                    }
                    let get = |i: usize, absent| values.get(i).copied().unwrap_or(absent);
                    match option {
                        "-o" => options.offset = Vec2::new(get(0, 0.0), get(1, 0.0)),
                        "-s" => options.scale = Vec2::new(get(0, 1.0), get(1, 1.0)),
                        _ => {}
                    }
                }
                "-clamp" => {
                    let (word, tail) = split_word(after);
                    options.clamp = word == "on";
                    after = tail;
                }
                "-mm" => after = split_word(split_word(after).1).1,
                "-blendu" | "-blendv" | "-cc" | "-bm" | "-boost" | "-texres" | "-imfchan" | "-type"
                | "-colorspace" => after = split_word(after).1,
                _ => return Err(format!("unknown texture option {option:?}")),
            }
            rest = after;
        }
        if rest.is_empty() {
            Err("there is no file name".into())
        } else {
            Ok((options, rest))
        }
    }

    /// Offset and scale for coordinates whose origin is at the top left.
    fn transform(&self) -> TextureTransform {
        let offset = Vec2::new(self.offset.x, 1.0 - self.offset.y - self.scale.y);
        TextureTransform {
            offset,
            scale: self.scale,
            rotation: 0.0,
        }
    }
}

fn split_word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

fn clamping_sampler(samplers: &mut Vec<Sampler>) -> usize {
    let clamping = Sampler {
        wrap_u: Wrap::ClampToEdge,
        wrap_v: Wrap::ClampToEdge,
        ..Sampler::default()
    };
    samplers.iter().position(|s| *s == clamping).unwrap_or_else(|| {
        samplers.push(clamping);
        samplers.len() - 1
    })
}

/// The file of this name, as written or, with a notice, in other letter case. Backslashes separate folders too.
fn find(folder: &Path, name: &str, notices: &mut Vec<Notice>) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let exact = folder.join(&name);
    if exact.is_file() {
        return Some(exact);
    }
    let mut path = folder.to_owned();
    for part in Path::new(&name).components() {
        let next = path.join(part);
        path = if next.exists() {
            next
        } else {
            in_other_case(&path, &part.as_os_str().to_string_lossy())?
        };
    }
    if !path.is_file() {
        return None;
    }
    let message = format!("found in other letter case, as {}", path.display());
    let notice = Notice {
        place: format!("file {name:?}"),
        message,
    };
    if !notices.contains(&notice) {
        notices.push(notice);
    }
    Some(path)
}

fn in_other_case(folder: &Path, name: &str) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let same = |other: &str| other.to_lowercase() == name.to_lowercase();
    let entries = std::fs::read_dir(folder).ok()?.filter_map(Result::ok);
    let mut matches: Vec<PathBuf> = entries
        .filter(|e| same(&e.file_name().to_string_lossy()))
        .map(|e| e.path())
        .collect();
    // The order of a folder's entries is not defined.
    matches.sort();
    matches.into_iter().next()
}

/// A colour: three numbers, or one for all; anything else (`spectral`, `xyz`) is not read.
fn color(text: &str) -> Result<Vec3, String> {
    let values: Vec<f32> = words(text).take(3).map(float).collect::<Result<_, _>>()?;
    let color = match values[..] {
        [r, g, b] => Vec3::new(r, g, b),
        [gray] => Vec3::splat(gray),
        _ => return Err(format!("a colour of {} numbers", values.len())),
    };
    if color.is_finite() {
        Ok(color)
    } else {
        Err("a colour that is not finite".into())
    }
}

fn scalar(text: &str) -> Result<f32, String> {
    let value = words(text)
        .next()
        .ok_or("a number is missing")
        .and_then(|w| float(w).map_err(|_| "not a number"))?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err("a number that is not finite".into())
    }
}
