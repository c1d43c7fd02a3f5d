//! Scene description, scene files, OBJ and MTL. No GPU types.
//!
//! [`Scene`] is plain data. [`Scene::load`] makes one from a file and [`Scene::validate`] checks one that was built in
//! code; both refuse anything that could not be rendered, with a [`SceneError`] that names the place.

mod defaults;
mod description;
mod environment;
mod error;
mod facing;
mod fingerprint;
mod fit;
mod format;
mod format_values;
mod from_table;
mod gltf;
mod image_file;
mod limits;
mod load;
mod load_options;
mod locate;
mod materials;
mod metals;
mod model;
mod named_camera;
pub mod obj;
mod parse;
mod placed;
mod precision;
mod problem;
mod read;
mod rgb;
mod silhouette;
pub(crate) mod srgb;
mod surface;
mod table_material;
mod table_model;
mod table_source;
mod table_texture;
mod tangents;
mod texel_channels;
mod texture;
mod texture_limit;
mod transform;
mod triangle;
mod unit;
mod validate;
mod validate_material;

pub use crate::scene::description::*;
pub use crate::scene::environment::Environment;
pub use crate::scene::error::{Entity, Location, SceneError};
pub use crate::scene::fingerprint::fingerprint;
pub use crate::scene::limits::{IOR_RANGE, MAX_DEPTH, MAX_IMAGE_SIDE, MAX_MAGNITUDE, MAX_SAMPLES, MIN_RADIUS};
pub use crate::scene::load::Loaded;
pub use crate::scene::load_options::LoadOptions;
pub use crate::scene::named_camera::{NamedCamera, Vertical};
pub(crate) use crate::scene::parse::one_line;
pub use crate::scene::texture::{Texels, Texture, TextureImage, TextureSlot, Wrap};
pub use crate::scene::transform::Placement;
pub(crate) use crate::scene::unit::unit;
