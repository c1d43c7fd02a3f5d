//! The image that errors are measured against, and how noisy it is itself.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::Context;
use crate::files::WriteError;
use crate::image;
use crate::image::metrics::RELATIVE_OFFSET;
use crate::image::{Image, ImageError, Metadata, Variance};
use crate::oracle;
use crate::oracle::OracleSettings;
use crate::render::{MAX_SAMPLES, RenderSettings, Renderer, Sampler};
use crate::scene::{Scene, fingerprint};

use crate::bench::error::BenchError;
use crate::bench::watched;

/// Independent batches behind the noise estimate of a reference that is made here.
const BATCHES: u32 = 16;
/// Samples per pixel of the batches that show how many a reference needs.
const PILOT_SAMPLES: u32 = 64;
/// By how much a pilot's noise must be below the wanted one for it to be the reference.
const PILOT_MARGIN: f64 = 2.0;
/// How many times as many samples are taken as the estimate asks for, so that it seldom matters whether they reach it.
const SPARE: f64 = 1.2;
/// Attempts to reach the wanted noise: the pilot may have missed rare bright paths.
const ATTEMPTS: u32 = 4;
/// Seeds of references lie far from those of measurements.
const SEED: u32 = 0x5eed_0000;

/// Of the renderer, in the names of references that it makes: one more for each error of it that is mended, so that nothing is
/// compared with images that have it. (2: opaque spheres hide emitters within.)
const REVISION: u32 = 2;

/// Where a reference came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// An image that the caller gave.
    Given,
    /// Made by the renderer with independent random numbers, in another seed space.
    Renderer,
    /// Made by the double-precision oracle on the CPU.
    Oracle,
}

/// A reference image with its noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The image.
    pub image: Image,
    /// Where it came from.
    pub origin: Origin,
    /// The file it is in, if it is in one.
    pub file: Option<PathBuf>,
    /// Samples per pixel, where known.
    pub samples: Option<u64>,
    /// Its share of a mean squared error: mean variance over pixels and channels.
    pub noise_mse: f64,
    /// Its share of a relative mean squared error.
    pub noise_rel_mse: f64,
    /// Standard error of its mean luminance (channels counted as fully correlated, which is the worst case).
    pub mean_error: f64,
}

impl Reference {
    /// From an image; `noise` (root mean variance, radiance) for one that does not carry its variance.
    ///
    /// # Errors
    /// It cannot be read, [`BenchError::NonFinite`] if a pixel or its variance is not finite, [`BenchError::UnknownNoise`]
    /// if it carries no variance and no noise is stated.
    pub fn given(path: &Path, noise: Option<f64>) -> Result<Self, BenchError> {
        let (image, metadata) = image::read(path)
            .map_err(|source| BenchError::Image { what: format!("reference {}", path.display()), source })?;
        let finite = |values: &[[f32; 3]], i: usize| values[i].iter().all(|v| v.is_finite());
        let good = |&i: &usize| finite(image.pixels(), i) && image.variance().is_none_or(|v| finite(&v.of_mean, i));
        let pixels = image.pixels().len();
        let good = (0..pixels).filter(good).count();
        if good < pixels {
            return Err(BenchError::NonFinite { path: path.to_owned(), count: pixels - good });
        }
        let samples = metadata.get("Samples").and_then(|s| s.parse::<f64>().ok()).map(|mean| mean.round() as u64);
        let file = Some(path.to_owned());
        match (noise, image.variance().is_some()) {
            (Some(noise), _) => {
                let of_mean = vec![[(noise * noise) as f32; 3]; pixels];
                Ok(Self::new(image, &of_mean, Origin::Given, file, samples))
            }
            (None, true) => Ok(Self::with_variance(image, Origin::Given, file, samples)),
            (None, false) => Err(BenchError::UnknownNoise { path: path.to_owned() }),
        }
    }

    /// From the cache folder if a good enough one is there, else made and, if there is a folder, kept: a cache that cannot be
    /// read or written costs a warning and the time to make the reference.
    ///
    /// `noise` is the largest allowed root mean variance, radiance; `on_progress` is told, between and during renderings, the
    /// samples per pixel that are being rendered.
    ///
    /// # Errors
    /// A rendering fails, the noise is not or cannot be reached, or [`BenchError::Interrupted`] if `on_progress` breaks.
    pub fn obtain(
        context: &Context,
        scene: &Scene,
        origin: Origin,
        noise: f64,
        cache: Option<&Path>,
        mut on_progress: impl FnMut(u64) -> ControlFlow<()>,
    ) -> Result<Self, BenchError> {
        let name = match origin {
            Origin::Oracle => "oracle".to_owned(),
            Origin::Given | Origin::Renderer => format!("renderer-{REVISION}"),
        };
        let file = cache.map(|folder| folder.join(format!("{:016x}-{name}.exr", fingerprint(scene))));
        if let Some(path) = file.as_deref().filter(|p| p.exists()) {
            match Self::given(path, None) {
                Ok(found) if found.noise_mse.sqrt() <= noise => return Ok(Self { origin, ..found }),
                Ok(_) => {}
                // A damaged file is replaced.
                Err(error) => log::warn!("{}; it is made anew", with_causes(&error)),
            }
        }
        let (image, samples) = match origin {
            Origin::Oracle => by_oracle(scene, noise, &mut on_progress)?,
            Origin::Given | Origin::Renderer => by_renderer(context, scene, noise, &mut on_progress)?,
        };
        let file = file.filter(|path| match keep(path, &image, scene, samples) {
            Ok(()) => true,
            Err(error) => {
                log::warn!("the reference is not kept: {}", with_causes(&error));
                false
            }
        });
        Ok(Self::with_variance(image, origin, file, Some(samples)))
    }

    fn with_variance(image: Image, origin: Origin, file: Option<PathBuf>, samples: Option<u64>) -> Self {
        let of_mean = image.variance().map(|v| v.of_mean.clone()).unwrap_or_default();
        Self::new(image, &of_mean, origin, file, samples)
    }

    fn new(image: Image, of_mean: &[[f32; 3]], origin: Origin, file: Option<PathBuf>, samples: Option<u64>) -> Self {
        let (mut noise, mut relative, mut luminance) = (0.0, 0.0, 0.0);
        for (pixel, variance) in image.pixels().iter().zip(of_mean) {
            let mut deviation = 0.0;
            for c in 0..3 {
                let (r, v) = (f64::from(pixel[c]), f64::from(variance[c]));
                noise += v;
                relative += v / (r * r + RELATIVE_OFFSET);
                deviation += image::metrics::LUMINANCE[c] * v.sqrt();
            }
            luminance += deviation * deviation;
        }
        let pixels = image.pixels().len() as f64;
        Self {
            origin,
            file,
            samples,
            noise_mse: noise / (3.0 * pixels),
            noise_rel_mse: relative / (3.0 * pixels),
            mean_error: luminance.sqrt() / pixels,
            image,
        }
    }
}

/// Writes a reference into the cache folder, which is made if it is not there.
fn keep(path: &Path, image: &Image, scene: &Scene, samples: u64) -> Result<(), ImageError> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|source| WriteError { path: folder.to_owned(), source })?;
    }
    let mut metadata = Metadata::new();
    metadata.push("Software", concat!("photolith ", env!("CARGO_PKG_VERSION")));
    metadata.push("Scene", &scene.source);
    metadata.push("Samples", samples);
    image::write(path, image, &metadata, scene.film.transfer).map(drop)
}

/// An error and what caused it, on one line.
fn with_causes(error: &dyn Error) -> String {
    let causes = std::iter::successors(Some(error), |&e| e.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// Means of equally large independent batches, accumulated (Welford's update).
struct Batches {
    count: u32,
    mean: Vec<[f64; 3]>,
    squares: Vec<[f64; 3]>,
}

impl Batches {
    fn new(pixels: usize) -> Self {
        Self { count: 0, mean: vec![[0.0; 3]; pixels], squares: vec![[0.0; 3]; pixels] }
    }

    fn add(&mut self, batch: impl Iterator<Item = [f64; 3]>) {
        self.count += 1;
        let n = f64::from(self.count);
        for ((mean, squares), x) in self.mean.iter_mut().zip(&mut self.squares).zip(batch) {
            for c in 0..3 {
                let delta = x[c] - mean[c];
                mean[c] += delta / n;
                squares[c] += delta * (x[c] - mean[c]);
            }
        }
    }

    /// Root of the mean variance of the mean.
    fn noise(&self) -> f64 {
        let values = self.squares.as_flattened();
        (values.iter().sum::<f64>() / values.len() as f64 / self.denominator()).sqrt()
    }

    fn denominator(&self) -> f64 {
        f64::from(self.count) * f64::from(self.count - 1)
    }

    fn image(&self, width: u32, height: u32) -> Result<Image, ImageError> {
        let single = |values: &[[f64; 3]], scale: f64| values.iter().map(|v| v.map(|x| (x * scale) as f32)).collect();
        Image::from_pixels(width, height, single(&self.mean, 1.0))?
            .with_variance(Variance { of_mean: single(&self.squares, 1.0 / self.denominator()), batches: self.count })
    }
}

/// Whether to go on; asked often.
type GoOn<'a> = dyn FnMut() -> ControlFlow<()> + 'a;

/// Renders batches until their mean is as exact as `noise`. `batch` renders one of so many samples with a seed.
fn by_batches(
    scene: &Scene,
    noise: f64,
    on_progress: &mut impl FnMut(u64) -> ControlFlow<()>,
    mut batch: impl FnMut(u32, u32, &mut GoOn<'_>) -> Result<Vec<[f64; 3]>, BenchError>,
) -> Result<(Image, u64), BenchError> {
    let (width, height) = (scene.film.width, scene.film.height);
    let pixels = width as usize * height as usize;
    let mut samples = PILOT_SAMPLES;
    let mut seed = SEED;
    let (mut reached, mut spent) = (f64::INFINITY, 0);
    for attempt in 0..ATTEMPTS {
        let mut batches = Batches::new(pixels);
        let in_all = u64::from(samples) * u64::from(BATCHES);
        let mut go_on = || on_progress(in_all);
        for _ in 0..BATCHES {
            if go_on().is_break() {
                return Err(BenchError::Interrupted);
            }
            batches.add(batch(samples, seed, &mut go_on)?.into_iter());
            seed += 1;
        }
        reached = batches.noise();
        spent = in_all;
        // The pilot is there to tell how many samples are needed. An image that is kept whenever its own samples say that they
        // are enough would be kept most readily where they have missed what is rare and bright.
        if reached <= if attempt == 0 { noise / PILOT_MARGIN } else { noise } {
            let image = batches
                .image(width, height)
                .map_err(|source| BenchError::Image { what: format!("reference of {}", scene.source), source })?;
            return Ok((image, in_all));
        }
        let factor = SPARE * (reached / noise).powi(2);
        let needed = (f64::from(samples) * factor.max(1.0)).ceil();
        if needed > f64::from(MAX_SAMPLES) {
            return Err(BenchError::ReferenceSamples {
                scene: scene.source.clone(),
                wanted: noise,
                needed: needed * f64::from(BATCHES),
                most: u64::from(MAX_SAMPLES) * u64::from(BATCHES),
            });
        }
        samples = needed as u32;
    }
    Err(BenchError::ReferenceNoise { scene: scene.source.clone(), reached, wanted: noise, samples: spent })
}

fn by_renderer(
    context: &Context,
    scene: &Scene,
    noise: f64,
    on_progress: &mut impl FnMut(u64) -> ControlFlow<()>,
) -> Result<(Image, u64), BenchError> {
    let fail = |source| BenchError::Render { what: format!("reference of {}", scene.source), source };
    let settings =
        RenderSettings { samples: PILOT_SAMPLES, sampler: Sampler::Independent, ..RenderSettings::of(scene) };
    let mut renderer = Renderer::new(context, scene, &settings).map_err(fail)?;
    by_batches(scene, noise, on_progress, |samples, seed, go_on| {
        // Independent numbers have no table, and so no other bound on the samples than the largest.
        renderer.set_samples(samples).map_err(fail)?;
        renderer.set_seed(seed);
        let film = watched::render(&mut renderer, go_on).map_err(fail)?.ok_or(BenchError::Interrupted)?;
        Ok(film.sums().iter().zip(film.counts()).map(|(s, &n)| s.map(|s| s / f64::from(n))).collect())
    })
}

fn by_oracle(
    scene: &Scene,
    noise: f64,
    on_progress: &mut impl FnMut(u64) -> ControlFlow<()>,
) -> Result<(Image, u64), BenchError> {
    by_batches(scene, noise, on_progress, |samples, seed, _| {
        Ok(oracle::render(scene, &OracleSettings { samples, seed: u64::from(seed) }).mean)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_give_mean_and_variance_of_the_mean() {
        let mut batches = Batches::new(1);
        for x in [1.0, 2.0, 6.0] {
            batches.add([[x, 0.0, 2.0 * x]].into_iter());
        }
        let image = batches.image(1, 1).unwrap();
        assert_eq!(image.pixels()[0], [3.0, 0.0, 6.0]);
        // Sample variance 7, over 3.
        let variance = image.variance().unwrap();
        assert!((variance.of_mean[0][0] - 7.0 / 3.0).abs() < 1e-6 && variance.batches == 3);
        assert!((batches.noise() - ((7.0 / 3.0 + 0.0 + 28.0 / 3.0) / 3.0f64).sqrt()).abs() < 1e-12);
        let reference = Reference::with_variance(image, Origin::Renderer, None, None);
        assert!((reference.noise_mse.sqrt() - batches.noise()).abs() < 1e-6);
        // One pixel: the mean's error is the pixel's.
        let deviation = 0.2126 * (7.0f64 / 3.0).sqrt() + 0.0722 * (28.0f64 / 3.0).sqrt();
        assert!((reference.mean_error - deviation).abs() < 1e-6);
        let relative = (7.0 / 3.0 / 9.01 + 28.0 / 3.0 / 36.01) / 3.0;
        assert!((reference.noise_rel_mse - relative).abs() < 1e-6);
    }
}
