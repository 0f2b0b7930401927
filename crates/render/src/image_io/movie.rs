//! Movies: many pictures in one file, each shown for the same time.
//!
//! APNG holds pictures as they are. GIF holds 256 colours of each, chosen anew for every frame, and times in hundredths
//! of a second. MP4, `WebM` and Matroska are made by an installed `ffmpeg`, which gets raw pictures on its standard
//! input; it and the build of its codecs decide about quality and bytes.

use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use super::file::{self, Sink};
use crate::error::check_size;
use crate::{Error, Result};

/// What is known of a movie before its first picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovieOptions {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Number of pictures, at least one.
    pub frames: u32,
    /// Pictures a second, above 0.
    pub rate: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Apng,
    Gif,
    Ffmpeg,
}

fn form(path: &Path) -> Option<Form> {
    let ending = path.extension()?.to_ascii_lowercase();
    match ending.to_str()? {
        "apng" => Some(Form::Apng),
        "gif" => Some(Form::Gif),
        "mp4" | "webm" | "mkv" => Some(Form::Ffmpeg),
        _ => None,
    }
}

/// Whether the ending of a path is that of a movie: `.apng`, `.gif`, `.mp4`, `.webm`, `.mkv`.
pub fn is_movie(path: &Path) -> bool {
    form(path).is_some()
}

/// What fills a buffer with three sRGB bytes a pixel, row 0 on top.
type NextFrame<'n> = &'n mut dyn FnMut(&mut Vec<u8>) -> io::Result<()>;

/// Writes a movie of the form that the path's ending names. `next` is called once for each picture, in order, and fills
/// the buffer with three sRGB bytes a pixel, row 0 on top; whatever error it gives ends the movie, and no file is left.
///
/// # Errors
/// Those of `next`. [`Error::UnknownImageFormat`] for another ending, [`Error::ImageSize`] for a size, number or rate
/// that the form cannot hold and for a buffer of another length, [`Error::Write`] for what the system or `ffmpeg` says.
pub fn write_movie<E: From<Error>>(
    path: &Path,
    options: &MovieOptions,
    mut next: impl FnMut(&mut Vec<u8>) -> std::result::Result<(), E>,
) -> std::result::Result<(), E> {
    let form = form(path).ok_or_else(|| Error::UnknownImageFormat {
        path: path.to_path_buf(),
        known: ".apng, .gif, .mp4, .webm and .mkv",
    })?;
    let bytes = check(form, options)?;
    let mut failure = None;
    let mut next = |rgb: &mut Vec<u8>| {
        let made = next(rgb).and_then(|()| match rgb.len() {
            length if length == bytes => Ok(()),
            _ => Err(unfit(options, "does not match the number of its bytes").into()),
        });
        made.map_err(|error| {
            failure = Some(error);
            io::Error::other("a frame is missing")
        })
    };
    let written = match form {
        Form::Apng => file::write(path, |sink| apng(sink, options, &mut next)),
        Form::Gif => file::write(path, |sink| gif(sink, options, &mut next)),
        Form::Ffmpeg => file::write_by_path(path, |target| by_ffmpeg(target, options, &mut next)),
    };
    match failure {
        Some(error) => Err(error),
        None => Ok(written?),
    }
}

fn unfit(options: &MovieOptions, problem: &'static str) -> Error {
    Error::ImageSize {
        width: options.width,
        height: options.height,
        problem,
    }
}

/// Bytes of a picture.
fn check(form: Form, options: &MovieOptions) -> Result<usize> {
    let pixels = check_size(options.width, options.height)?;
    if options.frames == 0 || !(options.rate > 0.0 && options.rate.is_finite()) {
        return Err(unfit(options, "needs frames and a rate to be a movie"));
    }
    if form == Form::Gif && options.width.max(options.height) > u32::from(u16::MAX) {
        return Err(unfit(options, "is too large for a GIF"));
    }
    Ok(pixels * 3)
}

fn apng(sink: &mut dyn Sink, options: &MovieOptions, next: NextFrame) -> io::Result<()> {
    let mut encoder = png::Encoder::new(sink, options.width, options.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_animated(options.frames, 0)?;
    let [seconds, parts] = delay(options.rate);
    encoder.set_frame_delay(seconds, parts)?;
    let mut writer = encoder.write_header()?;
    let mut rgb = Vec::new();
    for _ in 0..options.frames {
        next(&mut rgb)?;
        writer.write_image_data(&rgb)?;
    }
    Ok(writer.finish()?)
}

/// The time of a frame as the best fraction of 16-bit numbers whose numerator is a power of ten.
fn delay(rate: f64) -> [u16; 2] {
    let limit = f64::from(u16::MAX);
    let fraction = |numerator: u16| {
        let denominator = (f64::from(numerator) * rate).round().clamp(1.0, limit);
        let error = (f64::from(numerator) / denominator * rate - 1.0).abs();
        (error, [numerator, denominator as u16])
    };
    let fractions = [1, 10, 100, 1_000, 10_000].map(fraction);
    let best = fractions.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or([1, 1], |best| best.1)
}

fn gif(sink: &mut dyn Sink, options: &MovieOptions, next: NextFrame) -> io::Result<()> {
    let [width, height] = [options.width, options.height].map(|side| side as u16);
    let refused = |error: gif::EncodingError| io::Error::other(error);
    let mut encoder = gif::Encoder::new(sink, width, height, &[]).map_err(refused)?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(refused)?;
    let moment = |frame: u32| (f64::from(frame) * 100.0 / options.rate).round();
    let mut rgb = Vec::new();
    for i in 0..options.frames {
        next(&mut rgb)?;
        let mut frame = gif::Frame::from_rgb_speed(width, height, &rgb, GIF_SPEED);
        frame.delay = (moment(i + 1) - moment(i)) as u16;
        encoder.write_frame(&frame).map_err(refused)?;
    }
    Ok(())
}

/// How hurriedly colours are chosen, 1 to 30.
const GIF_SPEED: i32 = 10;

fn by_ffmpeg(target: &Path, options: &MovieOptions, next: NextFrame) -> io::Result<()> {
    let mut ffmpeg = Command::new("ffmpeg")
        .args(["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s"])
        .arg(format!("{}x{}", options.width, options.height))
        .args(["-r", &options.rate.to_string(), "-i", "-", "-an"])
        // Colour is stored for every second pixel, so sides have to be even.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709"])
        .args(["-pix_fmt", "yuv420p", "-colorspace", "bt709"])
        .arg(target)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| match error.kind() {
            ErrorKind::NotFound => io::Error::other(
                "ffmpeg is not installed; .apng and .gif need nothing, and numbered pictures can be joined later",
            ),
            _ => error,
        })?;
    let fed: io::Result<()> = ffmpeg.stdin.take().map_or(Ok(()), |mut pipe| {
        let mut rgb = Vec::new();
        for _ in 0..options.frames {
            next(&mut rgb)?;
            pipe.write_all(&rgb)?;
        }
        Ok(())
    });
    let mut said = String::new();
    if let Some(mut errors) = ffmpeg.stderr.take() {
        // Bytes that are no text are as good as nothing said.
        let _ = errors.read_to_string(&mut said);
    }
    let status = ffmpeg.wait()?;
    match fed {
        // It left before the end: its own words say why.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        Ok(()) if status.success() => Ok(()),
        _ => Err(io::Error::other(format!(
            "ffmpeg failed: {}",
            said.lines().next().unwrap_or("it gave no reason")
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: MovieOptions = MovieOptions {
        width: 5,
        height: 3,
        frames: 4,
        rate: 25.0,
    };

    /// Frame k is all of one grey.
    fn greys() -> impl FnMut(&mut Vec<u8>) -> Result<()> {
        let mut frame = 0;
        move |rgb| {
            frame += 50;
            rgb.clear();
            rgb.resize(5 * 3 * 3, frame);
            Ok(())
        }
    }

    #[test]
    fn an_apng_holds_every_frame_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.apng");
        write_movie(&path, &SIZE, greys()).unwrap();
        let file = io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        assert_eq!(reader.info().animation_control.unwrap().num_frames, 4);
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        for frame in 1..=4 {
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels, [frame * 50; 45]);
            let control = reader.info().frame_control.unwrap();
            assert_eq!((control.delay_num, control.delay_den), (1, 25));
        }
        assert!(reader.next_frame(&mut pixels).is_err());
    }

    #[test]
    fn a_gif_holds_all_frames_and_their_times() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gif");
        write_movie(&path, &MovieOptions { rate: 30.0, ..SIZE }, greys()).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(std::fs::File::open(&path).unwrap()).unwrap();
        let (mut greys, mut hundredths) = (Vec::new(), 0);
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            hundredths += frame.delay;
            greys.push(frame.buffer[0]);
        }
        assert_eq!((greys, hundredths), (vec![50, 100, 150, 200], 13));
    }

    #[test]
    fn a_failed_frame_or_a_wrong_one_leaves_no_file() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.apng", "a.gif"] {
            let path = folder.path().join(name);
            let fails = |_: &mut Vec<u8>| Err(unfit(&SIZE, "is not there"));
            assert!(matches!(
                write_movie(&path, &SIZE, fails),
                Err(Error::ImageSize { .. })
            ));
            let short = |rgb: &mut Vec<u8>| -> Result<()> {
                rgb.resize(3, 0);
                Ok(())
            };
            assert!(matches!(
                write_movie(&path, &SIZE, short),
                Err(Error::ImageSize { .. })
            ));
            let none = MovieOptions { frames: 0, ..SIZE };
            assert!(write_movie(&path, &none, greys()).is_err());
        }
        let unknown = write_movie(&folder.path().join("a.avi"), &SIZE, greys());
        assert!(matches!(unknown, Err(Error::UnknownImageFormat { .. })));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn delays_are_the_best_fractions() {
        assert_eq!(delay(24.0), [1, 24]);
        assert_eq!(delay(29.97), [100, 2997]);
        assert_eq!(delay(0.5), [10, 5]);
        assert_eq!(delay(1e9), [1, u16::MAX]);
    }
}
