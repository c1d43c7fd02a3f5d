//! Boxes around the leaves of the BVH, for the device to find them by (shaders/lib/intersect/query.glsl).

use rayon::prelude::*;

use crate::accel::{Aabb, Packed, Primitive, Texel};
use crate::scene::Scene;

use crate::render::settings::mutation::Mutation;
use crate::render::space::RenderSpace;

/// Boxes, and the records that they are around: of each leaf, depth first.
pub(crate) struct LeafBoxes {
    /// Lowest and highest corner.
    pub boxes: Vec<[[f32; 3]; 2]>,
    records: Vec<u32>,
}

impl LeafBoxes {
    /// Of a BVH over some primitives, which are numbered from `first_primitive` on, for rays that start no farther from the origin than
    /// `reach`.
    pub fn of(
        packed: &Packed,
        primitives: &[Primitive],
        first_primitive: u32,
        reach: f32,
        mutation: Option<Mutation>,
    ) -> Self {
        let mut records = packed.leaf_records();
        if mutation == Some(Mutation::QueriedLostLeaf) {
            records.pop();
        }
        let members = |record: u32| [0, 1].into_iter().filter_map(move |i| packed.primitive(2 * record as usize + i));
        let bounds = |primitive: u32| {
            let primitive = &primitives[(primitive - first_primitive) as usize];
            let thin = primitive.extent();
            match mutation {
                Some(Mutation::QueriedThinBoxes) => thin,
                Some(Mutation::QueriedEpsilonBoxes) => Aabb { lo: thin.lo - 1e-7, hi: thin.hi + 1e-7 },
                _ => primitive.bounds(reach),
            }
        };
        let boxes = records.par_iter().map(|&record| {
            let Aabb { lo, hi } = members(record).map(bounds).fold(Aabb::EMPTY, Aabb::union);
            [lo, hi].map(|corner| corner.to_array())
        });
        Self { boxes: boxes.collect(), records }
    }

    /// The records as texels, four in one.
    pub fn record_texels(&self) -> impl Iterator<Item = Texel> + '_ {
        self.records.chunks(4).map(|four| std::array::from_fn(|i| four.get(i).copied().unwrap_or(0)))
    }
}

/// The largest distance from the origin of render space at which rays may start: on the surface of a sphere, however large, or where
/// [`RenderSpace::reach`] says.
pub(crate) fn farthest_start(scene: &Scene, space: &RenderSpace) -> f32 {
    let farthest = |s: &crate::scene::Sphere| space.point(s.center).length() + space.length(s.radius);
    scene.spheres.iter().map(farthest).fold(space.reach, f64::max) as f32 * 1.0001
}
