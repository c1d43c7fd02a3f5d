//! Cost against the size of a scene.

use std::ops::ControlFlow;

use serde::Serialize;

use crate::Context;
use crate::render::{RenderError, RenderSettings, Renderer, SampleMap};
use crate::scene::{MAX_DEPTH, MAX_IMAGE_SIDE, Scene};

use crate::bench::error::BenchError;
use crate::bench::generate;
use crate::bench::statistics::{PowerLaw, median};
use crate::bench::watched;

/// Timed renderings of each scene.
const REPEATS: u32 = 3;

/// What grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Growth {
    /// Triangles of a landscape that fills the view.
    Triangles,
    /// Spheres that fill the view.
    Spheres,
    /// Point lights of equal total power.
    Lights,
    /// Pixels of the image.
    Pixels,
    /// Surface hits of a path in a closed room.
    Depth,
}

impl Growth {
    /// Smallest and largest size if no other is asked for, which takes less than a minute on two cores, and the factor
    /// from one size to the next.
    fn range(self) -> (u64, u64, f64) {
        match self {
            Self::Triangles => (1_000, 1_000_000, 10f64.sqrt()),
            Self::Spheres => (10, 100_000, 10.0),
            Self::Lights => (1, 10_000, 10.0),
            Self::Pixels => (64 * 64, 1024 * 1024, 4.0),
            Self::Depth => (1, 64, 2.0),
        }
    }

    /// The largest size that a scene can have; a device's memory may end a series before.
    fn limit(self) -> u64 {
        match self {
            // What shaders count things with has a sign.
            Self::Triangles | Self::Spheres | Self::Lights => i32::MAX as u64,
            Self::Pixels => u64::from(MAX_IMAGE_SIDE).pow(2),
            Self::Depth => u64::from(MAX_DEPTH),
        }
    }

    /// Sizes from the smallest to `max` (`None`: a default that takes less than a minute on two cores).
    ///
    /// # Errors
    /// [`BenchError::Settings`] if `max` is below the smallest, or beyond what a scene can have.
    pub fn sizes(self, max: Option<u64>) -> Result<Vec<u64>, BenchError> {
        let (least, most, factor) = self.range();
        let most = max.unwrap_or(most);
        if most < least {
            let name = self.name();
            let problem = format!("{name} up to {most}, expected at least {least}, the smallest size");
            return Err(BenchError::Settings(problem));
        }
        if most > self.limit() {
            let problem = format!("{} up to {most}, expected at most {}", self.name(), self.limit());
            return Err(BenchError::Settings(problem));
        }
        Ok((0..).map(|i| (least as f64 * f64::powi(factor, i)).round() as u64).take_while(|&n| n <= most).collect())
    }

    /// The scene of a size.
    pub fn scene(self, size: u64) -> Scene {
        match self {
            Self::Triangles => generate::terrain(size),
            Self::Spheres => generate::spheres(size),
            Self::Lights => generate::lights(size),
            Self::Pixels => generate::pixels(size),
            Self::Depth => generate::depth(size),
        }
    }

    fn size_of(self, scene: &Scene) -> u64 {
        match self {
            Self::Triangles => scene.triangle_count() as u64,
            Self::Spheres => scene.spheres.len() as u64,
            Self::Lights => scene.lights.len() as u64,
            Self::Pixels => u64::from(scene.film.width) * u64::from(scene.film.height),
            Self::Depth => u64::from(scene.integrator.max_depth),
        }
    }

    /// In the plural, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Triangles => "triangles",
            Self::Spheres => "spheres",
            Self::Lights => "lights",
            Self::Pixels => "pixels",
            Self::Depth => "depth",
        }
    }
}

/// One size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GrowthRow {
    /// How many there are of what grows.
    pub size: u64,
    /// Seconds to prepare: BVH, uploads, pipeline.
    pub setup_s: f64,
    /// Seconds to build the BVH.
    pub build_s: Option<f64>,
    /// Primitives a second in building, millions.
    pub mprimitives_per_s: Option<f64>,
    /// Bytes of the BVH, for each of its primitives.
    pub bytes_per_primitive: Option<f64>,
    /// Depth of the BVH.
    pub bvh_depth: Option<u32>,
    /// Steps through the BVH per ray.
    pub steps_per_ray: Option<f64>,
    /// Rays per sample.
    pub rays_per_sample: f64,
    /// Median wall seconds of a rendering.
    pub render_s: f64,
    /// Nanoseconds per sample.
    pub ns_per_sample: f64,
    /// Samples a second, millions.
    pub msamples_per_s: f64,
    /// Rays a second, millions.
    pub mrays_per_s: f64,
    /// Device memory in use after it, bytes.
    pub device_bytes: u64,
}

/// Exponents of cost ∝ size^exponent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GrowthReport {
    /// What grew.
    pub grows: Growth,
    /// Samples per pixel.
    pub samples: u32,
    /// One for each size that could be rendered.
    pub rows: Vec<GrowthRow>,
    /// Time per sample against size.
    pub time_exponent: Option<PowerLaw>,
    /// Time to build the BVH against size.
    pub build_exponent: Option<PowerLaw>,
    /// Steps per ray against size.
    pub steps_exponent: Option<PowerLaw>,
    /// Where and why the series ended early, such as a limit of the driver.
    pub ended: Option<String>,
}

/// Renders scene after scene. A failure ends the series and is kept in [`GrowthReport::ended`], with the error beside; so does
/// `on_progress`, which is told the size between and during renderings, if it breaks.
pub fn measure(
    context: &Context,
    grows: Growth,
    sizes: &[u64],
    settings: &RenderSettings,
    mut on_progress: impl FnMut(u64) -> ControlFlow<()>,
) -> (GrowthReport, Option<RenderError>) {
    let mut rows = Vec::new();
    let mut failure = None;
    let mut ended = None;
    for &size in sizes {
        let mut asked = on_progress(size);
        if asked.is_continue() {
            let scene = grows.scene(size);
            let go_on = || {
                asked = on_progress(size);
                asked
            };
            match row(context, grows, &scene, settings, go_on) {
                // Times of renderings that were broken off are none.
                Ok(row) if asked.is_continue() => rows.push(row),
                Ok(_) => {}
                Err(error) => {
                    ended = Some(format!("{} {}: {error}", grows.size_of(&scene), grows.name()));
                    failure = Some(error);
                    break;
                }
            }
        }
        if asked.is_break() {
            ended = Some(format!("{size} {}: interrupted", grows.name()));
            break;
        }
    }
    let fit = |value: fn(&GrowthRow) -> Option<f64>| {
        let points: Vec<_> = rows.iter().filter_map(|r| Some((r.size as f64, value(r)?))).collect();
        PowerLaw::fit(&points)
    };
    let report = GrowthReport {
        grows,
        samples: settings.samples,
        time_exponent: fit(|r| Some(r.ns_per_sample)),
        build_exponent: fit(|r| r.build_s),
        steps_exponent: fit(|r| r.steps_per_ray),
        rows,
        ended,
    };
    (report, failure)
}

/// Measures a scene; where `go_on` breaks, the row means nothing.
fn row(
    context: &Context,
    grows: Growth,
    scene: &Scene,
    settings: &RenderSettings,
    mut go_on: impl FnMut() -> ControlFlow<()>,
) -> Result<GrowthRow, RenderError> {
    // One sample is enough.
    let counted = RenderSettings { samples: 1, sample_map: SampleMap::Off, ..settings.clone() };
    let steps_per_ray = watched::steps_per_ray(context, scene, &counted, &mut go_on)?;
    let mut renderer = Renderer::new(context, scene, settings)?;
    let mut seconds = Vec::new();
    for seed in 0..REPEATS {
        renderer.set_seed(seed);
        renderer.render(|_| go_on())?;
        seconds.push(renderer.statistics().render_seconds);
    }
    let render_s = median(&seconds);
    let s = renderer.statistics();
    let rays = (s.rays + s.shadow_rays) as f64;
    let samples = s.samples as f64;
    let bvh = renderer.bvh();
    Ok(GrowthRow {
        size: grows.size_of(scene),
        setup_s: s.setup_seconds,
        build_s: bvh.map(|t| t.build_seconds),
        mprimitives_per_s: bvh.map(|t| t.primitives as f64 / t.build_seconds / 1e6),
        bytes_per_primitive: bvh.map(|t| t.bytes as f64 / t.primitives as f64),
        bvh_depth: bvh.map(|t| t.depth),
        steps_per_ray,
        rays_per_sample: rays / samples,
        render_s,
        ns_per_sample: render_s / samples * 1e9,
        msamples_per_s: samples / render_s / 1e6,
        mrays_per_s: rays / render_s / 1e6,
        device_bytes: context.memory().0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_reach_the_largest() {
        let sizes = |grows: Growth, max| grows.sizes(max).unwrap();
        assert_eq!(sizes(Growth::Triangles, Some(10_000)), [1000, 3162, 10_000]);
        assert_eq!(sizes(Growth::Triangles, Some(10_000_000)).last(), Some(&10_000_000));
        assert_eq!(sizes(Growth::Triangles, Some(1000)), [1000]);
        let error = Growth::Triangles.sizes(Some(999)).unwrap_err().to_string();
        assert!(error.contains("triangles up to 999, expected at least 1000, the smallest size"), "{error}");
        for (grows, most) in
            [(Growth::Depth, 65_535), (Growth::Pixels, 65_536 * 65_536), (Growth::Triangles, 2_147_483_647)]
        {
            assert!(sizes(grows, Some(most)).last().is_some_and(|&n| n <= most));
            let error = grows.sizes(Some(most + 1)).unwrap_err().to_string();
            assert!(error.ends_with(&format!("up to {}, expected at most {most}", most + 1)), "{error}");
        }
        assert_eq!(sizes(Growth::Depth, None), [1, 2, 4, 8, 16, 32, 64]);
        assert_eq!(sizes(Growth::Pixels, None).len(), 5);
    }
}
