//! `photolith bench`: run time against error, and cost against size.

mod document;
mod growth;
mod outputs;
mod samples;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{anyhow, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use photolith::bench::convergence::{self, Contender, Schedule};
use photolith::bench::rays::{self, RayKind};
use photolith::bench::report::{self, ReferenceReport, Report, SceneReport};
use photolith::bench::{self, BenchError, ConfigurationSummary, Machine, Origin, Reference, Vary};
use photolith::image::metrics::flip;
use photolith::render::{Accel, Choice as _, TechniqueList};
use photolith::scene::Scene;
use photolith::{Context, RenderSettings, user_cache};

use super::interrupt::Interrupt;
use super::numbers::{pixels_per_degree, positive};
use super::options::{DeviceOptions, SceneOptions, Size, check_memory};
use super::setting_options::{SettingOptions, explain_techniques};
use super::text::printable;
use super::{exit, output};
use growth::{GrowthArg, Series};
use samples::SampleCounts;

/// Options of run time against error, which mean nothing where another thing is measured.
const OF_ERRORS: [&str; 9] =
    ["vary", "techniques", "target", "seeds", "ppd", "reference", "reference_noise", "oracle", "cache"];

/// Measure run time against error, or cost against size
///
/// Renders each scene with several seeds at doubling numbers of samples and compares with a reference, whose own
/// variance is subtracted; errors below its noise are withheld, and the exit code is then 2. Times are medians over
/// the seeds; configurations (--vary) alternate, so that a drift of the machine's speed meets all alike.
///
/// Ctrl-C ends the measuring: what is complete is written (of the running scene the seeds that are, of its rays the kinds,
/// of --growth the sizes), and the exit code is 130.
#[derive(Args)]
pub struct BenchArgs {
    /// Scene files (.toml) or meshes (.obj)
    #[arg(value_name = "SCENE", required_unless_present = "growth")]
    scenes: Vec<PathBuf>,

    /// Samples per pixel: N (1 to N, doubling), A..B (A to B, doubling), or a list; with --growth one number
    /// [default: 1..64, with --growth 4]; sampling=dual takes 2 or more, and begins there
    #[arg(long, value_name = "LIST")]
    samples: Option<SampleCounts>,

    /// Independent renderings of each
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1000), allow_negative_numbers = true)]
    seeds: u32,

    /// Image size instead of the scene's
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,

    /// Surface hits of a path instead of the scene's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65535), allow_negative_numbers = true)]
    max_depth: Option<u32>,

    #[arg(long, value_name = "LIST", allow_hyphen_values = true, help = explain_techniques())]
    techniques: Option<TechniqueList>,

    #[arg(long, value_name = "KEY=VALUE,...", help = explain_vary())]
    vary: Vec<Vary>,

    /// Also print the time to this root mean square error [default: the smallest that all configurations reach]
    #[arg(long, value_name = "RMSE", value_parser = positive, allow_negative_numbers = true)]
    target: Option<f64>,

    /// Pixels per degree of visual angle, for FLIP
    #[arg(long, value_name = "X", default_value_t = flip::DEFAULT_PPD, value_parser = pixels_per_degree, allow_negative_numbers = true)]
    ppd: f64,

    #[command(flatten)]
    reference: ReferenceOptions,

    /// Measure cost against the size of generated scenes instead
    #[arg(long, value_enum, conflicts_with_all = OF_ERRORS, conflicts_with_all = ["scenes", "size", "max_depth"])]
    growth: Option<GrowthArg>,

    /// The largest size of --growth [default: by what grows]
    #[arg(long, value_name = "N")]
    max: Option<u64>,

    /// Measure rays a second instead: camera rays, shadow rays and continuations, without shading
    #[arg(long, conflicts_with_all = OF_ERRORS, conflicts_with_all = ["growth", "samples"])]
    rays: bool,

    /// How --rays finds triangles, side by side
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', default_value = "bvh", value_parser = ["bvh", "ray-query", "ray-query-triangles"])]
    accel: Vec<String>,

    /// Write the rays of --rays with what they met, and the triangles, for other programs to trace (one scene only; the format
    /// is described at photolith::bench::rays::dump)
    #[arg(long, value_name = "FILE")]
    dump_rays: Option<PathBuf>,

    /// Use path_trace.spv, path_interleaved.spv, path_queue.spv, light_trace.spv, first_hit.spv or traverse.spv (--rays) of this folder instead
    /// of the built-in shaders
    #[arg(long, value_name = "FOLDER", conflicts_with = "growth")]
    spirv: Option<PathBuf>,

    #[command(flatten)]
    device: DeviceOptions,

    /// Print one line of JSON (schema photolith-bench-2) on stdout instead of tables
    #[arg(long)]
    json: bool,

    /// Write all rows as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Draw the results
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,

    /// Write the tables into a Markdown document, in place of its section (--section)
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,

    /// Name of the section: it stands between <!-- begin NAME --> and <!-- end NAME -->, or is added at the end
    #[arg(long, value_name = "NAME", default_value = "bench", requires = "markdown")]
    section: String,
}

/// What errors are measured against.
#[derive(Args)]
#[command(next_help_heading = "Reference")]
struct ReferenceOptions {
    /// An image that counts as right (one scene only) [default: made with independent random numbers and kept]
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,

    /// Largest noise (root mean variance) of a reference that is made, or the noise of one that is given and does not
    /// say [default: half the smallest error that will be met]
    #[arg(long, value_name = "RADIANCE", value_parser = positive, allow_negative_numbers = true)]
    reference_noise: Option<f64>,

    /// Make the reference with the double-precision oracle on the CPU (slow: no BVH)
    #[arg(long, conflicts_with = "reference")]
    oracle: bool,

    /// Where references are kept [default: photolith/references in the user's cache folder]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
}

fn explain_vary() -> String {
    format!("Set a setting, or several values of it side by side; may be repeated. Keys: {}", Vary::keys())
}

/// Measures and prints.
pub fn run(args: &BenchArgs) -> anyhow::Result<ExitCode> {
    if args.reference.reference.is_some() && args.scenes.len() > 1 {
        bail!("--reference is for one scene, found {}", args.scenes.len());
    }
    if args.dump_rays.is_some() && args.scenes.len() > 1 {
        bail!("--dump-rays is for one scene, found {}", args.scenes.len());
    }
    if args.rays && args.plot.is_some() {
        bail!("--rays has nothing to draw: expected no --plot");
    }
    // The parser does not ask for an option that could not be there beside another one (`requires`).
    if args.max.is_some() && args.growth.is_none() {
        bail!("--max is a size of what grows: expected --growth");
    }
    if args.accel != ["bvh"] && !args.rays {
        bail!("--accel is of --rays: expected --rays, or --vary accel={}", args.accel.join(","));
    }
    if args.dump_rays.is_some() && !args.rays {
        bail!("--dump-rays has no rays to write: expected --rays");
    }
    let series = Series::of(args)?;
    Vary::check(&args.vary)?;
    let samples = sample_counts(args)?;
    outputs::check(args)?;
    let interrupt = Interrupt::install()?;
    let loaded = args.scenes.iter().map(|path| load(args, path)).collect::<Result<Vec<_>, _>>()?;
    let varied = bench::combine(&RenderSettings::default(), &args.vary);
    let accels: Vec<_> = args.accel.iter().filter_map(|name| Accel::named(name)).collect();
    let all_accels: Vec<_> = accels.iter().copied().chain(varied.iter().map(|c| c.settings.accel)).collect();
    let context = Context::new(&args.device.context_options(&all_accels))?;
    let mut report = Report {
        schema: report::SCHEMA,
        machine: Machine::of(&context),
        scenes: Vec::new(),
        growth: None,
        rays: Vec::new(),
    };
    let mut traced = None;
    let measured = match series {
        Some(series) => {
            let (found, error) = series.measure(&context, &interrupt);
            report.growth = Some(found);
            error.map_or(Ok(()), |error| Err(anyhow::Error::new(error).context("the series ended early")))
        }
        None => loaded.iter().take_while(|_| !interrupt.requested()).try_for_each(|(scene, settings)| {
            if args.rays {
                for &accel in &accels {
                    let settings = &RenderSettings { accel, ..settings.clone() };
                    let (rates, sets) = rays::measure(&context, scene, settings, |_| interrupt.go_on())?;
                    report.rays.push(rates);
                    traced = Some((scene, sets)).filter(|(_, sets)| sets.len() == RayKind::ALL.len());
                }
            } else {
                report.scenes.push(measure_scene(args, &samples, scene, settings, &context, &interrupt)?);
            }
            Ok(())
        }),
    };
    // What was measured is not lost by what could not be.
    let written = match report.is_empty() {
        true => Ok(()),
        false => outputs::write(args, &report, traced.as_ref().map(|(scene, sets)| (*scene, sets.as_slice()))),
    };
    if let Err(error) = measured
        && !matches!(error.downcast_ref(), Some(BenchError::Interrupted))
    {
        return exit::with(exit::code_of(&error), written).and(Err(error));
    }
    let messages = context.messages().all();
    if !messages.is_empty() {
        output::tell(&format!("{} validation message(s); the first: {}", messages.len(), messages[0]));
        return exit::with(exit::VALIDATION, written);
    }
    if interrupt.requested() {
        output::tell(match report.is_empty() {
            true => "interrupted before anything was measured",
            false => "interrupted; what was complete is written",
        });
        return exit::with(exit::INTERRUPTED, written);
    }
    written?;
    for scene in &report.scenes {
        let withheld = scene.withheld();
        if let Some((label, samples)) = withheld.first() {
            if !scene.reference.noise_rmse.is_finite() {
                bail!(
                    "{}: {} error(s) withheld, because the noise of the reference is not finite: radiance is too large for \
                     its square in single precision",
                    scene.scene,
                    withheld.len()
                );
            }
            bail!(
                "{}: {} error(s) withheld, because they are below the noise of the reference ({:.3e}), the first of \
                 {label} at {samples} samples; lower --reference-noise, or give a better --reference",
                scene.scene,
                withheld.len(),
                scene.reference.noise_rmse
            );
        }
    }
    Ok(ExitCode::from(exit::OK))
}

/// Samples per pixel, with which all configurations can be rendered.
fn sample_counts(args: &BenchArgs) -> anyhow::Result<Vec<u32>> {
    let least = args.vary.iter().map(Vary::least_samples).max().unwrap_or(1);
    let counts = args.samples.clone().unwrap_or_else(|| SampleCounts::usual(least));
    counts.doubling(least).map_err(|problem| anyhow!("--samples: {problem}, which sampling=dual needs"))
}

fn load(args: &BenchArgs, path: &Path) -> anyhow::Result<(Scene, RenderSettings)> {
    let settings = SettingOptions::of(args.techniques.clone());
    let options = SceneOptions { size: args.size, max_depth: args.max_depth, settings, ..SceneOptions::default() };
    let (scene, settings) = options.load(path)?;
    check_memory(&scene)?;
    Ok((scene, RenderSettings { spirv_folder: args.spirv.clone(), ..settings }))
}

fn measure_scene(
    args: &BenchArgs,
    samples: &[u32],
    scene: &Scene,
    settings: &RenderSettings,
    context: &Context,
    interrupt: &Interrupt,
) -> anyhow::Result<SceneReport> {
    let configurations = bench::combine(settings, &args.vary);
    let most = samples.last().copied().unwrap_or(1);
    let bar = Progress::new(configurations.len() * samples.len() * args.seeds as usize);
    bar.say("compiling");
    let compile = |c| match interrupt.go_on() {
        ControlFlow::Continue(()) => Contender::new(c, context, scene, most),
        ControlFlow::Break(()) => Err(BenchError::Interrupted),
    };
    let mut contenders = configurations.iter().map(compile).collect::<Result<Vec<_>, _>>()?;
    let reference = obtain_reference(&args.reference, context, scene, &mut contenders, most, &bar, interrupt)?;
    let schedule = Schedule { samples: samples.to_vec(), seeds: args.seeds, flip_ppd: args.ppd };
    let measurements = convergence::measure(&mut contenders, &schedule, &reference, |done, _| {
        bar.set(done, &scene.source);
        interrupt.go_on()
    })?;
    bar.finish();
    let mut summaries: Vec<_> =
        contenders.iter().enumerate().map(|(i, c)| ConfigurationSummary::of(i, c, &measurements, &reference)).collect();
    let reached = summaries.iter().filter_map(ConfigurationSummary::smallest_rmse).max_by(f64::total_cmp);
    let target = args.target.or(reached);
    if let Some(target) = target {
        summaries.iter_mut().for_each(|s| s.reach(target));
    }
    Ok(SceneReport {
        scene: scene.source.clone(),
        width: scene.film.width,
        height: scene.film.height,
        max_depth: scene.integrator.max_depth,
        seeds: (measurements.len() / (samples.len() * contenders.len())) as u32,
        reference: ReferenceReport::of(&reference),
        target_rmse: target,
        configurations: summaries,
    })
}

fn obtain_reference(
    options: &ReferenceOptions,
    context: &Context,
    scene: &Scene,
    contenders: &mut [Contender<'_>],
    most_samples: u32,
    bar: &Progress,
    interrupt: &Interrupt,
) -> anyhow::Result<Reference> {
    if let Some(path) = &options.reference {
        return Ok(Reference::given(path, options.reference_noise)?);
    }
    let noise = match options.reference_noise {
        Some(noise) => noise,
        None => {
            bar.say("finding the noise that the reference may have");
            convergence::wanted_noise(contenders, most_samples, || interrupt.go_on())?
        }
    };
    let origin = if options.oracle { Origin::Oracle } else { Origin::Renderer };
    let cache = options.cache.clone().or_else(|| Some(user_cache()?.join("references")));
    Ok(Reference::obtain(context, scene, origin, noise, cache.as_deref(), |samples| {
        bar.say(&format!("making the reference, {samples} samples per pixel"));
        interrupt.go_on()
    })?)
}

/// A bar on a terminal; nothing elsewhere.
struct Progress(ProgressBar);

impl Progress {
    fn new(total: usize) -> Self {
        let bar = ProgressBar::new(total as u64);
        if let Ok(style) = ProgressStyle::with_template("[{bar:30}] {pos} of {len}, {elapsed}: {wide_msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self(bar)
    }

    fn say(&self, message: &str) {
        self.0.set_message(printable(message, &[]).into_owned());
        self.0.tick();
    }

    fn set(&self, done: usize, message: &str) {
        self.0.set_position(done as u64);
        self.say(message);
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}
