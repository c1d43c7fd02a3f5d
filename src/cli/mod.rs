//! Subcommands: parse, call the library, print. Data goes to stdout, everything else to stderr.

mod aov;
mod bench;
mod check;
mod checkpoint;
mod compare;
mod develop_options;
mod devices;
mod exit;
mod heading;
mod image_output;
mod info;
mod input;
mod interrupt;
mod numbers;
mod options;
mod output;
mod paths;
mod progress;
mod render;
mod render_report;
mod setting_options;
mod signals;
mod source_options;
mod text;
mod view_options;

use std::io::Write as _;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// A headless Vulkan path tracer.
///
/// Renders scene files (TOML) and OBJ meshes with GLSL compute shaders on any Vulkan 1.2 device, a CPU driver such as
/// lavapipe included.
#[derive(Parser)]
#[command(name = "photolith", version, max_term_width = 100, after_help = exit::HELP)]
struct Cli {
    /// Say more about what is done (-v: notes, -vv: details)
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,

    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene to an image
    Render(render::RenderArgs),
    /// List the Vulkan devices, which one would be used, and what the others lack
    Devices(devices::DevicesArgs),
    /// Describe a scene: counts, bounds, BVH, and the features its pipeline is specialised for
    Info(info::InfoArgs),
    /// Compare an image with a reference: error metrics, bias, statistical test
    Compare(compare::CompareArgs),
    /// Measure run time against error, or cost against size
    Bench(bench::BenchArgs),
    /// Measure accuracy on a Vulkan device, case by case against oracles
    Check(check::CheckArgs),
}

/// Runs the command line; returns the exit code (see [`exit::HELP`]).
pub fn main() -> ExitCode {
    let result = match Cli::try_parse() {
        Ok(cli) => run(cli),
        Err(error) if error.use_stderr() => {
            // Where that cannot be written, nobody can be told.
            let _ = if std::env::args_os().any(|argument| argument.to_string_lossy().contains(char::is_control)) {
                // The message quotes it.
                write!(std::io::stderr(), "{}", text::printable(&error.render().to_string(), &['\n']))
            } else {
                error.print()
            };
            return ExitCode::from(exit::BAD_INPUT);
        }
        // Help and version are not errors.
        Err(help) => output::written(help.print()).map(|()| ExitCode::from(exit::OK)),
    };
    match result {
        Ok(code) => code,
        Err(error) => {
            output::tell(&format!("{error:#}"));
            ExitCode::from(exit::code_of(&error))
        }
    }
}

fn run(cli: Cli) -> anyhow::Result<ExitCode> {
    let level = match cli.verbose {
        0 => log::LevelFilter::Warn,
        1 => log::LevelFilter::Info,
        _ => log::LevelFilter::Debug,
    };
    env_logger::Builder::new()
        .filter_module("photolith", level)
        .parse_default_env()
        .format(|out, record| {
            let style = out.default_level_style(record.level());
            let message = record.args().to_string();
            writeln!(out, "[{style}{:<5}{style:#}] {}", record.level(), text::printable(&message, &[]))
        })
        .init();
    signals::fail_at_the_size_limit_of_files();
    // SAFETY: no other thread has been started.
    unsafe { photolith::gpu::separate_caches_by_width() };
    match cli.command {
        Command::Render(args) => render::run(&args),
        Command::Devices(args) => devices::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Check(args) => check::run(&args),
    }
}
