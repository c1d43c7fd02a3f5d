//! How surfaces scatter light, and what they emit.

use crate::scene::rgb::Rgb;

/// How a surface scatters light (shaders/lib/bsdf/bsdf.glsl).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bsdf {
    /// Scatters nothing.
    Black,
    /// Lambertian, on both sides.
    Diffuse {
        /// Reflectance, 0..=1 per channel.
        reflectance: Rgb,
    },
    /// Perfect mirror, on both sides.
    Mirror {
        /// Reflectance, 0..=1 per channel.
        reflectance: Rgb,
    },
    /// Smooth interface; the normal points to the side of index 1.
    Dielectric {
        /// Index of refraction of the side away from the normal over that of the normal's side; within
        /// [`IOR_RANGE`](crate::scene::IOR_RANGE).
        ior: f64,
    },
    /// glTF's metallic-roughness model and its extensions.
    MetallicRoughness(MetallicRoughness),
    /// Metal, or a rough mirror, on both sides.
    Conductor(Conductor),
}

impl Bsdf {
    /// What it is called.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Diffuse { .. } => "diffuse",
            Self::Mirror { .. } => "mirror",
            Self::Dielectric { .. } => "dielectric",
            Self::Black => "emitter",
            Self::MetallicRoughness(_) => "metallic-roughness",
            Self::Conductor(_) => "conductor",
        }
    }
}

/// Microfacets (GGX, with more than one scattering) that let no light in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conductor {
    /// What a microfacet reflects.
    pub reflection: Reflection,
    /// 0..=1.
    pub roughness: f64,
}

/// What part of light a microfacet reflects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reflection {
    /// The same at all angles, 0..=1 per channel.
    Constant(Rgb),
    /// By Fresnel's equations for unpolarised light and the index η + ik beside that of air.
    Index {
        /// Real part, > 0 per channel.
        eta: Rgb,
        /// Imaginary part, at least 0 per channel.
        k: Rgb,
    },
}

/// glTF's metallic-roughness model: the mix by metalness of a metal and of a dielectric over a diffuse base. Both reflect by a GGX
/// microfacet distribution with α = roughness², and what one scattering loses is added as more scatterings
/// (docs/rendering.md).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetallicRoughness {
    /// Reflectance of the diffuse base, and of metal at normal incidence; 0..=1 per channel.
    pub base_color: Rgb,
    /// 0..=1.
    pub metallic: f64,
    /// 0..=1.
    pub roughness: f64,
    /// Index of refraction of the dielectric, at least 1.
    pub ior: f64,
    /// Strength of the dielectric's reflection, 0..=1.
    pub specular: f64,
    /// Colour of the dielectric's reflection at normal incidence, at least 0 per channel.
    pub specular_color: Rgb,
    /// Part of the diffuse base that lets light through instead, 0..=1.
    pub transmission: f64,
    /// Of what lets light through: a body with an inside, else a thin wall.
    pub has_volume: bool,
    /// Colour of white light after it has gone `attenuation_distance` through the body; 0..=1 per channel.
    pub attenuation_color: Rgb,
    /// Scene units; infinite where nothing is absorbed.
    pub attenuation_distance: f64,
    /// Strength of a clear coat of index 1.5, 0..=1.
    pub coat: f64,
    /// Of the coat, 0..=1.
    pub coat_roughness: f64,
    /// 0..=1 per channel.
    pub sheen_color: Rgb,
    /// 0..=1.
    pub sheen_roughness: f64,
    /// Stretches reflections across the tangent, 0..=1.
    pub anisotropy: f64,
    /// From the tangent towards the bitangent, radians.
    pub anisotropy_rotation: f64,
}

impl Default for MetallicRoughness {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The most that a body absorbs on its attenuation distance, as −ln of what is left.
const MOST_ABSORBED: f64 = 100.0;

impl MetallicRoughness {
    /// What glTF says of a material that states nothing.
    pub const DEFAULT: Self = Self {
        base_color: [1.0; 3],
        metallic: 1.0,
        roughness: 1.0,
        ior: 1.5,
        specular: 1.0,
        specular_color: [1.0; 3],
        transmission: 0.0,
        has_volume: false,
        attenuation_color: [1.0; 3],
        attenuation_distance: f64::INFINITY,
        coat: 0.0,
        coat_roughness: 0.0,
        sheen_color: [0.0; 3],
        sheen_roughness: 0.0,
        anisotropy: 0.0,
        anisotropy_rotation: 0.0,
    };

    /// Of light that has gone a distance d through the body e^(−absorption·d) is left; per scene unit.
    pub fn absorption(&self) -> Rgb {
        if !self.has_volume {
            return [0.0; 3];
        }
        let of_channel = |color: f64| (-color.ln()).clamp(0.0, MOST_ABSORBED) / self.attenuation_distance;
        self.attenuation_color.map(of_channel)
    }
}

/// What a surface does with light: it scatters and, on its front or on both sides, emits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// What it does with light that arrives.
    pub bsdf: Bsdf,
    /// Radiance that leaves its front, the normal's side, in all directions; >= 0 per channel.
    pub emission: Rgb,
    /// Its back emits as its front does.
    pub two_sided: bool,
}

impl Surface {
    /// A Lambertian surface.
    pub const fn diffuse(reflectance: Rgb) -> Self {
        Self { bsdf: Bsdf::Diffuse { reflectance }, emission: [0.0; 3], two_sided: false }
    }

    /// A perfect mirror.
    pub const fn mirror(reflectance: Rgb) -> Self {
        Self { bsdf: Bsdf::Mirror { reflectance }, emission: [0.0; 3], two_sided: false }
    }

    /// A smooth interface.
    pub const fn dielectric(ior: f64) -> Self {
        Self { bsdf: Bsdf::Dielectric { ior }, emission: [0.0; 3], two_sided: false }
    }

    /// A surface that emits and scatters nothing.
    pub const fn emitter(radiance: Rgb) -> Self {
        Self { bsdf: Bsdf::Black, emission: radiance, two_sided: false }
    }

    pub(crate) fn is_diffuse(&self) -> bool {
        matches!(self.bsdf, Bsdf::Diffuse { .. })
    }

    pub(crate) fn is_mirror(&self) -> bool {
        matches!(self.bsdf, Bsdf::Mirror { .. })
    }

    pub(crate) fn is_dielectric(&self) -> bool {
        matches!(self.bsdf, Bsdf::Dielectric { .. })
    }

    pub(crate) fn is_metallic_roughness(&self) -> bool {
        self.model().is_some()
    }

    pub(crate) fn is_conductor(&self) -> bool {
        matches!(self.bsdf, Bsdf::Conductor(_))
    }

    /// Whether it reflects by microfacets.
    pub(crate) fn has_microfacets(&self) -> bool {
        self.is_metallic_roughness() || self.is_conductor()
    }

    /// Its numbers, if it is of the metallic-roughness model.
    pub(crate) fn model(&self) -> Option<&MetallicRoughness> {
        match &self.bsdf {
            Bsdf::MetallicRoughness(model) => Some(model),
            _ => None,
        }
    }

    /// Whether it is of the metallic-roughness model and lets light through.
    pub(crate) fn is_transmissive(&self) -> bool {
        matches!(self.bsdf, Bsdf::MetallicRoughness(m) if m.transmission > 0.0)
    }

    /// Whether light loses some of itself behind it.
    pub(crate) fn absorbs(&self) -> bool {
        matches!(self.bsdf, Bsdf::MetallicRoughness(m) if m.transmission > 0.0 && m.absorption() != [0.0; 3])
    }

    /// Whether any light leaves it that did not come to it.
    pub(crate) fn emits(&self) -> bool {
        self.emission != [0.0; 3]
    }

    /// What it emits, if that is anything.
    pub(crate) fn emitted(&self) -> Option<Rgb> {
        self.emits().then_some(self.emission)
    }
}
