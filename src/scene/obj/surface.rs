//! What a material of MTL becomes: which model reflects, and its numbers (docs/scene-format.md).

use crate::scene::description::{Bsdf, MetallicRoughness, Rgb};
use crate::scene::limits::{EXPECTED_IOR, IOR_RANGE};
use crate::scene::obj::map::MapKind;
use crate::scene::obj::mtl::MtlMaterial;
use crate::scene::problem::number;

/// Reflectance where a file gives none.
pub(super) const GREY: Rgb = [0.8; 3];

/// Index of refraction where a file gives none.
const IOR: f64 = 1.5;

/// From which opacity on a surface is opaque: exporters round.
pub(super) const OPAQUE: f64 = 0.999;

/// Largest `Ns`: that of what is perfectly smooth.
pub(super) const SMOOTH_EXPONENT: f64 = 1000.0;

/// Roughness where neither `Pr` nor `Ns` gives it.
const ROUGHNESS: f64 = 0.5;

/// The roughness for an exponent of Phong's model, as Blender has it.
pub(super) fn roughness_of_exponent(exponent: f64) -> f64 {
    1.0 - (exponent.clamp(0.0, SMOOTH_EXPONENT) / SMOOTH_EXPONENT).sqrt()
}

impl MtlMaterial {
    /// How it reflects, whatever it emits. `has` tells which textures there are, `opacity` is that of [`Self::opacity`]. `warn` is told
    /// of everything that is lost or replaced.
    ///
    /// A mirror is of `illum` 3, 5 or 8 (reflection) with `Ks` above 0 or `Kd` 0, or has `Ks` 1 and `Kd` 0. Glass needs an index that
    /// is not 1, and `illum` 4, 6, 7 or 9 (refraction) or transparency; without an index, `illum` and transparency (or `Kd` 0).
    /// Statements of physically based rendering go before these. All else is diffuse, with a gloss if it says so.
    pub fn reflecting(&self, has: &dyn Fn(MapKind) -> bool, opacity: f64, warn: &mut dyn FnMut(&str)) -> Bsdf {
        let is_pbr = self.is_physical(has);
        let reflects = matches!(self.model, Some(3 | 5 | 8));
        if !is_pbr {
            if self.is_mirror(has) {
                return self.mirror(has, warn);
            }
            if reflects {
                warn("a mirror (illum 3, 5 or 8) without Ks: the surface is diffuse");
            }
        }
        if self.is_glass(has, opacity, warn) {
            return self.glass(is_pbr, warn);
        }
        let base_color = self.base_color(has, warn);
        let ior = self.ior.filter(|ior| *ior > 1.0 && IOR_RANGE.contains(ior)).unwrap_or(IOR);
        let roughness = self.gloss(has).unwrap_or(ROUGHNESS);
        let plain = MetallicRoughness { base_color, metallic: 0.0, roughness, ior, ..MetallicRoughness::default() };
        if is_pbr {
            let metallic = if reflects { 1.0 } else { 0.0 };
            let sheen = if has(MapKind::Sheen) { 1.0 } else { self.sheen.unwrap_or(0.0) };
            return Bsdf::MetallicRoughness(MetallicRoughness {
                metallic: if has(MapKind::Metallic) { 1.0 } else { self.metallic.unwrap_or(metallic) },
                coat: if has(MapKind::Coat) { 1.0 } else { self.coat.unwrap_or(0.0) },
                coat_roughness: if has(MapKind::CoatRoughness) { 1.0 } else { self.coat_roughness.unwrap_or(0.0) },
                sheen_color: [sheen; 3],
                sheen_roughness: if sheen > 0.0 { ROUGHNESS } else { 0.0 },
                anisotropy: self.anisotropy.unwrap_or(0.0),
                anisotropy_rotation: std::f64::consts::TAU * self.anisotropy_rotation.unwrap_or(0.0).rem_euclid(1.0),
                ..plain
            });
        }
        let shines = self.specular.map_or(self.gloss(has).is_some(), |ks| !is_black(ks)) || has(MapKind::Specular);
        if shines && !matches!(self.model, Some(0 | 1)) {
            return Bsdf::MetallicRoughness(plain);
        }
        let others = [("Ks", self.specular), ("Ka", self.ambient)];
        if let Some((keyword, Some(color))) = others.into_iter().find(|(_, color)| color.is_some_and(|c| !is_black(c)))
            && is_black(base_color)
        {
            warn(&format!("{keyword} {color:?} is not supported, and Kd is 0: the surface is black"));
        }
        Bsdf::Diffuse { reflectance: base_color }
    }

    /// Whether it has statements of physically based rendering that do something.
    pub fn is_physical(&self, has: &dyn Fn(MapKind) -> bool) -> bool {
        use MapKind::{Coat, Metallic, Roughness, Sheen};
        let is_positive = |value: Option<f64>| value.is_some_and(|value| value > 0.0);
        self.roughness.is_some()
            || self.metallic.is_some()
            || [Roughness, Metallic, Sheen, Coat].into_iter().any(has)
            || [self.sheen, self.coat, self.anisotropy].into_iter().any(is_positive)
    }

    /// Roughness, if a statement or a texture gives it; a texture alone gives 1.
    fn gloss(&self, has: &dyn Fn(MapKind) -> bool) -> Option<f64> {
        if has(MapKind::Roughness) || has(MapKind::Exponent) {
            return Some(1.0);
        }
        self.roughness.or(self.exponent.map(roughness_of_exponent))
    }

    /// Whether a texture names colours, even if it is not there.
    fn has_colors(&self) -> bool {
        self.maps.contains_key(&MapKind::Diffuse)
    }

    /// Whether `Kd` is 0 or missing, and no texture names colours.
    pub fn is_dark(&self) -> bool {
        self.diffuse.is_none_or(is_black) && !self.has_colors()
    }

    fn is_mirror(&self, has: &dyn Fn(MapKind) -> bool) -> bool {
        let reflects = matches!(self.model, Some(3 | 5 | 8));
        let is_perfect = self.specular == Some([1.0; 3]) && self.diffuse == Some([0.0; 3]) && !self.has_colors();
        let has_specular = self.specular.is_some_and(|ks| !is_black(ks)) || has(MapKind::Specular);
        is_perfect || reflects && (has_specular || self.is_dark())
    }

    fn mirror(&self, has: &dyn Fn(MapKind) -> bool, warn: &mut dyn FnMut(&str)) -> Bsdf {
        let specular = self.specular.filter(|ks| !is_black(*ks));
        let diffuse = self.diffuse.filter(|kd| !is_black(*kd));
        let roughness = self.gloss(has).unwrap_or(0.0);
        // Exporters write the colour of metal as Kd, and its Ks grey.
        let has_colors =
            has(MapKind::Diffuse) || diffuse.is_some_and(is_coloured) && !specular.is_some_and(is_coloured);
        let of_metal = (roughness > 0.0 && has_colors).then(|| diffuse.unwrap_or([1.0; 3]));
        if let Some(color) = of_metal {
            warn(&format!("a mirror with Ns: it is a rough metal of colour Kd {color:?}, and Ks is dropped"));
        } else if let Some(kd) = diffuse {
            warn(&format!("a mirror (illum {}) has no diffuse part: Kd {kd:?} is dropped", self.model.unwrap_or(0)));
        }
        let reflectance = clamp("Ks", of_metal.or(specular).unwrap_or([1.0; 3]), warn);
        match roughness > 0.0 {
            true => Bsdf::MetallicRoughness(MetallicRoughness {
                base_color: reflectance,
                metallic: 1.0,
                roughness,
                ..MetallicRoughness::default()
            }),
            false => Bsdf::Mirror { reflectance },
        }
    }

    fn is_glass(&self, has: &dyn Fn(MapKind) -> bool, opacity: f64, warn: &mut dyn FnMut(&str)) -> bool {
        let is_pbr = self.is_physical(has);
        // What has a colour at every point is no clear glass, and files of physically based rendering mean alpha by d and by 9.
        let has_colors = self.has_colors() || self.maps.contains_key(&MapKind::Opacity);
        let refracts = matches!(self.model, Some(4 | 6 | 7)) || self.model == Some(9) && !is_pbr;
        let filters = self.filter.is_some_and(|tf| tf.iter().any(|&x| x < OPAQUE));
        let is_transparent = opacity < OPAQUE || filters;
        let is_glass = match self.ior.filter(|ior| IOR_RANGE.contains(ior)) {
            Some(1.0) => false,
            // Maya writes `illum 4` and `Tf 1 1 1` for what is opaque, and the index of a shader that has none.
            Some(_) => {
                let is_opaque_of_maya = self.model == Some(4) && self.lets_nothing_through();
                is_transparent && (refracts || !is_pbr && !has_colors) || refracts && !has_colors && !is_opaque_of_maya
            }
            None => refracts && (is_transparent || self.is_dark() && self.filter.is_none()),
        };
        if !is_glass {
            if filters && opacity >= OPAQUE {
                warn("transparency without refraction (Ni other than 1) is not supported: Tf is ignored");
            } else if refracts && !is_transparent {
                let model = self.model.unwrap_or(0);
                warn(&format!(
                    "illum {model} is glass, but neither d, Tf nor Ni says that it is: the surface is opaque"
                ));
            }
        }
        is_glass
    }

    fn glass(&self, is_pbr: bool, warn: &mut dyn FnMut(&str)) -> Bsdf {
        let ior = self.ior.filter(|ior| IOR_RANGE.contains(ior));
        if let (None, Some(given)) = (ior, self.ior) {
            warn(&format!("Ni is {}, expected {EXPECTED_IOR}: {IOR} is used", number(given)));
        }
        let ior = ior.unwrap_or(IOR);
        if let Some(kd) = self.diffuse.filter(|kd| !is_black(*kd) && *kd != [1.0; 3]) {
            warn(&format!("glass is clear: Kd {kd:?} is dropped"));
        }
        if let Some(tf) = self.filter.filter(|tf| is_coloured(*tf)) {
            warn(&format!("glass is clear: the colour of Tf {tf:?} is dropped"));
        }
        match self.roughness.filter(|&roughness| is_pbr && roughness > 0.0) {
            Some(roughness) => Bsdf::MetallicRoughness(MetallicRoughness {
                metallic: 0.0,
                roughness,
                ior: ior.max(1.0),
                transmission: 1.0,
                has_volume: true,
                ..MetallicRoughness::default()
            }),
            None => Bsdf::Dielectric { ior },
        }
    }

    fn base_color(&self, has: &dyn Fn(MapKind) -> bool, warn: &mut dyn FnMut(&str)) -> Rgb {
        let has_map = has(MapKind::Diffuse);
        let color = match self.diffuse {
            Some(kd) if !(is_black(kd) && self.has_colors()) => kd,
            Some(_) if has_map => {
                warn("Kd is 0 beside the texture map_Kd, which is used alone");
                [1.0; 3]
            }
            None if has_map => [1.0; 3],
            Some(_) => {
                warn(&format!("Kd is 0 beside the texture map_Kd: grey ({}) is used", GREY[0]));
                GREY
            }
            None => {
                warn(&format!("there is no Kd: grey ({}) is used", GREY[0]));
                GREY
            }
        };
        clamp("Kd", color, warn)
    }

    /// The part of rays that it stops, by `d` and `Tr`.
    pub fn opacity(&self, warn: &mut dyn FnMut(&str)) -> f64 {
        let mut within = |keyword: &str, value: Option<f64>| {
            value.filter(|value| {
                let is_within = (0.0..=1.0).contains(value);
                if !is_within {
                    warn(&format!("{keyword} is {}, expected a number from 0 to 1: it is ignored", number(*value)));
                }
                is_within
            })
        };
        match (within("d", self.opacity), within("Tr", self.transparency)) {
            (Some(d), Some(tr)) => {
                if (d - (1.0 - tr)).abs() > 1e-3 {
                    warn(&format!(
                        "d {} and Tr {} differ, expected Tr = 1 - d: the more opaque counts",
                        number(d),
                        number(tr)
                    ));
                }
                d.max(1.0 - tr)
            }
            (Some(d), None) => d,
            (None, Some(1.0)) if !matches!(self.model, Some(4 | 6 | 7 | 9)) => {
                warn("Tr 1 without d is taken for opaque, as many exporters mean it");
                1.0
            }
            (None, Some(tr)) => 1.0 - tr,
            (None, None) => 1.0,
        }
    }

    /// Whether it has a colour of its own and says that it is not transparent, in the words of Maya, whose `Tf` is 1 for opaque.
    fn lets_nothing_through(&self) -> bool {
        self.filter.is_some_and(|tf| tf.iter().all(|&x| x >= OPAQUE)) && !self.diffuse.is_none_or(is_black)
    }
}

pub(super) fn is_black(color: Rgb) -> bool {
    color.iter().all(|&x| x <= 0.0)
}

fn is_coloured([r, g, b]: Rgb) -> bool {
    r != g || g != b
}

/// A reflectance, made to lie in 0..=1.
fn clamp(keyword: &str, given: Rgb, warn: &mut dyn FnMut(&str)) -> Rgb {
    let reflectance = given.map(|x| x.clamp(0.0, 1.0));
    if reflectance != given {
        warn(&format!("{keyword} {given:?} is clamped to 0..=1"));
    }
    reflectance
}
