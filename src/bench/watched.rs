//! Renderings that end when they are asked to.

use std::ops::ControlFlow;

use crate::gpu::Context;
use crate::render::{Film, RenderError, RenderSettings, Renderer};
use crate::scene::Scene;

/// Renders; `go_on` is asked after every dispatch. `None` if it has broken: then the image may lack samples, and its time means
/// nothing.
///
/// # Errors
/// The rendering fails.
pub(super) fn render(
    renderer: &mut Renderer,
    mut go_on: impl FnMut() -> ControlFlow<()>,
) -> Result<Option<Film>, RenderError> {
    let mut asked = ControlFlow::Continue(());
    let film = renderer.render(|_| {
        asked = go_on();
        asked
    })?;
    Ok(asked.is_continue().then_some(film))
}

/// Steps of BVH traversal, if there is one, for each ray of a rendering. Counting takes time, so it has a pipeline of its own.
///
/// # Errors
/// The rendering fails.
pub(super) fn steps_per_ray(
    context: &Context,
    scene: &Scene,
    settings: &RenderSettings,
    go_on: impl FnMut() -> ControlFlow<()>,
) -> Result<Option<f64>, RenderError> {
    let mut renderer = Renderer::new(context, scene, &RenderSettings { count_steps: true, ..settings.clone() })?;
    render(&mut renderer, go_on)?;
    let s = renderer.statistics();
    Ok(renderer.bvh().map(|_| s.bvh_steps as f64 / (s.rays + s.shadow_rays).max(1) as f64))
}
