//! What a renderer has on the device, made side by side.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::thread::{Builder, scope};
use std::time::Instant;

use crate::gpu::{Device, DeviceKind, Pipeline, Timeline};
use crate::render::error::RenderError;
use crate::render::film::MEMBERS;
use crate::render::kernel;
use crate::render::kernel::bindings;
use crate::render::kernel::layout::binding;
use crate::render::renderer::IN_FLIGHT;
use crate::render::renderer::buffers;
use crate::render::renderer::buffers::Buffers;
use crate::render::renderer::launch::Launch;
use crate::render::renderer::light_tracing::{LightTracer, most_light_paths};
use crate::render::sampling::sobol;
use crate::render::scene::Prepared;

/// Buffers and pipelines.
pub(crate) struct Parts {
    pub timeline: Timeline,
    pub pipeline: Pipeline,
    pub light_paths: Option<LightTracer>,
    pub buffers: Buffers,
    /// The name of the kernel.
    pub stage: &'static str,
    /// What the pipelines took.
    pub pipeline_seconds: f64,
}

impl Parts {
    /// Makes them: the driver works on the shader while buffers are made and filled, unless it must do one after the other.
    ///
    /// # Errors
    /// The device's limits or memory are exceeded; a shader of the user's cannot be read; a Vulkan call fails.
    pub fn of(device: &Arc<Device>, launch: &Launch, prepared: &Prepared<'_>) -> Result<Self, RenderError> {
        let Prepared { scene, settings, tables, .. } = prepared;
        let built_in = kernel::built_in(launch.schedule);
        let spirv = kernel::spirv(&built_in, settings)?;
        let specialization = launch.specialization(prepared);
        let layout = bindings::layout(device, &buffers::BINDINGS)?;
        let light_tracing_layout = (launch.casters > 0).then(|| LightTracer::layout(device)).transpose()?;
        let light_tracing_workgroup = launch.light_tracing_workgroup();
        let mut timeline = Timeline::new(device, IN_FLIGHT + 1)?;
        let shape = launch.shape([scene.film.width, scene.film.height], settings);
        // Each time that lavapipe begins to make machine code, as it does for the buffers' formats, it sets the width of its vectors to 256
        // bits, and then to what was asked for: a shader that another thread works on meanwhile may take a subgroup's lanes for eight
        // (lp_build_init_native_width of Mesa 25.0; up to one start of 500 on a busy machine).
        let one_by_one = device.info.kind == DeviceKind::Cpu && launch.subgroup != 8;
        // (On the main thread pipelines, which allocate much more: the heaps of other threads grow in small steps.)
        let (pipeline, light_tracing_pipeline, pipeline_seconds, buffers) = scope(|scope| {
            let mut fill = || {
                let sobol = sobol::table(launch.sobol_levels, if launch.reuse { MEMBERS } else { 1 });
                Buffers::new(device, &layout, &mut timeline, tables, &sobol, &shape)
            };
            let filled = if one_by_one { Some(fill()?) } else { None };
            let touched = move || {
                let mut buffers = filled.map_or_else(fill, Ok)?;
                buffers.touch();
                Ok::<_, RenderError>(buffers)
            };
            let buffers = Builder::new().spawn_scoped(scope, touched).map_err(RenderError::Thread)?;
            let start = Instant::now();
            let of_light_paths = || match &light_tracing_layout {
                Some(layout) => {
                    LightTracer::pipeline(device, layout, &specialization, light_tracing_workgroup, settings).map(Some)
                }
                None => Ok(None),
            };
            let of_paths = || {
                Pipeline::new(device, built_in.name, &spirv, &specialization, &layout)
                    .map_err(|error| kernel::not_made(&built_in, settings, error))
            };
            let (pipeline, light_paths) = if one_by_one || light_tracing_layout.is_none() {
                (of_paths(), of_light_paths())
            } else {
                let light_paths = Builder::new().spawn_scoped(scope, of_light_paths).map_err(RenderError::Thread)?;
                (of_paths(), light_paths.join().unwrap_or_else(|panic| resume_unwind(panic)))
            };
            let seconds = start.elapsed().as_secs_f64();
            let buffers = buffers.join().unwrap_or_else(|panic| resume_unwind(panic))?;
            Ok::<_, RenderError>((pipeline?, light_paths?, seconds, buffers))
        })?;
        let light_paths = light_tracing_layout.zip(light_tracing_pipeline).map(|(layout, pipeline)| {
            let film = &buffers.bands[0].film;
            let own = [(binding::FILM, film), (binding::FILM_ROWS, film), (binding::COUNTERS, &buffers.counters)];
            let pixels = u64::from(scene.film.width) * u64::from(scene.film.height);
            let most_light_paths = most_light_paths(pixels, settings);
            LightTracer::new(
                device,
                &layout,
                pipeline,
                light_tracing_workgroup,
                &launch.traits,
                most_light_paths,
                &buffers.tables.and(&own),
            )
        });
        let light_paths = light_paths.transpose()?;
        Ok(Self { timeline, pipeline, light_paths, buffers, stage: built_in.name, pipeline_seconds })
    }
}
