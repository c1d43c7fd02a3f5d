//! What of a scene becomes constants, and what goes into the BVH, with the lights among both: in the order of the shaders' tables.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use crate::accel;
use crate::accel::{Passable, Primitive};
use crate::scene;
use crate::scene::{Material, Mesh, Scene, Sphere};

use crate::render::kernel::layout::flag;
use crate::render::light::emitter::{Light, LightShape};
use crate::render::light::list::{Emission, LightList};
use crate::render::scene::containment::Emitters;
use crate::render::scene::coplanar::Lifts;
use crate::render::scene::emission::EmissionMeans;
use crate::render::scene::geometry;
use crate::render::scene::geometry::{Attributes, Geometry, SphereShape, triangle_texels};
use crate::render::scene::materials::MaterialTexels;
use crate::render::scene::polygons;
use crate::render::scene::polygons::InlinePolygon;
use crate::render::scene::spheres;
use crate::render::scene::spheres::ConstantSphere;
use crate::render::scene::textures::TextureTable;
use crate::render::settings::RenderSettings;
use crate::render::settings::mutation::Mutation;
use crate::render::space::RenderSpace;

/// Where a primitive comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// Index among the scene's spheres.
    Sphere(usize),
    /// Index among the triangles of all meshes.
    Triangle(usize),
}

/// A scene in parts.
pub(crate) struct SceneGeometry {
    /// Constant spheres, polygons, and then the primitives of the BVH, in the order of their numbers.
    pub geometry: Geometry,
    pub lights: LightList,
    /// The first of the lights.
    pub points: usize,
    /// Point lights that no path can see.
    pub hidden_lights: usize,
    pub constant_spheres: Vec<ConstantSphere>,
    /// Scene indices of these.
    pub constant_origins: Vec<usize>,
    pub polygons: Vec<InlinePolygon>,
    /// Scene indices of the other spheres.
    other_spheres: Vec<usize>,
    /// By how much emitting triangles are moved.
    lifts: Lifts,
    /// Whether the triangles of each mesh are polygons.
    are_polygons: Vec<bool>,
    /// Shapes of the BVH, each once.
    pub primitives: Vec<Primitive>,
    /// Where these come from.
    pub origins: Vec<Origin>,
}

impl SceneGeometry {
    /// Constant spheres, polygons and materials.
    pub fn constants(scene: &Scene, space: &RenderSpace, settings: &RenderSettings, textures: &TextureTable) -> Self {
        let has_colors = scene.meshes.iter().any(|mesh| !mesh.colors.is_empty());
        let materials =
            MaterialTexels::of(&scene.materials, space, has_colors, |index, slot| textures.number(index, slot));
        let visible: Vec<_> = spheres::visible_lights(scene).collect();
        let points: Vec<_> = visible.iter().filter(|l| l.shines()).map(|l| point_light(l, space)).collect();
        let (constant_origins, other_spheres) = spheres::partition(scene, space);
        let lifts = match settings.mutation {
            Some(Mutation::FlushEmitters) => Lifts::default(),
            _ => Lifts::of(scene, space),
        };
        let (polygons, are_polygons) = polygons::select(scene, space, &lifts, settings.triangle_test);
        let mut geometry = Self {
            geometry: Geometry::new(materials),
            hidden_lights: scene.lights.len() - visible.len(),
            points: points.len(),
            lights: LightList::new(points),
            constant_spheres: Vec::new(),
            constant_origins,
            polygons: Vec::new(),
            other_spheres,
            lifts,
            are_polygons,
            primitives: Vec::new(),
            origins: Vec::new(),
        };
        geometry.add_constant_spheres(scene, space);
        geometry.add_polygons(polygons, &scene.materials);
        geometry
    }

    /// How many constant spheres and polygons there are: the number of the BVH's first primitive.
    pub fn constants_count(&self) -> usize {
        self.constant_spheres.len() + self.polygons.len()
    }

    /// Whether spheres are left for the BVH.
    pub fn has_bvh_spheres(&self) -> bool {
        !self.other_spheres.is_empty()
    }

    /// Whether triangles are.
    pub fn has_bvh_triangles(&self) -> bool {
        self.are_polygons.iter().any(|are_polygons| !are_polygons)
    }

    fn add_constant_spheres(&mut self, scene: &Scene, space: &RenderSpace) {
        let emitters = Emitters::of(scene);
        for &i in &self.constant_origins {
            let constant = spheres::classify(i, scene, &emitters, space);
            let ConstantSphere { center, radius, curvature, material, .. } = constant;
            let light = add_sphere(&mut self.lights, &scene.spheres[i], &scene.materials, space);
            let shape = SphereShape { center: center.into(), radius, curvature };
            self.geometry.add_sphere(shape, material, light);
            self.constant_spheres.push(constant);
        }
    }

    fn add_polygons(&mut self, polygons: Vec<InlinePolygon>, materials: &[Material]) {
        for f in &polygons {
            let [a, b, c, d] = f.corners;
            let light = match emitted(materials, f.material) {
                Some(emission) if f.is_triangle() => {
                    self.lights.add_polygon(LightShape::Triangle([a, b, c]), &[a, b, c], emission)
                }
                Some(emission) => self.lights.add_polygon(LightShape::Parallelogram([a, b, d]), &f.corners, emission),
                None => -1,
            };
            let offset = f.normal.dot(a) as f32;
            let corners = f.corners.map(|corner| corner.as_vec3());
            self.geometry.add_polygon(corners, f.normal.as_vec3(), offset, f.material, light);
        }
        self.polygons = polygons;
    }

    /// All else: spheres, then triangles.
    pub fn add_what_is_in_the_bvh(&mut self, scene: &Scene, space: &RenderSpace) {
        let most = scene.triangle_count() + self.other_spheres.len();
        self.primitives.reserve(most);
        self.geometry.reserve(most);
        for &i in &self.other_spheres {
            let sphere = &scene.spheres[i];
            let (center, radius) = (space.point32(sphere.center), space.length(sphere.radius) as f32);
            self.primitives.push(Primitive::Sphere { center, radius });
            let curvature = if sphere.inward { -1.0 / radius } else { 1.0 / radius };
            let light = add_sphere(&mut self.lights, sphere, &scene.materials, space);
            self.geometry.add_sphere(SphereShape { center, radius, curvature }, sphere.material, light);
            self.origins.push(Origin::Sphere(i));
        }
        let means = EmissionMeans::of(scene);
        let mut first_triangle = 0;
        for (i, mesh) in scene.meshes.iter().enumerate() {
            if !self.are_polygons[i] {
                let lifted: BTreeMap<_, _> = self.lifts.of_mesh(i).collect();
                let added = self.add_triangles(mesh, &lifted, &scene.materials, space);
                self.add_emitters(mesh, &added, &lifted, &scene.materials, &means, space);
                self.origins.par_extend(added.into_par_iter().map(|i| Origin::Triangle(first_triangle + i)));
            }
            first_triangle += mesh.triangles.len();
        }
        self.leave_out_copies(&scene.materials);
        self.name_primitives_of_lights(scene);
    }

    fn name_primitives_of_lights(&mut self, scene: &Scene) {
        for (light, primitive) in self.geometry.primitives_of_lights() {
            let two_sided = scene.surface(self.geometry.material_of(primitive)).two_sided;
            self.lights.set_primitive(light, two_sided, primitive as u32);
        }
    }

    /// Adds the triangles of a mesh that have an area in single precision, without light; returns their indices in the mesh.
    fn add_triangles(
        &mut self,
        mesh: &Mesh,
        lifted: &BTreeMap<usize, DVec3>,
        materials: &[Material],
        space: &RenderSpace,
    ) -> Vec<usize> {
        let corners = |i: usize| corners(mesh, lifted, i);
        let vertices: Vec<_> =
            (0..mesh.triangles.len()).into_par_iter().map(|i| space.triangle32(corners(i))).collect();
        let added: Vec<usize> = (0..vertices.len()).filter(|&i| vertices[i].is_some()).collect();
        self.primitives
            .par_extend(added.par_iter().map(|&i| Primitive::Triangle { vertices: vertices[i].unwrap_or_default() }));
        let position = |p: DVec3| geometry::position(space.point32(p));
        let mut positions: Vec<_> = mesh.positions.par_iter().map(|&p| position(p)).collect();
        let mut attributes = attributes(mesh, materials);
        // Triangles that are moved have vertices of their own.
        let mut own = BTreeMap::new();
        for &i in lifted.keys() {
            own.insert(i, positions.len() as u32);
            positions.extend(corners(i).map(position));
            attributes.repeat(mesh.triangles[i]);
        }
        let smooth = if attributes.normals.is_empty() { 0 } else { flag::SMOOTH };
        let first_vertex = self.geometry.add_vertices(positions, attributes);
        self.geometry.add_triangles(added.par_iter().map(|&i| {
            let [a, b, c] = corners(i);
            let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z).as_vec3();
            let numbers = own.get(&i).map_or(mesh.triangles[i], |&first| [first, first + 1, first + 2]);
            let numbers = numbers.map(|vertex| first_vertex + vertex);
            let material = mesh.triangle_materials[i];
            triangle_texels(numbers, normal, material | smooth)
        }));
        added
    }

    /// Makes lights of those of these triangles, the last primitives, that emit.
    fn add_emitters(
        &mut self,
        mesh: &Mesh,
        added: &[usize],
        lifted: &BTreeMap<usize, DVec3>,
        materials: &[Material],
        means: &EmissionMeans,
        space: &RenderSpace,
    ) {
        if mesh.triangle_materials.iter().all(|&material| emitted(materials, material).is_none()) {
            return;
        }
        let of_mesh = self.geometry.len() - added.len();
        for (number, &i) in added.iter().enumerate() {
            let material = mesh.triangle_materials[i];
            let Some(emission) = emitted(materials, material) else { continue };
            let mean = means.of_triangle(mesh, i, &materials[material as usize]);
            if mean == 0.0 {
                continue;
            }
            let emission = Emission { mean, ..emission };
            let corners = corners(mesh, lifted, i).map(|p| space.point(p));
            let light = self.lights.add_polygon(LightShape::Triangle(corners), &corners, emission);
            self.geometry.set_light(of_mesh + number, light);
        }
    }

    /// What rays may pass of a primitive of the BVH, if it is a triangle.
    pub fn passable(&self, primitive: usize, materials: &[Material]) -> Passable {
        let material = &materials[self.geometry.material_of(primitive) as usize];
        match self.primitives[primitive - self.constants_count()] {
            Primitive::Triangle { .. } => Passable { back: material.culls_back, alpha: material.has_alpha() },
            Primitive::Sphere { .. } => Passable::default(),
        }
    }

    /// Leaves exact copies of a primitive out: the first emitter among them, or else the first of them, is what rays hit.
    fn leave_out_copies(&mut self, materials: &[Material]) {
        let first = self.constants_count();
        // Of those that rays may pass another may show.
        let copies = accel::copies(&self.primitives, |i| self.geometry.is_light(first + i));
        let copies: Vec<_> = copies
            .into_iter()
            .filter(|&i| self.passable(first + i as usize, materials) == Passable::default())
            .collect();
        if copies.is_empty() {
            return;
        }
        let mut keeps = vec![true; self.primitives.len()];
        for i in copies {
            keeps[i as usize] = false;
        }
        let mut keep = keeps.iter();
        self.primitives.retain(|_| keep.next() == Some(&true));
        let mut keep = keeps.iter();
        self.origins.retain(|_| keep.next() == Some(&true));
        self.geometry.retain_from(first, &keeps);
    }
}

/// What the vertices of a mesh have.
fn attributes(mesh: &Mesh, materials: &[Material]) -> Attributes {
    let bits = |numbers: [f32; 4]| numbers.map(f32::to_bits);
    let uv = |i: usize| {
        let [first, second] = [0, 1].map(|set: usize| mesh.uvs[set].get(i).copied().unwrap_or_default());
        bits([first[0], first[1], second[0], second[1]])
    };
    let uvs = mesh.uvs[0].len().max(mesh.uvs[1].len());
    let is_anisotropic = |&material: &u32| materials[material as usize].is_anisotropic();
    let tangents = if mesh.tangents.is_empty() && mesh.triangle_materials.iter().any(is_anisotropic) {
        // The shader looks for some, and then takes others.
        vec![[[0; 4]; 2]; mesh.positions.len()]
    } else {
        mesh.tangents.par_iter().map(|two| two.map(|[x, y, z]| bits([x, y, z, 0.0]))).collect()
    };
    Attributes {
        normals: mesh.vertex_normals.par_iter().map(|n| geometry::position(n.as_vec3())).collect(),
        uvs: (0..uvs).into_par_iter().map(uv).collect(),
        colors: mesh.colors.par_iter().map(|&color| bits(color)).collect(),
        tangents,
    }
}

/// The corners of a triangle, in scene space.
fn corners(mesh: &Mesh, lifted: &BTreeMap<usize, DVec3>, triangle: usize) -> [DVec3; 3] {
    let offset = lifted.get(&triangle).copied().unwrap_or_default();
    mesh.triangles[triangle].map(|vertex| mesh.positions[vertex as usize] + offset)
}

/// What a material emits, if it does, and whether on both sides.
///
/// Of one with a texture that is what it is with white; what is not for light sampling emits nothing.
fn emitted(materials: &[Material], material: u32) -> Option<Emission> {
    let Material { surface, unlit, .. } = &materials[material as usize];
    if *unlit {
        return None;
    }
    Some(Emission { radiance: surface.emitted()?, two_sided: surface.two_sided, mean: 1.0 })
}

/// The number of a sphere's light, or −1.
fn add_sphere(lights: &mut LightList, s: &Sphere, materials: &[Material], space: &RenderSpace) -> i32 {
    match emitted(materials, s.material) {
        Some(emission) => lights.add_sphere(space.point(s.center), space.length(s.radius), s.inward, emission),
        None => -1,
    }
}

fn point_light(light: &scene::Light, space: &RenderSpace) -> Light {
    let (shape, radiance) = match *light {
        scene::Light::Point { position, power } => {
            let per = 1.0 / (4.0 * std::f64::consts::PI);
            (LightShape::Point(space.point(position)), power.map(|x| space.power(x) * per))
        }
        scene::Light::Spot { position, direction, intensity, inner, outer, range } => {
            let [inner, outer] = [inner, outer].map(|angle| angle.to_radians().cos());
            let axis = direction.normalize();
            let shape =
                LightShape::Spot { position: space.point(position), axis, inner, outer, range: space.length(range) };
            (shape, intensity.map(|x| space.power(x)))
        }
        scene::Light::Directional { direction, irradiance } => {
            (LightShape::Directional { axis: direction.normalize() }, irradiance)
        }
    };
    Light::new(shape, radiance)
}
