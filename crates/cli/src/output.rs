//! Where a picture goes. All that can be wrong with it is said before anything is rendered.

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use rayward::image_io::{encode_png, write_exr, write_npy, write_png};
use rayward::tonemap::automatic_exposure;
use rayward::{Error, Film, HeatMap, IntensityRange, LayerKind, Layers, Measure, Shard, ToneMap, ToneMapper};

use crate::args::{TargetArgs, ToneArgs};
use crate::failure::{Code, Failure};
use crate::report;
use crate::values::{self, Exposure, Operator};

/// File written without any wish.
const DEFAULT: &str = "rayward.png";

/// Form of the picture file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Png,
    Exr,
    Npy,
}

/// Where one picture goes.
pub(crate) struct Targets {
    /// The picture and its form; no path is standard output.
    picture: Option<(Option<PathBuf>, Form)>,
    /// Folder for arrays.
    arrays: Option<PathBuf>,
    tone_map: ToneMap,
    /// Whether the picture decides on the exposure.
    automatic: bool,
    /// What pictures of eight bits show instead of the colour.
    show: Option<Measure>,
    /// Layers that were asked for by name, or to be shown.
    pub(crate) asked: Layers,
    /// Layers that are written besides the colour.
    written: Layers,
    /// Layers that have to be rendered.
    pub(crate) layers: Layers,
}

impl Targets {
    /// Checks what was asked for. `json` says that standard output is taken.
    pub(crate) fn new(target: &TargetArgs, tone: &ToneArgs, json: bool) -> Result<Self, Failure> {
        let output = match (&target.output, &target.npy) {
            (Some(path), _) => Some(path.as_path()),
            (None, Some(_)) => None,
            (None, None) => Some(Path::new(DEFAULT)),
        };
        let written = match output {
            Some(path) if path.as_os_str() == "-" => {
                if json {
                    return Err(usage("--json and --output -: both go to standard output"));
                }
                if io::stdout().is_terminal() {
                    return Err(usage(
                        "--output -: standard output is a terminal, which shows no pictures",
                    ));
                }
                Some((None, Form::Png))
            }
            Some(path) => {
                let form = form(path)?;
                check_folder(path)?;
                Some((Some(path.to_path_buf()), form))
            }
            None => None,
        };
        let layered = target.npy.is_some() || written.as_ref().is_some_and(|(_, form)| *form == Form::Exr);
        if !layered && !target.layers.is_empty() {
            return Err(usage("--layers: only .exr files and --npy have layers"));
        }
        let show: Option<Measure> = tone.show.map(Measure::from);
        let shows = written.as_ref().is_some_and(|(_, form)| *form == Form::Png);
        if show.is_some() && !shows {
            return Err(usage("--show: only .png files and movies are in false colours"));
        }
        let layers = if layered {
            values::layers(&target.layers)
        } else {
            Layers::default()
        };
        let shown = show.map_or(Layers::default(), Measure::layers);
        Ok(Self {
            picture: written,
            arrays: target.npy.clone(),
            tone_map: tone_map(tone)?,
            automatic: tone.exposure == Some(Exposure::Auto),
            show,
            asked: if target.layers.is_empty() {
                shown
            } else {
                layers.or(shown)
            },
            written: layers,
            layers: with_sources(layers.or(shown)),
        })
    }

    /// As [`Targets::new`], for a part of a picture.
    pub(crate) fn of_part(
        target: &TargetArgs,
        shard: Shard,
        tone: &ToneArgs,
        json: bool,
    ) -> Result<Self, Failure> {
        let named = || PathBuf::from(format!("rayward-{}-of-{}.exr", shard.index(), shard.of()));
        let path = target.output.clone().unwrap_or_else(named);
        if path.as_os_str() == "-" || form(&path)? != Form::Exr {
            return Err(usage(format_args!(
                "--output {}: with --shard it is an .exr file, of which `rayward merge` makes any other",
                path.display()
            )));
        }
        let target = TargetArgs {
            output: Some(path),
            npy: None,
            layers: target.layers.clone(),
        };
        Self::new(&target, tone, json)
    }

    /// Memory for a pixel, in bytes: what the film holds of it, and what the largest of the writers holds besides.
    pub(crate) fn bytes_a_pixel(&self) -> u64 {
        let film = self.layers.bytes_a_pixel();
        let writing = match &self.picture {
            // The film once more by channels, in lines and compressed.
            Some((_, Form::Exr)) => film + 8,
            // Three bytes, filtered, compressed, and perhaps gathered for standard output.
            Some((_, Form::Png)) => 12,
            Some((_, Form::Npy)) | None => 0,
        };
        film + writing
    }

    /// Writes everything; returns the files. The film keeps the layers that are written.
    pub(crate) fn write(&self, film: &mut Film) -> Result<Vec<PathBuf>, Failure> {
        let mut files = Vec::new();
        let encoded = match &self.picture {
            Some((_, Form::Png)) => Some(self.encode(film)?),
            _ => None,
        };
        film.keep(self.written);
        let film = &*film;
        if let Some((path, form)) = &self.picture {
            match (path, form, encoded) {
                (Some(path), Form::Png, Some(map)) => write_png(path, map.width, map.height, &map.rgb)?,
                (Some(path), Form::Npy, _) => write_npy(path, film, LayerKind::Color)?,
                (Some(path), _, _) => write_exr(path, film)?,
                (None, _, encoded) => write_to_stdout(encoded)?,
            }
            files.extend(path.clone());
        }
        if let Some(folder) = &self.arrays {
            std::fs::create_dir_all(folder).map_err(|source| Error::Write {
                path: folder.clone(),
                source,
            })?;
            for kind in values::kinds(film) {
                let path = folder.join(format!("{}.npy", kind.name()));
                write_npy(&path, film, kind)?;
                files.push(path);
            }
        }
        Ok(files)
    }

    /// Three sRGB bytes a pixel.
    pub(crate) fn encode(&self, film: &Film) -> Result<HeatMap, Failure> {
        if let Some(measure) = self.show {
            return Ok(HeatMap::new(film, measure)?);
        }
        let operator = if self.automatic {
            self.tone_map.exposed(automatic_exposure(&film.color))
        } else {
            self.tone_map
        };
        let mut mapper = ToneMapper::new(operator);
        if self.tone_map == ToneMap::PreviousFrame {
            mapper.end_frame(IntensityRange::of(&film.color));
        }
        Ok(HeatMap {
            width: film.width(),
            height: film.height(),
            rgb: mapper.encode(film),
        })
    }

    /// Size of what is encoded of a picture of this size.
    pub(crate) fn encoded_size(&self, width: u32, height: u32) -> [u32; 2] {
        match self.show {
            Some(_) => HeatMap::size(width, height),
            None => [width, height],
        }
    }
}

/// These layers, and those that they are made of.
fn with_sources(layers: Layers) -> Layers {
    Layers {
        prim: layers.prim || layers.motion,
        bary: layers.bary || layers.motion,
        ..layers
    }
}

fn write_to_stdout(map: Option<HeatMap>) -> Result<(), Failure> {
    let Some(map) = map else { return Ok(()) };
    let mut bytes = Vec::new();
    encode_png(&mut bytes, map.width, map.height, &map.rgb)?;
    report::to_stdout(&bytes)
}

fn usage(message: impl std::fmt::Display) -> Failure {
    Failure::new(Code::Usage, message)
}

fn form(path: &Path) -> Result<Form, Failure> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    match ending.to_str() {
        Some("png") => Ok(Form::Png),
        Some("exr") => Ok(Form::Exr),
        Some("npy") => Ok(Form::Npy),
        _ => Err(usage(format_args!(
            "--output {}: the ending has to be .png, .exr or .npy, or of a movie for `rayward animate` and `rayward merge`",
            path.display()
        ))),
    }
}

/// A missing folder is better found before the work than after it.
fn check_folder(path: &Path) -> Result<(), Failure> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => Err(Failure::new(
            Code::Runtime,
            format_args!(
                "cannot write {}: there is no folder {}",
                path.display(),
                folder.display()
            ),
        )),
        _ => Ok(()),
    }
}

fn tone_map(args: &ToneArgs) -> Result<ToneMap, Failure> {
    let stops = match args.exposure {
        Some(Exposure::Stops(stops)) => stops,
        Some(Exposure::Auto) | None => 0.0,
    };
    let operator = args.tone_map.unwrap_or(match args.exposure {
        Some(_) => Operator::Exposure,
        None => Operator::None,
    });
    match operator {
        Operator::Exposure => Ok(ToneMap::Exposure { stops }),
        Operator::Aces => Ok(ToneMap::Aces { stops }),
        Operator::None | Operator::PreviousFrame if args.exposure.is_some() => {
            Err(usage("--exposure: only the tone maps exposure and aces have one"))
        }
        Operator::None => Ok(ToneMap::None),
        Operator::PreviousFrame => Ok(ToneMap::PreviousFrame),
    }
}
