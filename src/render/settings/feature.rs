//! What can be left out of the path tracer.

use crate::scene::{Material, Scene, Surface, TextureSlot};

/// What features follow from.
pub(crate) struct Needs<'a> {
    scene: &'a Scene,
    /// Which materials a primitive has.
    used: Vec<bool>,
    pub bvh: BvhNeeds,
}

/// What is left for the BVH, since not all is written out in the shaders.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BvhNeeds {
    pub spheres: bool,
    pub triangles: bool,
}

impl<'a> Needs<'a> {
    pub fn new(scene: &'a Scene, bvh: BvhNeeds) -> Self {
        let mut used = vec![false; scene.materials.len()];
        for sphere in &scene.spheres {
            used[sphere.material as usize] = true;
        }
        for mesh in &scene.meshes {
            for &m in &mesh.triangle_materials {
                used[m as usize] = true;
            }
        }
        Self { scene, used, bvh }
    }

    fn uses(&self, is: fn(&Surface) -> bool) -> bool {
        self.scene.materials.iter().zip(&self.used).any(|(m, &used)| used && is(&m.surface))
    }

    fn uses_material(&self, is: impl Fn(&Material) -> bool) -> bool {
        self.scene.materials.iter().zip(&self.used).any(|(material, &used)| used && is(material))
    }

    fn smooth_normals(&self) -> bool {
        self.scene.meshes.iter().any(|m| !m.vertex_normals.is_empty()) || self.normal_maps()
    }

    fn normal_maps(&self) -> bool {
        let has = |material: &Material, slot| material.textures.contains_key(&slot);
        self.uses_material(|m| has(m, TextureSlot::Normal) || (m.is_coated() && has(m, TextureSlot::CoatNormal)))
    }

    fn vertex_colors(&self) -> bool {
        self.scene.meshes.iter().any(|mesh| !mesh.colors.is_empty())
    }
}

/// What `info` says of a feature, and its constant in the shaders.
pub(crate) struct FeatureRow {
    pub name: &'static str,
    /// The name with a plus: the value of the setting that compiles it in without need.
    pub one_more: &'static str,
    /// Id and name of the constant, for features that have one of their own.
    pub constant: Option<(u32, &'static str)>,
    pub is_on: fn(&FeatureFlags) -> bool,
    /// Why it is compiled in, and why not.
    pub why: [&'static str; 2],
}

/// The table of features: adding one is a row here and its line in layout.glsl.
///
/// `field Variant, "name", ID CONSTANT: when a scene needs it; why it is compiled in; why not`. Those without a constant of their own
/// change that of something else (kernel/specialization.rs, kernel/features.rs).
macro_rules! features {
    ($($(#[$doc:meta])* $field:ident $variant:ident, $name:literal, $($id:literal $constant:ident)?:
        |$n:ident| $needed:expr; $yes:literal; $no:literal;)*) => {
        /// A part of the path tracer that is left out where a scene does not need it.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Feature {
            $($(#[$doc])* $variant,)*
        }

        impl Feature {
            /// All of them, and their names.
            pub const ALL: [(&'static str, Self); [$($name),*].len()] = [$(($name, Self::$variant)),*];
        }

        /// Which features are compiled in.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct FeatureFlags {
            $($(#[$doc])* pub $field: bool,)*
        }

        impl FeatureFlags {
            /// What the features are called, and why they are on or off.
            pub(crate) const TABLE: &'static [FeatureRow] = &[$(FeatureRow {
                name: $name,
                one_more: concat!("+", $name),
                constant: features!(@constant $($id $constant)?),
                is_on: |flags| flags.$field,
                why: [$yes, $no],
            }),*];

            /// Those that a scene needs, or is to have although it does not need them.
            pub(crate) fn new(needs: &Needs<'_>, is_forced: impl Fn(Feature) -> bool) -> Self {
                Self {
                    $($field: is_forced(Feature::$variant) || {
                        let $n = needs;
                        $needed
                    },)*
                }
            }
        }
    };
    (@constant $id:literal $constant:ident) => { Some(($id, stringify!($constant))) };
    (@constant) => { None };
}

features! {
    /// Diffuse surfaces, and light that falls on them.
    diffuse Diffuse, "diffuse", 7 HAS_DIFFUSE: |n| n.uses(Surface::is_diffuse);
        "a surface uses it"; "no surface uses it";
    /// Mirrors.
    mirror Mirror, "mirror", 8 HAS_MIRROR: |n| n.uses(Surface::is_mirror);
        "a surface uses it"; "no surface uses it";
    /// Glass.
    dielectric Dielectric, "dielectric", 9 HAS_DIELECTRIC: |n| n.uses(Surface::is_dielectric);
        "a surface uses it"; "no surface uses it";
    /// Surfaces that emit.
    emitter Emitter, "emitter", 10 HAS_EMITTER: |n| n.uses(Surface::emits);
        "a surface uses it"; "no surface uses it";
    /// Light from where a ray meets nothing.
    background Background, "background", 11 HAS_BACKGROUND: |n| n.scene.background != [0.0; 3] || n.scene.environment.is_some();
        "background.radiance is not black"; "background.radiance is black";
    /// A BVH: triangles, or spheres beyond the constants.
    bvh Bvh, "bvh", 12 HAS_BVH: |n| n.bvh.triangles || n.bvh.spheres;
        "triangles or many spheres"; "all triangles and spheres are constants";
    /// Spheres held in the BVH, because constants are full.
    bvh_spheres BvhSpheres, "bvh-spheres", 13 BVH_SPHERES: |n| n.bvh.spheres;
        "more spheres than constants hold"; "all spheres are constants";
    /// Triangles in the BVH.
    bvh_triangles BvhTriangles, "bvh-triangles", 14 BVH_TRIANGLES: |n| n.bvh.triangles;
        "meshes beyond the polygons"; "no mesh is in the BVH";
    /// A stack for BVHs of any depth, whatever the depth of this one.
    deep_bvh DeepBvh, "deep-bvh", : |_n| false;
        "was asked for"; "the stack is as deep as the BVH";
    /// Lights of all kinds, whatever those of the scene are.
    light_kinds LightKinds, "light-kinds", : |_n| false;
        "was asked for"; "kinds of lights that the scene has";
    /// Interpolated normals.
    smooth_normals SmoothNormals, "smooth-normals", 15 SMOOTH_NORMALS: |n| n.smooth_normals();
        "a mesh has them"; "no mesh has them";
    /// The metallic-roughness model.
    metallic_roughness MetallicRoughness, "metallic-roughness", 49 HAS_METALLIC_ROUGHNESS: |n| n.uses(Surface::has_microfacets);
        "a surface uses it"; "no surface uses it";
    /// Glass of the metallic-roughness model.
    transmission Transmission, "transmission", 62 HAS_TRANSMISSION: |n| n.uses(Surface::is_transmissive);
        "a metallic-roughness surface lets light through"; "none lets light through";
    /// Bodies that absorb light.
    absorption Absorption, "absorption", 63 HAS_ABSORPTION: |n| n.uses(Surface::absorbs);
        "a body of glass absorbs light"; "no body absorbs light";
    /// Materials with more to them than a colour or an index.
    details Details, "material-details", 50 HAS_DETAILS: |n| n.uses_material(Material::has_details) || n.vertex_colors();
        "textures, vertex colours or the metallic-roughness model"; "colours of materials are constant";
    /// Textures.
    textures Textures, "textures", 51 HAS_TEXTURES: |n| n.uses_material(|m| !m.textures.is_empty());
        "a material has some"; "no material has any";
    /// Reflection of dielectrics from textures.
    specular_textures SpecularTextures, "specular-textures", 100 HAS_SPECULAR_TEXTURES:
        |n| n.uses_material(Material::has_specular_textures);
        "a material has some"; "no material has any";
    /// Clear coats.
    coat Coat, "clear-coat", 101 HAS_COAT: |n| n.uses_material(Material::is_coated);
        "a material has one"; "no material has one";
    /// Sheen.
    sheen Sheen, "sheen", 102 HAS_SHEEN: |n| n.uses_material(Material::has_sheen);
        "a material has it"; "no material has it";
    /// Reflection that is rougher along one direction of a surface.
    anisotropy Anisotropy, "anisotropy", 103 HAS_ANISOTROPY: |n| n.uses_material(Material::is_anisotropic);
        "a material has it"; "no material has it";
    /// Metals by their complex index of refraction, and rough mirrors.
    conductor Conductor, "conductor", 104 HAS_CONDUCTOR: |n| n.uses(Surface::is_conductor);
        "a surface uses it"; "no surface uses it";
    /// Colours of vertices.
    vertex_colors VertexColors, "vertex-colors", 52 HAS_VERTEX_COLORS: |n| n.vertex_colors();
        "a mesh has them"; "no mesh has them";
    /// Normals from textures.
    normal_maps NormalMaps, "normal-maps", 53 HAS_NORMAL_MAPS: |n| n.normal_maps();
        "a material has one"; "no material has one";
    /// Surfaces with alpha.
    coverage Coverage, "coverage", 54 HAS_COVERAGE: |n| n.uses_material(Material::has_alpha);
        "a material has alpha"; "no material has alpha";
    /// Surfaces that let rays pass from behind.
    culled_backs CulledBacks, "culled-backs", 106 HAS_CULLED_BACKS: |n| n.uses_material(|m| m.culls_back);
        "a material has them"; "no material has any";
    /// Emission that differs from point to point.
    varied_emission VariedEmission, "varied-emission", 55 HAS_VARIED_EMISSION: |n| n.uses_material(Material::has_varied_emission);
        "an emitting material has a texture or alpha"; "emitters shine alike all over";
    /// A map of light from where a ray meets nothing.
    environment Environment, "environment", 58 HAS_ENVIRONMENT: |n| n.scene.environment.is_some();
        "the background is a map"; "the background is the same everywhere";
    /// A lens, which blurs what is not in focus.
    lens Lens, "lens", 56 HAS_LENS: |n| n.scene.camera.lens.is_some();
        "the camera has one"; "the camera has none";
    /// Parallel rays from the camera.
    orthographic Orthographic, "orthographic", 57 ORTHOGRAPHIC: |n| n.scene.camera.orthographic_width.is_some();
        "the camera is"; "the camera is not";
    /// All levels of the sampler's table.
    sampler_levels SamplerLevels, "sampler-levels", : |_n| false;
        "was asked for"; "as many as the number of samples needs";
}

impl Feature {
    /// Whether only models with textures and the like need it. All of these together, in a kernel that also shares paths, take a driver
    /// minutes and gigabytes to compile: general kernels are without.
    pub(crate) fn is_of_models(self) -> bool {
        use Feature::{
            Absorption, Anisotropy, Coat, Conductor, Coverage, CulledBacks, Details, Environment, MetallicRoughness,
            NormalMaps, Sheen, SpecularTextures, Textures, Transmission, VariedEmission, VertexColors,
        };
        let of_surfaces = matches!(self, Details | MetallicRoughness | NormalMaps | Textures | VertexColors);
        let of_layers = matches!(self, Anisotropy | Coat | Conductor | Sheen | SpecularTextures | Transmission);
        of_surfaces || of_layers || matches!(self, Absorption | Coverage | CulledBacks | Environment | VariedEmission)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, feature)| *feature == self).map_or("", |row| row.0)
    }
}
