//! `photolith compare`: measures an image against a reference, for people and for CI.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use photolith::image::heatmap::{self, Quantity};
use photolith::image::metrics::{CompareOptions, Comparison, compare, flip};
use photolith::image::{Format, Image, Metadata, check_writable, read, write};
use photolith::scene::Transfer;
use serde::Serialize;

use super::numbers::{finite, not_negative, pixels_per_degree, positive, probability};
use super::{exit, output, paths};

mod report;

/// Compare an image with a reference
///
/// Prints errors over linear radiance. Exits with 0 when all given thresholds are kept (or none is given), with 1
/// when one is exceeded or, with any threshold, a pixel is NaN or infinite, and with 2 on bad input.
#[derive(Debug, clap::Args)]
pub struct CompareArgs {
    /// Image to be judged: .png, .exr, .hdr or .pfm
    image: PathBuf,
    /// Image that counts as right
    reference: PathBuf,
    /// Print one line of JSON (schema photolith-compare-1)
    #[arg(long)]
    json: bool,
    /// Write an error map as PNG
    #[arg(long, value_name = "FILE.png")]
    heatmap: Option<PathBuf>,
    /// What the error map shows
    #[arg(long, value_enum, default_value = "difference", requires = "heatmap")]
    heatmap_of: HeatmapOf,
    /// The value at the bright end of the error map [default: the largest there is]
    #[arg(long, value_name = "X", value_parser = positive, allow_negative_numbers = true, requires = "heatmap")]
    heatmap_max: Option<f64>,
    /// List the worst pixels
    #[arg(long, value_name = "N", default_value_t = 0)]
    worst: usize,
    /// Radiance that counts as the peak signal in PSNR
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive, allow_negative_numbers = true)]
    psnr_peak: f64,
    /// Pixels per degree of visual angle, for FLIP
    #[arg(long, value_name = "X", default_value_t = flip::DEFAULT_PPD, value_parser = pixels_per_degree, allow_negative_numbers = true)]
    ppd: f64,
    /// Probability that Welch's test rejects images of equal expectation, for each of its three families
    #[arg(long, value_name = "P", default_value_t = 1e-4, value_parser = probability, allow_negative_numbers = true)]
    alpha: f64,
    #[command(flatten)]
    thresholds: Thresholds,
}

/// What must hold for exit code 0.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Thresholds")]
struct Thresholds {
    /// Root mean square error
    #[arg(long, value_name = "X", value_parser = not_negative, allow_negative_numbers = true)]
    max_rmse: Option<f64>,
    /// Mean of (x−r)²/(r²+0.01)
    #[arg(long, value_name = "X", value_parser = not_negative, allow_negative_numbers = true)]
    max_rel_mse: Option<f64>,
    /// Mean of |x−r|/(|r|+0.01)
    #[arg(long, value_name = "X", value_parser = not_negative, allow_negative_numbers = true)]
    max_mape: Option<f64>,
    /// Peak signal-to-noise ratio, dB
    #[arg(long, value_name = "X", value_parser = finite, allow_negative_numbers = true)]
    min_psnr: Option<f64>,
    /// Mean FLIP, 0 to 1
    #[arg(long, value_name = "X", value_parser = not_negative, allow_negative_numbers = true)]
    max_flip: Option<f64>,
    /// Largest absolute mean difference of a channel or the luminance, radiance
    #[arg(long, value_name = "X", value_parser = not_negative, allow_negative_numbers = true)]
    max_bias: Option<f64>,
    /// Welch's test must not reject; needs EXR images with noise estimates
    #[arg(long)]
    welch: bool,
}

/// What an error map can show.
#[derive(Debug, Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
enum HeatmapOf {
    /// Root mean square of x−r over the channels
    Difference,
    /// The same of (x−r)/(|r|+0.01)
    Relative,
    /// FLIP
    Flip,
}

/// A threshold and how it was met. The metric's name is also its label in the report.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Check {
    metric: &'static str,
    /// `None` where it is infinite (the PSNR of equal images).
    value: Option<f64>,
    limit: f64,
    pass: bool,
}

/// An error map that was written.
#[derive(Debug, Serialize)]
struct Heatmap {
    file: PathBuf,
    of: HeatmapOf,
    /// Value at the bright end.
    max: f64,
}

/// Compares, prints the report to stdout and returns the exit code, 0 or 1.
///
/// # Errors
/// Files that cannot be read or written, images of different sizes or without a finite pixel, `--welch`
/// without noise estimates: exit code 2.
pub fn run(args: &CompareArgs) -> Result<ExitCode> {
    if let Some(path) = &args.heatmap {
        if !matches!(Format::from_path(path), Ok(Format::Png)) {
            bail!("{}: an error map is written as .png", path.display());
        }
        paths::check_apart([&args.image, &args.reference], [("--heatmap", path)])?;
        check_writable(path)?;
    }
    let (image, _) = read(&args.image)?;
    let (reference, _) = read(&args.reference)?;
    let options =
        CompareOptions { psnr_peak: args.psnr_peak, flip_ppd: args.ppd, worst: args.worst, alpha: args.alpha };
    let comparison = compare(&image, &reference, &options)
        .with_context(|| format!("cannot compare {} with {}", args.image.display(), args.reference.display()))?;
    let checks = args.thresholds.check(&comparison)?;
    let heatmap = match &args.heatmap {
        Some(path) => Some(write_heatmap(path, args, &image, &reference)?),
        None => None,
    };
    let report = report::Report::new(args, &image, &comparison, checks, heatmap);
    let text = if args.json { report.json()? } else { report.table() };
    output::print(&text)?;
    Ok(ExitCode::from(if report.pass() { exit::OK } else { exit::WRONG_IMAGE }))
}

fn write_heatmap(path: &Path, args: &CompareArgs, image: &Image, reference: &Image) -> Result<Heatmap> {
    let quantity = match args.heatmap_of {
        HeatmapOf::Difference => Quantity::Difference,
        HeatmapOf::Relative => Quantity::Relative,
        HeatmapOf::Flip => Quantity::Flip,
    };
    let values = heatmap::error_map(image, reference, quantity, args.ppd)?;
    let max = args.heatmap_max.unwrap_or_else(|| values.iter().copied().fold(0.0, f64::max));
    let map = heatmap::heat_map(image.width(), image.height(), &values, max)?;
    let mut metadata = Metadata::new();
    metadata.push("Software", concat!("photolith ", env!("CARGO_PKG_VERSION")));
    metadata.push("heatmap.max", max);
    write(path, &map, &metadata, Transfer::Srgb)?;
    Ok(Heatmap { file: path.to_owned(), of: args.heatmap_of, max })
}

impl Thresholds {
    /// One check for each threshold that was given, and one of non-finite pixels if any was.
    fn check(&self, comparison: &Comparison) -> Result<Vec<Check>> {
        let at_most = |metric, value: f64, limit: Option<f64>| {
            limit.map(|limit| Check { metric, value: Some(value), limit, pass: value <= limit })
        };
        let p = &comparison.pointwise;
        let mut checks: Vec<Check> = [
            at_most("rmse", p.rmse, self.max_rmse),
            at_most("rel_mse", p.rel_mse, self.max_rel_mse),
            at_most("mape", p.mape, self.max_mape),
            self.min_psnr.map(|limit| Check {
                metric: "psnr",
                value: p.psnr,
                limit,
                pass: p.psnr.is_none_or(|psnr| psnr >= limit),
            }),
            at_most("flip", comparison.flip, self.max_flip),
            at_most("bias", comparison.bias.largest(), self.max_bias),
        ]
        .into_iter()
        .flatten()
        .collect();
        if self.welch {
            let welch = comparison.welch.as_ref().map_err(|e| anyhow::anyhow!("--welch cannot be done: {e}"))?;
            let rejected = welch.pixels.rejected + welch.tiles.rejected + welch.mean.rejected;
            checks.extend(at_most("welch", rejected as f64, Some(0.0)));
        }
        if !checks.is_empty() && comparison.non_finite.count > 0 {
            checks.extend(at_most("non_finite", comparison.non_finite.count as f64, Some(0.0)));
        }
        Ok(checks)
    }
}
