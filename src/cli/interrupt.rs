//! Ctrl-C: asked once, a command ends in good order; asked twice, at once.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::signals;

/// Whether Ctrl-C was pressed.
#[derive(Clone)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Listens from now on. Once in a process.
    ///
    /// # Errors
    /// The system refuses.
    pub fn install() -> anyhow::Result<Self> {
        let pressed = Arc::new(AtomicBool::new(false));
        signals::set_when_asked_to_end(Arc::clone(&pressed))?;
        Ok(Self(pressed))
    }

    /// Whether it was pressed.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }

    /// The same for what asks whether to go on.
    pub fn go_on(&self) -> ControlFlow<()> {
        if self.requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// The same for what looks by itself.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.0)
    }
}
