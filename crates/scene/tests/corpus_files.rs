//! Every glTF among the local scenes: the sound ones load, none of the broken ones panics, hangs or takes
//! absurd memory. Needs `RAYWARD_SCENES`, the folder of the scenes.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rayward_scene::{Error, LoadOptions, Scene, load};

/// All `.gltf` and `.glb` files below a folder, sorted.
fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.expect("a folder entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path
                .extension()
                .is_some_and(|ending| ending == "gltf" || ending == "glb")
            {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn scenes_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("RAYWARD_SCENES")
        .filter(|value| !value.is_empty())
        .map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: RAYWARD_SCENES is not set");
    }
    folder
}

/// Triangles of some of the files, each mesh counted once.
const TRIANGLES: &[(&str, usize)] = &[
    ("2CylinderEngine.glb", 75_730),
    ("AttenuationTest.glb", 232),
    ("CesiumMan.glb", 4_672),
    ("CesiumMilkTruck.glb", 2_856),
    ("DamagedHelmet.glb", 15_452),
    ("MetalRoughSpheresNoTextures.glb", 1_040_409),
    ("NegativeScaleTest.glb", 3_884),
    ("PalmTree.gltf", 10_124),
    ("RecursiveSkeletons.glb", 76),
    ("SimpleInstancing.glb", 12),
    ("SimpleSkin.gltf", 8),
    ("SunglassesKhronos.glb", 13_396),
    ("TransmissionTest.glb", 128_775),
    ("dragon_bunny252k.glb", 252_571),
    ("scene.gltf", 18_515),
    ("tiny.glb", 6_841),
    ("wineglass.gltf", 2_144),
];

/// The most memory this process has had, in bytes, where the system tells.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim()
        .strip_suffix("kB")?
        .trim()
        .parse::<u64>()
        .ok()
        .map(|kib| kib << 10)
}

fn triangles(scene: &Scene) -> usize {
    let of_mesh = |mesh: usize| {
        scene.meshes[mesh]
            .primitives
            .iter()
            .map(|p| p.triangles.len())
            .sum::<usize>()
    };
    scene.nodes.iter().filter_map(|node| node.mesh).map(of_mesh).sum()
}

#[test]
fn sound_files_load() {
    let Some(folder) = scenes_folder() else { return };
    let files: Vec<_> = ["textured", "animated"]
        .iter()
        .flat_map(|sub| gltf_files(&folder.join(sub)))
        .collect();
    assert!(files.len() >= 28, "only {} files", files.len());
    for path in files {
        let start = Instant::now();
        let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        println!(
            "{}: {} triangles, {} nodes, {} materials, {} images, {} skins, {} animations, {:.0?}",
            path.display(),
            triangles(&scene),
            scene.nodes.len(),
            scene.materials.len(),
            scene.images.len(),
            scene.skins.len(),
            scene.animations.len(),
            start.elapsed()
        );
        let name = path.file_name().expect("a name").to_string_lossy();
        if let Some((_, expected)) = TRIANGLES.iter().find(|(known, _)| *known == name) {
            let primitives = scene.meshes.iter().flat_map(|mesh| &mesh.primitives);
            assert_eq!(
                primitives.map(|p| p.triangles.len()).sum::<usize>(),
                *expected,
                "{name}"
            );
        }
        for notice in &scene.notices {
            println!("    {notice}");
        }
    }
}

#[test]
fn broken_files_give_errors_or_scenes() {
    let Some(folder) = scenes_folder() else { return };
    let folders = ["nasty/gltf", "nasty/gltf_validator", "nasty/generated"];
    let files: Vec<_> = folders
        .iter()
        .flat_map(|sub| gltf_files(&folder.join(sub)))
        .collect();
    assert!(files.len() >= 90, "only {} files", files.len());
    for path in files {
        let start = Instant::now();
        let result = catch_unwind(AssertUnwindSafe(|| load(&path, &LoadOptions::default())))
            .unwrap_or_else(|_| panic!("{} panicked", path.display()));
        assert!(
            start.elapsed() < Duration::from_secs(10),
            "{} took {:?}",
            path.display(),
            start.elapsed()
        );
        match result {
            Ok(scene) => println!("{}: {} triangles", path.display(), triangles(&scene)),
            Err(error) => {
                let message = error.to_string();
                println!("{message}");
                let name = path.file_name().expect("a name").to_string_lossy().into_owned();
                assert!(message.contains(&name), "{message} does not name {name}");
                assert!(!matches!(error, Error::UnknownBuiltin { .. }));
            }
        }
    }
    if let Some(peak) = peak_memory() {
        assert!(peak < 2 << 30, "peak memory {peak}");
    }
}
