//! What the device finds hits by: boxes around the leaves of the BVH (shaders/lib/intersect/query.glsl), or triangles, and boxes around
//! spheres (shaders/lib/intersect/query_triangles.glsl).

use rayon::prelude::*;

use crate::accel::{Aabb, Packed, Primitive, Texel};
use crate::gpu::{Instance, Part, Shapes};
use crate::scene::{Material, Scene};

use crate::render::settings::mutation::Mutation;
use crate::render::settings::{Accel, QueryBuild, RenderSettings};
use crate::render::space::RenderSpace;

/// Boxes and triangles, in the order in which the BVH's leaves are met depth first.
pub(crate) struct QueryGeometry {
    /// Lowest and highest corner.
    pub boxes: Vec<[[f32; 3]; 2]>,
    /// Corners.
    pub triangles: Vec<[[f32; 3]; 3]>,
    /// Whether triangles stop all rays that meet them.
    pub opaque: bool,
    /// How the acceleration structure is built.
    pub build: QueryBuild,
    /// Of boxes, then of triangles: twice the leaf's record, and 1 more for its second triangle.
    handles: Vec<u32>,
}

impl QueryGeometry {
    /// Of a BVH over some primitives, which are numbered from `first_primitive` on; nothing where no ray queries are asked for.
    pub fn of(
        packed: &Packed,
        primitives: &[Primitive],
        first_primitive: u32,
        scene: &Scene,
        space: &RenderSpace,
        settings: &RenderSettings,
    ) -> Option<Self> {
        let mutation = settings.mutation;
        let triangles_too = match settings.accel {
            Accel::RayQuery => false,
            Accel::RayQueryTriangles => true,
            _ => return None,
        };
        let reach = farthest_start(scene, space);
        let mut records = packed.leaf_records();
        if mutation == Some(Mutation::QueriedLostLeaf) {
            records.pop();
        }
        if settings.query_build == QueryBuild::Shuffled {
            let mut random = 1u32;
            for i in (1..records.len()).rev() {
                random = random.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                records.swap(i, ((u64::from(random) * (i as u64 + 1)) >> 32) as usize);
            }
        }
        let primitive =
            |handle: u32| Some(&primitives[(packed.primitive(handle as usize)? - first_primitive) as usize]);
        let members =
            |record: u32| [2 * record, 2 * record + 1].into_iter().filter_map(move |h| Some((h, primitive(h)?)));
        let bounds = |primitive: &Primitive| {
            let thin = primitive.extent();
            match mutation {
                Some(Mutation::QueriedThinBoxes) => thin,
                Some(Mutation::QueriedEpsilonBoxes) => Aabb { lo: thin.lo - 1e-7, hi: thin.hi + 1e-7 },
                _ => primitive.bounds(reach),
            }
        };
        let bounds_of = |record: u32| {
            let Aabb { lo, hi } = members(record).map(|(_, p)| bounds(p)).fold(Aabb::EMPTY, Aabb::union);
            [lo, hi].map(|corner| corner.to_array())
        };
        let has_box = |record: &u32| {
            !triangles_too || members(*record).any(|(_, primitive)| matches!(primitive, Primitive::Sphere { .. }))
        };
        // Shaders know by an instance's own index where triangles begin.
        let (boxed, others): (Vec<u32>, Vec<u32>) = records.into_iter().partition(has_box);
        let in_others = others.par_iter().flat_map_iter(|&record| members(record));
        let (of_triangles, triangles): (Vec<u32>, Vec<_>) = in_others
            .filter_map(|(handle, primitive)| match primitive {
                Primitive::Triangle { vertices } => Some((handle, vertices.map(|corner| corner.to_array()))),
                Primitive::Sphere { .. } => None,
            })
            .unzip();
        Some(Self {
            boxes: boxed.par_iter().map(|&record| bounds_of(record)).collect(),
            triangles,
            opaque: !scene.materials.iter().any(Material::lets_rays_pass),
            build: settings.query_build,
            handles: boxed.into_iter().map(|record| 2 * record).chain(of_triangles).collect(),
        })
    }

    /// What to build: boxes come before triangles.
    pub fn parts(&self) -> (Vec<Part<'_>>, Vec<Instance>) {
        let boxes = Part { shapes: Shapes::Boxes(&self.boxes), opaque: false };
        let triangles = Part { shapes: Shapes::Triangles(&self.triangles), opaque: self.opaque };
        match (self.boxes.len(), self.triangles.len()) {
            (_, 0) => (vec![boxes], vec![Instance::of(0, 0)]),
            (0, _) => (vec![triangles], vec![Instance::of(0, 0)]),
            (first, _) => (vec![boxes, triangles], vec![Instance::of(0, 0), Instance::of(1, first as u32)]),
        }
    }

    /// The handles as texels, four in one.
    pub fn handle_texels(&self) -> impl Iterator<Item = Texel> + '_ {
        self.handles.chunks(4).map(|four| std::array::from_fn(|i| four.get(i).copied().unwrap_or(0)))
    }
}

/// The largest distance from the origin of render space at which rays may start: on the surface of a sphere, however large, or where
/// [`RenderSpace::reach`] says.
fn farthest_start(scene: &Scene, space: &RenderSpace) -> f32 {
    let farthest = |s: &crate::scene::Sphere| space.point(s.center).length() + space.length(s.radius);
    scene.spheres.iter().map(farthest).fold(space.reach, f64::max) as f32 * 1.0001
}
