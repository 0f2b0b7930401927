//! `render` on a GPU, through the cube, and without a driver.

use std::process::Command;

use crate::support::{Folder, Run};

const SMALL: [&str; 5] = ["render", "--builtin", "teapot-mirror", "--resolution", "64x48"];

fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL, more].concat()
}

/// Runs it where no driver is found.
fn without_driver(mut command: Command) -> Run {
    command
        .env("VK_DRIVER_FILES", "/nowhere.json")
        .env("VK_ICD_FILENAMES", "/nowhere.json");
    Run::from(command.output().expect("the program runs"))
}

#[test]
fn pictures_do_not_depend_on_what_answers_their_rays() {
    let folder = Folder::new();
    folder.run(&small(&["-o", "hierarchy.png"])).expect(0);
    folder
        .run(&small(&["--secondary", "cube", "-o", "cube.png"]))
        .expect(0);
    folder.run(&["compare", "hierarchy.png", "cube.png"]).expect(0);
    let doctor = folder.run(&["doctor", "--json"]).expect(0).json();
    let on_gpu = folder.run(&small(&["--gpu", "--gpu-shading", "cpu", "-o", "gpu.png"]));
    if let Some(name) = doctor["gpu"]["used"].as_str() {
        let told = on_gpu.expect(0).stderr;
        assert!(
            told.contains(name) && told.contains("answered on the CPU") && told.contains("shaded on the CPU"),
            "{told}"
        );
        folder.run(&["compare", "hierarchy.png", "gpu.png"]).expect(0);
    } else {
        on_gpu.expect(1).says(&["no GPU"]);
    }
}

#[test]
fn frames_are_shaded_on_the_device_and_say_so() {
    let folder = Folder::new();
    folder.run(&small(&["-o", "cpu.png"])).expect(0);
    let on_gpu = folder.run(&small(&["--gpu", "--json", "-o", "gpu.png"]));
    let doctor = folder.run(&["doctor", "--json"]).expect(0).json();
    if doctor["gpu"]["used"].is_null() {
        on_gpu.expect(1).says(&["no GPU"]);
        return;
    }
    let told = on_gpu.expect(0);
    assert!(told.stderr.contains("surfaces shaded"), "{}", told.stderr);
    let gpu = &told.json()["gpu"];
    assert_eq!(
        (&gpu["shading"], &gpu["adapter"]),
        (&"device".into(), &doctor["gpu"]["used"])
    );
    assert!(gpu["shading_problem"].is_null());
    let number = |field: &str| gpu[field].as_u64().unwrap_or(0);
    assert!(
        number("surfaces") > 1000 && number("beams") > 1000 && number("rays") > 1000,
        "{gpu}"
    );
    folder
        .run(&["compare", "cpu.png", "gpu.png", "--tolerance", "0.001"])
        .expect(0);
    let on_cpu = folder.run(&small(&["--json", "-o", "cpu.png"])).expect(0).json();
    assert!(on_cpu["gpu"].is_null());
}

#[test]
fn frames_of_animations_tell_what_the_device_did_up_to_them() {
    let folder = Folder::new();
    let walker = [
        "animate",
        "--builtin",
        "walker",
        "--resolution",
        "24x16",
        "--json",
    ];
    let frames = ["--rate", "4", "--frames", "0..2", "-o", "f#.png"];
    let lines = |more: &[&str]| -> Vec<serde_json::Value> {
        let run = folder.run(&[&walker[..], &frames, more].concat()).expect(0);
        let lines = std::str::from_utf8(&run.stdout).expect("text").lines();
        lines
            .map(|line| serde_json::from_str(line).expect("an object a line"))
            .collect()
    };
    assert!(lines(&[]).iter().all(|frame| frame["gpu"].is_null()));
    let doctor = folder.run(&["doctor", "--json"]).expect(0).json();
    if doctor["gpu"]["used"].is_null() {
        return;
    }
    let on_gpu = lines(&["--gpu"]);
    let rays: Vec<_> = on_gpu.iter().map(|frame| frame["gpu"]["rays"].as_u64()).collect();
    let [Some(first), Some(second)] = rays[..] else {
        panic!("{rays:?}")
    };
    assert!(first > 0 && second > first, "{first} {second}");
    assert_eq!(on_gpu[0]["gpu"]["adapter"], doctor["gpu"]["used"]);
}

#[test]
fn a_missing_gpu_is_an_error_or_said() {
    let folder = Folder::new();
    if cfg!(target_os = "linux") {
        without_driver(folder.command(&small(&["--gpu", "-o", "a.png"])))
            .expect(1)
            .says(&["no GPU"]);
        let auto = without_driver(folder.command(&small(&["--gpu=auto", "-o", "a.png"])));
        let told = auto.expect(0).stderr;
        assert!(told.contains("on the CPU: no GPU"), "{told}");
    }
    folder
        .run(&small(&["--gpu", "--secondary", "cube", "-o", "a.png"]))
        .expect(2);
    folder
        .run(&small(&["--gpu-shading", "cpu", "-o", "a.png"]))
        .expect(2);
}
