//! Lights as the device has them: a table of lights and emitters, and a grid by which one of many is chosen (shaders/lib/light/).

pub(crate) mod alias;
pub(crate) mod emitter;
pub(crate) mod environment;
pub(crate) mod grid;
pub(crate) mod list;
pub(crate) mod screen_bounds;
pub(crate) mod solid_angle;
pub(crate) mod table;
pub(crate) mod tree;
