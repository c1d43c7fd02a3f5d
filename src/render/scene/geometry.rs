//! The table of primitives, vertices and materials that rays are shaded from, whatever finds the hits (shaders/lib/geometry.glsl).
//!
//! ```text
//! triangle    vertex 0, vertex 1, vertex 2, material | flags;      normal | light
//! sphere      centre | material | flags;                           radius, ±1/radius, - | light
//! polygon     first of 4 vertices, n·p of its points, -, material; normal | light
//! ```
//! Two texels a primitive, in the order of their numbers; then two a material, and materials' details; then of vertices, a texel each:
//! positions, shading normals, coordinates of textures, colours; and two, tangents and bitangents. Of what not all meshes have only
//! the vertices up to the last that has it are there.

use glam::Vec3;

use crate::accel::Texel;

use crate::render::kernel::layout::flag;
use crate::render::scene::materials::MaterialTexels;

/// The table in parts.
#[derive(Debug, Default)]
pub(crate) struct Geometry {
    primitives: Vec<[Texel; 2]>,
    materials: MaterialTexels,
    positions: Vec<Texel>,
    attributes: Attributes,
}

/// What vertices may have beside a position, a texel each.
#[derive(Debug, Default)]
pub(crate) struct Attributes {
    pub normals: Vec<Texel>,
    /// Both sets of coordinates.
    pub uvs: Vec<Texel>,
    pub colors: Vec<Texel>,
    /// Tangent and bitangent.
    pub tangents: Vec<[Texel; 2]>,
}

/// The table, and where its parts begin.
pub(crate) struct GeometryTexels {
    pub texels: Vec<Texel>,
    pub first_material: u32,
    pub first_position: u32,
    pub first_normal: u32,
    pub first_detail: u32,
    pub first_uv: u32,
    pub first_color: u32,
    pub first_tangent: u32,
}

/// What a sphere, or one of its copies, looks like.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SphereShape {
    pub center: Vec3,
    pub radius: f32,
    /// ±1/radius: negative if the normal points inward.
    pub curvature: f32,
}

impl Geometry {
    /// A table without primitives.
    pub fn new(materials: MaterialTexels) -> Self {
        Self { materials, ..Self::default() }
    }

    /// Primitives so far: the number of the next one.
    pub fn len(&self) -> usize {
        self.primitives.len()
    }

    pub fn reserve(&mut self, primitives: usize) {
        self.primitives.reserve(primitives);
    }

    pub fn add_sphere(&mut self, sphere: SphereShape, material: u32, light: i32) {
        let SphereShape { center, radius, curvature } = sphere;
        self.primitives
            .push([texel(center, material | flag::SPHERE), texel(Vec3::new(radius, curvature, 0.0), light as u32)]);
    }

    /// Adds a flat polygon of four corners, in a plane with a unit normal.
    pub fn add_polygon(&mut self, corners: [Vec3; 4], normal: Vec3, offset: f32, material: u32, light: i32) {
        let first = self.add_vertices(corners.map(position), Attributes::default());
        self.primitives.push([[first, offset.to_bits(), 0, material], texel(normal, light as u32)]);
    }

    /// Adds triangles, as [`triangle_texels`] makes them.
    pub fn add_triangles(&mut self, triangles: impl rayon::iter::IndexedParallelIterator<Item = [Texel; 2]>) {
        use rayon::iter::ParallelExtend as _;
        self.primitives.par_extend(triangles);
    }

    /// Adds vertices, and what they have of attributes; returns the number of the first.
    pub fn add_vertices(&mut self, positions: impl IntoIterator<Item = Texel>, attributes: Attributes) -> u32 {
        const WHITE: Texel = [1f32.to_bits(); 4];
        let first = self.positions.len();
        self.positions.extend(positions);
        let own = &mut self.attributes;
        add(&mut own.normals, first, [0; 4], attributes.normals);
        add(&mut own.uvs, first, [0; 4], attributes.uvs);
        add(&mut own.colors, first, WHITE, attributes.colors);
        add(&mut own.tangents, first, [[0; 4]; 2], attributes.tangents);
        first as u32
    }

    /// Whether a primitive is a light.
    pub fn is_light(&self, primitive: usize) -> bool {
        self.primitives[primitive][1][3] as i32 >= 0
    }

    /// The number of each light's primitive.
    pub fn primitives_of_lights(&self) -> impl Iterator<Item = (usize, usize)> {
        let light = |[_, attributes]: &[Texel; 2]| usize::try_from(attributes[3] as i32).ok();
        self.primitives.iter().enumerate().filter_map(move |(i, primitive)| Some((light(primitive)?, i)))
    }

    pub fn material_of(&self, primitive: usize) -> u32 {
        self.primitives[primitive][0][3] & !(flag::SPHERE | flag::SMOOTH)
    }

    pub fn set_light(&mut self, primitive: usize, light: i32) {
        self.primitives[primitive][1][3] = light as u32;
    }

    /// Keeps some of the primitives from number `first` on.
    pub fn retain_from(&mut self, first: usize, keeps: &[bool]) {
        let mut keep = std::iter::repeat_n(&true, first).chain(keeps);
        self.primitives.retain(|_| keep.next() == Some(&true));
    }

    /// The whole table. Rays that meet nothing are shaded as well, as if they had met the first primitive: there is one of all.
    pub fn into_texels(mut self) -> GeometryTexels {
        if self.primitives.is_empty() {
            self.primitives.push([[0; 4], [0, 0, 0, u32::MAX]]);
        }
        let count = self.positions.len();
        let own = &mut self.attributes;
        // Colours are read of all vertices, whether a mesh has some or not; likewise coordinates and tangents.
        complete(&mut own.uvs, count, [0; 4]);
        complete(&mut own.colors, count, [1f32.to_bits(); 4]);
        complete(&mut own.tangents, count, [[0; 4]; 2]);
        let mut texels = self.primitives.into_flattened();
        let mut append = |part: Vec<Texel>, least: usize| {
            let first = texels.len();
            texels.extend(part);
            texels.resize(texels.len().max(first + least), [0; 4]);
            first as u32
        };
        let first_material = append(self.materials.records.into_flattened(), 2);
        let first_detail = append(self.materials.details, 0);
        let first_position = append(self.positions, 1);
        let first_normal = append(self.attributes.normals, 0);
        let first_uv = append(self.attributes.uvs, 0);
        let first_color = append(self.attributes.colors, 0);
        let first_tangent = append(self.attributes.tangents.into_flattened(), 0);
        GeometryTexels {
            texels,
            first_material,
            first_position,
            first_normal,
            first_detail,
            first_uv,
            first_color,
            first_tangent,
        }
    }
}

impl Attributes {
    /// Adds the vertices of a triangle once more.
    pub fn repeat(&mut self, triangle: [u32; 3]) {
        fn again<T: Copy>(all: &mut Vec<T>, triangle: [u32; 3]) {
            if !all.is_empty() {
                all.extend(triangle.map(|vertex| all[vertex as usize]));
            }
        }
        again(&mut self.normals, triangle);
        again(&mut self.uvs, triangle);
        again(&mut self.colors, triangle);
        again(&mut self.tangents, triangle);
    }
}

/// Adds what vertices from the number `first` on have; those before them without get `missing`.
fn add<T: Copy>(to: &mut Vec<T>, first: usize, missing: T, new: Vec<T>) {
    if !new.is_empty() {
        to.resize(first, missing);
        to.extend(new);
    }
}

/// If some of `count` vertices have it, all are to.
fn complete<T: Copy>(all: &mut Vec<T>, count: usize, missing: T) {
    if !all.is_empty() {
        all.resize(count, missing);
    }
}

/// The texels of a triangle that is no light, with what its vertices and its material are like ([`flag`]).
pub(crate) fn triangle_texels([a, b, c]: [u32; 3], normal: Vec3, material_and_flags: u32) -> [Texel; 2] {
    [[a, b, c, material_and_flags], texel(normal, u32::MAX)]
}

/// The texel of a vertex.
pub(crate) fn position(p: Vec3) -> Texel {
    texel(p, 0)
}

fn texel(v: Vec3, w: u32) -> Texel {
    [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stand_as_far_from_the_first_as_positions() {
        let mut geometry = Geometry::new(MaterialTexels { records: vec![[[1; 4]; 2]], details: Vec::new() });
        geometry.add_polygon([Vec3::X; 4], Vec3::Z, 0.5, 0, 2);
        let point = |x: f32| position(Vec3::splat(x));
        assert_eq!(geometry.add_vertices([point(1.0), point(2.0)], Attributes::default()), 4);
        assert_eq!(
            geometry.add_vertices(
                [point(3.0), point(4.0)],
                Attributes { normals: vec![point(5.0), point(6.0)], ..Attributes::default() }
            ),
            6
        );
        assert_eq!(geometry.add_vertices([point(7.0)], Attributes::default()), 8);
        let triangles = vec![triangle_texels([6, 7, 8], Vec3::Y, flag::SMOOTH); 3];
        geometry.add_triangles(rayon::iter::IntoParallelIterator::into_par_iter(triangles));
        geometry.set_light(2, 7);
        geometry.retain_from(1, &[false, true, true]);
        assert_eq!((0..geometry.len()).map(|i| geometry.is_light(i)).collect::<Vec<_>>(), [true, true, false]);
        let table = geometry.into_texels();
        assert_eq!((table.first_material, table.first_position, table.first_normal), (6, 8, 17));
        assert_eq!(table.texels[8 + 7], point(4.0));
        assert_eq!(table.texels[17 + 7], point(6.0));
        assert_eq!(table.texels[2], [6, 7, 8, flag::SMOOTH]);
        let empty = Geometry::default().into_texels();
        assert_eq!(empty.texels.len(), 5);
    }
}
