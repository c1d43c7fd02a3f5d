//! `photolith check`: the accuracy suite on a Vulkan device, for people and for CI.

use std::fmt::Write as _;
use std::io::Write as _;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context as _, anyhow, bail};
use clap::Args;
use photolith::check::{
    DeviceReport, Expectations, Report, RunOptions, SCHEMA, Verdict, junit, markdown, provoke_validation,
    run as run_suite, written_expectations,
};
use photolith::files;
use photolith::gpu::{DeviceKind, RayQueryUse};
use photolith::render::{Accel, Choice as _};
use photolith::{Context, ContextOptions, Validation};

use super::interrupt::Interrupt;
use super::numbers::{count, seconds};
use super::options::DeviceOptions;
use super::{exit, output, paths};

mod table;

/// Measure the accuracy of this renderer on a Vulkan device, case by case against oracles
///
/// Exits with 0 when every case passes, 1 when one fails (or passes although it is declared to fail), 3 without a
/// device, 4 on a validation message, 5 when the device is lost, 6 when a case takes too long. Cases that fail, are
/// skipped or are flaky as declared, or that the device does not support, are counted apart: with --strict all but
/// declared failures make it 1 too. Ctrl-C gives the running cases 15 s, reports the others as not run, and exits with
/// 130.
#[derive(Args)]
pub struct CheckArgs {
    #[command(flatten)]
    device: DeviceOptions,

    /// Run on every device that can be used
    #[arg(long, conflicts_with = "device")]
    all_devices: bool,

    /// Full sizes: 10⁸ rays where the quick size takes less, 10⁹ samples, 10⁷ triangles
    #[arg(long)]
    full: bool,

    /// Run only cases whose name contains TEXT (may be given more than once)
    #[arg(long, value_name = "TEXT")]
    filter: Vec<String>,

    /// List the cases and run none
    #[arg(long, conflicts_with_all = ["junit", "markdown", "expectations", "write_expectations", "bundle", "device", "validate"])]
    list: bool,

    /// Print one line of JSON (schema photolith-check-1) instead of the table
    #[arg(long)]
    json: bool,

    /// Write a JUnit XML report
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,

    /// Write the measured table as Markdown
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,

    /// JSON of an earlier run, say with another driver, to stand beside this one in the Markdown table (may be given
    /// more than once; runs of one driver at one size share a column)
    #[arg(long, value_name = "FILE", requires = "markdown")]
    with: Vec<PathBuf>,

    /// Cases that fail, must not be run or are flaky on a driver (TOML, see docs/ci.md); it comes before what is built in
    #[arg(long, value_name = "FILE")]
    expectations: Option<PathBuf>,

    /// How triangles are found: ray-query runs the cases through the device's ray queries
    #[arg(long, value_name = "NAME", default_value = "bvh", value_parser = ["bvh", "ray-query", "ray-query-triangles"])]
    accel: String,

    /// Write declarations (TOML) by which this run would pass
    #[arg(long, value_name = "FILE")]
    write_expectations: Option<PathBuf>,

    /// Run a case that fails so many times again; one that passes then is flaky
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    retries: u32,

    /// Cases that are flaky, skipped or not supported fail the run too
    #[arg(long)]
    strict: bool,

    /// For each case that does not pass, write a folder in DIR with what a driver's maintainers need: SPIR-V, constants, buffers,
    /// expected and actual values
    #[arg(long, value_name = "DIR")]
    bundle: Option<PathBuf>,

    /// How long a case may take; default 120, or 1800 with --full
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    timeout: Option<Duration>,

    /// Cases at a time; default: as many as there are cores on a CPU device, else 1
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    jobs: Option<NonZeroUsize>,
}

/// Runs the suite; the exit code says how it went.
pub fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let options = RunOptions {
        full: args.full,
        filter: args.filter.clone(),
        accel: Accel::named(&args.accel).unwrap_or_default(),
        timeout: args.timeout.unwrap_or(Duration::from_secs(if args.full { 1800 } else { 120 })),
        retries: args.retries,
        bundle: args.bundle.clone(),
        ..RunOptions::default()
    };
    if options.selected().is_empty() {
        bail!("no case matches {}; `photolith check --list` names them", args.filter.join(", "));
    }
    if args.list {
        output::print(&list(&options, args.json))?;
        return Ok(ExitCode::from(exit::OK));
    }
    let inputs = args.with.iter().chain(&args.expectations);
    let outputs =
        [("--junit", &args.junit), ("--markdown", &args.markdown), ("--write-expectations", &args.write_expectations)];
    paths::check_apart(inputs, outputs.into_iter().filter_map(|(option, path)| Some((option, path.as_ref()?))))?;
    // Before minutes of measuring, not after.
    for path in args.junit.iter().chain(&args.markdown).chain(&args.write_expectations) {
        files::check_writable(path)?;
    }
    if let Some(folder) = &args.bundle {
        std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    }
    let expectations = match &args.expectations {
        Some(path) => Expectations::load(path)?,
        None => Expectations::default(),
    };
    let earlier = args.with.iter().map(|path| read_report(path)).collect::<anyhow::Result<Vec<_>>>()?;

    let interrupt = Interrupt::install()?;
    let options = RunOptions { interrupted: interrupt.flag(), ..options };
    let mut table = table::Table::new(args.json);
    let mut devices = Vec::new();
    let mut wanted = wanted_devices(args)?.into_iter().take_while(|_| !interrupt.requested());
    let checked = wanted.try_for_each(|device| {
        devices.push(check_device(device, args, &options, &expectations, &mut table)?);
        Ok(())
    });
    let report = Report::new(devices);
    // What was measured is not lost by a device that could not be.
    let written = if report.devices.is_empty() { Ok(()) } else { write(args, &report, &earlier, table) };
    match checked {
        Ok(()) => exit::with(code(&report, args.strict, &interrupt), written),
        Err(error) => exit::with(exit::code_of(&error), written).and(Err(error)),
    }
}

/// Writes what was asked for, each whatever becomes of the others; the first error counts.
fn write(args: &CheckArgs, report: &Report, earlier: &[Report], table: table::Table) -> anyhow::Result<()> {
    let to_file = |path: &Option<PathBuf>, text: &dyn Fn() -> String| -> anyhow::Result<()> {
        let Some(path) = path else { return Ok(()) };
        Ok(files::write_whole(path, |out| out.write_all(text().as_bytes()))?)
    };
    let json = || match args.json {
        true => output::print(&format!("{}\n", serde_json::to_string(report)?)),
        false => Ok(()),
    };
    let side_by_side = || markdown(&earlier.iter().chain([report]).cloned().collect::<Vec<_>>());
    let results = [
        table.finish(),
        json(),
        to_file(&args.junit, &|| junit(report)),
        to_file(&args.markdown, &side_by_side),
        to_file(&args.write_expectations, &|| written_expectations(report)),
    ];
    results.into_iter().collect()
}

/// Devices to open, by index or as the user named them.
fn wanted_devices(args: &CheckArgs) -> anyhow::Result<Vec<Option<String>>> {
    if !args.all_devices {
        return Ok(vec![args.device.device.clone()]);
    }
    let (devices, choice) = Context::devices(None)?;
    // None that can be used is an error, and it says why.
    choice?;
    let (usable, unusable): (Vec<_>, Vec<_>) = devices.into_iter().partition(|d| d.missing.is_empty());
    for device in unusable {
        log::warn!("device {} ({}) is left out: it lacks {}", device.index, device.name, device.missing.join(", "));
    }
    Ok(usable.into_iter().map(|d| Some(d.index.to_string())).collect())
}

fn check_device(
    device: Option<String>,
    args: &CheckArgs,
    options: &RunOptions,
    expectations: &Expectations,
    table: &mut table::Table,
) -> anyhow::Result<DeviceReport> {
    let validation = args.device.validation();
    let capture = args.bundle.is_some();
    let opened =
        ContextOptions { device, validation, capture, ray_query: RayQueryUse::Always, ..ContextOptions::default() };
    let context = Context::new(&opened)?;
    if validation != Validation::Off && provoke_validation(&context)?.is_empty() {
        // Silence would prove nothing.
        return Err(anyhow!("the validation layer did not report a deliberate violation")).context(exit::Deaf);
    }
    if options.accel.needs_ray_queries() {
        context.check_ray_queries()?;
    }
    table.device(&context, options.selected().len());
    // A case uses one core for the most part: drivers compile and oracles compute on the thread that asks.
    let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let by_kind = || if context.info().kind == DeviceKind::Cpu { cores() } else { NonZeroUsize::MIN };
    let options = RunOptions { jobs: args.jobs.unwrap_or_else(by_kind), ..options.clone() };
    let expectations = expectations.clone().or(Expectations::built_in(context.info().driver_id)?);
    let report = run_suite(&context, &options, &expectations, |case| table.case(case))?;
    table.end(&report);
    Ok(report)
}

/// A line for each case.
fn list(options: &RunOptions, json: bool) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    for case in options.selected() {
        if json {
            let line = serde_json::json!({
                "name": case.name, "what": case.what, "oracle": case.oracle, "quantity": case.quantity,
                "threshold": case.threshold, "full_only": case.full_only,
            });
            let _ = writeln!(out, "{line}");
        } else {
            let _ = writeln!(
                out,
                "{:<28} {}; {}: {} at most {:e}",
                case.name, case.what, case.oracle, case.quantity, case.threshold
            );
        }
    }
    out
}

fn read_report(path: &Path) -> anyhow::Result<Report> {
    let text = files::read_regular(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let not_a_report = || format!("{}: not a report, expected the JSON of `photolith check --json`", path.display());
    let report: Report = serde_json::from_slice(&text).with_context(not_a_report)?;
    if report.schema != SCHEMA {
        bail!("{}: schema {}, expected {SCHEMA}", path.display(), report.schema);
    }
    Ok(report)
}

/// The gravest finding decides; whether cases pass is not known after an interruption.
fn code(report: &Report, strict: bool, interrupt: &Interrupt) -> u8 {
    let all_count = |d: &DeviceReport| {
        !strict || d.cases.iter().all(|c| matches!(c.verdict, Verdict::Pass | Verdict::ExpectedFail))
    };
    let any = |verdict| report.devices.iter().any(|d| d.count(verdict) > 0);
    if any(Verdict::DeviceLost) {
        exit::DEVICE_LOST
    } else if any(Verdict::Timeout) {
        exit::TIMEOUT
    } else if any(Verdict::Validation) {
        exit::VALIDATION
    } else if interrupt.requested() {
        exit::INTERRUPTED
    } else if report.devices.iter().all(|d| d.passes() && all_count(d)) {
        exit::OK
    } else {
        exit::WRONG_IMAGE
    }
}
