//! Renderings that end when they are asked to.

use std::ops::ControlFlow;

use crate::render::{Film, RenderError, Renderer};

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
