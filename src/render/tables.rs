//! The scene as the shaders' tables: materials, spheres, lights, the packed tree, and the constants that go with them.

use std::time::Instant;

use bytemuck::Zeroable;
use glam::DVec3;
use rayon::prelude::*;

use crate::accel::{self, Aabb, Leaf, Packed, Primitive, Texel, TreeStatistics};
use crate::gpu::Specialization;
use crate::scene::{self, Scene, Sphere, Surface};

use super::beams::BeamTable;
use super::driver::DriverFacts;
use super::facets::{self, Facet};
use super::features::Features;
use super::layout::{SceneValues, constant, kind};
use super::light_list::LightList;
use super::lights::{Light, LightShape, LightTable};
use super::mutation::Mutation;
use super::rectangles;
use super::settings::{LightSamples, RenderSettings, Sampler};
use super::space::RenderSpace;
use super::spheres::{self, ConstantSphere};
use super::view::{Rectangle, View};

/// Ids of the shader from here on are records of the tree (shaders/lib/intersect/tree.glsl).
pub(super) const TREE_ID: usize = 0x0100_0000;
/// Samples of lights at a first diffuse hit: shaders/lib/path.glsl spreads up to four over a lamp.
const LIGHT_SAMPLES: u32 = 4;

/// Where a primitive of the shader comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// Index among the scene's spheres.
    Sphere(usize),
    /// Index among the triangles of all meshes.
    Triangle(usize),
}

/// Everything that is uploaded or becomes a constant.
pub(crate) struct Tables {
    pub shapes: Vec<[f32; 4]>,
    pub lights: LightTable,
    /// Follows the lights' texels.
    pub beams: BeamTable,
    /// Texels of lights before it.
    beam_texels: u32,
    light_count: u32,
    emitter_count: u32,
    /// The pixels that may show emitters directly.
    pub emitters_in_view: Vec<Rectangle>,
    /// The only light, if that is a point.
    single_point: Option<Light>,
    /// Of the packed tree.
    pub tree_texels: Vec<Texel>,
    pub tree: Option<TreeStatistics>,
    /// Of each record of the tree, its primitives.
    records: Vec<[u32; 2]>,
    /// Where the tree's primitives come from.
    origins: Vec<Origin>,
    /// Scene indices of the constant spheres.
    constant_origins: Vec<usize>,
    tree_boxes: Vec<Aabb>,
    constant_spheres: Vec<ConstantSphere>,
    facets: Vec<Facet>,
    facet_occluders: u32,
    hidden_lights: usize,
}

impl Tables {
    pub fn of(scene: &Scene, space: &RenderSpace, settings: &RenderSettings) -> Self {
        let (constant, rest) = spheres::partition(scene, space);
        let constant_spheres: Vec<_> =
            constant.iter().map(|&i| spheres::classify(&scene.spheres[i], scene, space)).collect();

        let visible: Vec<_> = spheres::visible_lights(scene).collect();
        let lights: Vec<Light> = visible.iter().filter(|l| l.shines()).map(|l| point_light(l, space)).collect();
        let points = lights.len();
        let mut lights = LightList::new(lights);
        let emitted = |material: u32| match scene.materials[material as usize].surface {
            Surface::Emitter { radiance } if radiance != [0.0; 3] => Some(radiance),
            _ => None,
        };
        let add_sphere = |lights: &mut LightList, s: &Sphere| match emitted(s.material) {
            Some(radiance) => lights.add_sphere(space.point(s.center), space.length(s.radius), s.inward, radiance),
            None => -1,
        };

        let materials: Vec<_> = scene.materials.iter().map(|m| material_texel(&m.surface)).collect();
        let mut shapes = Vec::new();
        for (s, &i) in constant_spheres.iter().zip(&constant) {
            let [x, y, z] = s.center;
            shapes.push([x, y, z, s.curvature]);
            shapes.push(materials[s.material as usize]);
            let light = add_sphere(&mut lights, &scene.spheres[i]);
            shapes.push([f32::from_bits(light as u32), 0.0, 0.0, 0.0]);
        }
        let (facets, in_constants) = facets::select(scene, space, settings.triangle_test);
        for f in &facets {
            let n = f.normal.as_vec3();
            shapes.push([n.x, n.y, n.z, f.normal.dot(f.corners[0]) as f32]);
            shapes.push(materials[f.material as usize]);
            let [a, b, c, d] = f.corners;
            let light = match emitted(f.material) {
                Some(radiance) if f.is_triangle() => {
                    lights.add_polygon(LightShape::Triangle([a, b, c]), &[a, b, c], radiance)
                }
                Some(radiance) => lights.add_polygon(LightShape::Parallelogram([a, b, d]), &f.corners, radiance),
                None => -1,
            };
            shapes.push([f32::from_bits(light as u32), 0.0, 0.0, 0.0]);
        }
        for f in &facets {
            let plane = f.normal.extend(f.normal.dot(f.corners[0])).as_vec4().to_array();
            shapes.extend(f.corners.iter().zip(plane).map(|(c, w)| c.as_vec3().extend(w).to_array()));
        }
        let first_material = shapes.len() as u32;
        shapes.extend(&materials);

        let start = Instant::now();
        let mut primitives = Vec::with_capacity(scene.triangle_count() + rest.len());
        let mut origins: Vec<Origin> = rest.iter().map(|&i| Origin::Sphere(i)).collect();
        for &i in &rest {
            let sphere = &scene.spheres[i];
            primitives.push(Primitive::Sphere {
                center: space.point32(sphere.center),
                radius: space.length(sphere.radius) as f32,
                inward: sphere.inward,
                surface: first_material + sphere.material,
                light: add_sphere(&mut lights, sphere),
            });
        }
        let mut first_triangle = 0;
        for (mesh, &constant) in scene.meshes.iter().zip(&in_constants) {
            if !constant {
                let added = add_triangles(mesh, space, first_material, &mut shapes, &mut primitives);
                let of_mesh = primitives.len() - added.len();
                let emits = |i: usize| emitted(mesh.triangle_materials[i]);
                if mesh.triangle_materials.iter().any(|&material| emitted(material).is_some()) {
                    for (&i, primitive) in added.iter().zip(&mut primitives[of_mesh..]) {
                        let (Some(radiance), Primitive::Triangle { light, .. }) = (emits(i), primitive) else {
                            continue;
                        };
                        let corners = mesh.triangles[i].map(|v| space.point(mesh.positions[v as usize]));
                        *light = lights.add_polygon(LightShape::Triangle(corners), &corners, radiance);
                    }
                }
                origins.par_extend(added.into_par_iter().map(|i| Origin::Triangle(first_triangle + i)));
            }
            first_triangle += mesh.triangles.len();
        }
        let lights = lights.into_vec();
        let mut light_table = LightTable::of(&lights, |light| rectangles::looks_large(light, scene, space));
        let beams = BeamTable::of(scene, space, &lights[points..]);
        let beam_texels = light_table.texels.len() as u32;
        light_table.texels.extend(&beams.texels);
        let view = View::of(scene);
        let mut tables = Self {
            shapes,
            single_point: (points == 1 && lights.len() == 1).then(|| lights[0]),
            light_count: lights.len() as u32,
            emitter_count: (lights.len() - points) as u32,
            emitters_in_view: lights.iter().filter_map(|l| view.pixels_of(l)).collect(),
            lights: light_table,
            beams,
            beam_texels,
            tree_texels: Vec::new(),
            tree: None,
            records: Vec::new(),
            origins: Vec::new(),
            constant_origins: constant,
            tree_boxes: Vec::new(),
            constant_spheres,
            facet_occluders: facets::occluders(&facets, scene, space),
            facets,
            hidden_lights: scene.lights.len() - visible.len(),
        };
        leave_out_copies(&mut primitives, &mut origins);
        let leaves = accel::leaves(&primitives);
        if let Some(tree) = build_tree(&primitives, &leaves, settings) {
            let packed = accel::pack(&tree, &leaves, &primitives);
            let build_seconds = start.elapsed().as_secs_f64();
            tables.tree = Some(TreeStatistics { build_seconds, ..packed.statistics });
            tables.tree_boxes = tree.top_boxes(constant::MAX_TREE_BOXES);
            tables.records = packed.primitives;
            tables.tree_texels = packed.texels;
            tables.origins = origins;
        } else {
            // A tree is compiled in only by the general pipeline.
            let nothing = Packed::nothing();
            tables.records = nothing.primitives;
            tables.tree_texels = nothing.texels;
        }
        tables
    }

    /// Point lights that no path can see, because an opaque sphere is around them or around the camera.
    pub fn hidden_lights(&self) -> usize {
        self.hidden_lights
    }

    /// Boxes around all that is in the tree; none without one.
    pub fn tree_boxes(&self) -> &[Aabb] {
        &self.tree_boxes
    }

    /// Records of the packed tree.
    pub fn tree_records(&self) -> usize {
        self.records.len()
    }

    /// Groups of children that a walk may have to keep: one for each level but the last, from which it goes nowhere.
    fn stack_levels(&self) -> u32 {
        self.tree.as_ref().map_or(1, |t| t.depth.saturating_sub(1).max(1))
    }

    /// Where the primitive with this id in the shader comes from; `None` for facets, which may join triangles.
    pub fn origin_of(&self, id: i32) -> Option<Origin> {
        let id = usize::try_from(id).ok()?;
        match id.checked_sub(TREE_ID) {
            None => self.constant_origins.get(id).map(|&i| Origin::Sphere(i)),
            Some(slot) => self.origins.get(self.records.get(slot / 2)?[slot % 2] as usize).copied(),
        }
    }

    /// Whether emitters are among the lights.
    pub fn has_emitters(&self) -> bool {
        self.emitter_count > 0
    }

    /// Samples of lights that a path takes where it first meets a diffuse surface, if it serves several pixels.
    pub fn light_samples(&self, wanted: LightSamples) -> u32 {
        if self.samples_lights() && wanted == LightSamples::Auto { LIGHT_SAMPLES } else { 1 }
    }

    /// Whether lights are sampled: there is more than a point.
    pub fn samples_lights(&self) -> bool {
        self.light_count > 0 && self.single_point.is_none()
    }

    /// The numbers of the scene.
    pub fn values(&self) -> SceneValues {
        let mut values = SceneValues { record_count: self.records.len() as u32, ..SceneValues::zeroed() };
        for (value, s) in values.spheres.iter_mut().zip(&self.constant_spheres) {
            let [x, y, z] = s.center;
            *value = [[x, y, z, s.radius], [s.power, 0.0, 0.0, 0.0]];
        }
        for (value, b) in values.tree_boxes.iter_mut().zip(&self.tree_boxes) {
            *value = [b.lo, b.hi].map(|corner| corner.extend(0.0).to_array());
        }
        for (value, f) in values.facets.iter_mut().zip(&self.facets) {
            let plane = f.normal.dot(f.corners[0]);
            *value = [f.edges().map(|edge| edge.z as f32), [plane as f32, 0.0, 0.0, 0.0]];
        }
        if let Some(Light { shape: LightShape::Point(p), radiance }) = self.single_point {
            values.point_position = p.extend(0.0).as_vec4().to_array();
            values.point_intensity = rgb(radiance, 0.0);
        }
        let grid = &self.lights.grid;
        values.light_grid = grid.center.extend(grid.size).as_vec4().to_array();
        values
    }

    /// Values of all specialization constants but the workgroup's size and the loop budget.
    pub fn specialization(&self, features: &Features, settings: &RenderSettings, facts: DriverFacts) -> Specialization {
        let mut s = Specialization::default();
        s.uint(constant::FILTER, u32::from(features.gaussian))
            .uint(
                constant::SAMPLER,
                match features.sampler {
                    Sampler::Sobol => 0,
                    Sampler::Independent => 1,
                    Sampler::Pcg => 2,
                },
            )
            .uint(constant::MAX_DEPTH, features.max_depth)
            .uint(constant::ROULETTE_DEPTH, features.roulette)
            .bool(constant::INDIRECT, features.indirect)
            .bool(constant::HAS_DIFFUSE, features.diffuse)
            .bool(constant::HAS_MIRROR, features.mirror)
            .bool(constant::HAS_DIELECTRIC, features.dielectric)
            .bool(constant::HAS_EMITTER, features.emitter)
            .bool(constant::HAS_BACKGROUND, features.background)
            .uint(constant::SPHERE_COUNT, features.constant_spheres)
            .bool(constant::HAS_TREE, features.tree)
            .bool(constant::TREE_SPHERES, features.tree_spheres)
            .bool(constant::TREE_TRIANGLES, features.tree_triangles)
            .bool(constant::BRUTE_FORCE, features.brute_force)
            .bool(constant::MOLLER_TRUMBORE, features.moller_trumbore)
            .bool(constant::SMOOTH_NORMALS, features.smooth_normals)
            .uint(constant::LIGHT_COUNT, self.light_count)
            .uint(constant::EMITTER_COUNT, self.emitter_count)
            .uint(constant::LIGHT_KINDS, if features.light_kinds { LightTable::ALL_KINDS } else { self.lights.kinds })
            .uint(constant::LIGHT_NODES, self.lights.nodes)
            .uint(constant::LIGHT_ENTRIES, self.lights.grid.entries)
            .uint(constant::LIGHT_CELLS, self.lights.grid.cells)
            .uint(constant::LIGHT_DEPTH, self.lights.grid.depth)
            .uint(constant::BEAM_TEXELS, self.beam_texels)
            .uint(constant::LIGHT_LOOPS, self.lights.grid.loops())
            .uint(constant::SOBOL_LEVELS, features.sobol_levels)
            .bool(constant::THREADS, facts.threads)
            .bool(constant::SHUFFLES, facts.threads && facts.shuffles)
            .uint(constant::TREE_BOX_COUNT, self.tree_boxes.len() as u32)
            .uint(constant::TREE_LEVELS, if features.deep_tree { accel::MAX_DEPTH } else { self.stack_levels() })
            .uint(constant::MUTATION, settings.mutation.map_or(0, |m| m as u32))
            .bool(constant::PATH_STATS, settings.count_steps);
        for (i, sphere) in self.constant_spheres.iter().enumerate() {
            let base = constant::SPHERES + 2 * i as u32;
            s.uint(base, sphere.side as u32).uint(base + 1, sphere.form as u32);
        }
        if let Some(Light { shape: LightShape::Point(p), .. }) = self.single_point {
            let is_inside = |s: &ConstantSphere| {
                let center = DVec3::from(s.center.map(f64::from));
                center.distance_squared(p) < f64::from(s.radius).powi(2)
            };
            let inside = self.constant_spheres.iter().enumerate().map(|(i, s)| u32::from(is_inside(s)) << i).sum();
            s.uint(constant::POINT_INSIDE, inside);
        }
        s.uint(constant::FACET_COUNT, self.facets.len() as u32).uint(constant::FACET_OCCLUDERS, self.facet_occluders);
        let across = |axis| self.facets.iter().enumerate().map(|(i, f)| u32::from(f.axis() == axis) << i).sum();
        let exact = settings.exact_facets.unwrap_or(!facts.skips_branches);
        s.bool(constant::EXACT_FACETS, exact)
            .uint(constant::FACETS_ACROSS_X, across(0))
            .uint(constant::FACETS_ACROSS_Y, across(1));
        for (i, f) in self.facets.iter().enumerate() {
            let base = constant::FACETS + 16 * i as u32;
            let corners = if exact { f.corners } else { f.edges().map(|edge| edge.truncate().extend(0.0)) };
            for (j, v) in corners.into_iter().chain([f.normal]).flat_map(|c| c.to_array()).enumerate() {
                s.float(base + j as u32, v as f32);
            }
        }
        s
    }
}

fn rgb(c: [f64; 3], w: f32) -> [f32; 4] {
    [c[0] as f32, c[1] as f32, c[2] as f32, w]
}

fn material_texel(surface: &Surface) -> [f32; 4] {
    match *surface {
        Surface::Diffuse { reflectance } => rgb(reflectance, kind::DIFFUSE),
        Surface::Mirror { reflectance } => rgb(reflectance, kind::MIRROR),
        Surface::Dielectric { ior } => rgb([1.0; 3], ior as f32),
        Surface::Emitter { radiance } => rgb(radiance, kind::EMITTER),
    }
}

fn point_light(light: &scene::Light, space: &RenderSpace) -> Light {
    let scene::Light::Point { position, power } = *light;
    let per = 1.0 / (4.0 * std::f64::consts::PI * std::f64::consts::PI);
    Light { shape: LightShape::Point(space.point(position)), radiance: power.map(|x| space.power(x) * per) }
}

/// Leaves exact copies of a primitive out: the first of them is what rays hit.
fn leave_out_copies(primitives: &mut Vec<Primitive>, origins: &mut Vec<Origin>) {
    let copies = accel::copies(primitives);
    if copies.is_empty() {
        return;
    }
    let mut keeps = vec![true; primitives.len()];
    for i in copies {
        keeps[i as usize] = false;
    }
    let mut keep = keeps.iter();
    primitives.retain(|_| keep.next() == Some(&true));
    let mut keep = keeps.iter();
    origins.retain(|_| keep.next() == Some(&true));
}

fn build_tree(primitives: &[Primitive], leaves: &[Leaf], settings: &RenderSettings) -> Option<accel::Tree> {
    let is_thin = matches!(settings.mutation, Some(Mutation::ThinBoxes | Mutation::NoMargins));
    let bounds_of = if is_thin { Primitive::extent } else { Primitive::bounds };
    let of_leaf =
        |leaf: &Leaf| leaf.members().fold(Aabb::EMPTY, |all, i| all.union(bounds_of(&primitives[i as usize])));
    accel::build(&leaves.par_iter().map(of_leaf).collect::<Vec<_>>())
}

/// Adds the triangles of a mesh that have an area in single precision, without light; returns their indices in the mesh.
fn add_triangles(
    mesh: &crate::scene::Mesh,
    space: &RenderSpace,
    first_material: u32,
    shapes: &mut Vec<[f32; 4]>,
    primitives: &mut Vec<Primitive>,
) -> Vec<usize> {
    let corners = |i: usize| mesh.triangles[i].map(|vertex| mesh.positions[vertex as usize]);
    let vertices: Vec<_> = (0..mesh.triangles.len()).into_par_iter().map(|i| space.triangle32(corners(i))).collect();
    let added: Vec<usize> = (0..vertices.len()).filter(|&i| vertices[i].is_some()).collect();
    let smooth = !mesh.vertex_normals.is_empty();
    let first_row = shapes.len();
    primitives.par_extend(added.par_iter().enumerate().map(|(number, &i)| {
        let [a, b, c] = corners(i);
        Primitive::Triangle {
            vertices: vertices[i].unwrap_or_default(),
            normal: (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z).as_vec3(),
            surface: first_material + mesh.triangle_materials[i],
            attributes: if smooth { (first_row + 3 * number) as i32 } else { -1 },
            light: -1,
        }
    }));
    if smooth {
        shapes.extend(added.iter().flat_map(|&i| mesh.triangles[i]).map(|vertex| {
            let n = mesh.vertex_normals[vertex as usize].as_vec3();
            [n.x, n.y, n.z, 0.0]
        }));
    }
    added
}

#[cfg(test)]
mod tests {
    use super::super::driver::Sharers;
    use super::*;
    use crate::bench::generate;
    use crate::scene::PixelFilter;

    fn specialization(scene: &Scene) -> Specialization {
        let settings = RenderSettings::of(scene);
        let facts = DriverFacts {
            loop_budget: 0,
            workgroup_size: 64,
            queue: true,
            reuse: Sharers::Lanes,
            threads: false,
            shuffles: false,
            groups_fit: true,
            invocations: 0,
            skips_branches: true,
            queue_regions: 64,
        };
        Tables::of(scene, &RenderSpace::of(scene), &settings).specialization(
            &Features::of(scene, &settings),
            &settings,
            facts,
        )
    }

    /// Drivers compile a kernel for each set of constants, which takes longer than many a rendering.
    #[test]
    fn what_moves_compiles_nothing_anew() {
        let room = r#"
            version = 1
            [camera]
            position = [0, 0, 5]
            target = [0, 0, 0]
            horizontal_fov = 40
            [film]
            width = 8
            height = 8
            [[material]]
            name = "grey"
            type = "diffuse"
            reflectance = [0.5, 0.5, 0.5]
            [[material]]
            name = "glass"
            type = "dielectric"
            ior = 1.5
            [[sphere]]
            center = [0, -1000, 0]
            radius = 999
            material = "grey"
            [[sphere]]
            center = [0, 0, 0]
            radius = 1
            material = "glass"
            [[light]]
            type = "point"
            position = [2, 3, 4]
            power = [1, 1, 1]
        "#;
        let room = Scene::from_toml_str(room, "room", None).unwrap().scene;
        let cornell = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/cornell.toml");
        let cornell = Scene::load(std::path::Path::new(cornell)).unwrap().scene;
        for scene in [room.clone(), generate::terrain(200), cornell] {
            let constants = specialization(&scene);
            let mut moved = scene.clone();
            moved.camera.position += DVec3::new(0.11, 0.07, -0.13);
            moved.camera.target.x += 0.3;
            assert_eq!(specialization(&moved), constants, "{}", scene.source);
        }
        let mut moved = room.clone();
        moved.spheres[1].center.y += 0.25;
        moved.spheres[1].radius = 0.9;
        moved.materials[1].surface = Surface::Dielectric { ior: 1.6 };
        moved.lights = vec![scene::Light::Point { position: DVec3::new(-2.0, 3.0, 1.0), power: [2.0, 3.0, 4.0] }];
        assert_eq!(specialization(&moved), specialization(&room));
        // What another kind of light or surface needs is compiled.
        moved.film.filter = PixelFilter::Gaussian;
        moved.materials[1].surface = Surface::Mirror { reflectance: [1.0; 3] };
        assert_ne!(specialization(&moved), specialization(&room));
    }
}
