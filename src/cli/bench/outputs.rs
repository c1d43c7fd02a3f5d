//! What a benchmark writes: checked before it measures, and each whatever becomes of the others.

use std::io::Write as _;
use std::path::Path;

use anyhow::Result;
use photolith::bench::plot;
use photolith::bench::plot::Figure;
use photolith::bench::rays::{self, RaySet};
use photolith::bench::report::Report;
use photolith::files::{check_writable, write_whole};
use photolith::scene::Scene;

use super::{BenchArgs, document};
use crate::cli::{output, paths};

/// Checks that all that was asked for can be written, before an hour of measuring.
///
/// # Errors
/// Something cannot.
pub fn check(args: &BenchArgs) -> Result<()> {
    let outputs = [
        ("--csv", &args.csv),
        ("--plot", &args.plot),
        ("--markdown", &args.markdown),
        ("--dump-rays", &args.dump_rays),
    ];
    let outputs = outputs.into_iter().filter_map(|(option, path)| Some((option, path.as_ref()?)));
    paths::check_apart(args.scenes.iter().chain(&args.reference.reference), outputs)?;
    for path in args.csv.iter().chain(&args.dump_rays) {
        check_writable(path)?;
    }
    if let Some(path) = &args.plot {
        plot::check_path(path)?;
    }
    if let Some(path) = &args.markdown {
        document::check(path, &args.section)?;
    }
    Ok(())
}

/// Prints and writes all that was asked for. `traced`: the rays that may be dumped, with their scene. A plot without a point
/// is left out with a warning.
///
/// # Errors
/// That of the first that cannot be written, when all have been tried.
pub fn write(args: &BenchArgs, report: &Report, traced: Option<(&Scene, &[RaySet])>) -> Result<()> {
    let plot = args.plot.as_deref().and_then(|path| Some((path, figure(path, report)?)));
    let drawn = plot.as_ref().map(|(path, _)| *path);
    let results = [
        print(args, report),
        with(args.csv.as_deref(), |path| Ok(write_whole(path, |out| out.write_all(report.csv().as_bytes()))?)),
        with(plot.as_ref(), |(path, figure)| Ok(figure.write(path)?)),
        with(args.markdown.as_deref(), |path| document::write_section(path, &args.section, &report.text(true), drawn)),
        with(args.dump_rays.as_deref().zip(traced), |(path, (scene, sets))| Ok(rays::dump(path, scene, sets)?)),
    ];
    results.into_iter().collect()
}

fn figure(path: &Path, report: &Report) -> Option<Figure> {
    let figure = report.figure();
    if figure.is_none() {
        log::warn!("{} is not written: there is no point to draw", path.display());
    }
    figure
}

fn print(args: &BenchArgs, report: &Report) -> Result<()> {
    let text = if args.json { format!("{}\n", serde_json::to_string(report)?) } else { report.text(false) };
    output::print(&text)
}

/// Does nothing for what was not asked for.
fn with<T>(asked: Option<T>, write: impl FnOnce(T) -> Result<()>) -> Result<()> {
    asked.map_or(Ok(()), write)
}
