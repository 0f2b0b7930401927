//! Signals: the code of each, promptly, and nothing left behind.

use std::process::{Child, Command};
use std::time::{Duration, Instant};

use crate::support::Folder;

/// Waits until something holds of the process.
fn wait_until(what: &str, holds: impl Fn() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < Duration::from_secs(60), "waited for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Whether a set of signals in a process's status has this one.
fn has(process: &str, set: &str, signal: i32) -> bool {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let mask = text.lines().find_map(|line| line.strip_prefix(set));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask & (1 << (signal - 1)) != 0)
}

/// Whether the process catches this signal by now.
fn catches(child: &Child, signal: i32) -> bool {
    has(&child.id().to_string(), "SigCgt:", signal)
}

/// Those signals that were not ignored by whoever started the tests, and so by the program too: shells ignore an
/// interrupt of what they run in the background.
fn heeded<const N: usize>(signals: [(&'static str, i32); N]) -> impl Iterator<Item = (&'static str, i32)> {
    signals
        .into_iter()
        .filter(|(_, number)| !has("self", "SigIgn:", *number))
}

fn send(child: &Child, signal: &str) {
    let sent = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(sent.is_ok_and(|status| status.success()));
}

#[test]
fn a_signal_while_rendering_leaves_nothing_behind() {
    for (signal, number) in heeded([("-INT", 2), ("-TERM", 15)]) {
        let folder = Folder::new();
        let arguments = ["render", "--builtin", "forest", "--resolution", "8000x8000", "-q"];
        let mut child = folder.command(&arguments).spawn().expect("the program runs");
        wait_until("a handler", || catches(&child, number));
        std::thread::sleep(Duration::from_millis(50));
        send(&child, signal);
        let code = child.wait().expect("the program ends").code();
        assert_eq!(code, Some(128 + number), "{signal}");
        assert!(folder.names().is_empty(), "{signal}: {:?}", folder.names());
    }
}

#[test]
fn a_signal_while_writing_does_not_wait_for_the_file() {
    for (signal, number) in heeded([("-INT", 2), ("-TERM", 15), ("-HUP", 1)]) {
        let folder = Folder::new();
        let scene = ["render", "--builtin", "blob-1k", "--no-shadows", "-q"];
        let picture = ["--resolution", "3000x2000", "--layers", "depth", "-o", "a.exr"];
        let mut child = folder
            .command(&[&scene[..], &picture].concat())
            .spawn()
            .expect("the program runs");
        wait_until("a file that is being written", || !folder.names().is_empty());
        send(&child, signal);
        let code = child.wait().expect("the program ends").code();
        assert_eq!(code, Some(128 + number), "{signal}");
        assert!(folder.names().is_empty(), "{signal}: {:?}", folder.names());
    }
}

/// Killed without a chance to clean up: what is in place is whole, and a resumed run makes the rest.
#[test]
fn frames_survive_a_kill() {
    let (whole, killed) = (Folder::new(), Folder::new());
    let frames = [
        "animate",
        "--builtin",
        "walker",
        "--resolution",
        "96x64",
        "-q",
        "--frames",
        "0..12",
    ];
    whole.run(&frames).expect(0);
    let names = whole.names();
    assert_eq!(names.len(), 12);
    let resumed = [&frames[..], &["--resume"]].concat();
    let in_place = || {
        killed
            .names()
            .into_iter()
            .filter(|name| !name.starts_with('.'))
            .collect::<Vec<_>>()
    };
    for frames in [1, 4, 7] {
        let mut child = killed.command(&resumed).spawn().expect("the program runs");
        wait_until("some frames", || in_place().len() >= frames);
        // At no moment in particular.
        std::thread::sleep(Duration::from_millis(frames as u64));
        child.kill().expect("it runs");
        child.wait().expect("it has ended");
        for name in in_place() {
            let [now, then] =
                [&killed, &whole].map(|folder| std::fs::read(folder.path(&name)).expect("a frame"));
            assert!(now == then, "{name}");
        }
    }
    killed.run(&resumed).expect(0);
    assert_eq!(killed.names(), names, "nothing else is left");
    for name in names {
        let [now, then] = [&killed, &whole].map(|folder| std::fs::read(folder.path(&name)).expect("a frame"));
        assert!(now == then, "{name}");
    }
}

/// Killed while it writes: what is left unfinished is removed by the run that goes on, and nothing else.
#[test]
fn a_resumed_run_removes_what_a_kill_left() {
    let folder = Folder::new();
    let scene = [
        "animate",
        "--builtin",
        "blob-1k",
        "--no-shadows",
        "-q",
        "--resume",
    ];
    let large = ["--resolution", "3000x2000", "--frames", "0..9", "-o", "f#.exr"];
    let small = ["--resolution", "24x16", "--frames", "0..9", "-o", "f#.exr"];
    folder.file(".rayward-notes.exr", "of somebody else");
    let unfinished = || {
        let names = folder.names().into_iter();
        names.filter(|name| name.starts_with(".rayward-") && name != ".rayward-notes.exr")
    };
    // One that has just got its place by the time of the kill leaves nothing; then the next will.
    for _ in 0..9 {
        let command = &mut folder.command(&[&scene[..], &large].concat());
        let mut child = command.spawn().expect("the program runs");
        let written = |name: String| std::fs::metadata(folder.path(&name)).is_ok_and(|file| file.len() > 0);
        wait_until("a file that is being written", || unfinished().any(written));
        child.kill().expect("it runs");
        child.wait().expect("it has ended");
        if unfinished().next().is_some() {
            break;
        }
    }
    assert_eq!(unfinished().count(), 1);
    folder.run(&[&scene[..], &small].concat()).expect(0);
    let frames = (0..9).map(|frame| format!("f{frame}.exr"));
    let expected: Vec<_> = std::iter::once(".rayward-notes.exr".into())
        .chain(frames)
        .collect();
    assert_eq!(folder.names(), expected);
}

#[test]
fn memory_does_not_grow_from_frame_to_frame() {
    let folder = Folder::new();
    let frames = [
        "animate",
        "--builtin",
        "walker",
        "--resolution",
        "64x48",
        "-q",
        "--frames",
        "0..60",
    ];
    let run = folder
        .run(&[&frames[..], &["--json", "--threads", "2"]].concat())
        .expect(0);
    let peaks: Vec<u64> = std::str::from_utf8(&run.stdout)
        .expect("text")
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).expect("an object a line"))
        .map(|frame| frame["peak_memory_bytes"].as_u64().expect("a number"))
        .collect();
    // What the first frames leave behind is reused by the rest.
    let (early, last) = (peaks[20], peaks[59]);
    assert!(last < early + (1 << 20), "{early} bytes, then {last}");
}

#[test]
fn a_signal_that_the_caller_ignores_stays_ignored() {
    let folder = Folder::new();
    let program = env!("CARGO_BIN_EXE_rayward");
    let script = format!("trap '' HUP; exec {program} render --builtin forest --resolution 8000x8000 -q");
    let mut shell = Command::new("sh");
    let mut child = shell
        .args(["-c", &script])
        .current_dir(folder.path("."))
        .spawn()
        .expect("a shell");
    wait_until("a handler", || catches(&child, 15));
    assert!(!catches(&child, 1));
    send(&child, "-HUP");
    send(&child, "-TERM");
    assert_eq!(child.wait().expect("the program ends").code(), Some(143));
}
