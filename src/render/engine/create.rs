//! An engine is made: buffers and pipelines side by side.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::thread::{Builder, scope};
use std::time::Instant;

use crate::gpu::{Device, DeviceKind, Pipeline, Timeline};
use crate::render::engine::Engine;
use crate::render::engine::buffers;
use crate::render::engine::buffers::{Buffers, IN_FLIGHT, Shape};
use crate::render::error::RenderError;
use crate::render::film::tiling::MEMBERS;
use crate::render::kernel;
use crate::render::kernel::bindings;
use crate::render::kernel::sobol;
use crate::render::plan::launch::Launch;
use crate::render::plan::prepared::{Prepared, push_constants};
use crate::render::statistics::RenderStatistics;

/// What else is made while the driver works on the engine's pipeline.
pub(crate) type Beside<'a, T> = dyn Fn() -> Result<T, RenderError> + Sync + 'a;

impl Engine {
    /// Makes one: the driver works on the shader while buffers are made and filled, and while something is made beside it, unless it must
    /// do one after the other. Returns what was made beside as well, and the seconds that pipelines took.
    ///
    /// # Errors
    /// The device's limits or memory are exceeded; a shader of the user's cannot be read; a Vulkan call fails.
    pub fn new<T: Send>(
        device: &Arc<Device>,
        launch: Launch,
        prepared: &Prepared<'_>,
        beside: Option<&Beside<'_, T>>,
    ) -> Result<(Self, Option<T>, f64), RenderError> {
        let Prepared { scene, settings, features, tables, .. } = prepared;
        let built_in = kernel::built_in(launch.schedule);
        let spirv = kernel::spirv(&built_in, settings)?;
        let specialization = launch.specialization(prepared);
        let layout = bindings::layout(device, &buffers::BINDINGS, features.ray_query)?;
        let mut timeline = Timeline::new(device, IN_FLIGHT + 1)?;
        let shape = Shape::new(&launch, [scene.film.width, scene.film.height], settings);
        // Each time that lavapipe begins to make machine code, as it does for the buffers' formats, it sets the width of its vectors to 256
        // bits, and then to what was asked for: a shader that another thread works on meanwhile may take a subgroup's lanes for eight
        // (lp_build_init_native_width of Mesa 25.0; up to one start of 500 on a busy machine).
        let one_by_one = device.info.kind == DeviceKind::Cpu && launch.subgroup != 8;
        // (On the main thread pipelines, which allocate much more: the heaps of other threads grow in small steps.)
        let (pipeline, made_beside, seconds, buffers) = scope(|scope| {
            let mut fill = || {
                let sobol = sobol::table(launch.kernel.sobol_levels, if launch.kernel.reuse { MEMBERS } else { 1 });
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
            let make_pipeline = || {
                Pipeline::new(device, built_in.name, &spirv, &specialization, &layout)
                    .map_err(|error| kernel::not_made(&built_in, settings, error))
            };
            let (pipeline, made_beside) = match beside {
                Some(beside) if !one_by_one => {
                    let made = Builder::new().spawn_scoped(scope, beside).map_err(RenderError::Thread)?;
                    (make_pipeline(), made.join().unwrap_or_else(|panic| resume_unwind(panic)).map(Some))
                }
                _ => (make_pipeline(), beside.map(|beside| beside()).transpose()),
            };
            let seconds = start.elapsed().as_secs_f64();
            let buffers = buffers.join().unwrap_or_else(|panic| resume_unwind(panic))?;
            Ok::<_, RenderError>((pipeline?, made_beside?, seconds, buffers))
        })?;
        let engine = Self {
            statistics: RenderStatistics::default(),
            push: push_constants(scene, settings),
            pace: launch.pace(settings),
            launch,
            stage: built_in.name,
            timeline,
            pipeline,
            buffers,
        };
        Ok((engine, made_beside, seconds))
    }
}
