//! How each analytic sphere is intersected; see shaders/lib/intersect/sphere.glsl.

use std::collections::HashMap;

use crate::scene::{Light, Scene, Sphere};

use crate::render::kernel::layout::constant::MAX_CONSTANT_SPHERES;
use crate::render::scene::containment::{Emitters, Place, is_opaque, place_of_point};
use crate::render::space::{RenderSpace, aperture};

/// From where rays can meet a sphere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Side {
    /// Opaque, camera and emitters are outside: only the near root counts.
    Solid = 0,
    /// Opaque, camera and emitters are inside: only the far root counts.
    Cavity = 1,
    /// Rays may be on either side.
    Both = 2,
}

/// How the roots are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Form {
    /// Larger than what is seen of it.
    Wall = 0,
    /// Of the size of the scene.
    Small = 1,
}

/// A sphere in render space, as the shader wants it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ConstantSphere {
    pub center: [f32; 3],
    pub radius: f32,
    /// |centre|² − radius².
    pub power: f32,
    pub side: Side,
    pub form: Form,
    /// 1/radius, negative if the normal points inward.
    pub curvature: f32,
    pub material: u32,
}

/// Indices of the spheres that become constants (the largest), in scene order, and of those that go into the BVH:
/// those for which there is no room, and those far away for their size, which need more precision. Of exact copies only one is
/// there, or glass would be entered twice.
pub(crate) fn partition(scene: &Scene, space: &RenderSpace) -> (Vec<usize>, Vec<usize>) {
    let spheres = &scene.spheres;
    let near = |&i: &usize| space.length(spheres[i].radius) > space.reach / 32.0;
    let (mut constant, mut rest): (Vec<_>, Vec<_>) = one_of_each(scene).into_iter().partition(near);
    constant.sort_by(|&a, &b| spheres[b].radius.total_cmp(&spheres[a].radius).then(a.cmp(&b)));
    rest.extend(constant.split_off(constant.len().min(MAX_CONSTANT_SPHERES)));
    constant.sort_unstable();
    rest.sort_unstable();
    (constant, rest)
}

/// Indices of the spheres without copies, in scene order: of each place and radius the first emitter, or else the first.
fn one_of_each(scene: &Scene) -> Vec<usize> {
    let shape = |s: &Sphere| [s.center.x, s.center.y, s.center.z, s.radius].map(|x| (x + 0.0).to_bits());
    let emits = |i: usize| scene.surface(scene.spheres[i].material).emits();
    let mut kept: HashMap<[u64; 4], usize> = HashMap::with_capacity(scene.spheres.len());
    for (i, sphere) in scene.spheres.iter().enumerate() {
        let one = kept.entry(shape(sphere)).or_insert(i);
        if emits(i) && !emits(*one) {
            *one = i;
        }
    }
    let mut kept: Vec<usize> = kept.into_values().collect();
    kept.sort_unstable();
    kept
}

/// Chooses side and form of the sphere with this index in the scene.
pub(crate) fn classify(index: usize, scene: &Scene, emitters: &Emitters, space: &RenderSpace) -> ConstantSphere {
    let sphere = &scene.spheres[index];
    let center = space.point(sphere.center);
    let radius = space.length(sphere.radius);
    // The camera is the origin, or around it; on the surface itself either side is possible.
    let distance = center.length();
    let margin = 1e-6 * radius + space.aperture;
    let camera = match distance - radius {
        d if d > margin => Place::Outside,
        d if d < -margin => Place::Inside,
        _ => Place::Across,
    };
    // Shadow rays end, and light paths begin, on emitters that no path gets to.
    let together = is_opaque(sphere, scene) && camera != Place::Across && emitters.are_all(camera, index, scene);
    let side = match camera {
        Place::Outside if together => Side::Solid,
        Place::Inside if together => Side::Cavity,
        _ => Side::Both,
    };
    // WALL: error ~ reach·2⁻²² whatever the radius. SMALL: error ~ (reach + r)·2⁻²³, fine up to a few times the
    // reach, and down to reach/32, where 2⁻²³·32 of a radius is misplaced at the silhouette.
    let form = if radius > 4.0 * space.reach { Form::Wall } else { Form::Small };
    ConstantSphere {
        center: center.as_vec3().to_array(),
        radius: radius as f32,
        power: ((distance - radius) * (distance + radius)) as f32,
        side,
        form,
        curvature: (if sphere.inward { -1.0 / radius } else { 1.0 / radius }) as f32,
        material: sphere.material,
    }
}

/// The point lights that paths can see.
pub(crate) fn visible_lights(scene: &Scene) -> impl Iterator<Item = &Light> {
    scene.lights.iter().zip(are_hidden(scene)).filter(|(_, hidden)| !hidden).map(|(light, _)| light)
}

/// Of each point light whether an opaque sphere separates it from everything that a path can reach. Such a light adds nothing.
fn are_hidden(scene: &Scene) -> Vec<bool> {
    let position = |i: usize| scene.lights[i].position().unwrap_or_default();
    // Along an axis: of many lights a small sphere is near few.
    let mut order: Vec<usize> = (0..scene.lights.len()).filter(|&i| scene.lights[i].position().is_some()).collect();
    order.sort_unstable_by(|&a, &b| position(a).x.total_cmp(&position(b).x));
    let mut hidden = vec![false; scene.lights.len()];
    let aperture = aperture(scene);
    for sphere in scene.spheres.iter().filter(|sphere| is_opaque(sphere, scene)) {
        let (lo, hi) = (sphere.center.x - sphere.radius, sphere.center.x + sphere.radius);
        let camera = scene.camera.position;
        if (sphere.center.distance(camera) - sphere.radius).abs() < aperture {
            continue;
        }
        let (other_side, near) = match place_of_point(sphere, camera) {
            Place::Inside => (Place::Outside, &order[..]),
            Place::Outside => {
                let first = order.partition_point(|&i| position(i).x < lo);
                let end = order.partition_point(|&i| position(i).x <= hi);
                (Place::Inside, &order[first..end.max(first)])
            }
            Place::Across => continue,
        };
        for &i in near {
            hidden[i] = hidden[i] || place_of_point(sphere, position(i)) == other_side;
        }
    }
    hidden
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::scenes::{Build, diffuse, empty, glass, v};

    /// Against a look at each pair.
    #[test]
    fn lights_are_hidden_by_opaque_spheres_around_them_or_the_camera() {
        let mut random = crate::accel::random_numbers(5);
        let mut between = |lo: f64, hi: f64| lo + (hi - lo) * f64::from(random());
        for around_camera in [false, true] {
            let mut scene = empty();
            let mut point = |size: f64| v(between(-size, size), between(-size, size), between(-size, size));
            for _ in 0..300 {
                scene.light(point(5.0), 1.0);
            }
            for i in 0..60 {
                let surface = if i % 4 == 0 { glass(1.5) } else { diffuse(0.5) };
                scene.sphere(point(6.0), f64::from(i % 5) * 0.3 + 0.2, surface);
            }
            scene.spheres.retain(|sphere| place_of_point(sphere, scene.camera.position) == Place::Outside);
            if around_camera {
                scene.sphere(v(1.0, 0.5, 0.0), 4.0, diffuse(0.5));
            }
            let hides = |sphere: &Sphere, position| {
                let places = [scene.camera.position, position].map(|point| place_of_point(sphere, point));
                is_opaque(sphere, &scene)
                    && matches!(places, [Place::Outside, Place::Inside] | [Place::Inside, Place::Outside])
            };
            let hidden = |light: &Light| scene.spheres.iter().any(|sphere| hides(sphere, light.position().unwrap()));
            let expected: Vec<_> = scene.lights.iter().map(hidden).collect();
            assert_eq!(are_hidden(&scene), expected);
            let count = expected.iter().filter(|hidden| **hidden).count();
            assert!((10..290).contains(&count), "{count} of 300");
            assert_eq!(visible_lights(&scene).count(), 300 - count);
        }
    }
}
