//! Images from differences between neighbouring pixels, where paths serve several of them (shaders/lib/gradient.glsl).

pub(crate) mod develop;
pub(crate) mod phases;
pub(crate) mod screened_poisson;
pub(crate) mod surfaces;
pub(crate) mod weights;
