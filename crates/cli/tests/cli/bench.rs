//! `rayward bench` at tiny sizes: counts, pictures and the form of the reports. No time is looked at.

use crate::support::{Folder, Run};

const TINY: [&str; 4] = ["--resolution", "96x60", "--runs", "1"];

/// Ray tracers of others that are always there.
const LIBRARIES: [&str; 3] = ["obvhs, wide", "obvhs, binary", "crate bvh"];

#[test]
fn frames_of_all_contenders_agree() {
    let folder = Folder::new();
    let arguments = [
        &["bench", "frames", "blob-1k", "courtyard", "--json", "-q"][..],
        &TINY,
    ]
    .concat();
    let run = folder
        .run(&[&arguments[..], &["--pictures", "pictures"]].concat())
        .expect(0);
    let report = run.json();
    assert_eq!(report["width"], 96);
    assert!(report["machine"]["threads"] == 1 && report["machine"]["simd"].is_string());
    let frames = report["frames"].as_array().expect("frames");
    let kinds: Vec<_> = frames
        .iter()
        .map(|f| (f["scene"].as_str(), f["frame"].as_str()))
        .collect();
    let (blob, court) = (Some("blob-1k"), Some("courtyard"));
    let (eye, hard, soft) = (Some("eye"), Some("eye+hard"), Some("eye+soft8"));
    let wanted = [blob, court].map(|scene| [eye, hard, soft].map(|frame| (scene, frame)));
    assert_eq!(kinds, wanted.concat());
    let mut pictures = 0;
    for frame in frames {
        assert_eq!(frame["eye_rays"], 96 * 60);
        let shadow_rays = frame["shadow_rays"].as_u64().expect("a number");
        assert_eq!(shadow_rays > 0, frame["frame"] != "eye");
        let rows = frame["rows"].as_array().expect("rows");
        // Rayward, obvhs with two trees, and bvh; Embree only where it is installed.
        let names: Vec<_> = rows.iter().filter_map(|row| row["contender"].as_str()).collect();
        assert_eq!(names[0], "rayward");
        for library in LIBRARIES {
            assert!(names.contains(&library), "{library} in {names:?}");
        }
        pictures += rows.len();
        for row in rows {
            assert_eq!(row["same_picture"], true, "{row}");
            assert!(row["times"]["cpu_ms"]["median"].is_number(), "{row}");
            assert_eq!(row["kept_build_ms"].is_null(), row["ours"] == true, "{row}");
        }
        assert!(frame["ratio"].is_number());
    }
    let written = std::fs::read_dir(folder.path("pictures"))
        .expect("a folder")
        .count();
    assert_eq!(written, pictures);
}

#[test]
fn frames_have_a_table_and_rows() {
    let folder = Folder::new();
    let base = [
        &["bench", "frames", "blob-1k", "--no-peers", "--frames", "eye"][..],
        &TINY,
    ]
    .concat();
    let run = folder.run(&base).expect(0);
    let text = String::from_utf8(run.stdout).expect("text");
    assert!(
        text.contains("blob-1k, 980 triangles, eye: 5760 eye rays, 0 shadow rays"),
        "{text}"
    );
    assert!(run.stderr.contains("blob-1k"), "progress");
    let run = folder.run(&[&base[..], &["--csv", "-q"]].concat()).expect(0);
    let csv = String::from_utf8(run.stdout).expect("text");
    let lines: Vec<_> = csv.lines().collect();
    assert_eq!(lines.len(), 2, "{csv}");
    assert!(
        lines[0].starts_with("scene,triangles,frame")
            && lines[1].starts_with("blob-1k,980,eye,rayward,1,5760,0")
    );
    assert!(run.stderr.is_empty(), "{}", run.stderr);
}

#[test]
fn scaling_and_builds_count_what_they_measure() {
    let folder = Folder::new();
    let arguments = [
        "bench",
        "scaling",
        "--quick",
        "--threads",
        "2",
        "--runs",
        "1",
        "--json",
        "-q",
    ];
    let report = folder.run(&arguments).expect(0).json();
    let curves = report["curves"].as_array().expect("curves");
    let parameters: Vec<_> = curves.iter().filter_map(|c| c["parameter"].as_str()).collect();
    assert_eq!(
        parameters,
        [
            "triangles",
            "pixels",
            "triangles",
            "pixels",
            "triangles",
            "pixels",
            "lights",
            "samples",
            "light size",
            "depth complexity",
            "depth complexity",
            "threads",
            "distance of origins",
            "distance of origins",
            "distance of origins",
        ]
    );
    let points = |i: usize| curves[i]["points"].as_array().expect("points");
    assert_eq!(points(0)[1]["triangles"], 9680);
    assert_eq!(points(0)[1]["rays"], 96 * 60);
    assert_eq!(points(1)[0]["rays"], 64 * 40);
    let rays = |point: usize| points(6)[point]["rays"].as_u64().expect("a number") - 96 * 60;
    assert!(rays(0) > 0 && rays(1) > rays(0), "shadow rays for each light");
    let rays = |point: usize| points(7)[point]["rays"].as_u64().expect("a number") - 96 * 60;
    assert_eq!(rays(1), 16 * rays(0));
    assert_eq!(points(11).len(), 2);
    assert_eq!(points(9)[1]["triangles"], 3 * 9680);
    let seen = |point: usize| points(10)[point]["rays"].as_u64().expect("a number");
    assert_eq!(seen(0), seen(1), "blobs behind the first send no shadow rays");
    for structure in 12..15 {
        let cells = |point: usize| points(structure)[point]["steps"][0].as_f64().expect("cells");
        assert!(cells(0) > 1.0 && cells(1) > 1.0, "{structure}");
    }

    let arguments = [&["bench", "build", "blob-4k", "--json", "-q"][..], &TINY].concat();
    let report = folder.run(&arguments).expect(0).json();
    let scene = &report["scenes"][0];
    assert_eq!(
        (&scene["scene"], &scene["triangles"]),
        (&"blob-4k".into(), &3920.into())
    );
    assert!(scene["references"].as_u64().is_some_and(|n| n > 1000));
    for piece in ["eye_grid", "binning", "shadows", "frame"] {
        assert!(scene[piece]["speed_up"].is_number(), "{piece}");
    }
}

#[test]
fn tables_have_all_rows_of_the_paper() {
    let folder = Folder::new();
    let arguments = [
        &[
            "bench",
            "tables",
            "--json",
            "-q",
            "--threads",
            "2",
            "--cubes",
            "32,64",
        ][..],
        &TINY,
    ]
    .concat();
    let output = folder.command(&arguments).env_remove("RAYWARD_SCENES").output();
    let report = Run::from(output.expect("the program runs")).expect(0).json();
    let lines = |name: &str| report[name].as_array().expect("lines").clone();
    assert_eq!(lines("frames").len(), 9 * 3);
    for line in lines("frames") {
        assert!(line["fps"].as_f64().is_some_and(|fps| fps > 0.0), "{line}");
        assert_eq!(
            line["untested"].is_number(),
            line["frame"] == "eye+hard",
            "{line}"
        );
    }
    assert_eq!(lines("peers").len(), 6);
    for line in lines("peers") {
        assert!(
            line["grid_fps"].is_number() && line["prebuilt_fps"].is_number(),
            "{line}"
        );
    }
    let covered = report["raster"]["covered"].as_f64().expect("a share");
    assert!((0.04..0.06).contains(&covered), "{covered}");
    assert_eq!(report["steps"]["same_answers"], true);
    assert_eq!(lines("claims").len(), 12);
    assert_eq!(lines("cubes").len(), 5 * 2);
    for line in lines("cubes") {
        assert_eq!(line["exact_wrong"], 0.0, "{line}");
        assert!(line["rays"].as_u64().is_some_and(|rays| rays > 100), "{line}");
    }
    assert_eq!(lines("cube_claims").len(), 6);
}

#[test]
fn without_an_improvement_the_picture_is_the_same() {
    let folder = Folder::new();
    let arguments = [&["bench", "ablation", "courtyard", "--json", "-q"][..], &TINY].concat();
    let report = folder.run(&arguments).expect(0).json();
    let frames = report["frames"].as_array().expect("frames");
    assert_eq!(frames.len(), 3);
    for frame in frames {
        let rows = frame["rows"].as_array().expect("rows");
        assert!(
            rows.len() >= 3 && rows[0]["contender"] == "all improvements",
            "{frame}"
        );
        for row in rows {
            assert_eq!(row["differing_pixels"], 0, "{row}");
            assert!(
                row["over_rayward"].as_f64().is_some_and(|ratio| ratio > 0.0),
                "{row}"
            );
        }
    }
}

#[test]
fn structures_answer_all_rays_alike() {
    let folder = Folder::new();
    let base = [
        "bench",
        "structures",
        "blob-1k",
        "--number",
        "600",
        "--cube",
        "32",
        "--runs",
        "1",
        "-q",
    ];
    let report = folder.run(&[&base[..], &["--json"]].concat()).expect(0).json();
    let scene = &report["scenes"][0];
    let classes = scene["classes"].as_array().expect("classes");
    let names: Vec<_> = classes.iter().filter_map(|c| c["class"].as_str()).collect();
    assert_eq!(names, ["eye", "hard", "soft", "reflection", "random", "through"]);
    for class in classes {
        let rows = class["rows"].as_array().expect("rows");
        let who: Vec<_> = rows.iter().filter_map(|row| row["structure"].as_str()).collect();
        assert!(
            who[0] == "bvh" && who.contains(&"regular grid") && who.contains(&"cube"),
            "{who:?}"
        );
        let own = match class["class"].as_str() {
            Some("eye") => "eye grid",
            Some("hard") => "lit pixels",
            Some("soft") => "area tree",
            _ => "perspective grids, eye",
        };
        assert!(who.contains(&own), "{who:?}");
        for row in rows {
            let by_design = row["structure"] == "cube, planes of samples";
            let of_others = row["structure"]
                .as_str()
                .is_some_and(|name| LIBRARIES.contains(&name));
            assert!(by_design || of_others || row["differing"] == 0, "{row}");
            assert!(
                row["hits"].as_u64() > Some(0) && row["ns_per_ray"].is_number(),
                "{row}"
            );
        }
    }
    let csv = folder
        .run(&[&base[..], &["--csv", "--rays", "random"]].concat())
        .expect(0);
    let csv = String::from_utf8(csv.stdout).expect("text");
    assert!(csv.starts_with("scene,triangles,class,structure") && csv.contains("\nblob-1k,980,random,bvh,"));
}

#[test]
fn a_report_is_a_page_that_needs_nothing_beside_it() {
    let folder = Folder::new();
    let arguments = [
        "bench",
        "all",
        "--quick",
        "--runs",
        "1",
        "--threads",
        "1",
        "-q",
        "--report",
        "out",
    ];
    let run = folder
        .command(&arguments)
        .env_remove("RAYWARD_SCENES")
        .output()
        .expect("the program runs");
    let run = Run::from(run).expect(0);
    let text = String::from_utf8(run.stdout).expect("text");
    assert!(text.contains("What falls short"), "{text}");
    let read = |name: &str| std::fs::read_to_string(folder.path("out").join(name)).expect("a file");
    let page = read("index.html");
    let first = page.find("What falls short").expect("a section");
    assert!(first < page.find("HM08, Table 1").expect("a section"));
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,") && page.ends_with("</html>"));
    let outside = ["src=\"http", "href=\"http", "<script", "<link"];
    assert!(outside.iter().all(|mark| !page.contains(mark)));
    let markdown = read("report.md");
    let shown = markdown
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'));
    let mut files = 0;
    for (file, _) in shown {
        assert!(folder.path("out").join(file).is_file(), "{file}");
        files += 1;
    }
    assert!(files > 10, "{markdown}");
    folder.file("taken", "");
    folder
        .run(&[
            "bench",
            "build",
            "blob-1k",
            "--resolution",
            "32x20",
            "--runs",
            "1",
            "-q",
            "--report",
            "taken",
        ])
        .expect(1)
        .says(&["taken"]);
}

#[test]
fn what_cannot_be_measured_is_named() {
    let folder = Folder::new();
    folder.run(&["bench"]).expect(2);
    folder
        .run(&["bench", "frames", "castle", "-q"])
        .expect(2)
        .says(&["castle", "courtyard"]);
    folder.run(&["bench", "frames", "--runs", "0"]).expect(2);
    folder.file("broken.obj", "v 1 2\n");
    folder
        .run(&["bench", "frames", "broken.obj", "-q"])
        .expect(3)
        .says(&["broken.obj"]);
    let missing = folder
        .command(&[&["bench", "frames", "blob-1k", "-q"][..], &TINY].concat())
        .env("RAYWARD_EMBREE", "no/such/library.so")
        .output()
        .expect("the program runs");
    assert_eq!(missing.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("no/such/library.so"));
}
