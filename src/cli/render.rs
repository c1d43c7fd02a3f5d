//! `photolith render`.

use std::mem::forget;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context as _;
use clap::Args;
use photolith::files::check_writable;
use photolith::image::{Format, Variance};
use photolith::render::{Adaptive, Prepared, Progress, RenderStatistics};
use photolith::{Context, Image, RenderError, Renderer, Validation};

use super::checkpoint::Keeper;
use super::develop_options::{DevelopOptions, develop};
use super::image_output::{self, ImageOutput};
use super::interrupt::Interrupt;
use super::numbers::seconds;
use super::options::{DeviceOptions, SceneOptions, check_memory};
use super::progress::Bar;
use super::render_report::{identity, metadata, report};
use super::signals::Deadline;
use super::{aov, exit, heading, input, output, paths};

/// Arguments of `photolith render`.
#[derive(Args)]
pub struct RenderArgs {
    /// Scene file (.toml) or mesh (.obj), or - for either of them from standard input
    #[arg(help_heading = heading::SCENE, display_order = 0)]
    scene: PathBuf,

    /// Image to write: .png, .exr, .hdr, .pfm, or - for standard output [default: the scene's name with .png, here]
    #[arg(short, long, value_name = "FILE", help_heading = heading::IMAGE)]
    output: Option<PathBuf>,

    /// Format of the image, whatever its name; needed for standard output
    #[arg(long, value_parser = image_output::format(), help_heading = heading::IMAGE)]
    format: Option<Format>,

    /// Write what the camera sees as layers of this OpenEXR file too: albedo, normals, position, depth, ids
    ///
    /// They are those of the ray through the centre of each pixel and of the lens, where it first meets a surface. Mirrors and glass are not
    /// seen through.
    #[arg(long, value_name = "FILE", help_heading = heading::IMAGE)]
    aov: Option<PathBuf>,

    /// Render until the image has no more noise than this: 0.1 is a preview, 0.01 is low noise
    ///
    /// The noise is the root mean square, over pixels and channels, of the standard error relative to √(radiance² + 0.01). Two
    /// independent halves of the samples tell it.
    #[arg(long, value_name = "TARGET", value_parser = noise, allow_negative_numbers = true, help_heading = heading::QUALITY)]
    noise: Option<f64>,

    /// Stop after so many seconds and write what there is, which is a sample of every pixel at least
    ///
    /// They begin when the scene is loaded: to compile kernels counts. A driver that takes more than these, and more than 30, for that is
    /// given up, with exit code 6.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true, help_heading = heading::QUALITY)]
    time_limit: Option<Duration>,

    /// Save what is done in this file, and go on from it if it is there
    ///
    /// It is written from time to time and when the rendering is stopped, and removed when the image is complete. The image has the
    /// same bits as if it had been rendered at once. With more --samples than it was begun with, it is gone on with to these.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["noise", "spirv"], help_heading = heading::QUALITY)]
    checkpoint: Option<PathBuf>,

    /// Keep the checkpoint of a complete image, to go on from it to more samples later
    #[arg(long, requires = "checkpoint", help_heading = heading::QUALITY)]
    keep_checkpoint: bool,

    /// How often the checkpoint is written
    #[arg(
        long,
        value_name = "SECONDS",
        value_parser = seconds,
        allow_negative_numbers = true,
        default_value = "600",
        requires = "checkpoint",
        help_heading = heading::QUALITY
    )]
    checkpoint_every: Duration,

    #[command(flatten)]
    develop: DevelopOptions,

    #[command(flatten)]
    device: DeviceOptions,

    /// Print one line of JSON about the rendering on stdout
    #[arg(long, help_heading = heading::OUTPUT)]
    json: bool,

    #[command(flatten)]
    scene_options: SceneOptions,

    /// Use the shaders of this folder instead of the built-in ones, where it has them
    ///
    /// Their names are path_trace.spv, path_interleaved.spv, path_queue.spv, light_trace.spv and first_hit.spv. Compile an edited shader with
    /// `glslc --target-env=vulkan1.2`, and render again.
    #[arg(long, value_name = "FOLDER", help_heading = heading::DEVELOPERS, hide_short_help = true)]
    spirv: Option<PathBuf>,
}

/// Seconds that the driver takes for a kernel that it finds in its cache: what is not there it compiles, and drivers may still be
/// writing that to the cache when the image is done.
const LITTLE_TO_COMPILE: f64 = 0.1;

/// How long a driver may compile, unless there is a limit of time, and with one that is shorter than what many drivers need: there is to
/// be a sample of every pixel.
const COMPILE_LIMIT: Duration = Duration::from_secs(600);
const LEAST_TO_COMPILE: Duration = Duration::from_secs(30);

/// Independent images behind a film's variance.
const HALVES: u32 = 2;

/// With --noise, what bounds the samples of a pixel if nothing else does.
const MOST_SAMPLES: u32 = 1 << 14;

fn noise(text: &str) -> Result<f64, String> {
    text.parse::<f64>()
        .ok()
        .filter(|n| *n > 0.0 && n.is_finite())
        .ok_or_else(|| format!("'{text}' is not a noise to stop at, expected a number above 0, such as 0.02"))
}

/// Renders and writes the image.
pub fn run(args: &RenderArgs) -> anyhow::Result<ExitCode> {
    let place = match &args.output {
        Some(path) => path.clone(),
        None => default_output(&args.scene, args.format)?,
    };
    let output = ImageOutput::of(&place, args.format, args.json)?;
    // Before hours of rendering, not after.
    output.check()?;
    let outputs =
        [("--output", output.path()), ("--aov", args.aov.as_ref()), ("--checkpoint", args.checkpoint.as_ref())];
    let outputs = outputs.into_iter().filter_map(|(option, path)| Some((option, path?)));
    paths::check_apart([&input::path(&args.scene).to_owned()], outputs)?;
    if let Some(aov) = &args.aov {
        aov::check(aov)?;
    }
    if let Some(checkpoint) = &args.checkpoint {
        check_writable(checkpoint)?;
    }
    let (mut scene, mut settings) = args.scene_options.load(&args.scene)?;
    args.develop.apply(&mut scene, output.format())?;
    if let Some(noise) = args.noise {
        settings.adaptive = Some(Adaptive { noise });
        settings.samples = args.scene_options.samples.unwrap_or(MOST_SAMPLES);
    }
    settings.time_limit = args.time_limit;
    settings.spirv_folder = args.spirv.clone();

    check_memory(&scene)?;
    let pixels = u64::from(scene.film.width) * u64::from(scene.film.height);
    let mut keeper = match &args.checkpoint {
        Some(path) => Some(Keeper::open(path, args.checkpoint_every, args.keep_checkpoint, pixels)?),
        None => None,
    };
    settings.begun_with = keeper.as_ref().and_then(Keeper::begun_with);
    let interrupt = Interrupt::install()?;
    let started = std::time::Instant::now();
    let (prepared, context) = std::thread::scope(|scope| {
        let preparing = std::thread::Builder::new().spawn_scoped(scope, || Prepared::of(&scene, &settings));
        let context = Context::new(&args.device.context_options(&[settings.accel]));
        // A panic in there is one here.
        preparing.map(|thread| (thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), context))
    })
    .context("starting a thread")?;
    let context = context?;
    let compiling = Deadline::after(args.time_limit.map_or(COMPILE_LIMIT, |limit| limit.max(LEAST_TO_COMPILE)));
    let mut renderer = Renderer::with(&context, prepared?).map_err(|error| told_of_shaders(args, error))?;
    drop(compiling);
    if renderer.hidden_lights() > 0 {
        log::warn!("{} light(s) left out: an opaque sphere keeps them from all that is seen", renderer.hidden_lights());
        args.scene_options.check_warnings(1)?;
    }
    if let Some(keeper) = &mut keeper {
        keeper.describe(&identity(&scene, &settings, &context))?;
    }
    let setup = started.elapsed().as_secs_f64();
    // What was needed to get ready counts.
    renderer.set_time_limit(args.time_limit.map(|limit| limit.saturating_sub(started.elapsed())));
    let bar = Bar::new();
    let on_progress = |progress: &Progress| {
        bar.set(progress);
        interrupt.go_on()
    };
    let film = match &mut keeper {
        Some(keeper) => keeper.render(&mut renderer, on_progress),
        None => renderer.render(on_progress),
    };
    let film = film.map_err(|error| told_of_shaders(args, error))?;
    bar.finish();

    let mut late_warnings = 0;
    let statistics = renderer.statistics();
    if statistics.bad_samples > 0 {
        late_warnings += 1;
        log::warn!("{} samples were NaN or infinite and count as black", statistics.bad_samples);
    }
    let was_interrupted = statistics.stopped && interrupt.requested();
    if statistics.stopped {
        let why = if was_interrupted { "interrupted" } else { "time limit reached" };
        let most = settings.samples;
        let done = samples(statistics);
        let light_paths = if statistics.light_paths > 0 {
            format!(" and {} light paths", statistics.light_paths)
        } else {
            String::new()
        };
        // Where all pixels have what was asked for, light paths are lacking, or what noisy parts have more (`SampleMap`).
        let lacking = statistics.light_paths == 0 && statistics.samples_per_pixel >= most;
        let more = if lacking { "; noisy parts were to have more" } else { "" };
        output::tell(&format!(
            "{why} after {done} of {most} samples per pixel{light_paths}{more}; writing what there is"
        ));
    }
    if let Some(target) = args.noise {
        say_noise(target, statistics);
    }
    let mut image = Image::from_pixels(film.width(), film.height(), film.mean())?;
    if args.noise.is_some() {
        image = image.with_counts(film.counts().to_vec())?;
    }
    if let Some(variance) = film.variance() {
        image = image.with_variance(Variance { of_mean: variance.to_vec(), batches: HALVES })?;
    }
    let samples = renderer.statistics().samples_per_pixel;
    let (mut image, development) = develop(image, &scene, &settings, samples, output.format(), &context)?;
    let mut m = metadata(&scene, &settings, &context, &renderer);
    if output.format() == Format::Png {
        image = image.displayed(development.exposure, development.tone);
        m.push("Exposure", development.exposure);
        m.push("Tone", development.tone.name());
    }
    let written = output.write(&image, &m, scene.film.transfer);
    let kept = keeper.map_or(Ok(()), |keeper| keeper.finish(&mut renderer, written.is_ok()));
    let written = written?;
    if let Some(aov) = &args.aov {
        aov::write(aov, &mut renderer, [scene.film.width, scene.film.height], &m)?;
    }
    if written.non_finite > 0 {
        late_warnings += 1;
        log::warn!("{output}: {} pixels are not finite", written.non_finite);
    }
    let printed = match args.json {
        true => {
            output::print(&format!("{}\n", report(&context, &scene, &settings, &renderer, development, setup, &place)))
        }
        false => Ok(()),
    };
    let printed = printed.and(args.scene_options.check_warnings(late_warnings));
    let messages = context.messages().all();
    let code = match messages.first() {
        Some(first) => {
            output::tell(&format!("{} validation message(s); the first: {first}", messages.len()));
            exit::VALIDATION
        }
        None if was_interrupted => exit::INTERRUPTED,
        None => exit::OK,
    };
    if context.validation() == Validation::Off && renderer.statistics().compile_seconds < LITTLE_TO_COMPILE {
        // The system takes back at once what would be given back piece by piece.
        forget((renderer, context));
    }
    exit::with(code, printed.and(kept))
}

/// An error, which the user's own shaders may be the cause of.
fn told_of_shaders(args: &RenderArgs, error: RenderError) -> anyhow::Error {
    let error = anyhow::Error::from(error);
    match &args.spirv {
        Some(folder) => error.context(format!("with shaders of {}", folder.display())),
        None => error,
    }
}

/// The noise reached, for people.
fn say_noise(target: f64, statistics: &RenderStatistics) {
    let samples = samples(statistics);
    output::tell(&match statistics.adaptive {
        None => format!("too few samples to estimate the noise ({samples} samples per pixel)"),
        Some(reached) => {
            let missed = if reached.noise > target { format!(", {target} was asked for") } else { String::new() };
            let (noise, noisiest) = (reached.noise, reached.noisiest_tile);
            format!("noise {noise:.3e}{missed} (noisiest tile {noisiest:.3e}) with {samples} samples per pixel")
        }
    });
}

/// The number of samples per pixel, or fewest, mean and most where they differ.
fn samples(s: &RenderStatistics) -> String {
    let (fewest, mean, most) = (s.samples_per_pixel, s.mean_samples_per_pixel, s.most_samples_per_pixel);
    if fewest == most { fewest.to_string() } else { format!("{fewest} to {most} (mean {mean:.1})") }
}

fn default_output(scene: &Path, format: Option<Format>) -> anyhow::Result<PathBuf> {
    let mut name = input::stem(scene)?;
    // Not with_extension: of frame.001.toml this is frame.001.png.
    name.push(".");
    name.push(format.unwrap_or(Format::Png).extension());
    Ok(PathBuf::from(name))
}
