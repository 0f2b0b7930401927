//! `rayward animate`: numbered frames, whatever order and process they are made in.

use crate::support::{Folder, Run};

const WALKER: [&str; 6] = ["animate", "--builtin", "walker", "--resolution", "24x16", "-q"];

fn animate(folder: &Folder, more: &[&str]) -> Run {
    folder.run(&[&WALKER, more].concat())
}

fn bytes(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.path(name)).expect("a frame")
}

#[test]
fn frames_are_those_of_render() {
    let folder = Folder::new();
    animate(&folder, &["--rate", "4", "--seconds", "0.25..1"]).expect(0);
    assert_eq!(
        folder.names(),
        ["frame-0001.png", "frame-0002.png", "frame-0003.png"]
    );
    let moment = [
        "render",
        "--builtin",
        "walker",
        "--resolution",
        "24x16",
        "-q",
        "--time",
        "0.5",
    ];
    folder.run(&[&moment[..], &["-o", "one.png"]].concat()).expect(0);
    assert!(bytes(&folder, "one.png") == bytes(&folder, "frame-0002.png"));
    assert!(bytes(&folder, "frame-0001.png") != bytes(&folder, "frame-0002.png"));
}

#[test]
fn lens_and_shutter_are_those_of_render() {
    let folder = Folder::new();
    let blurred = ["--aperture", "0.4", "--shutter", "0.1", "--pixel-samples", "4"];
    animate(
        &folder,
        &[&["--rate", "4", "--frames", "1..2"][..], &blurred].concat(),
    )
    .expect(0);
    let moment = ["--resolution", "24x16", "-q", "--time", "0.25"];
    let render = [&["render", "--builtin", "walker"][..], &moment];
    let render = |more: &[&str], name| {
        folder
            .run(&[&render.concat()[..], more, &["-o", name]].concat())
            .expect(0);
        bytes(&folder, name)
    };
    assert!(render(&blurred, "blurred.png") == bytes(&folder, "frame-0001.png"));
    assert!(render(&[], "sharp.png") != bytes(&folder, "frame-0001.png"));
}

#[test]
fn shards_and_a_resumed_run_give_the_frames_of_the_whole() {
    let (whole, parts) = (Folder::new(), Folder::new());
    let frames = ["--rate", "6", "--turn", "90", "-o", "f#.png"];
    animate(&whole, &frames).expect(0);
    assert_eq!(whole.names().len(), 6);
    animate(&parts, &[&frames[..], &["--shard", "2/2"]].concat()).expect(0);
    assert_eq!(parts.names(), ["f1.png", "f3.png", "f5.png"]);
    // A file that is there is done, whatever is in it.
    parts.file("f1.png", "kept");
    let resumed = animate(&parts, &[&frames[..], &["--resume", "--json"]].concat()).expect(0);
    let lines: Vec<serde_json::Value> = std::str::from_utf8(&resumed.stdout)
        .expect("text")
        .lines()
        .map(|line| serde_json::from_str(line).expect("an object a line"))
        .collect();
    let numbers: Vec<_> = lines.iter().map(|line| line["frame"].as_u64()).collect();
    assert_eq!(numbers, [Some(0), Some(2), Some(4)]);
    assert_eq!(bytes(&parts, "f1.png"), b"kept");
    for name in ["f0.png", "f2.png", "f3.png", "f4.png", "f5.png"] {
        assert!(bytes(&whole, name) == bytes(&parts, name), "{name}");
    }
}

#[test]
fn what_makes_no_sense_is_a_usage_error() {
    let folder = Folder::new();
    let still = ["animate", "--builtin", "office", "--resolution", "8x8", "-q"];
    folder.run(&still).expect(2).says(&["--frames", "office"]);
    folder
        .run(&[&still[..], &["--frames", "0..1"]].concat())
        .expect(0);
    animate(&folder, &["-o", "-"]).expect(2).says(&["--output -"]);
    animate(&folder, &["--shard", "3/2"]).expect(2);
    animate(&folder, &["--frames", "2..1"]).expect(2);
    animate(&folder, &["-o", "none/f#.png"]).expect(1);
}

#[test]
fn a_movie_is_its_numbered_frames_merged() {
    let folder = Folder::new();
    let frames = ["--rate", "8", "--turn", "-120"];
    for name in ["a.apng", "a.gif"] {
        let movie = animate(&folder, &[&frames[..], &["-o", name, "--json"]].concat()).expect(0);
        assert_eq!(movie.stdout.iter().filter(|&&b| b == b'\n').count(), 8);
    }
    animate(&folder, &[&frames[..], &["-o", "f#.png"]].concat()).expect(0);
    let numbered: Vec<_> = (0..8).map(|i| format!("f{i}.png")).collect();
    let numbered: Vec<_> = numbered.iter().map(String::as_str).collect();
    for (name, whole) in [("b.apng", "a.apng"), ("b.gif", "a.gif")] {
        let merge = ["merge", "-q", "--rate", "8", "-o", name];
        folder.run(&[&merge[..], &numbered].concat()).expect(0);
        assert!(bytes(&folder, name) == bytes(&folder, whole), "{name}");
    }
}

#[test]
fn what_is_no_movie_is_said() {
    let folder = Folder::new();
    animate(&folder, &["-o", "a.gif", "--resume"])
        .expect(2)
        .says(&["merge"]);
    animate(&folder, &["-o", "a.avi"]).expect(2).says(&[".avi"]);
    let still = ["render", "--builtin", "office", "--resolution", "9x8", "-q", "-o"];
    folder.run(&[&still[..], &["a.png"]].concat()).expect(0);
    animate(&folder, &["-o", "b#.png", "--rate", "2"]).expect(0);
    let merge = ["merge", "-q", "a.png", "b0.png", "-o"];
    folder
        .run(&[&merge[..], &["a.avi"]].concat())
        .expect(2)
        .says(&["a.avi", "movie"]);
    folder
        .run(&[&merge[..], &["a.gif"]].concat())
        .expect(3)
        .says(&["b0.png", "9x8"]);
    folder
        .run(&["merge", "-q", "none.png", "-o", "a.gif"])
        .expect(3)
        .says(&["none.png"]);
    assert!(!folder.names().contains(&"a.gif".to_owned()));
}

#[cfg(unix)]
#[test]
fn other_movies_are_made_by_ffmpeg() {
    use std::os::unix::fs::PermissionsExt;

    let folder = Folder::new();
    let arguments = [&WALKER[..], &["--rate", "4", "-o", "a.mp4"]].concat();
    let run = |path: &str| {
        let output = folder.command(&arguments).env("PATH", path).output();
        Run::from(output.expect("the program runs"))
    };
    let without = run("").expect(1);
    assert!(
        without.stderr.contains("ffmpeg is not installed"),
        "{}",
        without.stderr
    );
    // Stands in for it: the last argument gets what comes in.
    folder.file(
        "ffmpeg",
        "#!/bin/sh\nfor last; do :; done\n/bin/cat > \"$last\"\n",
    );
    let executable = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(folder.path("ffmpeg"), executable).expect("a script");
    let path = folder.path("").display().to_string();
    run(&path).expect(0);
    assert_eq!(bytes(&folder, "a.mp4").len(), 24 * 16 * 3 * 4);
    folder.file("ffmpeg", "#!/bin/sh\necho no such codec >&2\nexit 1\n");
    std::fs::set_permissions(folder.path("ffmpeg"), std::fs::Permissions::from_mode(0o755))
        .expect("a script");
    let failed = run(&path).expect(1);
    assert!(failed.stderr.contains("no such codec"), "{}", failed.stderr);
    assert_eq!(
        bytes(&folder, "a.mp4").len(),
        24 * 16 * 3 * 4,
        "what was there is left"
    );
    assert_eq!(folder.names(), ["a.mp4", "ffmpeg"]);
}
