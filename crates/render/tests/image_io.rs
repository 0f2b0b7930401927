//! Files: what is written is read back as it was, bad files are errors, and nothing is left half-written.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3, Vec4};
use rayward::image_io::{encode_png, write_exr, write_npy, write_png};
use rayward::{Error, Film, LayerKind, Layers, Picture, Sample, read_picture};

/// A film whose every value tells its place.
fn film(width: u32, height: u32, layers: Layers) -> Film {
    let mut film = Film::new(width, height, layers).unwrap();
    let mut tiles = film.tiles_mut(width, height);
    for y in 0..height {
        for x in 0..width {
            let (fx, fy) = (x as f32, y as f32);
            let sample = Sample {
                color: Vec3::new(fx, fy, 0.125 * fx * fy),
                alpha: 0.5,
                depth: fx + 100.0 * fy,
                distance: f32::INFINITY,
                normal: Vec3::new(0.0, -1.0, fx),
                object: 4_000_000_000 + x,
                prim: y,
                bary: Vec2::new(0.25, fy),
            };
            tiles[0].put(x, y, &sample);
        }
    }
    film
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// The only thing in the folder is this file.
fn assert_alone(path: &Path) {
    let names: Vec<_> = fs::read_dir(path.parent().unwrap())
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    assert_eq!(names, [path]);
}

#[test]
fn png_round_trip_and_tag() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let rgb: Vec<u8> = (0..5 * 3 * 3).map(|i| (i * 41 % 256) as u8).collect();
    write_png(&path, 5, 3, &rgb).unwrap();
    assert_alone(&path);
    let bytes = fs::read(&path).unwrap();
    assert!(bytes.windows(4).any(|w| w == b"sRGB"), "tagged");
    let picture = read_picture(&path).unwrap();
    assert_eq!((picture.width, picture.height, picture.srgb), (5, 3, true));
    for (pixel, want) in picture.pixels.iter().zip(rgb.chunks(3)) {
        assert_eq!(
            pixel.to_array().map(|v| (v * 255.0).round() as u8),
            [want[0], want[1], want[2], 255]
        );
    }
    let mut stream = Vec::new();
    encode_png(&mut stream, 5, 3, &rgb).unwrap();
    assert_eq!(stream, bytes, "the stream is the file");
}

#[test]
fn sixteen_bit_png_keeps_its_precision() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&[0x12, 0x34, 0xff, 0xff])
        .unwrap();
    let picture = read_picture(&write(folder.path(), "grey.png", &bytes)).unwrap();
    let grey = f32::from(0x1234u16) / 65535.0;
    assert_eq!(picture.pixels, [Vec4::new(grey, grey, grey, 1.0), Vec4::ONE]);
}

#[test]
fn exr_holds_all_layers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let film = film(19, 37, Layers::ALL);
    write_exr(&path, &film).unwrap();
    assert_alone(&path);
    let picture = read_picture(&path).unwrap();
    assert_eq!(picture, Picture::from(&film));
    assert!(!picture.srgb && picture.pixels[20] == Vec4::new(1.0, 1.0, 0.125, 0.5));

    let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let channels = &image.layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
    let mut want = "A B G N.X N.Y N.Z R bary.u bary.v depth.Z distance.D id.object id.prim"
        .split(' ')
        .collect::<Vec<_>>();
    want.sort_unstable();
    assert_eq!(names, want);
    let values = |name: &str| &channels.iter().find(|c| c.name.eq(name)).unwrap().sample_data;
    assert!(
        *values("id.object") == exr::image::FlatSamples::U32(film.object.clone()),
        "ids are exact"
    );
    assert!(*values("depth.Z") == exr::image::FlatSamples::F32(film.depth.clone()));
    assert!(
        *values("distance.D") == exr::image::FlatSamples::F32(film.distance.clone()),
        "infinity survives"
    );
}

#[test]
fn exr_without_further_layers_has_colour_only() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let film = film(4, 4, Layers::default());
    write_exr(&path, &film).unwrap();
    let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    assert_eq!(image.layer_data.channel_data.list.len(), 3);
    assert_eq!(read_picture(&path).unwrap().pixels[15].w, 1.0);
}

#[test]
fn npy_is_a_numpy_array() {
    let folder = tempfile::tempdir().unwrap();
    let film = film(7, 3, Layers::ALL);
    let path = folder.path().join("a.npy");
    write_npy(&path, &film, LayerKind::Object).unwrap();
    assert_alone(&path);
    let bytes = fs::read(&path).unwrap();
    assert_eq!(bytes[..8], *b"\x93NUMPY\x01\x00");
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(start % 64, 0);
    assert_eq!(
        std::str::from_utf8(&bytes[10..start])
            .unwrap()
            .trim_end_matches(' ')
            .trim_end_matches('\n')
            .trim_end(),
        "{'descr': '<u4', 'fortran_order': False, 'shape': (3, 7), }"
    );
    assert_eq!(bytes[start - 1], b'\n');
    let ids: Vec<u32> = bytes[start..]
        .chunks(4)
        .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    assert_eq!(ids, film.object);
    for layer in LayerKind::ALL.into_iter().filter(|&layer| film.holds(layer)) {
        write_npy(&path, &film, layer).unwrap();
        let picture = read_picture(&path).unwrap();
        assert_eq!(
            (picture.width, picture.height, picture.srgb),
            (7, 3, false),
            "{}",
            layer.name()
        );
    }
    write_npy(&path, &film, LayerKind::Normal).unwrap();
    assert_eq!(
        read_picture(&path).unwrap().pixels[8],
        Vec4::new(0.0, -1.0, 1.0, 1.0)
    );
    write_npy(&path, &film, LayerKind::Bary).unwrap();
    assert_eq!(
        read_picture(&path).unwrap().pixels[8],
        Vec4::new(0.25, 1.0, 0.0, 1.0)
    );
}

#[test]
fn npy_of_other_types_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let array = |kind: &str, shape: &str, data: &[u8]| {
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}\n");
        let length = (header.len() as u16).to_le_bytes();
        let bytes = [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat();
        read_picture(&write(folder.path(), "x.npy", &bytes))
    };
    assert_eq!(
        array("|u1", "1, 1, 4", &[255, 0, 51, 102]).unwrap().pixels,
        [Vec4::new(1.0, 0.0, 0.2, 0.4)]
    );
    assert_eq!(
        array(">i2", "1, 2", &[0xff, 0xfe, 0, 7]).unwrap().pixels[0].x,
        -2.0
    );
    assert_eq!(
        array("<f8", "1, 1", &2.5f64.to_le_bytes()).unwrap().pixels[0].y,
        2.5
    );
    assert_eq!(
        array(">f4", "1, 1, 1", &2.5f32.to_be_bytes()).unwrap().pixels[0].z,
        2.5
    );
    for (kind, shape, data) in [
        ("<c8", "1, 1", &[0u8; 8][..]),
        ("<f4", "1, 1, 9", &[0; 36]),
        ("<f4", "1,", &[0; 4]),
        ("<f4", "2, 2", &[0; 15]),
        ("<f4", "0, 4", &[]),
        ("<f4", "-1, 4", &[]),
    ] {
        assert!(
            matches!(array(kind, shape, data), Err(Error::MalformedImage { .. })),
            "{kind} ({shape})"
        );
    }
    assert!(matches!(
        array("<f4", "4000000000, 4000000000", &[]),
        Err(Error::ImageTooLarge { .. })
    ));
}

#[test]
fn pfm_and_hdr_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let floats = |values: &[f32], big: bool| -> Vec<u8> {
        values
            .iter()
            .flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() })
            .collect()
    };
    let grey = [b"Pf\n1 2\n-1.0\n".to_vec(), floats(&[1.0, 2.0], false)].concat();
    let picture = read_picture(&write(folder.path(), "a.pfm", &grey)).unwrap();
    assert_eq!(
        picture.pixels,
        [Vec4::new(2.0, 2.0, 2.0, 1.0), Vec4::ONE],
        "rows go from the bottom up"
    );
    let color = [b"PF 1 1 1.0\n".to_vec(), floats(&[0.5, 1.5, -2.5], true)].concat();
    let picture = read_picture(&write(folder.path(), "b.pfm", &color)).unwrap();
    assert_eq!(
        (picture.pixels[0], picture.srgb),
        (Vec4::new(0.5, 1.5, -2.5, 1.0), false)
    );
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x40\x20\x82".to_vec();
    let picture = read_picture(&write(folder.path(), "c.hdr", &hdr)).unwrap();
    assert_eq!(
        (picture.pixels[0], picture.srgb),
        (Vec4::new(2.0, 1.0, 0.5, 1.0), false)
    );
}

#[test]
fn broken_files_are_errors_that_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let good = |name: &str| {
        let path = folder.path().join(name);
        let film = film(32, 32, Layers::ALL);
        match path.extension().unwrap().to_str().unwrap() {
            "png" => write_png(&path, 32, 32, &[7; 32 * 32 * 3]).unwrap(),
            "exr" => write_exr(&path, &film).unwrap(),
            _ => write_npy(&path, &film, LayerKind::Color).unwrap(),
        }
        fs::read(&path).unwrap()
    };
    for name in ["a.png", "a.exr", "a.npy"] {
        let bytes = good(name);
        for length in [5, 9, 40, bytes.len() / 2, bytes.len() - 1] {
            let path = write(folder.path(), name, &bytes[..length]);
            let error = match read_picture(&path) {
                Err(error @ (Error::MalformedImage { .. } | Error::UnknownImageFormat { .. })) => error,
                // All that is missing is the checksum of PNG's last, empty chunk.
                Ok(_) if name == "a.png" && length == bytes.len() - 1 => continue,
                other => panic!("{name} cut to {length}: {other:?}"),
            };
            let message = error.to_string();
            assert!(message.contains(name), "{message}");
            let placed = message.contains(&format!("near byte {length} of {length}"));
            assert!(placed || name != "a.png" || length < 8, "{message}");
        }
        // One byte wrong anywhere is an error or another picture, never a panic.
        for at in (0..bytes.len()).step_by(bytes.len() / 97 + 1) {
            let mut bent = bytes.clone();
            bent[at] ^= 0xff;
            let _ = read_picture(&write(folder.path(), name, &bent));
        }
    }
    for (name, bytes) in [
        ("empty.png", &b""[..]),
        ("text.exr", b"hello, world"),
        ("a.pfm", b"PF\n9 9\n-1\nxx"),
    ] {
        let error = read_picture(&write(folder.path(), name, bytes)).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
    }
    let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 9 +X 9\nxx";
    let message = read_picture(&write(folder.path(), "cut.hdr", header))
        .unwrap_err()
        .to_string();
    let end = header.len();
    assert!(
        message.contains(&format!("near byte {end} of {end}")),
        "{message}"
    );
    assert!(matches!(
        read_picture(&folder.path().join("none.png")),
        Err(Error::Read { .. })
    ));
    assert!(matches!(read_picture(folder.path()), Err(Error::Read { .. })));
}

#[test]
fn absurd_sizes_do_not_allocate() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut writer = png::Encoder::new(&mut bytes, 2_000_000_000, 2_000_000_000)
        .write_header()
        .unwrap();
    writer.write_chunk(png::chunk::IDAT, &[]).unwrap();
    drop(writer);
    assert!(matches!(
        read_picture(&write(folder.path(), "a.png", &bytes)),
        Err(Error::ImageTooLarge { .. })
    ));
    let pfm = b"PF\n4000000000 4000000000\n-1.0\n";
    assert!(matches!(
        read_picture(&write(folder.path(), "a.pfm", pfm)),
        Err(Error::ImageTooLarge { .. })
    ));
    let film = film(32, 32, Layers::default());
    let path = folder.path().join("a.exr");
    write_exr(&path, &film).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    // Both windows are 0 0 31 31: make them 2^30 wide.
    let (window, wide) = (
        [0, 0, 0, 0, 0, 0, 0, 0, 31, 0, 0, 0, 31, 0, 0, 0],
        [0, 0, 0, 0x40],
    );
    let places: Vec<_> = (0..bytes.len() - 16)
        .filter(|&i| bytes[i..i + 16] == window)
        .collect();
    assert!(places.len() >= 2);
    for place in places {
        bytes[place + 8..place + 12].copy_from_slice(&wide);
    }
    assert!(matches!(
        read_picture(&write(folder.path(), "b.exr", &bytes)),
        Err(Error::MalformedImage { .. })
    ));
}

#[test]
fn places_that_cannot_be_written_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let film = film(4, 4, Layers::default());
    let missing = folder.path().join("no/such/folder/a.png");
    for path in [
        folder.path(),
        Path::new("/proc/a.png"),
        missing.as_path(),
        Path::new(""),
    ] {
        for error in [
            write_png(path, 2, 2, &[0; 12]).unwrap_err(),
            write_exr(path, &film).unwrap_err(),
            write_npy(path, &film, LayerKind::Color).unwrap_err(),
        ] {
            assert!(
                matches!(&error, Error::Write { path: named, .. } if named == path),
                "{error}"
            );
        }
    }
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        0,
        "nothing is left behind"
    );
    let path = folder.path().join("a.npy");
    assert!(matches!(
        write_npy(&path, &film, LayerKind::Depth),
        Err(Error::MissingLayer { layer: "depth" })
    ));
    assert!(matches!(
        write_png(&path, 2, 2, &[0; 11]),
        Err(Error::ImageSize { .. })
    ));
    assert!(matches!(
        write_png(&path, 0, 0, &[]),
        Err(Error::ImageSize { .. })
    ));
    assert!(!path.exists());
}

#[cfg(unix)]
#[test]
fn files_keep_their_kind() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let (target, link) = (folder.path().join("a.png"), folder.path().join("link.png"));
    write_png(&target, 1, 1, &[1, 2, 3]).unwrap();
    let plain = folder.path().join("plain");
    fs::write(&plain, b"").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&target), mode(&plain), "as readable as any new file");
    symlink(&target, &link).unwrap();
    write_png(&link, 1, 1, &[9, 9, 9]).unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(read_picture(&target).unwrap().pixels[0].x, 9.0 / 255.0);
    fs::set_permissions(&target, fs::Permissions::from_mode(0o444)).unwrap();
    assert!(
        matches!(write_png(&target, 1, 1, &[0; 3]), Err(Error::Write { .. })),
        "read-only stays"
    );
    write_png(Path::new("/dev/null"), 1, 1, &[0; 3]).unwrap();
    assert!(
        !fs::metadata("/dev/null").unwrap().is_file(),
        "a device is written, not replaced"
    );
}
