//! The scene as plain data, in double precision and in the units of the scene file.
//!
//! Nothing here knows of files, of the GPU or of how the scene is rendered. A [`Scene`] that passed
//! [`Scene::validate`](crate::Scene::validate) is finite, has at least one primitive, and all of its
//! indices are in range.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::scene::environment::Environment;
use crate::scene::texture::{Texture, TextureImage, TextureSlot};

pub use crate::scene::rgb::Rgb;
pub use crate::scene::surface::*;

/// A camera: a pinhole, unless it says otherwise. `target` is in the middle of the image.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Of the pinhole, of the middle of the lens, or of the plane that parallel rays start from; scene units.
    pub position: DVec3,
    /// A point on the optical axis, scene units; not equal to `position`.
    pub target: DVec3,
    /// Points up in the image; not parallel to the optical axis. Any length.
    pub up: DVec3,
    /// Full horizontal angle of view, degrees, in (0, 180). Parallel rays have none.
    pub horizontal_fov: f64,
    /// Width of what an orthographic camera shows, scene units, > 0; `None`: perspective.
    pub orthographic_width: Option<f64>,
    /// Thin lens; `None`: all is in focus.
    pub lens: Option<Lens>,
}

impl Camera {
    /// Whether all rays start in one point.
    pub fn is_pinhole(&self) -> bool {
        self.orthographic_width.is_none() && self.lens.is_none()
    }
}

/// A thin lens with a round aperture. Each pixel's rays leave it evenly spread, and meet where the pinhole's ray meets the plane in
/// focus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Of the aperture, scene units, > 0.
    pub radius: f64,
    /// Of the plane in focus, along the optical axis; scene units, > 0.
    pub focus: f64,
}

/// The reconstruction filter of a pixel. Both are importance sampled: every sample has weight 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelFilter {
    /// Normal distribution around the pixel centre with a standard deviation of half a pixel (Box–Muller).
    Gaussian,
    /// Uniform over the one-pixel square.
    Box,
}

/// How linear radiance becomes 8-bit code values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transfer {
    /// `code = 255·L^(1/gamma)`, gamma > 0.
    Gamma(f64),
    /// The piecewise curve of IEC 61966-2-1.
    Srgb,
}

/// By how much 8-bit output is brightened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    /// By 2 to the power of this.
    Stops(f64),
    /// So that the mean logarithm of the luminance of what shows geometry becomes that of 0.18, to a third of a stop.
    Auto,
}

/// How radiance is brought into the range of 8-bit output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// It is cut off at 1.
    None,
    /// Khronos PBR Neutral: colours below 0.8 keep their hue and saturation.
    Neutral,
    /// AgX, its base look.
    Agx,
}

/// Image size and how samples become pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Pixels, 1..=65536.
    pub width: u32,
    /// Pixels, 1..=65536.
    pub height: u32,
    /// Reconstruction filter.
    pub filter: PixelFilter,
    /// Transfer curve of 8-bit output.
    pub transfer: Transfer,
    /// Of 8-bit output.
    pub exposure: Exposure,
    /// Of 8-bit output.
    pub tone: Tone,
    /// The background is left out, and alpha is the share of camera rays that meet geometry.
    pub transparent: bool,
}

/// How light is carried.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Integrator {
    /// Longest chain of surface hits of a path, each with its direct light; 1 = direct light only. At least 1.
    pub max_depth: u32,
    /// Samples per pixel, 1 to [`MAX_SAMPLES`](crate::scene::MAX_SAMPLES).
    pub samples: u32,
    /// First surface hit (1 = the first) after which a path may be ended at random; `None`: never.
    pub russian_roulette: Option<u32>,
    /// `false`: direct light only on diffuse surfaces (mirror and glass are still followed).
    pub indirect: bool,
}

/// Which rays a surface stops. Those that it lets pass do not meet it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Coverage {
    /// All.
    #[default]
    Opaque,
    /// All, where alpha is at least this.
    Mask(f64),
    /// The part alpha of them.
    Blend,
}

/// A named surface, with what varies over it.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Unique in the scene.
    pub name: String,
    /// What it does, where no texture or vertex colour changes that.
    pub surface: Surface,
    /// By what they change.
    pub textures: BTreeMap<TextureSlot, Texture>,
    /// Scales x and y of normals that textures give.
    pub normal_scale: f64,
    /// The same, of the coat.
    pub coat_normal_scale: f64,
    /// Alpha: 0..=1; times that of the texture of the base colour, and that of vertex colours.
    pub alpha: f64,
    /// What alpha means.
    pub coverage: Coverage,
    /// Its back lets all rays pass.
    pub culls_back: bool,
    /// Its emission is not light for light sampling, and has the colour of the base texture and of the vertices.
    pub unlit: bool,
}

impl Material {
    /// Without textures; opaque on both sides.
    pub fn new(name: impl Into<String>, surface: Surface) -> Self {
        Self {
            name: name.into(),
            surface,
            textures: BTreeMap::new(),
            normal_scale: 1.0,
            coat_normal_scale: 1.0,
            alpha: 1.0,
            coverage: Coverage::Opaque,
            culls_back: false,
            unlit: false,
        }
    }

    /// Whether there is more to it than a colour or an index.
    pub(crate) fn has_details(&self) -> bool {
        self.surface.has_microfacets() || !self.textures.is_empty() || self.has_alpha()
    }

    /// Whether something lies over its base, or makes that other than isotropic and of a constant dielectric.
    pub(crate) fn has_layers(&self) -> bool {
        let is_layered = self.is_coated() || self.has_sheen() || self.is_anisotropic();
        is_layered || self.has_specular_textures() || self.surface.is_conductor()
    }

    /// Whether it has a clear coat.
    pub(crate) fn is_coated(&self) -> bool {
        self.surface.model().is_some_and(|model| model.coat > 0.0)
    }

    /// Whether it has sheen.
    pub(crate) fn has_sheen(&self) -> bool {
        self.surface.model().is_some_and(|model| model.sheen_color != [0.0; 3])
    }

    /// Whether it reflects more broadly along one direction of the surface.
    pub(crate) fn is_anisotropic(&self) -> bool {
        self.surface.model().is_some_and(|model| model.anisotropy > 0.0)
    }

    /// Whether the reflection of its dielectric differs from point to point.
    pub(crate) fn has_specular_textures(&self) -> bool {
        let has = |slot| self.textures.contains_key(&slot);
        self.surface.is_metallic_roughness() && (has(TextureSlot::Specular) || has(TextureSlot::SpecularColor))
    }

    /// Whether some rays pass it.
    pub(crate) fn lets_rays_pass(&self) -> bool {
        self.culls_back || self.has_alpha()
    }

    /// Whether what it emits differs from point to point.
    pub(crate) fn has_varied_emission(&self) -> bool {
        self.surface.emits() && (self.has_alpha() || self.textures.contains_key(&TextureSlot::Emission))
    }

    /// The set of texture coordinates that tangents are needed along, if they are.
    pub(crate) fn tangent_uv(&self) -> Option<usize> {
        let texture = |slot| self.textures.get(&slot);
        let normal = texture(TextureSlot::Normal).or(texture(TextureSlot::CoatNormal));
        let is_anisotropic = matches!(self.surface.bsdf, Bsdf::MetallicRoughness(m) if m.anisotropy > 0.0);
        let along = normal.or(texture(TextureSlot::Anisotropy));
        (normal.is_some() || is_anisotropic).then(|| along.map_or(0, |texture| texture.uv_set as usize))
    }

    /// Whether alpha may let rays pass.
    pub(crate) fn has_alpha(&self) -> bool {
        self.coverage != Coverage::Opaque
    }
}

/// An analytic sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Sphere {
    /// Scene units.
    pub center: DVec3,
    /// Scene units, > 0.
    pub radius: f64,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// The normal points to the centre.
    pub inward: bool,
}

/// Which normal shades a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Normals {
    /// The geometric one.
    #[default]
    Flat,
    /// Interpolated from the vertices (from the file, else area-weighted from the faces).
    Smooth,
}

/// A triangle mesh in scene space (scale, rotation and translation are already applied).
///
/// Front is the side from which the vertices run counter-clockwise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// For messages: the file.
    pub name: String,
    /// Vertices, scene units.
    pub positions: Vec<DVec3>,
    /// Unit vertex normals, one for each position; empty when `normals` is flat.
    pub vertex_normals: Vec<DVec3>,
    /// Two sets of texture coordinates, each with one for each position or empty.
    pub uvs: [Vec<[f32; 2]>; 2],
    /// Unit tangent and bitangent, one for each position; empty where no texture gives normals and nothing is anisotropic.
    pub tangents: Vec<[[f32; 3]; 2]>,
    /// Linear colours that multiply the base colour, and alpha; one for each position or empty.
    pub colors: Vec<[f32; 4]>,
    /// Indices into `positions`; no degenerate triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`], one for each triangle.
    pub triangle_materials: Vec<u32>,
    /// Which normal shades.
    pub normals: Normals,
    /// Faces of the file that were dropped because they have no area.
    pub degenerate_dropped: usize,
}

/// A source of light that is not a surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// Isotropic: irradiance = power·cosθ / (4π d²).
    Point {
        /// Scene units.
        position: DVec3,
        /// Total power per channel, >= 0.
        power: Rgb,
    },
    /// A point within a cone: irradiance = intensity·s·w·cosθ/d², where s falls from 1 to 0 between the inner and the outer angle as the
    /// square of the part of the difference of their cosines, and w = max(0, 1 − (d/range)⁴) (KHR_lights_punctual).
    Spot {
        /// Scene units.
        position: DVec3,
        /// Axis of the cone; any length but 0.
        direction: DVec3,
        /// Power per steradian and channel, >= 0.
        intensity: Rgb,
        /// From the axis, degrees, 0..=180; at 180 it shines to all sides alike.
        inner: f64,
        /// From the axis, degrees, `inner`..=180.
        outer: f64,
        /// Scene units, > 0; infinite where distance alone weakens it.
        range: f64,
    },
    /// Parallel light from afar: irradiance·cosθ.
    Directional {
        /// Where light goes; any length but 0.
        direction: DVec3,
        /// Per channel, >= 0, on a surface across the direction.
        irradiance: Rgb,
    },
}

impl Light {
    /// Whether any light comes from it.
    pub fn shines(&self) -> bool {
        self.color() != [0.0; 3]
    }

    /// Its power, intensity or irradiance.
    pub fn color(&self) -> Rgb {
        match *self {
            Self::Point { power: color, .. }
            | Self::Spot { intensity: color, .. }
            | Self::Directional { irradiance: color, .. } => color,
        }
    }

    /// Where it is, unless it is infinitely far.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }

    /// The same place to change.
    pub fn position_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }
}

/// Everything that is rendered, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Where the scene came from, for messages and metadata.
    pub source: String,
    /// The camera.
    pub camera: Camera,
    /// Image size, filter and transfer curve.
    pub film: Film,
    /// Path depth, samples, roulette.
    pub integrator: Integrator,
    /// Radiance that arrives where a ray meets nothing.
    pub background: Rgb,
    /// A map of the radiance that arrives there instead.
    pub environment: Option<Environment>,
    /// Surfaces, referred to by index.
    pub materials: Vec<Material>,
    /// What textures show, referred to by index.
    pub images: Vec<TextureImage>,
    /// Analytic spheres.
    pub spheres: Vec<Sphere>,
    /// Triangle meshes.
    pub meshes: Vec<Mesh>,
    /// Point lights. (Emitting surfaces are spheres and meshes with an emitter material.)
    pub lights: Vec<Light>,
}

impl Scene {
    /// Number of triangles over all meshes.
    pub fn triangle_count(&self) -> usize {
        self.meshes.iter().map(|m| m.triangles.len()).sum()
    }

    /// Of a material, by its index.
    pub(crate) fn surface(&self, material: u32) -> &Surface {
        &self.materials[material as usize].surface
    }
}
