//! Where cases are measured: a device, a size, and maybe a deliberate error.

use std::mem::take;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::Pod;
use glam::DVec3;

use crate::gpu::Context;
use crate::render::{Accel, Film, Mutation, Prepared, RenderSettings, RenderStatistics, Renderer};
use crate::scene::Scene;

use crate::check::probe::{
    Function, HitRecord, Kernel, OcclusionRecord, PathInput, PathRecord, Probe, RayInput, RayProbe, Words, tables_of,
};
use crate::check::scenes;
use crate::check::{CheckError, Evidence, Measured};

/// The device under test.
#[derive(Clone)]
pub struct Lab {
    pub(crate) context: Context,
    /// Sizes of the full suite (10⁸ rays) instead of the quick ones.
    pub full: bool,
    /// Breaks one thing in the shaders of every case.
    pub mutation: Option<Mutation>,
    /// How triangles are found, where a case does not decide that itself.
    pub accel: Accel,
    /// What cases have found that differs, where they can tell it word by word.
    pub(crate) evidence: Arc<Mutex<Vec<Evidence>>>,
}

/// A film and what it took.
pub(crate) struct Rendered {
    pub film: Film,
    pub statistics: RenderStatistics,
}

/// Pixels that a case counts as different from those of an image; infinitely many if that shows too little to tell.
pub(crate) fn pixels_that_differ(image: &Film, differ: usize, detail: impl Into<String>) -> Measured {
    let lit = image.sums().iter().filter(|sum| sum[0] > 0.0).count();
    if lit < 500 {
        Measured::new(f64::INFINITY, format!("only {lit} pixels are lit"))
    } else {
        Measured::new(differ as f64, detail)
    }
}

impl Rendered {
    /// What a renderer renders.
    pub fn by(renderer: &mut Renderer) -> Result<Self, CheckError> {
        let film = renderer.render(|_| ControlFlow::Continue(()))?;
        Ok(Self { film, statistics: renderer.statistics().clone() })
    }

    /// Mean over the image, per channel.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (pixel, &n) in self.film.sums().iter().zip(self.film.counts()) {
            for c in 0..3 {
                sum[c] += pixel[c] / f64::from(n);
            }
        }
        sum.map(|s| s / self.film.counts().len() as f64)
    }

    /// Mean radiance of each pixel, one channel.
    pub fn channel(&self, c: usize) -> Vec<f64> {
        self.film.sums().iter().zip(self.film.counts()).map(|(s, &n)| s[c] / f64::from(n)).collect()
    }

    /// Pixels whose sums or counts differ.
    pub fn differing(&self, other: &Self) -> usize {
        let bits = |film: &Film, i: usize| (film.sums()[i].map(f64::to_bits), film.counts()[i]);
        let pixels = self.film.counts().len();
        if pixels != other.film.counts().len() {
            return pixels.max(other.film.counts().len());
        }
        (0..pixels).filter(|&i| bits(&self.film, i) != bits(&other.film, i)).count()
    }
}

impl Lab {
    /// A lab on a device, for the quick sizes and without a mutation.
    pub fn new(context: &Context) -> Self {
        let accel = Accel::default();
        Self { context: context.clone(), full: false, mutation: None, accel, evidence: Arc::default() }
    }

    /// How many words of a kernel are not as they should be, which is kept for those who are to mend it.
    pub(crate) fn differing(&self, name: &str, expected: &[u32], actual: &[u32]) -> usize {
        let lacking = expected.len().abs_diff(actual.len());
        let differ = lacking + expected.iter().zip(actual).filter(|(e, a)| e != a).count();
        if differ > 0 {
            let evidence = Evidence { name: name.to_owned(), expected: expected.to_vec(), actual: actual.to_vec() };
            self.evidence.lock().unwrap_or_else(PoisonError::into_inner).push(evidence);
        }
        differ
    }

    /// What cases have found that differs since this was last asked.
    pub(crate) fn take_evidence(&self) -> Vec<Evidence> {
        take(&mut *self.evidence.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// `quick`, or `full` where that is asked for.
    pub(crate) fn size(&self, quick: usize, full: usize) -> usize {
        if self.full { full } else { quick }
    }

    /// The scene's settings, with those of the lab.
    pub(crate) fn settings(&self, scene: &Scene) -> RenderSettings {
        RenderSettings { mutation: self.mutation, accel: self.accel, ..RenderSettings::of(scene) }
    }

    /// Renders with the scene's settings.
    pub(crate) fn render(&self, scene: &Scene) -> Result<Rendered, CheckError> {
        self.render_with(scene, &self.settings(scene))
    }

    /// Renders.
    pub(crate) fn render_with(&self, scene: &Scene, settings: &RenderSettings) -> Result<Rendered, CheckError> {
        // Some scenes are such that Renderer::new would refuse them.
        Rendered::by(&mut Renderer::with(&self.context, Prepared::of(scene, settings)?)?)
    }

    /// Closest hits in a scene.
    pub(crate) fn closest(&self, scene: &Scene) -> Result<RayProbe<RayInput, HitRecord>, CheckError> {
        RayProbe::closest(&self.context, scene, &self.settings(scene))
    }

    /// Closest hits with other settings.
    pub(crate) fn closest_with(
        &self,
        scene: &Scene,
        settings: &RenderSettings,
    ) -> Result<RayProbe<RayInput, HitRecord>, CheckError> {
        RayProbe::closest(&self.context, scene, settings)
    }

    /// Closest polygons of a scene that has nothing else, by the exact test alone.
    pub(crate) fn closest_polygons(&self, scene: &Scene) -> Result<RayProbe<RayInput, HitRecord>, CheckError> {
        RayProbe::closest_polygons(&self.context, scene, &self.settings(scene))
    }

    /// Occlusion in a scene.
    pub(crate) fn occluded(&self, scene: &Scene) -> Result<RayProbe<RayInput, OcclusionRecord>, CheckError> {
        RayProbe::occluded(&self.context, scene, &self.settings(scene))
    }

    /// Single scattering events in a scene.
    pub(crate) fn scatter(&self, scene: &Scene) -> Result<RayProbe<PathInput, PathRecord>, CheckError> {
        RayProbe::scatter(&self.context, scene, &self.settings(scene))
    }

    /// Follows paths to their ends, and returns the radiance that each brings back.
    pub(crate) fn radiance(&self, scene: &Scene, paths: &[PathInput]) -> Result<Vec<DVec3>, CheckError> {
        let mut probe = self.scatter(scene)?;
        let mut radiance = vec![DVec3::ZERO; paths.len()];
        let mut alive: Vec<(usize, PathInput)> = paths.iter().copied().enumerate().collect();
        while !alive.is_empty() {
            let inputs: Vec<_> = alive.iter().map(|p| p.1).collect();
            let records = probe.run(&inputs)?;
            let mut next = Vec::with_capacity(alive.len());
            for ((index, path), record) in alive.iter().zip(&records) {
                radiance[*index] += DVec3::from(record.radiance.map(f64::from));
                if record.alive != 0 {
                    next.push((*index, record.next(path)));
                }
            }
            alive = next;
        }
        Ok(radiance)
    }

    /// Runs a function of the shader library.
    pub(crate) fn function(&self, function: Function, inputs: &[Words]) -> Result<Vec<Words>, CheckError> {
        self.function_in(&scenes::room(), function, inputs)
    }

    /// The same, specialised for the film and the sampler of `scene`.
    pub(crate) fn function_in(
        &self,
        scene: &Scene,
        function: Function,
        inputs: &[Words],
    ) -> Result<Vec<Words>, CheckError> {
        self.kernel(scene, function.kernel(), 1)?.run(inputs)
    }

    /// A kernel specialised for `scene`.
    pub(crate) fn kernel<I: Pod, O: Pod>(
        &self,
        scene: &Scene,
        kernel: Kernel,
        film_slots: usize,
    ) -> Result<Probe<I, O>, CheckError> {
        self.kernel_with(scene, &self.settings(scene), kernel, film_slots)
    }

    /// The same with other settings.
    pub(crate) fn kernel_with<I: Pod, O: Pod>(
        &self,
        scene: &Scene,
        settings: &RenderSettings,
        kernel: Kernel,
        film_slots: usize,
    ) -> Result<Probe<I, O>, CheckError> {
        let (_, tables) = tables_of(scene, settings);
        Probe::new(&self.context, kernel, scene, &tables, settings, film_slots)
    }
}
