//! The lights of a scene, each of them once.
//!
//! Where surfaces lie on each other rays meet the first one, so that a copy of an emitter (a face that is twice in a file, a mesh that was
//! loaded twice) adds no light. Sampling must not find it either. What is the same in single precision is the same to rays
//! (accel::copies).

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::Rgb;

use crate::render::light::emitter::{Light, LightShape};

/// What a surface emits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Emission {
    pub radiance: Rgb,
    /// From its back too, which is a light of its own: the number after that of the front.
    pub two_sided: bool,
    /// About the part of the radiance that a texture leaves.
    pub mean: f64,
}

/// Lights by number, and where the surfaces among them are.
pub(crate) struct LightList {
    lights: Vec<Light>,
    /// Numbers by the corners of the surface as rays see them, in single precision, in ascending order; and what it emits.
    surfaces: HashMap<Vec<[u32; 3]>, (usize, Emission)>,
}

impl LightList {
    pub fn new(points: Vec<Light>) -> Self {
        Self { lights: points, surfaces: HashMap::new() }
    }

    /// Adds a polygon that emits; `corners` are all of its corners. Returns its number, that of an earlier one if it is
    /// a copy, or −1 if another one hides it that shines otherwise or to the other side.
    pub fn add_polygon(&mut self, shape: LightShape, corners: &[DVec3], emission: Emission) -> i32 {
        self.add(shape, emission, corners)
    }

    /// Adds a sphere that emits, likewise.
    pub fn add_sphere(&mut self, center: DVec3, radius: f64, inward: bool, emission: Emission) -> i32 {
        let shape = LightShape::Sphere { center, radius, inward };
        // The centre twice: centre and radius must not change places when they are sorted.
        self.add(shape, emission, &[center, center, DVec3::splat(radius)])
    }

    /// Whether any surface emits on both sides.
    pub fn has_two_sided(&self) -> bool {
        self.surfaces.values().any(|(_, emission)| emission.two_sided)
    }

    /// Says which primitive a light is; the back, which follows it, too.
    pub fn set_primitive(&mut self, light: usize, two_sided: bool, primitive: u32) {
        let last = light + usize::from(two_sided);
        self.lights[light..=last].iter_mut().for_each(|light| light.primitive = primitive);
    }

    pub fn into_vec(self) -> Vec<Light> {
        self.lights
    }

    fn add(&mut self, shape: LightShape, emission: Emission, corners: &[DVec3]) -> i32 {
        // −0 is where 0 is.
        let mut key: Vec<_> = corners.iter().map(|p| p.as_vec3().to_array().map(|x| (x + 0.0).to_bits())).collect();
        key.sort_unstable();
        let number = self.lights.len();
        let (first, other) = *self.surfaces.entry(key).or_insert((number, emission));
        if first == number {
            let light = |shape| Light { mean: emission.mean, ..Light::new(shape, emission.radiance) };
            self.lights.push(light(shape));
            self.lights.extend(emission.two_sided.then(|| light(reversed(shape))));
            return number as i32;
        }
        if other == emission && same_side(&self.lights[first].shape, &shape) { first as i32 } else { -1 }
    }
}

/// The same surface, whose back is the front.
fn reversed(shape: LightShape) -> LightShape {
    match shape {
        LightShape::Point(_) | LightShape::Spot { .. } | LightShape::Directional { .. } => shape,
        LightShape::Triangle([a, b, c]) => LightShape::Triangle([a, c, b]),
        LightShape::Parallelogram([a, b, c]) => LightShape::Parallelogram([a, c, b]),
        LightShape::Sphere { center, radius, inward } => LightShape::Sphere { center, radius, inward: !inward },
    }
}

fn same_side(a: &LightShape, b: &LightShape) -> bool {
    let front = |shape: &LightShape| match *shape {
        LightShape::Triangle([a, b, c]) | LightShape::Parallelogram([a, b, c]) => (b - a).cross(c - a),
        LightShape::Sphere { inward: true, .. } => -DVec3::X,
        _ => DVec3::X,
    };
    front(a).dot(front(b)) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_sided(radiance: f64) -> Emission {
        Emission { radiance: [radiance; 3], two_sided: false, mean: 1.0 }
    }

    #[test]
    fn the_back_is_the_light_after_the_front() {
        let mut list = LightList::new(Vec::new());
        let emission = Emission { two_sided: true, ..one_sided(1.0) };
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(list.add_polygon(LightShape::Triangle(corners), &corners, emission), 0);
        assert_eq!(list.add_polygon(LightShape::Triangle(corners), &corners, emission), 0, "a copy");
        assert_eq!(list.add_polygon(LightShape::Triangle(corners), &corners, one_sided(1.0)), -1);
        assert_eq!(list.add_sphere(DVec3::X, 1.0, true, emission), 2);
        assert!(list.has_two_sided());
        let lights = list.into_vec();
        assert!(lights.len() == 4 && !same_side(&lights[0].shape, &lights[1].shape));
        assert!(!same_side(&lights[2].shape, &lights[3].shape));
    }

    #[test]
    fn copies_share_a_number_and_what_is_hidden_has_none() {
        let mut list = LightList::new(vec![Light::new(LightShape::Point(DVec3::ZERO), [1.0; 3])]);
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let mut add = |[i, j, k]: [usize; 3], radiance: f64| {
            let corners = [corners[i], corners[j], corners[k]];
            list.add_polygon(LightShape::Triangle(corners), &corners, one_sided(radiance))
        };
        assert_eq!([add([0, 1, 2], 2.0), add([0, 1, 2], 2.0), add([1, 2, 0], 2.0)], [1, 1, 1]);
        assert_eq!([add([0, 2, 1], 2.0), add([0, 1, 2], 3.0)], [-1, -1], "the other side, another radiance");
        let almost = [DVec3::ZERO, DVec3::X * (1.0 + 1e-12), DVec3::Y];
        assert_eq!(list.add_polygon(LightShape::Triangle(almost), &almost, one_sided(2.0)), 1, "the same to rays");
        assert_eq!(list.add_sphere(DVec3::X, 1.0, false, one_sided(2.0)), 2);
        assert_eq!(list.add_sphere(DVec3::X, 1.0, false, one_sided(2.0)), 2);
        assert_eq!(list.add_sphere(DVec3::X, 1.0, true, one_sided(2.0)), -1);
        assert_eq!(list.add_sphere(DVec3::X, 2.0, false, one_sided(2.0)), 3);
        assert_eq!(list.add_sphere(DVec3::splat(3.0), 4.0, false, one_sided(2.0)), 4);
        assert_eq!(list.add_sphere(DVec3::splat(4.0), 3.0, false, one_sided(2.0)), 5, "radius and centre exchanged");
        assert_eq!(list.into_vec().len(), 6);
    }
}
