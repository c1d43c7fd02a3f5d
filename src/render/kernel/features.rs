//! What a scene and its settings need. Only that is compiled into the pipeline and put into buffers.

use glam::DVec3;

use crate::scene::{PixelFilter, Scene, Surface};

use crate::render::kernel::layout::constant::MAX_POLYGONS;
use crate::render::sampling::sobol;
use crate::render::scene::coplanar::Lifts;
use crate::render::scene::polygons;
use crate::render::scene::spheres;
use crate::render::settings::{Accel, RenderSettings, Sampler, TriangleTest};
use crate::render::space::RenderSpace;
use crate::render::space::view::View;

/// Part of the picture that meshes of glass cover from which on reuse of paths lowers the variance by too little for GPUs: where dragons
/// and armadillos cover more, by 1.3 to 1.9; where they cover .35 of it, by 2 and more (in a room).
const MOST_GLASS: f64 = 0.6;

/// A part of the path tracer that is left out where a scene does not need it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// Diffuse surfaces, and light that falls on them.
    Diffuse,
    /// Mirrors.
    Mirror,
    /// Glass.
    Dielectric,
    /// Surfaces that emit.
    Emitter,
    /// Light from where a ray meets nothing.
    Background,
    /// A tree.
    Tree,
    /// Spheres in the tree.
    BvhSpheres,
    /// [`Features::bvh_triangles`]
    BvhTriangles,
    /// A stack for trees of any depth.
    DeepBvh,
    /// Lights of all kinds, if there is any.
    LightKinds,
    /// Interpolated normals.
    SmoothNormals,
    /// All levels of the sampler's table.
    SamplerLevels,
}

impl Feature {
    /// All of them, and their names.
    pub const ALL: [(&'static str, Self); 12] = [
        ("diffuse", Self::Diffuse),
        ("mirror", Self::Mirror),
        ("dielectric", Self::Dielectric),
        ("emitter", Self::Emitter),
        ("background", Self::Background),
        ("tree", Self::Tree),
        ("tree-spheres", Self::BvhSpheres),
        ("tree-triangles", Self::BvhTriangles),
        ("deep-tree", Self::DeepBvh),
        ("light-kinds", Self::LightKinds),
        ("smooth-normals", Self::SmoothNormals),
        ("sampler-levels", Self::SamplerLevels),
    ];
}

/// The features of a scene. Code is specialised from these; data layout never is, so that a pipeline with more
/// features than needed gives the same bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    /// Gaussian pixel filter, else one-pixel box.
    pub gaussian: bool,
    /// Random numbers.
    pub sampler: Sampler,
    /// Longest chain of surface hits.
    pub max_depth: u32,
    /// First hit that may end a path at random; 0: none.
    pub roulette: u32,
    /// Paths go on beyond a diffuse surface.
    pub indirect: bool,
    /// Diffuse surfaces.
    pub diffuse: bool,
    /// Mirrors.
    pub mirror: bool,
    /// Glass.
    pub dielectric: bool,
    /// Surfaces that emit.
    pub emitter: bool,
    /// Light from where a ray meets nothing.
    pub background: bool,
    /// Constant spheres: written out in the shaders.
    pub constant_spheres: u32,
    /// Constant flat polygons, likewise.
    pub polygons: u32,
    /// Spheres held in the tree, because constants are full.
    pub bvh_spheres: bool,
    /// Triangles in the tree.
    pub bvh_triangles: bool,
    /// A tree: triangles, or spheres beyond the constants.
    pub tree: bool,
    /// A stack for trees of any depth, whatever the depth of this one.
    pub deep_bvh: bool,
    /// Lights of all kinds, whatever those of the scene are.
    pub light_kinds: bool,
    /// Every leaf is tested.
    pub brute_force: bool,
    /// Möller–Trumbore instead of the watertight test.
    pub moller_trumbore: bool,
    /// Interpolated normals.
    pub smooth_normals: bool,
    /// Point lights.
    pub lights: u32,
    /// Levels of the sampler's table.
    pub sobol_levels: u32,
}

impl Features {
    /// Finds what `scene` needs under `settings`.
    pub fn of(scene: &Scene, settings: &RenderSettings) -> Self {
        let mut used = vec![false; scene.materials.len()];
        for sphere in &scene.spheres {
            used[sphere.material as usize] = true;
        }
        for mesh in &scene.meshes {
            for &m in &mesh.triangle_materials {
                used[m as usize] = true;
            }
        }
        let unneeded = |feature| settings.general || settings.unneeded == Some(feature);
        let any = |feature, wanted: fn(&Surface) -> bool| {
            unneeded(feature) || scene.materials.iter().zip(&used).any(|(m, &used)| used && wanted(&m.surface))
        };
        let space = RenderSpace::of(scene);
        let (constant, rest) = spheres::partition(scene, &space);
        let (polygons, in_constants) = polygons::select(scene, &space, &Lifts::default(), settings.triangle_test);
        let triangles = in_constants.iter().any(|constant| !constant);
        let dielectric = any(Feature::Dielectric, Surface::is_dielectric);
        Self {
            gaussian: scene.film.filter == PixelFilter::Gaussian,
            sampler: settings.sampler,
            max_depth: scene.integrator.max_depth,
            roulette: scene.integrator.russian_roulette.unwrap_or(0),
            indirect: scene.integrator.indirect,
            diffuse: any(Feature::Diffuse, Surface::is_diffuse),
            mirror: any(Feature::Mirror, Surface::is_mirror),
            dielectric,
            emitter: any(Feature::Emitter, Surface::emits),
            background: unneeded(Feature::Background) || scene.background != [0.0; 3],
            constant_spheres: constant.len() as u32,
            polygons: polygons.len() as u32,
            bvh_spheres: unneeded(Feature::BvhSpheres) || !rest.is_empty(),
            bvh_triangles: unneeded(Feature::Tree) || unneeded(Feature::BvhTriangles) || triangles,
            tree: [Feature::Tree, Feature::BvhSpheres, Feature::BvhTriangles].into_iter().any(unneeded)
                || triangles
                || !rest.is_empty(),
            deep_bvh: unneeded(Feature::DeepBvh),
            light_kinds: unneeded(Feature::LightKinds),
            brute_force: settings.accel == Accel::None && (triangles || !rest.is_empty()),
            moller_trumbore: settings.triangle_test == TriangleTest::MollerTrumbore,
            smooth_normals: unneeded(Feature::SmoothNormals)
                || scene.meshes.iter().any(|m| !m.vertex_normals.is_empty()),
            lights: spheres::visible_lights(scene).filter(|light| light.shines()).count() as u32,
            sobol_levels: if unneeded(Feature::SamplerLevels) {
                sobol::MAX_LEVELS
            } else {
                sobol::levels(settings.samples)
            },
        }
    }

    /// Whether paths go on from surfaces that they meet.
    pub fn has_long_paths(&self) -> bool {
        self.max_depth > 1 && (self.indirect || self.mirror || self.dielectric)
    }

    /// Whether there are paths that other pixels can use: two diffuse hits, the first of which, seen directly, ends none at
    /// random.
    pub fn can_reuse(&self) -> bool {
        self.diffuse && self.indirect && self.max_depth > 1 && self.roulette != 1
    }

    /// Whether most noise may be that of light which comes from emitters by way of glass and mirrors, which reuse of paths does
    /// not lower.
    pub fn has_caustics(&self) -> bool {
        self.tree && self.emitter && (self.dielectric || self.mirror)
    }

    /// Whether light may be traced from emitters: to what the camera sees of diffuse surfaces, by way of glass and mirrors. Smooth
    /// normals do not let it back the way that it came.
    pub fn may_trace_light(&self) -> bool {
        self.emitter
            && (self.dielectric || self.mirror)
            && self.diffuse
            && self.indirect
            && self.max_depth > 1
            && !self.smooth_normals
            && !self.brute_force
    }

    /// Each feature: its name, whether it is compiled in, and why.
    pub fn explain(&self) -> Vec<(&'static str, bool, String)> {
        let plain = |name, on, yes: &str, no: &str| (name, on, if on { yes } else { no }.to_owned());
        vec![
            plain("gaussian filter", self.gaussian, "film.filter is gaussian", "film.filter is box"),
            (
                "sobol sampler",
                self.sampler == Sampler::Sobol,
                match self.sampler {
                    Sampler::Sobol => format!("{} table level(s) for the number of samples", self.sobol_levels),
                    Sampler::Independent => "independent numbers were asked for".to_owned(),
                    Sampler::Pcg => "numbers of PCG were asked for".to_owned(),
                },
            ),
            (
                "bounces",
                self.max_depth > 1,
                if self.max_depth > 1 {
                    format!("max_depth is {}", self.max_depth)
                } else {
                    "max_depth is 1".to_owned()
                },
            ),
            plain(
                "indirect light",
                self.indirect && self.max_depth > 1,
                "paths go on after diffuse surfaces",
                "direct light only",
            ),
            (
                "russian roulette",
                self.roulette > 0,
                if self.roulette > 0 {
                    format!("from hit {} on", self.roulette)
                } else {
                    "off in the scene".to_owned()
                },
            ),
            plain("diffuse", self.diffuse, "a surface uses it", "no surface uses it"),
            plain("mirror", self.mirror, "a surface uses it", "no surface uses it"),
            plain("dielectric", self.dielectric, "a surface uses it", "no surface uses it"),
            plain("emitter", self.emitter, "a surface uses it", "no surface uses it"),
            plain("background", self.background, "background.radiance is not black", "background.radiance is black"),
            (
                "point lights",
                self.lights > 0,
                match (self.lights, self.emitter) {
                    (0, _) => "none can be seen".to_owned(),
                    (1, false) => "1, a constant point".to_owned(),
                    (n, false) => format!("{n}, one is chosen at each hit"),
                    (n, true) => format!("{n}, one of these and the emitters is chosen at each hit"),
                },
            ),
            (
                "constant spheres",
                self.constant_spheres > 0,
                format!("{} of {} places, unrolled", self.constant_spheres, spheres::MAX_CONSTANT_SPHERES),
            ),
            (
                "polygons",
                self.polygons > 0,
                format!(
                    "{} of {} places, unrolled: triangles and quadrilaterals of small meshes",
                    self.polygons, MAX_POLYGONS
                ),
            ),
            plain("tree", self.tree, "triangles or many spheres", "all triangles and spheres are constants"),
            plain("tree triangles", self.bvh_triangles, "meshes beyond the polygons", "no mesh is in the tree"),
            plain("tree spheres", self.bvh_spheres, "more spheres than constants hold", "all spheres are constants"),
            plain(
                "path reuse",
                self.can_reuse() && !self.has_caustics(),
                "unless switched off, on GPUs in long renderings only and not where glass fills the view, if a pilot pass shows that it pays: diffuse surfaces light each other",
                if !self.can_reuse() {
                    "no diffuse surface lights another"
                } else {
                    "unless asked for: most noise is that of emitters seen by way of glass and mirrors"
                },
            ),
            plain(
                "gradients",
                self.can_reuse() && !self.has_caustics(),
                "where paths are reused and most noise is theirs, from 2 samples on, unless switched off",
                "only where paths are reused",
            ),
            plain(
                "sample map",
                self.emitter || (self.can_reuse() && !self.has_caustics()),
                "unless switched off: more samples at edges of bright emitters, through glass where light paths are traced, and in noisy parts where paths are reused",
                "no surface emits, and no paths are reused",
            ),
            plain(
                "light tracing",
                self.may_trace_light(),
                "traced from emitters, unless switched off: glass or mirrors may make caustics",
                if self.emitter && (self.dielectric || self.mirror) {
                    "not with smooth normals, without indirect light or a hierarchy"
                } else {
                    "no emitters together with glass or mirrors"
                },
            ),
            plain("brute force", self.brute_force, "no hierarchy was asked for", "the hierarchy is used"),
            plain("smooth normals", self.smooth_normals, "a mesh has them", "no mesh has them"),
            plain("moller-trumbore", self.moller_trumbore, "was asked for", "the watertight test is used"),
        ]
    }
}

/// A corner of each triangle of glass.
fn glass_triangles(scene: &Scene) -> impl Iterator<Item = DVec3> {
    let is_glass = |material: &u32| scene.surface(*material).is_dielectric();
    scene.meshes.iter().flat_map(move |mesh| {
        let of_glass = mesh.triangles.iter().zip(&mesh.triangle_materials).filter(move |(_, m)| is_glass(m));
        of_glass.map(|(triangle, _)| mesh.positions[triangle[0] as usize])
    })
}

/// Whether meshes of glass cover most of the picture. It looks at all of their triangles.
pub(crate) fn glass_fills_view(scene: &Scene) -> bool {
    let camera = scene.camera.position;
    View::of(scene).part_with(glass_triangles(scene).map(|corner| corner - camera)) >= MOST_GLASS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::generate;

    #[test]
    fn glass_fills_the_view_where_its_triangles_are_seen() {
        let mut scene = generate::terrain(10_000);
        assert!(!glass_fills_view(&scene));
        let material = scene.meshes[0].triangle_materials[0] as usize;
        scene.materials[material].surface = Surface::dielectric(1.5);
        assert!(glass_fills_view(&scene));
        // From farther away, and with the back turned.
        let camera = &mut scene.camera;
        camera.position -= 3.0 * (camera.target - camera.position);
        assert!(!glass_fills_view(&scene));
        scene.camera.target = 2.0 * scene.camera.position - scene.camera.target;
        assert!(!glass_fills_view(&scene));
    }
}
