//! Light traced from emitters through glass and by mirrors (shaders/light_trace.comp), and what it lights.

pub(crate) mod splats;
pub(crate) mod tracer;
