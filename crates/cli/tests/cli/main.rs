//! The program from the outside: arguments and files in, exit codes, files and text out.

mod animate;
mod bad_input;
mod bench;
mod commands;
mod environment;
mod gpu;
mod render;
mod shards;
#[cfg(target_os = "linux")]
mod signals;
mod support;
