//! What the leaves of a tree hold: shapes, and the boxes around them.

use glam::Vec3;

use crate::accel::aabb::Aabb;

/// How much larger than a primitive its box is, relative to the largest of its coordinates: a ray may hit by rounding
/// what it passes beside. shaders/lib/intersect/bvh/slab.glsl has the derivation, and what is relative to the ray's origin.
const BOX_ERROR: f32 = 40.0 / (1 << 24) as f32;

/// A shape that rays meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Primitive {
    /// A triangle.
    Triangle {
        /// Corners; front is the side from which they run counter-clockwise.
        vertices: [Vec3; 3],
    },
    /// A sphere.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius.
        radius: f32,
    },
}

impl Primitive {
    /// The smallest box around it, up to rounding.
    pub fn extent(&self) -> Aabb {
        match *self {
            Self::Triangle { vertices } => Aabb::around(vertices),
            Self::Sphere { center, radius } => Aabb { lo: center - radius, hi: center + radius },
        }
    }

    /// The box for rays that start no farther from the origin than `reach`, widened by what rounding may move the primitive or the ray.
    pub fn bounds(&self, reach: f32) -> Aabb {
        let Aabb { lo, hi } = self.extent();
        let margin = BOX_ERROR * (lo.abs().max(hi.abs()).max_element() + reach);
        Aabb { lo: lo - margin, hi: hi + margin }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_widened_as_the_shader_reckons() {
        let shader = include_str!("../../shaders/lib/intersect/bvh/slab.glsl");
        assert!(shader.contains("0.0 : 40.0 / 16777216.0;"));
        let mut random = crate::accel::random_numbers(5);
        for i in 0..1000 {
            let size = 10f32.powi(i % 9 - 6);
            let vertices = [(); 3].map(|()| size * (Vec3::new(random(), random(), random()) - 0.5));
            let p = Primitive::Triangle { vertices };
            let (tight, wide) = (p.extent(), p.bounds(0.0));
            let far = f64::from(tight.lo.abs().max(tight.hi.abs()).max_element());
            for axis in 0..3 {
                // One rounding of the 40 may be lost.
                let least = 39.0 / f64::from(1 << 24) * far;
                assert!(f64::from(tight.lo[axis]) - f64::from(wide.lo[axis]) >= least, "{p:?}");
                assert!(f64::from(wide.hi[axis]) - f64::from(tight.hi[axis]) >= least, "{p:?}");
            }
        }
    }
}
