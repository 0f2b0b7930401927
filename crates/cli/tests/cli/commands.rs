//! `info`, `compare`, `doctor`, `completions`, help, and how the program ends.

use std::process::Stdio;

use crate::support::{Folder, Run};

#[test]
fn info_tells_what_is_in_a_scene() {
    let folder = Folder::new();
    let run = folder.run(&["info", "--builtin", "walker"]).expect(0);
    let text = String::from_utf8(run.stdout).expect("text");
    for word in [
        "walker, built-in",
        "triangles",
        "1 skin",
        "animation   0",
        "bounds",
        "closed",
    ] {
        assert!(text.contains(word), "{word} is not in\n{text}");
    }
    assert!(run.stderr.is_empty());
    let json = folder
        .run(&["info", "--builtin", "blob-1k", "--json"])
        .expect(0)
        .json();
    assert_eq!(json["triangles"], 980);
    assert!(
        json["components"]["closed"]
            .as_u64()
            .is_some_and(|closed| closed >= 1)
    );
    assert_eq!(json["components"]["open"], 0);
    assert!(folder.names().is_empty(), "info writes no file");
}

#[test]
fn info_counts_what_is_dropped() {
    let folder = Folder::new();
    folder.file(
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\nf 1 1 2\n",
    );
    let json = folder.run(&["info", "a.obj", "--json"]).expect(0).json();
    assert_eq!(json["format"], "OBJ");
    assert_eq!(json["triangles"], 1);
    assert_eq!(json["components"]["open"], 1);
    let render = folder.run(&["render", "a.obj", "--resolution", "8x8"]).expect(0);
    assert!(render.stderr.contains("dropped"), "{}", render.stderr);
}

#[test]
fn compare_ends_with_5_beyond_the_tolerance() {
    let folder = Folder::new();
    let picture = |name: &str, more: &[&str]| {
        let base = [
            "render",
            "--builtin",
            "blob-1k",
            "--resolution",
            "64x48",
            "-q",
            "-o",
            name,
        ];
        folder.run(&[&base, more].concat()).expect(0);
    };
    picture("a.png", &[]);
    picture("b.png", &["--exposure", "0.2"]);
    let json = folder
        .run(&["compare", "a.png", "a.png", "--json"])
        .expect(0)
        .json();
    assert_eq!(
        (&json["rmse"], &json["differing_pixels"]),
        (&0.0.into(), &0.into())
    );
    assert!(json["psnr_db"].is_null(), "infinite");

    let run = folder
        .run(&["compare", "a.png", "b.png", "--json", "--difference", "d.png"])
        .expect(5);
    let flip = run.json()["mean_flip"].as_f64().expect("a number");
    assert!(flip > 0.0 && flip < 1.0, "{flip}");
    assert!(folder.path("d.png").exists());
    let compare = |tolerance: f64| {
        let tolerance = tolerance.to_string();
        folder.run(&["compare", "a.png", "b.png", "--tolerance", &tolerance])
    };
    let within = compare(flip * 1.01).expect(0);
    assert!(String::from_utf8_lossy(&within.stdout).contains("within"));
    let beyond = compare(flip * 0.99).expect(5);
    assert!(String::from_utf8_lossy(&beyond.stdout).contains("beyond"));
}

#[test]
fn compare_names_what_it_cannot_compare() {
    let folder = Folder::new();
    for (name, size) in [("a.png", "16x16"), ("b.png", "8x8")] {
        folder
            .run(&[
                "render",
                "--builtin",
                "blob-1k",
                "--resolution",
                size,
                "-q",
                "-o",
                name,
            ])
            .expect(0);
    }
    folder
        .run(&["compare", "a.png", "b.png"])
        .expect(5)
        .says(&["16x16", "8x8"]);
    folder
        .run(&["compare", "a.png", "none.png"])
        .expect(3)
        .says(&["none.png"]);
    let png = std::fs::read(folder.path("a.png")).expect("a picture");
    folder.file("cut.png", &png[..png.len() / 2]);
    folder
        .run(&["compare", "a.png", "cut.png"])
        .expect(3)
        .says(&["cut.png"]);
    folder.file("text.png", "no picture");
    folder
        .run(&["compare", "a.png", "text.png"])
        .expect(3)
        .says(&["text.png"]);
}

#[test]
fn doctor_finds_this_machine_sound() {
    let folder = Folder::new();
    let json = folder.run(&["doctor", "--json"]).expect(0).json();
    assert_eq!(json["self_test"], true);
    assert!(json["threads"].as_u64().is_some_and(|threads| threads > 0));
    let levels = json["simd_levels"].as_array().expect("levels");
    assert!(levels.contains(&json["simd"]));
    let gpu = &json["gpu"];
    let (used, off) = (gpu["used"].as_str(), gpu["off"].as_str());
    assert!(used.is_some() != off.is_some(), "{gpu}");
    if let Some(used) = used {
        let adapters = gpu["adapters"].as_array().expect("adapters");
        assert!(adapters.iter().any(|a| a["name"] == used), "{gpu}");
    }
    if cfg!(target_os = "linux") {
        let output = folder
            .command(&["doctor", "--json"])
            .env("VK_DRIVER_FILES", "/nowhere.json")
            .env("VK_ICD_FILENAMES", "/nowhere.json")
            .output()
            .expect("the program runs");
        let without = Run::from(output).expect(0).json();
        let off = without["gpu"]["off"].as_str().expect("a reason");
        assert!(off.contains("no GPU"), "{off}");
    }
    folder.run(&["doctor"]).expect(0);
}

#[test]
fn completions_for_every_shell() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let run = folder.run(&["completions", shell]).expect(0);
        assert!(
            String::from_utf8_lossy(&run.stdout).contains("rayward"),
            "{shell}"
        );
    }
}

#[test]
fn help_has_examples_and_exit_codes() {
    let folder = Folder::new();
    let help = |arguments: &[&str]| {
        let run = folder.run(arguments).expect(0);
        assert!(run.stderr.is_empty());
        String::from_utf8(run.stdout).expect("text")
    };
    let top = help(&["--help"]);
    assert!(
        top.contains("Examples:") && top.contains("Exit codes:") && top.contains("130"),
        "{top}"
    );
    let render = help(&["render", "--help"]);
    assert!(render.contains("Examples:") && render.contains("courtyard") && render.contains("blob-69k"));
    assert!(help(&["--version"]).starts_with("rayward "));
}

#[test]
fn a_senseless_command_line_ends_with_2() {
    let folder = Folder::new();
    for arguments in [
        &[][..],
        &["paint"],
        &["render", "--builtin", "castle"],
        &["render", "a.obj", "--builtin", "office"],
        &["render", "--resolution", "0x5"],
        &["render", "--width", "0"],
        &["render", "--threads", "0"],
        &["render", "--light", "moon:1,2,3"],
        &["render", "--light", "sphere:1,2,3"],
        &["render", "--samples", "0"],
        &["render", "--samples", "257"],
        &["render", "--area-light"],
        &["render", "--time", "nan"],
        &["render", "-o", "picture.gif"],
        &["render", "--tone-map", "none", "--exposure", "1"],
        &["compare", "a.png"],
    ] {
        let run = folder.run(arguments).expect(2);
        assert!(run.stdout.is_empty() && !run.stderr.is_empty(), "{arguments:?}");
    }
    assert!(folder.names().is_empty());
}

#[test]
fn outputs_that_cannot_be_written_end_with_1() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("folder.png")).expect("a folder");
    for output in ["missing/a.png", "folder.png"] {
        let arguments = [
            "render",
            "--builtin",
            "blob-1k",
            "--resolution",
            "8x8",
            "-o",
            output,
        ];
        folder.run(&arguments).expect(1).says(&[output]);
    }
    assert_eq!(folder.names(), ["folder.png"]);
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_is_no_disaster() {
    let folder = Folder::new();
    for arguments in [
        &["completions", "bash"][..],
        &["--help"],
        &["info", "--builtin", "blob-1k", "--json"],
        &[
            "render",
            "--builtin",
            "blob-1k",
            "--resolution",
            "640x480",
            "-q",
            "-o",
            "-",
        ],
    ] {
        let mut child = folder
            .command(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program runs");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("the program ends");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.is_empty(), "{arguments:?} says {said}");
        assert!(
            matches!(output.status.code(), Some(0 | 1)),
            "{arguments:?}: {}",
            output.status
        );
    }
}

#[test]
fn compare_neither_overwrites_its_inputs_nor_reads_without_end() {
    let folder = Folder::new();
    for name in ["a.png", "b.png"] {
        folder
            .run(&[
                "render",
                "--builtin",
                "blob-1k",
                "--resolution",
                "16x12",
                "-q",
                "-o",
                name,
            ])
            .expect(0);
    }
    let before = std::fs::read(folder.path("a.png")).expect("a picture");
    folder
        .run(&["compare", "a.png", "b.png", "--difference", "./a.png"])
        .expect(2);
    assert_eq!(std::fs::read(folder.path("a.png")).expect("a picture"), before);
    #[cfg(unix)]
    {
        let endless = folder.run(&["compare", "a.png", "/dev/zero"]).expect(3);
        assert!(
            endless.stderr.contains("not a regular file"),
            "{}",
            endless.stderr
        );
    }
}

#[test]
fn compare_refuses_pictures_over_the_limit() {
    let folder = Folder::new();
    // A promise of 1.6 thousand million pixels without any.
    let mut dictionary = "{'descr': '<f4', 'fortran_order': False, 'shape': (40000, 40000), }".to_owned();
    dictionary.push_str(&" ".repeat(117 - dictionary.len()));
    dictionary.push('\n');
    let array = [b"\x93NUMPY\x01\x00\x76\x00", dictionary.as_bytes()].concat();
    folder.file("large.npy", &array);
    folder
        .run(&["compare", "large.npy", "large.npy"])
        .expect(4)
        .says(&["large.npy", "40000x40000"]);
}

#[test]
#[cfg(unix)]
fn an_existing_picture_keeps_its_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let path = folder.file("a.png", "old");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("its own file");
    folder
        .run(&[
            "render",
            "--builtin",
            "blob-1k",
            "--resolution",
            "16x12",
            "-q",
            "-o",
            "a.png",
        ])
        .expect(0);
    let mode = std::fs::metadata(&path).expect("a picture").permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
}
