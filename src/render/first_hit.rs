//! What the camera sees in each pixel: the first hit of one ray (shaders/first_hit.comp).

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use crate::gpu::{BindingKind, BindingSet, Buffer, Device, Pipeline, Resource, Specialization, Usage};

use crate::render::engine::Engine;
use crate::render::engine::buffers::mapped;
use crate::render::error::RenderError;
use crate::render::film::tiling::{pixels_in, to_pixels};
use crate::render::kernel;
use crate::render::kernel::FIRST_HIT;
use crate::render::kernel::bindings;
use crate::render::kernel::layout::{FirstHit, Push, binding, first_hit};
use crate::render::kernel::specialization::id;
use crate::render::plan::dispatch::Span;
use crate::render::plan::launch::Launch;
use crate::render::plan::prepared::Prepared;
use crate::render::settings::RenderSettings;
use crate::render::space::RenderSpace;
use crate::render::space::view::View;

/// Rays of a dispatch at most, on CPUs and on GPUs.
const DISPATCH: [u32; 2] = [1 << 15, 1 << 18];
/// What the kernel sees, besides what all kernels do.
const BINDINGS: [(u32, BindingKind); 1] = [(binding::FIRST_HITS, BindingKind::Array)];

/// Which ray of each pixel is traced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CameraRay {
    /// That through the centre of the pixel, and that of the lens.
    Center,
    /// That of a sample.
    OfSample(u32),
}

/// What the ray through the centre of a pixel meets first, in the scene's units. Surfaces that some rays pass are met by chance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenSurface {
    /// Where.
    pub position: DVec3,
    /// Its distance from the camera, measured along the direction in which that looks.
    pub depth: f64,
    /// Unit geometric normal, towards the camera's side.
    pub normal: [f32; 3],
    /// Unit shading normal, on that side too.
    pub shading_normal: [f32; 3],
    /// The part of light that the surface scatters, an estimate; 0 of those that only emit.
    pub albedo: [f32; 3],
    /// The renderer's number of the sphere, polygon or triangle.
    pub primitive: u32,
    /// Index into the scene's materials.
    pub material: u32,
}

/// Traces camera rays to what they meet first. The kernel is made when it is first asked for.
pub(crate) struct FirstHitTracer {
    device: Arc<Device>,
    settings: RenderSettings,
    ray_query: bool,
    specialization: Specialization,
    workgroup: u32,
    most_rays: u32,
    kernel: Option<Kernel>,
    space: RenderSpace,
    /// In which the camera looks.
    forward: DVec3,
}

/// What it takes on the device.
struct Kernel {
    pipeline: Pipeline,
    set: BindingSet,
    records: Buffer,
}

impl FirstHitTracer {
    /// For what an engine with that launch renders.
    pub fn new(device: &Arc<Device>, launch: &Launch, prepared: &Prepared<'_>) -> Self {
        let traits = &launch.traits;
        // Small ones: pixels that are asked for may be few.
        let workgroup = if traits.threads { launch.subgroup.clamp(32, 128) } else { traits.workgroup_size };
        let mut specialization = launch.specialization(prepared);
        specialization.uint(id::WORKGROUP, workgroup).bool(id::PERSISTENT_THREADS, false).uint(id::SPLIT, 1);
        Self {
            device: Arc::clone(device),
            settings: prepared.settings.clone(),
            ray_query: prepared.features.ray_query,
            specialization,
            workgroup,
            most_rays: DISPATCH[usize::from(traits.threads)],
            kernel: None,
            space: RenderSpace::of(prepared.scene),
            forward: View::of(prepared.scene, 1.0).forward,
        }
    }

    /// Makes the kernel, which is soon asked for.
    ///
    /// # Errors
    /// A shader of the user's cannot be read; a limit of the device or its memory is exceeded; a Vulkan call fails.
    pub fn prepare(&mut self, engine: &mut Engine) -> Result<(), RenderError> {
        self.kernel(engine).map(|_| ())
    }

    /// Makes the kernel, if it is not there.
    fn kernel(&mut self, engine: &mut Engine) -> Result<&Kernel, RenderError> {
        if self.kernel.is_none() {
            let start = Instant::now();
            self.kernel = Some(self.make(engine)?);
            engine.statistics.compile_seconds += start.elapsed().as_secs_f64();
        }
        self.kernel.as_ref().ok_or_else(|| RenderError::Driver("no kernel".to_owned()))
    }

    fn make(&self, engine: &mut Engine) -> Result<Kernel, RenderError> {
        let Self { device, settings, .. } = self;
        let layout = bindings::layout(device, &BINDINGS, self.ray_query)?;
        let spirv = kernel::spirv(&FIRST_HIT, settings)?;
        let pipeline = Pipeline::new(device, FIRST_HIT.name, &spirv, &self.specialization, &layout)
            .map_err(|error| kernel::not_made(&FIRST_HIT, settings, error))?;
        let bytes = u64::from(self.most_rays) * size_of::<FirstHit>() as u64;
        let records = Buffer::new(device, "first hits", bytes, Usage::HostTexelAndArray)?;
        let buffers = engine.buffers();
        let film = &buffers.bands[0].film;
        let own = [(binding::FILM, film), (binding::FILM_ROWS, film), (binding::COUNTERS, &buffers.counters)];
        let mut bound = buffers.tables.and(&own);
        bound.push((binding::FIRST_HITS, Resource::Buffer(&records)));
        let set = BindingSet::new(&layout, &bound)?;
        engine.warm_up_kernel((&pipeline, &set))?;
        Ok(Kernel { pipeline, set, records })
    }

    /// What each pixel shows, row by row from the top left.
    ///
    /// # Errors
    /// As of [`Self::trace`].
    pub fn seen_surfaces(&mut self, engine: &mut Engine) -> Result<Vec<Option<SeenSurface>>, RenderError> {
        let (space, forward, whole) = (self.space, self.forward, engine.whole_film());
        let mut seen = vec![None; engine.pixel_count() as usize];
        let put = |seen: &mut Option<SeenSurface>, hit: &FirstHit| {
            let position = DVec3::from(hit.position.map(f64::from));
            *seen = hit.is(first_hit::MET).then(|| SeenSurface {
                position: space.scene_point(position),
                depth: space.scene_length(position.dot(forward)),
                normal: hit.normal,
                shading_normal: hit.shading,
                albedo: hit.albedo,
                primitive: hit.primitive.cast_unsigned(),
                material: hit.material,
            });
        };
        engine.look(|_| (), |engine| self.trace(engine, &whole, (CameraRay::Center, false), &mut seen, put))?;
        Ok(seen)
    }

    /// Traces a ray of each pixel of some spans, on from mirrors if these are to be `followed`. `put` gets what it meets, and the pixel of an
    /// image, row by row. The film is not touched.
    ///
    /// # Errors
    /// The kernel cannot be made; the device fails; the budget of loops does not suffice for a ray.
    pub fn trace<P: Send>(
        &mut self,
        engine: &mut Engine,
        spans: &[Span],
        (ray, followed): (CameraRay, bool),
        pixels: &mut [P],
        put: impl Fn(&mut P, &FirstHit) + Sync,
    ) -> Result<(), RenderError> {
        let (most_rays, workgroup) = (self.most_rays, self.workgroup);
        let Kernel { pipeline, set, records } = self.kernel(engine)?;
        let [width, height] = engine.size();
        let camera_sample = match ray {
            CameraRay::Center => first_hit::CENTER,
            CameraRay::OfSample(number) => number,
        };
        for span in spans {
            for first_slot in (span.first_slot..span.end_slot).step_by(most_rays as usize) {
                let end_slot = span.end_slot.min(first_slot + most_rays);
                let push =
                    Push { first_slot, end_slot, camera_sample, follows_mirrors: followed.into(), ..engine.push };
                let workgroups = (end_slot - first_slot).div_ceil(workgroup);
                let wanted = engine.statistics.samples + pixels_in(first_slot, end_slot, width, height);
                let ticket = engine.submit_kernel((pipeline, set), FIRST_HIT.name, &push, workgroups, 0)?;
                engine.finish(&ticket, 0)?;
                if engine.statistics.samples < wanted {
                    return Err(RenderError::Stuck { budget: engine.launch.loop_budget });
                }
                let hits: &[FirstHit] = bytemuck::cast_slice(mapped(records)?);
                to_pixels(first_slot, &hits[..(end_slot - first_slot) as usize], pixels, width, &put);
            }
        }
        Ok(())
    }
}
