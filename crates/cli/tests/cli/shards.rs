//! Parts of one picture, whatever order and process they are made in, and their joining.

use crate::support::{Folder, Run};

const SCENE: [&str; 8] = [
    "render",
    "--builtin",
    "teapot-mirror",
    "--resolution",
    "150x130",
    "--samples",
    "2",
    "-q",
];

fn render(folder: &Folder, more: &[&str]) -> Run {
    folder.run(&[&SCENE, more].concat()).expect(0)
}

fn merge(folder: &Folder, more: &[&str]) -> Run {
    folder.run(&[&["merge", "-q"], more].concat())
}

fn bytes(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.path(name)).expect("a file")
}

#[test]
fn parts_joined_are_the_whole() {
    let folder = Folder::new();
    let parts = ["rayward-2-of-2.exr", "rayward-1-of-2.exr"];
    render(&folder, &["--shard", "1/2", "--threads", "1"]);
    render(&folder, &["--shard", "2/2"]);
    let whole = ["--exposure", "auto", "-o", "whole.png"];
    render(&folder, &whole);
    render(&folder, &["-o", "whole.exr"]);
    render(&folder, &["-o", "whole.npy", "--npy", "whole"]);
    for wanted in [
        &["-o", "joined.exr"][..],
        &["-o", "joined.npy", "--npy", "joined"],
        &["-o", "joined.png", "--exposure", "auto"],
    ] {
        merge(&folder, &[&parts, wanted].concat()).expect(0);
    }
    for ending in [".png", ".exr", ".npy", "/depth.npy", "/normal.npy", "/prim.npy"] {
        let [whole, joined] = ["whole", "joined"].map(|stem| bytes(&folder, &format!("{stem}{ending}")));
        assert!(whole == joined, "{ending}");
    }
    // A part has work of its own to do, and shows less than the whole.
    let [first, whole] = [parts[1], "whole.exr"].map(|name| bytes(&folder, name).len());
    assert!(
        first * 10 < whole * 9 && first * 10 > whole,
        "{first} of {whole} bytes"
    );
}

#[test]
fn parts_that_do_not_belong_together_are_said() {
    let folder = Folder::new();
    let small = [
        "render",
        "--builtin",
        "blob-1k",
        "--resolution",
        "70x70",
        "-q",
        "--no-shadows",
    ];
    let part = |name: &str, more: &[&str]| {
        let named = ["--layers", "depth", "-o", name];
        folder.run(&[&small[..], &named, more].concat()).expect(0);
    };
    part("a.exr", &["--shard", "1/3"]);
    part("b.exr", &["--shard", "2/3"]);
    part("other.exr", &["--shard", "2/3", "--seed", "7"]);
    part("of2.exr", &["--shard", "2/2"]);
    part("whole.exr", &[]);
    part("turned.exr", &["--shard", "2/3", "--camera-vfov", "41"]);
    let layers = ["--layers", "depth,normal", "-o", "layers.exr", "--shard", "2/3"];
    folder.run(&[&small[..], &layers].concat()).expect(0);
    let mut cut = bytes(&folder, "b.exr");
    cut.truncate(cut.len() * 2 / 3);
    folder.file("cut.exr", cut);
    folder.file("text.exr", "no picture");

    let fails = |parts: &[&str], says: &[&str]| {
        merge(&folder, &[parts, &["-o", "joined.exr"]].concat())
            .expect(3)
            .says(says);
        assert!(!folder.path("joined.exr").exists());
    };
    fails(&["a.exr", "b.exr"], &["1 of the 3 parts", "3/3"]);
    fails(&["b.exr"], &["2 of the 3 parts", "1/3"]);
    fails(&["a.exr", "b.exr", "b.exr"], &["b.exr", "part 2/3 as b.exr is"]);
    fails(
        &["a.exr", "other.exr"],
        &["other.exr", "another picture than a.exr"],
    );
    fails(&["a.exr", "turned.exr"], &["turned.exr", "another picture"]);
    fails(&["a.exr", "of2.exr"], &["of2.exr", "2/2", "a.exr is part 1/3"]);
    fails(&["a.exr", "layers.exr"], &["layers.exr", "layers"]);
    fails(&["a.exr", "whole.exr"], &["whole.exr", "no part"]);
    fails(&["a.exr", "cut.exr"], &["cut.exr"]);
    fails(&["a.exr", "text.exr"], &["text.exr", "no part"]);
    fails(&["a.exr", "none.exr"], &["none.exr"]);
    part("c.exr", &["--shard", "3/3"]);
    let all = ["a.exr", "b.exr", "c.exr", "-o", "joined.exr", "--layers", "prim"];
    merge(&folder, &all).expect(3).says(&["prim"]);
}

#[test]
fn a_part_is_an_exr_file() {
    let folder = Folder::new();
    for output in ["a.png", "-", "a.npy"] {
        folder
            .run(&[&SCENE[..], &["--shard", "1/2", "-o", output]].concat())
            .expect(2)
            .says(&[output, ".exr"]);
    }
    for wrong in [&["--shard", "3/2"][..], &["--shard", "1/2", "--npy", "a"]] {
        folder.run(&[&SCENE[..], wrong].concat()).expect(2);
    }
    assert!(folder.names().is_empty());
}
