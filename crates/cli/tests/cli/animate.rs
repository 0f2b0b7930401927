//! `rayward animate`: numbered frames, whatever order and process they are made in.

use crate::support::Folder;

const WALKER: [&str; 6] = ["animate", "--builtin", "walker", "--resolution", "24x16", "-q"];

fn animate(folder: &Folder, more: &[&str]) -> crate::support::Run {
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
