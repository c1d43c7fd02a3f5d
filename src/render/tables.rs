//! The scene as the shaders' tables: materials, spheres, lights, the packed tree, and the constants that go with them.

use std::time::Instant;

use glam::DVec3;

use crate::accel::{self, Aabb, Primitive, Record, TreeStatistics};
use crate::gpu::Specialization;
use crate::scene::{Light, Scene, Surface};

use super::features::Features;
use super::layout::{constant, kind};
use super::settings::{RenderSettings, Sampler};
use super::space::RenderSpace;
use super::spheres::{self, ConstantSphere};

/// Ids of the shader from here on are records of the tree (shaders/lib/intersect/tree.glsl).
const TREE_ID: usize = 0x0100_0000;

/// A primitive by its place in the tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TablePrimitive {
    /// Index among the constant spheres.
    ConstantSphere(usize),
    /// Index among the tree's primitives: triangles in scene order, then spheres.
    OfTree(usize),
}

/// Everything that is uploaded or becomes a constant.
pub(crate) struct Tables {
    pub shapes: Vec<[f32; 4]>,
    pub lights: Vec<[f32; 4]>,
    pub records: Vec<Record>,
    pub tree: Option<TreeStatistics>,
    /// Primitive of each leaf record: triangles in scene order, then the spheres of the tree.
    pub order: Vec<u32>,
    pub first_leaf: u32,
    tree_boxes: Vec<Aabb>,
    constant_spheres: Vec<ConstantSphere>,
    hidden_lights: usize,
}

impl Tables {
    pub fn of(scene: &Scene, space: &RenderSpace) -> Self {
        let (constant, rest) = spheres::partition(&scene.spheres);
        let constant_spheres: Vec<_> =
            constant.iter().map(|&i| spheres::classify(&scene.spheres[i], scene, space)).collect();

        let materials: Vec<_> = scene.materials.iter().map(|m| material_texel(&m.surface)).collect();
        let mut shapes = Vec::new();
        for s in &constant_spheres {
            let [x, y, z] = s.center;
            shapes.push([x, y, z, s.curvature]);
            shapes.push(materials[s.material as usize]);
        }
        let first_material = shapes.len() as u32;
        shapes.extend(&materials);

        let visible: Vec<_> =
            scene.lights.iter().filter(|l| !scene.spheres.iter().any(|s| spheres::hides(s, scene, l))).collect();
        let lights = visible.iter().flat_map(|l| light_texels(l, space)).collect();

        let start = Instant::now();
        let mut primitives = Vec::with_capacity(scene.triangle_count() + rest.len());
        for mesh in &scene.meshes {
            add_triangles(mesh, space, first_material, &mut shapes, &mut primitives);
        }
        for &i in &rest {
            let sphere = &scene.spheres[i];
            primitives.push(Primitive::Sphere {
                center: space.point32(sphere.center),
                radius: space.length(sphere.radius) as f32,
                inward: sphere.inward,
                surface: first_material + sphere.material,
            });
        }
        let bounds: Vec<_> = primitives.iter().map(Primitive::bounds).collect();
        let mut tables = Self {
            shapes,
            lights,
            records: Vec::new(),
            tree: None,
            order: Vec::new(),
            first_leaf: 0,
            tree_boxes: Vec::new(),
            constant_spheres,
            hidden_lights: scene.lights.len() - visible.len(),
        };
        if let Some(tree) = accel::build(&bounds) {
            tables.records = accel::pack(&tree, &primitives);
            tables.first_leaf = tree.nodes.len() as u32;
            tables.tree_boxes = tree.top_boxes(constant::MAX_TREE_BOXES);
            tables.tree = Some(TreeStatistics::of(&tree, start.elapsed().as_secs_f64()));
            tables.order = tree.order;
        } else {
            // A tree is compiled in only by the general pipeline: one node whose boxes no ray meets.
            let mut nothing = [f32::NAN; 16];
            nothing[3] = f32::from_bits(0x8000_0000);
            nothing[7] = f32::from_bits(0x8000_0000);
            tables.records.push(nothing);
        }
        tables
    }

    /// Point lights that no path can see, because an opaque sphere is around them or around the camera.
    pub fn hidden_lights(&self) -> usize {
        self.hidden_lights
    }

    /// What the shader calls the primitive that a ray met, in scene order: constant spheres, triangles, tree spheres.
    pub fn primitive_of(&self, id: i32) -> Option<TablePrimitive> {
        let record = usize::try_from(id).ok()?.checked_sub(TREE_ID);
        match record {
            None => Some(TablePrimitive::ConstantSphere(id as usize)),
            Some(record) => {
                let leaf = record.checked_sub(self.first_leaf as usize)?;
                self.order.get(leaf).map(|&p| TablePrimitive::OfTree(p as usize))
            }
        }
    }

    /// Values of all specialization constants but the workgroup's size and the loop budget.
    pub fn specialization(&self, features: &Features, settings: &RenderSettings) -> Specialization {
        let mut s = Specialization::default();
        s.uint(constant::FILTER, u32::from(features.gaussian))
            .uint(constant::SAMPLER, u32::from(features.sampler == Sampler::Independent))
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
            .bool(constant::BRUTE_FORCE, features.brute_force)
            .bool(constant::MOLLER_TRUMBORE, features.moller_trumbore)
            .bool(constant::SMOOTH_NORMALS, features.smooth_normals)
            .uint(constant::LIGHT_COUNT, features.lights)
            .uint(constant::SOBOL_LEVELS, features.sobol_levels)
            .uint(constant::TREE_BOX_COUNT, self.tree_boxes.len() as u32)
            .uint(constant::LEAF_BEGIN, self.first_leaf)
            .uint(constant::LEAF_END, self.records.len() as u32)
            .uint(constant::MUTATION, settings.mutation.map_or(0, |m| m as u32))
            .bool(constant::PATH_STATS, settings.count_steps);
        for (i, b) in self.tree_boxes.iter().enumerate() {
            for (j, x) in b.lo.to_array().into_iter().chain(b.hi.to_array()).enumerate() {
                s.float(constant::TREE_BOXES + (6 * i + j) as u32, x);
            }
        }
        for (i, sphere) in self.constant_spheres.iter().enumerate() {
            let base = constant::SPHERES + 8 * i as u32;
            let [x, y, z] = sphere.center;
            for (j, v) in [x, y, z, sphere.radius, sphere.power].into_iter().enumerate() {
                s.float(base + j as u32, v);
            }
            s.uint(base + 5, sphere.side as u32).uint(base + 6, sphere.form as u32);
        }
        if let [position, intensity] = self.lights.as_slice() {
            for (i, v) in position[..3].iter().chain(&intensity[..3]).enumerate() {
                s.float(constant::POINT + i as u32, *v);
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

fn light_texels(light: &Light, space: &RenderSpace) -> [[f32; 4]; 2] {
    let Light::Point { position, power } = *light;
    let p = space.point32(position);
    let per = 1.0 / (4.0 * std::f64::consts::PI * std::f64::consts::PI);
    [[p.x, p.y, p.z, 0.0], rgb(power.map(|x| space.power(x) * per), 0.0)]
}

fn add_triangles(
    mesh: &crate::scene::Mesh,
    space: &RenderSpace,
    first_material: u32,
    shapes: &mut Vec<[f32; 4]>,
    primitives: &mut Vec<Primitive>,
) {
    let smooth = !mesh.vertex_normals.is_empty();
    for (triangle, &material) in mesh.triangles.iter().zip(&mesh.triangle_materials) {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        let normal = (b - a).cross(c - a);
        let normal = normal.try_normalize().unwrap_or(DVec3::Z);
        let attributes = if smooth {
            let row = shapes.len() as i32;
            shapes.extend(triangle.map(|i| {
                let n = mesh.vertex_normals[i as usize].as_vec3();
                [n.x, n.y, n.z, 0.0]
            }));
            row
        } else {
            -1
        };
        primitives.push(Primitive::Triangle {
            vertices: [a, b, c].map(|p| space.point32(p)),
            normal: normal.as_vec3(),
            surface: first_material + material,
            attributes,
        });
    }
}
