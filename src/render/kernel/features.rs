//! What a scene and its settings need. Only that is compiled into the pipeline and put into buffers.

use std::ops::Deref;

use glam::DVec3;

use crate::scene::{PixelFilter, Scene};

use crate::render::kernel::sobol;
use crate::render::scene::tables::Tables;
use crate::render::settings::feature::{BvhNeeds, Feature, FeatureFlags, Needs};
use crate::render::settings::{Accel, RenderSettings, Sampler, TriangleTest};
use crate::render::space::view::View;

/// Part of the picture that meshes of glass cover from which on reuse of paths lowers the variance by too little for GPUs: where dragons
/// and armadillos cover more, by 1.3 to 1.9; where they cover .35 of it, by 2 and more (in a room).
const MOST_GLASS: f64 = 0.6;

/// The features of a scene, and numbers that go with them. Code is specialised from these; data layout never is, so that a pipeline with
/// more features than needed gives the same bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    flags: FeatureFlags,
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
    /// Constant spheres: written out in the shaders.
    pub constant_spheres: u32,
    /// Constant flat polygons, likewise.
    pub polygons: u32,
    /// Every leaf is tested.
    pub brute_force: bool,
    /// Ray queries find the leaves.
    pub ray_query: bool,
    /// They test triangles themselves.
    pub queried_triangles: bool,
    /// Möller–Trumbore instead of the watertight test.
    pub moller_trumbore: bool,
    /// Point lights.
    pub lights: u32,
    /// Levels of the sampler's table.
    pub sobol_levels: u32,
}

/// The flags are read like fields.
impl Deref for Features {
    type Target = FeatureFlags;

    fn deref(&self) -> &FeatureFlags {
        &self.flags
    }
}

impl Features {
    /// Finds what `scene`, compiled to `tables`, needs under `settings`.
    pub(crate) fn new(scene: &Scene, tables: &Tables, settings: &RenderSettings) -> Self {
        let needs = Needs::new(scene, BvhNeeds { spheres: tables.bvh_spheres, triangles: tables.bvh_triangles });
        let is_forced =
            |feature: Feature| (settings.general && !feature.is_of_models()) || settings.unneeded == Some(feature);
        let mut flags = FeatureFlags::new(&needs, is_forced);
        // A BVH that nothing needs is one of triangles.
        flags.bvh_triangles |= settings.unneeded == Some(Feature::Bvh);
        flags.bvh |= flags.bvh_triangles || flags.bvh_spheres;
        Self {
            gaussian: scene.film.filter == PixelFilter::Gaussian,
            sampler: settings.sampler,
            max_depth: scene.integrator.max_depth,
            roulette: scene.integrator.russian_roulette.unwrap_or(0),
            indirect: scene.integrator.indirect,
            constant_spheres: tables.constant_spheres.len() as u32,
            polygons: tables.polygons.len() as u32,
            brute_force: settings.accel == Accel::None && (needs.bvh.spheres || needs.bvh.triangles),
            ray_query: tables.query_geometry.is_some(),
            queried_triangles: tables.query_geometry.is_some() && settings.accel == Accel::RayQueryTriangles,
            moller_trumbore: settings.triangle_test == TriangleTest::MollerTrumbore,
            lights: tables.point_count,
            sobol_levels: if flags.sampler_levels { sobol::MAX_LEVELS } else { sobol::levels(settings.samples) },
            flags,
        }
    }

    /// Whether paths go on from surfaces that they meet.
    pub fn has_long_paths(&self) -> bool {
        self.max_depth > 1 && (self.indirect || self.mirror || self.dielectric || self.transmission)
    }

    /// Whether there are paths that other pixels can use: two hits of diffuse surfaces, or of ones with a diffuse part, the first of which,
    /// seen directly, ends none at random, and between which nothing absorbs light.
    pub fn can_reuse(&self) -> bool {
        (self.diffuse || self.metallic_roughness)
            && self.indirect
            && self.max_depth > 1
            && self.roulette != 1
            && !self.absorption
    }

    /// Whether most noise may be that of light which comes from emitters by way of glass and mirrors, which reuse of paths does
    /// not lower.
    pub fn has_caustics(&self) -> bool {
        self.bvh && self.emitter && (self.dielectric || self.mirror)
    }

    /// Whether light may be traced from emitters: to what the camera sees of diffuse surfaces, by way of glass and mirrors. It is not
    /// traced through glass of the metallic-roughness model, and it goes to a pinhole.
    pub fn may_trace_light(&self) -> bool {
        self.emitter
            && (self.dielectric || self.mirror)
            && self.diffuse
            && self.indirect
            && self.max_depth > 1
            && !self.transmission
            && !self.brute_force
            && !self.lens
            && !self.orthographic
    }

    /// Whether reuse of paths may lower the noise by enough.
    pub(crate) fn reuse_may_pay(&self) -> bool {
        self.can_reuse() && !self.has_caustics()
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
    View::of(scene, 1.0).part_with(glass_triangles(scene).map(|corner| corner - camera)) >= MOST_GLASS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::generate;
    use crate::scene::Surface;

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
