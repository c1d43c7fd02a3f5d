//! The table of primitives, vertices and materials that rays are shaded from, whatever finds the hits (shaders/lib/geometry.glsl).
//!
//! ```text
//! triangle    vertex 0, vertex 1, vertex 2, material | flags;      normal | light
//! sphere      centre | material | flags;                           radius, ±1/radius, - | light
//! polygon     first of 4 vertices, n·p of its points, -, material; normal | light
//! ```
//! Two texels a primitive, in the order of their numbers; then two a material, a texel a vertex with its position, and, up to the
//! last vertex that has one, a texel a vertex with its shading normal.

use glam::Vec3;

use crate::accel::Texel;

use crate::render::kernel::layout::flag;

/// The table in parts.
#[derive(Debug, Default)]
pub(crate) struct Geometry {
    primitives: Vec<[Texel; 2]>,
    materials: Vec<[Texel; 2]>,
    positions: Vec<Texel>,
    normals: Vec<Texel>,
}

/// The table, and where its parts begin.
pub(crate) struct GeometryTexels {
    pub texels: Vec<Texel>,
    pub first_material: u32,
    pub first_position: u32,
    pub first_normal: u32,
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
    pub fn new(materials: Vec<[Texel; 2]>) -> Self {
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
        let first = self.add_vertices(corners.map(position), &[]);
        self.primitives.push([[first, offset.to_bits(), 0, material], texel(normal, light as u32)]);
    }

    /// Adds triangles, as [`triangle_texels`] makes them.
    pub fn add_triangles(&mut self, triangles: impl rayon::iter::IndexedParallelIterator<Item = [Texel; 2]>) {
        use rayon::iter::ParallelExtend as _;
        self.primitives.par_extend(triangles);
    }

    /// Adds vertices, with normals or without; returns the number of the first.
    pub fn add_vertices(&mut self, positions: impl IntoIterator<Item = Texel>, normals: &[Texel]) -> u32 {
        let first = self.positions.len();
        self.positions.extend(positions);
        if !normals.is_empty() {
            self.normals.resize(first, [0; 4]);
            self.normals.extend_from_slice(normals);
        }
        first as u32
    }

    /// Whether a primitive is a light.
    pub fn is_light(&self, primitive: usize) -> bool {
        self.primitives[primitive][1][3] as i32 >= 0
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
        let first_material = 2 * self.primitives.len();
        let mut texels = self.primitives.into_flattened();
        texels.extend(self.materials.iter().flatten());
        texels.resize(texels.len().max(first_material + 2), [0; 4]);
        let first_position = texels.len();
        texels.append(&mut self.positions);
        texels.resize(texels.len().max(first_position + 1), [0; 4]);
        let first_normal = texels.len();
        texels.append(&mut self.normals);
        GeometryTexels {
            texels,
            first_material: first_material as u32,
            first_position: first_position as u32,
            first_normal: first_normal as u32,
        }
    }
}

/// The texels of a triangle that is no light. Of vertices that are `smooth` it has the normals.
pub(crate) fn triangle_texels([a, b, c]: [u32; 3], normal: Vec3, material: u32, smooth: bool) -> [Texel; 2] {
    let flags = if smooth { flag::SMOOTH } else { 0 };
    [[a, b, c, material | flags], texel(normal, u32::MAX)]
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
        let mut geometry = Geometry::new(vec![[[1; 4]; 2]]);
        geometry.add_polygon([Vec3::X; 4], Vec3::Z, 0.5, 0, 2);
        let point = |x: f32| position(Vec3::splat(x));
        assert_eq!(geometry.add_vertices([point(1.0), point(2.0)], &[]), 4);
        assert_eq!(geometry.add_vertices([point(3.0), point(4.0)], &[point(5.0), point(6.0)]), 6);
        assert_eq!(geometry.add_vertices([point(7.0)], &[]), 8);
        let triangles = vec![triangle_texels([6, 7, 8], Vec3::Y, 0, true); 3];
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
