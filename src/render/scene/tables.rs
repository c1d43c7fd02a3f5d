//! The scene as the shaders' tables: materials, spheres, lights, the packed BVH, and the constants that go with them.

use std::time::Instant;

use bytemuck::Zeroable;
use glam::Vec3;
use rayon::prelude::*;

use crate::accel;
use crate::accel::Texel;
use crate::accel::{Aabb, BvhStatistics, Leaf, Packed, Primitive};
use crate::scene::{Material, Scene};

use crate::render::kernel::layout::SceneValues;
use crate::render::light::emitter::{Light, LightShape};
use crate::render::light::environment::EnvironmentTable;
use crate::render::light::screen_bounds::emitter_bounds;
use crate::render::light::solid_angle;
use crate::render::light::table::{LightTable, kind};
use crate::render::scene::collect::{Origin, SceneGeometry};
use crate::render::scene::geometry::GeometryTexels;
use crate::render::scene::light_paths::CasterTable;
use crate::render::scene::materials::rgb;
use crate::render::scene::polygons;
use crate::render::scene::polygons::InlinePolygon;
use crate::render::scene::query_geometry::QueryGeometry;
use crate::render::scene::spheres::ConstantSphere;
use crate::render::scene::textures::TextureTable;
use crate::render::settings::mutation::Mutation;
use crate::render::settings::{LightSamples, LightTracing, RenderSettings, Reuse, SampleMap};
use crate::render::space::RenderSpace;
use crate::render::space::view::{Rectangle, View};

/// Handles by which rays name the surface that they leave (`self_id`) are from here on slots of the BVH, of which a record has two
/// (shaders/lib/intersect/bvh/traversal.glsl); below they are the numbers of constant spheres and polygons.
pub(crate) const BVH_ID: usize = 0x0100_0000;
/// Samples of lights at a first diffuse hit: shaders/lib/path.glsl spreads up to four over an emitter.
const LIGHT_SAMPLES: u32 = 4;

/// Everything that is uploaded or becomes a constant.
pub(crate) struct Tables {
    pub geometry: GeometryTexels,
    /// Textures, and the table of albedos.
    pub textures: Vec<Texel>,
    /// Where in these the environment is, and how much of light sampling goes to it.
    environment: EnvironmentValues,
    /// First texel of the albedos of glass among them.
    glass: u32,
    pub lights: LightTable,
    /// Follows the lights' texels; empty where no light paths are wanted.
    pub light_paths: CasterTable,
    /// Texels of lights before it.
    pub splat_texels: u32,
    /// Point lights and emitters; the latter follow the former.
    pub light_count: u32,
    pub point_count: u32,
    /// The camera, and radiance of the background.
    view: View,
    /// Radius of the lens, and distance of what is in focus.
    lens: Option<[f64; 2]>,
    background: [f64; 3],
    /// The pixels that may show emitters, directly or in mirrors.
    pub emitter_bounds: Vec<Rectangle>,
    /// The only light, if that is a point.
    pub single_point: Option<Light>,
    pub packed: Packed,
    pub bvh: Option<BvhStatistics>,
    /// What ray queries find hits by, if there is a BVH and they are asked for.
    pub query_geometry: Option<QueryGeometry>,
    /// Where the BVH's primitives come from.
    origins: Vec<Origin>,
    /// Scene indices of the constant spheres.
    constant_origins: Vec<usize>,
    /// Whether all that does not emit is in the BVH, and the camera and the lights are outside of the box around that.
    pub seen_from_outside: bool,
    pub constant_spheres: Vec<ConstantSphere>,
    pub polygons: Vec<InlinePolygon>,
    /// Bit n: polygon n may lie between two points of the scene. The others bound its convex hull.
    pub polygon_occluders: u32,
    /// Whether spheres and triangles are left for the BVH.
    pub bvh_spheres: bool,
    pub bvh_triangles: bool,
    hidden_lights: usize,
}

impl Tables {
    /// Compiles a scene.
    pub fn new(scene: &Scene, space: &RenderSpace, settings: &RenderSettings) -> Self {
        let mut textures = TextureTable::of(scene);
        let mut geometry = SceneGeometry::constants(scene, space, settings, &textures);
        let start = Instant::now();
        geometry.add_what_is_in_the_bvh(scene, space);
        let primitives = &geometry.primitives;
        let leaves = accel::leaves(primitives);
        let tree = build_tree(primitives, &leaves, settings);
        let first_primitive = geometry.constants_count() as u32;
        // Without one, a BVH is compiled in only by the general pipeline.
        let mut packed =
            tree.as_ref().map_or_else(Packed::nothing, |tree| accel::pack(tree, &leaves, primitives, first_primitive));
        if scene.materials.iter().any(Material::lets_rays_pass) {
            packed.mark_passable(|primitive| geometry.passable(primitive as usize, &scene.materials));
        }
        let query_geometry = match &tree {
            Some(_) => QueryGeometry::of(&packed, primitives, first_primitive, scene, space, settings),
            None => None,
        };
        packed.texels.extend(query_geometry.iter().flat_map(QueryGeometry::handle_texels));
        let build_seconds = start.elapsed().as_secs_f64();

        let (bvh_spheres, bvh_triangles) = (geometry.has_bvh_spheres(), geometry.has_bvh_triangles());
        let points = geometry.points;
        let two_sided = u32::from(geometry.lights.has_two_sided());
        let lights = geometry.lights.into_vec();
        let environment = EnvironmentValues::add(scene, &lights, &mut textures.texels);
        let mut light_table = LightTable::of(&lights, |light| solid_angle::looks_large(light, scene, space));
        light_table.kinds |= two_sided << kind::TWO_SIDED;
        // Light that pixels share would have to be shared with light paths for each of them apart.
        let light_paths = if settings.light_tracing == LightTracing::Auto && settings.reuse != Reuse::Always {
            CasterTable::of(scene, space, &lights[points..])
        } else {
            CasterTable::default()
        };
        let splat_texels = light_table.texels.len() as u32;
        light_table.texels.extend(&light_paths.texels);
        let view = View::of(scene, space.length(1.0));
        let emits = |&sphere: &usize| scene.surface(scene.spheres[sphere].material).emits();
        let in_bvh =
            geometry.polygons.iter().all(|polygon| polygon.emits) && geometry.constant_origins.iter().all(emits);
        let seen_from_outside = in_bvh && are_seen_from_outside(&packed.root_boxes, &lights);
        Self {
            geometry: geometry.geometry.into_texels(),
            textures: textures.texels,
            environment,
            glass: textures.glass,
            single_point: single_point(&lights, scene.environment.is_some()),
            light_count: lights.len() as u32,
            point_count: points as u32,
            emitter_bounds: match settings.sample_map {
                SampleMap::Auto if scene.camera.is_pinhole() => emitter_bounds(scene, space, &view, &lights[points..]),
                _ => Vec::new(),
            },
            lights: light_table,
            light_paths,
            splat_texels,
            view,
            lens: scene.camera.lens.map(|lens| [lens.radius, lens.focus].map(|length| space.length(length))),
            background: scene.background,
            seen_from_outside,
            bvh: tree.map(|_| BvhStatistics { build_seconds, ..packed.statistics }),
            packed,
            query_geometry,
            origins: geometry.origins,
            constant_origins: geometry.constant_origins,
            constant_spheres: geometry.constant_spheres,
            polygon_occluders: polygons::occluders(&geometry.polygons, scene, space),
            bvh_spheres,
            bvh_triangles,
            polygons: geometry.polygons,
            hidden_lights: geometry.hidden_lights,
        }
    }

    /// Point lights that no path can see, because an opaque sphere is around them or around the camera.
    pub fn hidden_lights(&self) -> usize {
        self.hidden_lights
    }

    /// Boxes around all that is in the BVH; none without one.
    pub fn root_boxes(&self) -> &[Aabb] {
        &self.packed.root_boxes
    }

    /// Records of the packed BVH.
    pub fn bvh_records(&self) -> usize {
        self.packed.records
    }

    /// Groups of children that a traversal may have to keep: one for each level but the last, from which it goes nowhere.
    pub fn stack_levels(&self) -> u32 {
        self.bvh.as_ref().map_or(1, |t| t.depth.saturating_sub(1).max(1))
    }

    /// Where a primitive comes from; `None` for polygons, which may join triangles.
    pub fn origin_of(&self, primitive: i32) -> Option<Origin> {
        let primitive = usize::try_from(primitive).ok()?;
        match primitive.checked_sub(self.constant_spheres.len() + self.polygons.len()) {
            None => self.constant_origins.get(primitive).map(|&i| Origin::Sphere(i)),
            Some(of_bvh) => self.origins.get(of_bvh).copied(),
        }
    }

    /// The primitive that rays name by a handle, or −1.
    pub fn primitive_of(&self, self_id: i32) -> i32 {
        match usize::try_from(self_id).ok().and_then(|id| id.checked_sub(BVH_ID)) {
            None => self_id,
            Some(slot) => self.packed.primitive(slot).map_or(-1, |primitive| primitive as i32),
        }
    }

    /// Samples of lights that a path takes where it first meets a diffuse surface, if it serves several pixels.
    pub fn light_samples(&self, wanted: LightSamples) -> u32 {
        if self.samples_lights() && wanted == LightSamples::Auto { LIGHT_SAMPLES } else { 1 }
    }

    /// Whether lights are sampled: there is more than a point.
    pub fn samples_lights(&self) -> bool {
        (self.light_count > 0 || self.environment.share > 0.0) && self.single_point.is_none()
    }

    /// The numbers of the scene.
    pub fn values(&self) -> SceneValues {
        let mut values = SceneValues {
            record_count: self.packed.records as u32,
            // The last word of the root's record.
            root_order: self.packed.texels[2][3],
            first_material: self.geometry.first_material,
            first_position: self.geometry.first_position,
            first_normal: self.geometry.first_normal,
            first_detail: self.geometry.first_detail,
            first_uv: self.geometry.first_uv,
            first_color: self.geometry.first_color,
            first_tangent: self.geometry.first_tangent,
            environment_half: self.environment.left,
            environment_share: self.environment.share,
            environment_turn: self.environment.turn,
            environment_map: self.environment.map,
            glass_table: [self.glass, 0, 0, 0],
            ..SceneValues::zeroed()
        };
        for (value, s) in values.spheres.iter_mut().zip(&self.constant_spheres) {
            let [x, y, z] = s.center;
            *value = [[x, y, z, s.radius], [s.power, 0.0, 0.0, 0.0]];
        }
        for (value, b) in values.root_boxes.iter_mut().zip(&self.packed.root_boxes) {
            *value = [b.lo, b.hi].map(|corner| corner.extend(0.0).to_array());
        }
        for (value, f) in values.polygons.iter_mut().zip(&self.polygons) {
            let plane = f.normal.dot(f.corners[0]);
            *value = [f.edges().map(|edge| edge.z as f32), [plane as f32, 0.0, 0.0, 0.0]];
        }
        if let Some(Light { shape: LightShape::Point(p), radiance, .. }) = self.single_point {
            values.point_position = p.extend(0.0).as_vec4().to_array();
            values.point_intensity = rgb(radiance, 0.0);
        }
        values.even_share = self.lights.even_share;
        let grid = &self.lights.grid;
        values.light_grid = grid.center.extend(grid.size).as_vec4().to_array();
        let View { right, up, forward, orthographic, .. } = self.view;
        let [radius, focus] = self.lens.unwrap_or_default();
        [values.camera_right, values.camera_up, values.camera_forward] =
            [(right, radius), (up, focus), (forward, f64::from(u8::from(orthographic)))]
                .map(|(v, w)| v.extend(w).as_vec4().to_array());
        values.background = rgb(self.background, 0.0);
        values
    }
}

/// An environment as the scene's values have it.
#[derive(Debug, Clone, Copy, Default)]
struct EnvironmentValues {
    left: f32,
    share: f32,
    turn: [f32; 4],
    map: [u32; 4],
}

impl EnvironmentValues {
    /// Adds the map of a scene to the texels.
    fn add(scene: &Scene, lights: &[Light], texels: &mut Vec<Texel>) -> Self {
        let Some(environment) = &scene.environment else { return Self::default() };
        let table = EnvironmentTable::of(environment);
        let first = texels.len() as u32;
        texels.extend(&table.pixels);
        let density = texels.len() as u32;
        texels.extend(&table.density);
        let (sin, cos) = environment.rotation.to_radians().sin_cos();
        let visible = if environment.visible { 1.0 } else { 0.0 };
        let shines = !lights.is_empty();
        Self {
            left: table.left,
            share: match (shines, table.power > 0.0) {
                (false, _) => 1.0,
                (true, true) => 0.5,
                (true, false) => 0.0,
            },
            turn: [cos as f32, sin as f32, environment.scale as f32, visible],
            map: [first, environment.width, environment.height, density],
        }
    }
}

/// The only light of a scene, if that is a point that shines to all sides alike.
fn single_point(lights: &[Light], has_environment: bool) -> Option<Light> {
    match lights {
        [light @ Light { shape: LightShape::Point(_), .. }] if !has_environment => Some(*light),
        _ => None,
    }
}

fn build_tree(primitives: &[Primitive], leaves: &[Leaf], settings: &RenderSettings) -> Option<accel::Tree> {
    let is_thin = matches!(settings.mutation, Some(Mutation::ThinBoxes | Mutation::NoMargins));
    let bounds_of = |primitive: &Primitive| if is_thin { primitive.extent() } else { primitive.bounds(0.0) };
    let of_leaf =
        |leaf: &Leaf| leaf.members().fold(Aabb::EMPTY, |all, i| all.union(bounds_of(&primitives[i as usize])));
    accel::build(&leaves.par_iter().map(of_leaf).collect::<Vec<_>>())
}

/// Whether the camera, which is the origin, and some lights are outside of the box around these.
fn are_seen_from_outside(boxes: &[Aabb], lights: &[Light]) -> bool {
    let around = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
    let is_outside = |light: &Light| {
        let (lo, hi) = light.bounds();
        !around.meets(Aabb::around([lo.as_vec3(), hi.as_vec3()]))
    };
    !around.meets(Aabb::around([Vec3::ZERO])) && lights.iter().all(is_outside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::generate;
    use crate::check::scenes::divided_room;
    use crate::scene;

    #[test]
    fn terrain_is_seen_from_outside() {
        let from_outside =
            |scene: &Scene| Tables::new(scene, &RenderSpace::of(scene), &RenderSettings::of(scene)).seen_from_outside;
        let terrain = generate::terrain(2000);
        assert!(from_outside(&terrain));
        let position = terrain.meshes[0].positions[terrain.meshes[0].positions.len() / 2];
        let mut from_within = terrain.clone();
        from_within.camera.position = position;
        assert!(!from_outside(&from_within));
        let mut lit_from_within = terrain.clone();
        lit_from_within.lights.push(scene::Light::Point { position, power: [1.0; 3] });
        assert!(!from_outside(&lit_from_within));
        // What is in no BVH is not seen to be outside.
        assert!(!from_outside(&divided_room()));
    }
}
