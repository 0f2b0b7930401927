//! The `rayward` command: pictures from scene files, what is in them, and how pictures differ.
//!
//! Data goes to standard output, all else to standard error; nothing but this program prints. Every way to end
//! has its exit code, see [`failure::Code`].

mod animate;
mod args;
mod bench;
mod compare;
mod doctor;
mod failure;
mod gpu;
mod info;
mod input;
mod interrupt;
mod machine;
mod merge;
mod output;
mod progress;
mod render;
mod report;
mod summary;
mod values;
mod view;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use args::{Cli, Command};
use failure::{Code, Failure};

fn main() -> ExitCode {
    interrupt::install();
    let result = match Cli::try_parse() {
        Ok(cli) => run(cli.command),
        Err(error) => usage(&error),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.say();
            failure.code.into()
        }
    }
}

fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::Render(args) => render::run(&args),
        Command::Animate(args) => animate::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Doctor(args) => doctor::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "rayward", &mut script);
            report::to_stdout(&script)
        }
    }
}

/// Help and version are data; everything else the parser has to say is a usage error in this program's form.
fn usage(error: &clap::Error) -> Result<(), Failure> {
    let text = error.render().to_string();
    if !error.use_stderr() {
        return report::to_stdout(text.as_bytes());
    }
    let text = text.trim_end();
    match text.strip_prefix("error: ") {
        Some(message) => Err(Failure::lines(Code::Usage, message)),
        // Help for a command line without a command.
        None => {
            report::note(text);
            Err(Failure::silent(Code::Usage))
        }
    }
}
