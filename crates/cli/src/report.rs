//! All printing, and the forms of numbers for people.
//!
//! A reader that has gone ends the program quietly; names from files lose their control characters, so that none
//! of them can command a terminal.

use std::io::{self, ErrorKind, Write};
use std::time::Duration;

use serde::Serialize;

use crate::failure::{Code, Failure};

/// Writes data.
pub(crate) fn to_stdout(bytes: &[u8]) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    let written = stdout.write_all(bytes).and_then(|()| stdout.flush());
    written.map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Failure::silent(Code::Runtime),
        _ => Failure::new(
            Code::Runtime,
            format_args!("cannot write standard output: {error}"),
        ),
    })
}

/// Writes one JSON object and a line break.
pub(crate) fn to_stdout_json(value: &impl Serialize) -> Result<(), Failure> {
    let mut bytes = serde_json::to_vec_pretty(value)
        .map_err(|error| Failure::new(Code::Runtime, format_args!("cannot make JSON: {error}")))?;
    bytes.push(b'\n');
    to_stdout(&bytes)
}

/// Writes one JSON object in one line.
pub(crate) fn to_stdout_json_line(value: &impl Serialize) -> Result<(), Failure> {
    let mut bytes = serde_json::to_vec(value)
        .map_err(|error| Failure::new(Code::Runtime, format_args!("cannot make JSON: {error}")))?;
    bytes.push(b'\n');
    to_stdout(&bytes)
}

/// Says something to people. Nobody has to listen: a closed standard error is no error.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Text without control characters.
pub(crate) fn clean(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out
}

/// 1234567 as 1,234,567.
pub(crate) fn thousands(number: impl TryInto<u64>) -> String {
    let digits = number.try_into().unwrap_or(u64::MAX).to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// A number with its noun, in the singular where it is one.
pub(crate) fn count(number: usize, noun: &str) -> String {
    let ending = match number {
        1 => "",
        _ if noun.ends_with('h') => "es",
        _ => "s",
    };
    format!("{} {noun}{ending}", thousands(number))
}

/// Bytes in decimal units.
pub(crate) fn bytes(number: u64) -> String {
    match number {
        0..1_000 => format!("{number} B"),
        1_000..1_000_000 => format!("{:.1} kB", number as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", number as f64 / 1e6),
        _ => format!("{:.2} GB", number as f64 / 1e9),
    }
}

/// A duration with three digits or so.
pub(crate) fn duration(duration: Duration) -> String {
    let ms = milliseconds(duration);
    match ms {
        ..10.0 => format!("{ms:.2} ms"),
        ..1000.0 => format!("{ms:.0} ms"),
        _ => format!("{:.2} s", ms / 1e3),
    }
}

/// A duration in milliseconds.
pub(crate) fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people() {
        assert_eq!(thousands(0_u64), "0");
        assert_eq!(thousands(999_u64), "999");
        assert_eq!(thousands(1_234_567_usize), "1,234,567");
        assert_eq!(count(1, "light"), "1 light");
        assert_eq!(count(0, "light"), "0 lights");
        assert_eq!(count(2, "mesh"), "2 meshes");
        assert_eq!(bytes(999), "999 B");
        assert_eq!(bytes(1_500_000), "1.5 MB");
        assert_eq!(duration(Duration::from_micros(1234)), "1.23 ms");
        assert_eq!(duration(Duration::from_millis(2500)), "2.50 s");
    }

    #[test]
    fn control_characters_are_shown_not_obeyed() {
        assert_eq!(clean("a\x1b[2Jb\nc\u{9b}d é"), "a\\u{1b}[2Jb\\nc\\u{9b}d é");
    }
}
