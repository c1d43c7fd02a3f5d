//! The `photolith` command.

use std::process::ExitCode;

use clap::Parser;

mod cli {
    pub mod compare;
}

#[derive(Parser)]
#[command(version)]
enum Command {
    Compare(cli::compare::CompareArgs),
}

fn main() -> ExitCode {
    let Command::Compare(args) = Command::parse();
    cli::compare::run(&args).unwrap_or_else(|error| {
        eprintln!("photolith: {error:#}");
        ExitCode::from(2)
    })
}
