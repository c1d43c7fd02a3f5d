//! The scene file as it is written: tables, keys and defaults of version 1, read by serde.
//!
//! Only types are checked here; what the values mean is checked once, in `validate`.

use serde::Deserialize;

use crate::scene::description::{Film, Integrator, PixelFilter, Transfer};
use crate::scene::metals::Metal;

pub(super) use crate::scene::format_values::*;

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
    pub texture: Vec<TextureTable>,
    #[serde(default)]
    pub material: Vec<MaterialTable>,
    #[serde(default)]
    pub sphere: Vec<SphereTable>,
    #[serde(default)]
    pub mesh: Vec<MeshTable>,
    #[serde(default)]
    pub model: Vec<ModelTable>,
    #[serde(default)]
    pub instance: Vec<InstanceTable>,
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
    pub texture: Option<String>,
    pub base_color_texture: Option<String>,
    pub metallic_roughness_texture: Option<String>,
    pub normal_texture: Option<String>,
    pub normal_scale: Option<f64>,
    pub emission_texture: Option<String>,
    pub alpha: Option<AlphaName>,
    pub alpha_cutoff: Option<f64>,
    pub opacity: Option<f64>,
    pub double_sided: Option<bool>,
    pub clearcoat: Option<f64>,
    pub clearcoat_roughness: Option<f64>,
    pub sheen_color: Option<Triple>,
    pub sheen_roughness: Option<f64>,
    pub anisotropy: Option<f64>,
    pub anisotropy_rotation: Option<f64>,
    pub eta: Option<Triple>,
    pub k: Option<Triple>,
    pub preset: Option<Metal>,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum AlphaName {
    #[default]
    Opaque,
    Mask,
    Blend,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TextureTable {
    pub name: String,
    pub file: String,
    #[serde(default)]
    pub color: ColorName,
    #[serde(default)]
    pub wrap: WrapValue,
    #[serde(default)]
    pub filter: TextureFilterName,
    #[serde(default)]
    pub uv: i64,
    #[serde(default)]
    pub offset: Numbers<2>,
    #[serde(default = "ones")]
    pub scale: Numbers<2>,
    #[serde(default)]
    pub rotate: f64,
}

fn ones() -> Numbers<2> {
    Numbers([1.0; 2])
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum ColorName {
    /// By what a material uses it for.
    #[default]
    Auto,
    Srgb,
    Linear,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum TextureFilterName {
    #[default]
    Linear,
    Nearest,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum MaterialKind {
    Diffuse,
    Mirror,
    Dielectric,
    Conductor,
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
    pub name: Option<String>,
    pub file: String,
    pub material: Option<String>,
    #[serde(default)]
    pub normals: NormalsName,
    #[serde(default)]
    pub vertex_colors: VertexColorsName,
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModelTable {
    pub name: Option<String>,
    pub file: String,
    pub material: Option<String>,
    pub variant: Option<String>,
    pub time: Option<f64>,
    #[serde(default = "yes")]
    pub lights: bool,
    pub scale: Option<Numbers<3>>,
    pub rotate: Option<Triple>,
    pub translate: Option<Triple>,
    pub matrix: Option<Rows>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InstanceTable {
    pub of: String,
    pub scale: Option<Numbers<3>>,
    pub rotate: Option<Triple>,
    pub translate: Option<Triple>,
    pub matrix: Option<Rows>,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum NormalsName {
    #[default]
    Flat,
    Smooth,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum VertexColorsName {
    #[default]
    Srgb,
    Linear,
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
