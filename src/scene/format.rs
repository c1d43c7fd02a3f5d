//! The scene file as it is written: tables, keys and defaults of version 1, read by serde.
//!
//! Only types are checked here; what the values mean is checked once, in `validate`.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Unexpected, Visitor};

use crate::scene::description::{Film, Integrator, PixelFilter, Transfer};

/// The version of the format that this program reads.
pub(super) const VERSION: i64 = 1;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneTable {
    #[expect(dead_code, reason = "checked before the tables are read; here so that it is required and known")]
    pub version: i64,
    pub camera: CameraTable,
    #[serde(default)]
    pub film: FilmTable,
    #[serde(default)]
    pub integrator: IntegratorTable,
    #[serde(default)]
    pub background: BackgroundTable,
    pub environment: Option<EnvironmentTable>,
    #[serde(default)]
    pub material: Vec<MaterialTable>,
    #[serde(default)]
    pub sphere: Vec<SphereTable>,
    #[serde(default)]
    pub mesh: Vec<MeshTable>,
    #[serde(default)]
    pub light: Vec<LightTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraTable {
    pub position: Triple,
    pub target: Triple,
    #[serde(default = "up")]
    pub up: Triple,
    #[serde(rename = "type", default)]
    pub kind: CameraKind,
    pub horizontal_fov: Option<f64>,
    pub width: Option<f64>,
    pub lens_radius: Option<f64>,
    pub f_number: Option<f64>,
    pub focal_length_mm: Option<f64>,
    pub focus: Option<FocusValue>,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum CameraKind {
    #[default]
    Perspective,
    Orthographic,
}

/// A number, or a word for another value.
#[derive(Clone, Copy)]
pub(super) enum FocusValue {
    Distance(f64),
    Target,
}

#[derive(Clone, Copy)]
pub(super) enum ExposureValue {
    Stops(f64),
    Auto,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum ToneName {
    None,
    Neutral,
    Agx,
}

fn up() -> Triple {
    Triple([0.0, 1.0, 0.0])
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct FilmTable {
    pub width: i64,
    pub height: i64,
    pub filter: FilterName,
    pub gamma: GammaValue,
    pub exposure: ExposureValue,
    pub tone: ToneName,
    pub transparent: bool,
}

impl Default for FilmTable {
    fn default() -> Self {
        let film = Film::default();
        Self {
            width: film.width.into(),
            height: film.height.into(),
            filter: match film.filter {
                PixelFilter::Gaussian => FilterName::Gaussian,
                PixelFilter::Box => FilterName::Box,
            },
            gamma: match film.transfer {
                Transfer::Gamma(gamma) => GammaValue::Number(gamma),
                Transfer::Srgb => GammaValue::Srgb,
            },
            exposure: ExposureValue::Stops(0.0),
            tone: ToneName::None,
            transparent: film.transparent,
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum FilterName {
    Gaussian,
    Box,
}

pub(super) enum GammaValue {
    Number(f64),
    Srgb,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct IntegratorTable {
    pub max_depth: i64,
    pub samples: i64,
    pub russian_roulette: RouletteValue,
    pub indirect: bool,
}

impl Default for IntegratorTable {
    fn default() -> Self {
        let integrator = Integrator::default();
        Self {
            max_depth: integrator.max_depth.into(),
            samples: integrator.samples.into(),
            russian_roulette: match integrator.russian_roulette {
                Some(depth) => RouletteValue::From(depth.into()),
                None => RouletteValue::Off,
            },
            indirect: integrator.indirect,
        }
    }
}

pub(super) enum RouletteValue {
    /// The first depth that may end a path.
    From(i64),
    Off,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub(super) struct BackgroundTable {
    pub radiance: Triple,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EnvironmentTable {
    pub file: String,
    #[serde(default)]
    pub rotation: f64,
    #[serde(default = "one")]
    pub scale: f64,
    #[serde(default = "yes")]
    pub visible: bool,
}

fn yes() -> bool {
    true
}

/// Which of the optional keys belong to which type is checked when the material is built: serde's tagged enums would
/// lose the place of a wrong key.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialTable {
    pub name: String,
    #[serde(rename = "type")]
    pub kind: MaterialKind,
    pub reflectance: Option<Triple>,
    pub ior: Option<f64>,
    pub radiance: Option<Triple>,
    pub emission: Option<Triple>,
    pub two_sided: Option<bool>,
    pub base_color: Option<Triple>,
    pub metallic: Option<f64>,
    pub roughness: Option<f64>,
    pub specular: Option<f64>,
    pub specular_color: Option<Triple>,
    pub transmission: Option<f64>,
    pub thin: Option<bool>,
    pub attenuation_color: Option<Triple>,
    pub attenuation_distance: Option<f64>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum MaterialKind {
    Diffuse,
    Mirror,
    Dielectric,
    Emitter,
    Pbr,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SphereTable {
    pub center: Triple,
    pub radius: f64,
    pub material: String,
    #[serde(default)]
    pub inward: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshTable {
    pub file: String,
    pub material: Option<String>,
    #[serde(default)]
    pub normals: NormalsName,
    #[serde(default = "one")]
    pub scale: f64,
    #[serde(default)]
    pub rotate: Triple,
    #[serde(default)]
    pub translate: Triple,
}

fn one() -> f64 {
    1.0
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum NormalsName {
    #[default]
    Flat,
    Smooth,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightTable {
    #[serde(rename = "type")]
    pub kind: LightKind,
    pub position: Option<Triple>,
    pub power: Option<Triple>,
    pub direction: Option<Triple>,
    pub intensity: Option<Triple>,
    pub irradiance: Option<Triple>,
    pub inner: Option<f64>,
    pub outer: Option<f64>,
    pub range: Option<f64>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum LightKind {
    Point,
    Spot,
    Directional,
}

/// A point, a vector or a colour. Not a plain array, of which the `toml` crate ignores what is too much.
#[derive(Default, Clone, Copy)]
pub(super) struct Triple(pub [f64; 3]);

impl<'de> Deserialize<'de> for Triple {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TripleVisitor;

        impl<'de> Visitor<'de> for TripleVisitor {
            type Value = Triple;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an array of three numbers")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Triple, A::Error> {
                let mut numbers = [0.0; 3];
                let mut count = 0;
                while let Some(number) = elements.next_element()? {
                    if let Some(slot) = numbers.get_mut(count) {
                        *slot = number;
                    }
                    count += 1;
                }
                if count == numbers.len() { Ok(Triple(numbers)) } else { Err(A::Error::invalid_length(count, &self)) }
            }
        }

        deserializer.deserialize_any(TripleVisitor)
    }
}

/// Reads a number, or the only word that may be in its place.
macro_rules! number_or_word {
    ($value:ident, $number:ident, $what:literal, $word:literal, $variant:ident) => {
        impl<'de> Deserialize<'de> for $value {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct NumberOrWord;

                impl Visitor<'_> for NumberOrWord {
                    type Value = $value;

                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        f.write_str(concat!($what, " or \"", $word, "\""))
                    }

                    fn visit_f64<E: Error>(self, value: f64) -> Result<$value, E> {
                        Ok($value::$number(value))
                    }

                    fn visit_i64<E: Error>(self, value: i64) -> Result<$value, E> {
                        Ok($value::$number(value as f64))
                    }

                    fn visit_str<E: Error>(self, value: &str) -> Result<$value, E> {
                        match value {
                            $word => Ok($value::$variant),
                            _ => Err(E::invalid_value(Unexpected::Str(value), &self)),
                        }
                    }
                }

                deserializer.deserialize_any(NumberOrWord)
            }
        }
    };
}

number_or_word!(GammaValue, Number, "a number > 0", "srgb", Srgb);
number_or_word!(FocusValue, Distance, "a distance > 0", "target", Target);
number_or_word!(ExposureValue, Stops, "a number of stops", "auto", Auto);

impl<'de> Deserialize<'de> for RouletteValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RouletteVisitor;

        impl Visitor<'_> for RouletteVisitor {
            type Value = RouletteValue;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an integer >= 1 or \"off\"")
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<RouletteValue, E> {
                Ok(RouletteValue::From(value))
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<RouletteValue, E> {
                match value {
                    "off" => Ok(RouletteValue::Off),
                    _ => Err(E::invalid_value(Unexpected::Str(value), &self)),
                }
            }
        }

        deserializer.deserialize_any(RouletteVisitor)
    }
}
