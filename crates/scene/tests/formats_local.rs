//! Every local scene file loads and poses, or gives an error: none of them may panic.
//!
//! The files are not part of the repository; they are looked for in the folder that `RAYWARD_SCENES` names.

use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayward_scene::{LoadOptions, load};

fn files(folder: &Path, into: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    for path in entries.filter_map(Result::ok).map(|e| e.path()) {
        if path.is_dir() {
            files(&path, into);
        } else {
            into.push(path);
        }
    }
}

fn scene_files(folders: &[&str]) -> Option<Vec<PathBuf>> {
    let Some(root) = std::env::var_os("RAYWARD_SCENES").filter(|value| !value.is_empty()) else {
        println!("skipped: RAYWARD_SCENES is not set");
        return None;
    };
    let mut found = Vec::new();
    for folder in folders {
        files(&Path::new(&root).join(folder), &mut found);
    }
    found.retain(|p| {
        p.extension()
            .is_some_and(|e| e == "obj" || e == "ply" || e == "stl")
    });
    found.sort();
    assert!(!found.is_empty(), "no scene files in {}", root.display());
    Some(found)
}

#[test]
fn benchmark_scenes_load_whole() {
    let Some(files) = scene_files(&["bench", "textured"]) else {
        return;
    };
    for path in files {
        let start = Instant::now();
        let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let loaded = start.elapsed();
        let frame = scene.at(0.0);
        let dropped = frame.dropped_non_finite + frame.dropped_degenerate;
        assert_eq!(frame.dropped_non_finite, 0, "{}", path.display());
        println!(
            "{:6} triangles, {dropped} dropped, {} objects, {:.0} ms: {}",
            frame.triangle_count(),
            frame.objects.len(),
            loaded.as_secs_f64() * 1e3,
            path.display()
        );
        for notice in &scene.notices {
            println!("       {notice}");
        }
        // The number in a file's name is its count of triangles in thousands; repairs changed it a little.
        let stem = path.file_stem().unwrap().to_string_lossy();
        let digits = stem
            .trim_end_matches('k')
            .trim_start_matches(|c: char| !c.is_ascii_digit());
        if let Ok(thousands) = digits.parse::<f64>() {
            let count = (frame.triangle_count() + dropped) as f64 / 1e3;
            assert!((count - thousands).abs() <= 1.0, "{stem}: {count}k triangles");
        }
    }
}

#[test]
fn broken_files_give_errors_or_scenes() {
    let Some(files) = scene_files(&["nasty"]) else {
        return;
    };
    for path in files {
        let outcome = catch_unwind(|| {
            load(&path, &LoadOptions::default()).map(|scene| {
                let frame = scene.at(0.0);
                let dropped = (frame.dropped_non_finite, frame.dropped_degenerate);
                let notices: Vec<String> = scene.notices.iter().map(ToString::to_string).collect();
                format!(
                    "{} triangles, dropped {dropped:?}, {notices:?}",
                    frame.triangle_count()
                )
            })
        });
        let name = path.file_name().unwrap().to_string_lossy();
        match outcome.unwrap_or_else(|_| panic!("{} makes the loader panic", path.display())) {
            Ok(found) => println!("{name}: {found}"),
            Err(error) => {
                let message = error.to_string();
                println!("{name}: error {message}");
                assert!(
                    message.contains(&*path.to_string_lossy()),
                    "the error does not name the file: {message}"
                );
            }
        }
    }
}
