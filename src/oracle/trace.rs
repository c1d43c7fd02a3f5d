//! Rays against all spheres and triangles, one after the other.

use glam::DVec3;

use crate::oracle::material;
use crate::oracle::material::Place;
use crate::scene::{Mesh, Normals, Scene, Sphere, Surface};

/// A surface of the scene; ordered as they are tested, and the first of equally near ones is hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Primitive {
    /// Index into the scene's spheres.
    Sphere(usize),
    /// Index into the scene's meshes, and into the triangles of that mesh.
    Triangle(usize, usize),
}

/// A half-line. Distances along it are in units of its direction's length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Scene units.
    pub origin: DVec3,
    /// Any length but 0.
    pub direction: DVec3,
    /// The surface that `origin` lies on. It is not hit again at the origin, by logic and not by an epsilon.
    pub leaving: Option<Primitive>,
}

impl Ray {
    /// A ray that starts in free space.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, leaving: None }
    }
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance, > 0, in units of the ray direction's length.
    pub t: f64,
    /// The surface.
    pub primitive: Primitive,
    /// Index into the scene's materials.
    pub material: usize,
    /// The hit point, as near to the surface as rounding allows.
    pub position: DVec3,
    /// Unit geometric normal, turned towards where the ray comes from. It decides about sides.
    pub normal: DVec3,
    /// Unit shading normal, on the side of `normal`. It decides about cosines.
    pub shading_normal: DVec3,
    /// The same of a clear coat.
    pub coat_normal: DVec3,
    /// Along which the surface is rougher, if it is anisotropic.
    pub tangent: DVec3,
    /// Whether the ray comes from the front: the side that the untouched normal points to.
    pub front: bool,
    /// What the surface does there.
    pub surface: Surface,
    /// The part of rays that meet it there; the others pass.
    pub coverage: f64,
}

impl Hit {
    /// A ray that leaves the hit point.
    pub fn spawn(&self, direction: DVec3) -> Ray {
        Ray { origin: self.position, direction, leaving: Some(self.primitive) }
    }
}

/// The nearest hit of `ray`. Rays that are not finite, or have no direction, miss.
pub fn closest_hit(scene: &Scene, ray: &Ray) -> Option<Hit> {
    let (t, primitive, weights) = nearest(scene, ray, f64::INFINITY)?;
    let (material, position, outward, interpolated, place) = match primitive {
        Primitive::Sphere(index) => {
            let sphere = &scene.spheres[index];
            let radial = (ray.origin + t * ray.direction - sphere.center).normalize();
            let normal = if sphere.inward { -radial } else { radial };
            (sphere.material, sphere.center + sphere.radius * radial, normal, normal, None)
        }
        Primitive::Triangle(mesh, triangle) => {
            let mesh = &scene.meshes[mesh];
            let blend = |values: [DVec3; 3]| weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2];
            let corners = corners(mesh, triangle);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            let shading = match mesh.normals {
                Normals::Flat => normal,
                Normals::Smooth => {
                    blend(mesh.triangles[triangle].map(|i| mesh.vertex_normals[i as usize])).normalize_or(normal)
                }
            };
            let place = Place { mesh, vertices: mesh.triangles[triangle], weights };
            let index = mesh.triangle_materials[triangle];
            (index, blend(corners), normal, shading, Some(place))
        }
    };
    let front = ray.direction.dot(outward) < 0.0;
    let normal = if front { outward } else { -outward };
    let index = material as usize;
    let material = &scene.materials[index];
    let ([shading, coat], surface, coverage) = match place {
        Some(place) => (
            place.normals(scene, material, interpolated),
            place.surface(scene, material),
            place.coverage(scene, material, front),
        ),
        None => ([interpolated; 2], material.surface, 1.0),
    };
    let [shading_normal, coat_normal] =
        [shading, coat].map(|shading| if shading.dot(normal) < 0.0 { -shading } else { shading });
    let tangent = material::tangent(scene, material, place.as_ref(), interpolated);
    Some(Hit {
        t,
        primitive,
        material: index,
        position,
        normal,
        shading_normal,
        coat_normal,
        tangent,
        front,
        surface,
        coverage,
    })
}

/// The part of light that passes along `ray` strictly between distance 0 and `t_max`.
pub fn transmittance(scene: &Scene, ray: &Ray, t_max: f64) -> f64 {
    let (mut ray, mut left, mut passes) = (*ray, t_max, 1.0);
    while let Some(hit) = closest_hit(scene, &ray).filter(|hit| hit.t < left && passes > 0.0) {
        passes *= 1.0 - hit.coverage;
        left -= hit.t;
        ray = hit.spawn(ray.direction);
    }
    passes
}

/// Whether anything lies on `ray` strictly between distance 0 and `t_max`, whatever part of rays it stops.
pub fn occluded(scene: &Scene, ray: &Ray, t_max: f64) -> bool {
    nearest(scene, ray, t_max).is_some()
}

/// Distance, primitive and (for a triangle) barycentric weights of the nearest hit before `t_max`.
fn nearest(scene: &Scene, ray: &Ray, t_max: f64) -> Option<(f64, Primitive, [f64; 3])> {
    let (mut t_max, mut nearest) = (t_max, None);
    for (index, sphere) in scene.spheres.iter().enumerate() {
        let id = Primitive::Sphere(index);
        // also false for NaN
        let hit = intersect_sphere(sphere, ray, ray.leaving == Some(id)).filter(|&t| t < t_max);
        if let Some(t) = hit {
            (t_max, nearest) = (t, Some((t, id, [0.0; 3])));
        }
    }
    let shear = Shear::new(ray);
    for (m, mesh) in scene.meshes.iter().enumerate() {
        for index in 0..mesh.triangles.len() {
            let id = Primitive::Triangle(m, index);
            if ray.leaving == Some(id) {
                continue;
            }
            if let Some((t, weights)) = shear.intersect(corners(mesh, index)).filter(|&(t, _)| t < t_max) {
                (t_max, nearest) = (t, Some((t, id, weights)));
            }
        }
    }
    nearest
}

fn corners(mesh: &Mesh, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].map(|i| mesh.positions[i as usize])
}

/// The smallest positive distance to a sphere.
///
/// The discriminant is that of Haines et al., "Precision Improvements for Ray/Sphere Intersection" (Ray
/// Tracing Gems, chapter 7). From a point on the sphere the chord has a closed form: t = -2 f·d / d².
fn intersect_sphere(sphere: &Sphere, ray: &Ray, on_sphere: bool) -> Option<f64> {
    let (f, d) = (ray.origin - sphere.center, ray.direction);
    let a = d.length_squared();
    let b = -f.dot(d);
    if on_sphere {
        return (b > 0.0).then_some(2.0 * b / a);
    }
    let nearest_to_center = f + (b / a) * d;
    let discriminant = a * (sphere.radius * sphere.radius - nearest_to_center.length_squared());
    if discriminant < 0.0 {
        return None;
    }
    let q = b + discriminant.sqrt().copysign(b);
    let c = (f.length() - sphere.radius) * (f.length() + sphere.radius);
    let (t0, t1) = (c / q, q / a);
    [t0.min(t1), t0.max(t1)].into_iter().find(|&t| t > 0.0)
}

/// The ray's part of the watertight test of Woop, Benthin and Wald (JCGT 2(1), 2013): the affine map that
/// takes the ray to the unit z axis. Both sides of a triangle are hit.
struct Shear {
    origin: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl Shear {
    fn new(ray: &Ray) -> Self {
        let z = ray.direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let [dx, dy, dz] = axes.map(|k| ray.direction[k]);
        Self { origin: ray.origin, axes, shear: DVec3::new(dx / dz, dy / dz, 1.0 / dz) }
    }

    /// Distance > 0, and the barycentric weights of the three corners.
    fn intersect(&self, corners: [DVec3; 3]) -> Option<(f64, [f64; 3])> {
        let [a, b, c] = corners.map(|corner| {
            let p = corner - self.origin;
            let [x, y, z] = self.axes.map(|k| p[k]);
            DVec3::new(x - self.shear.x * z, y - self.shear.y * z, self.shear.z * z)
        });
        let [u, v, w] = [c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x];
        // Neighbours see the negated value of a shared edge, and 0 counts as inside: no ray slips through.
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        let t = (u * a.z + v * b.z + w * c.z) / determinant;
        // also false for NaN: an edge-on or degenerate triangle, a ray that is not finite
        (t > 0.0).then_some((t, [u / determinant, v / determinant, w / determinant]))
    }
}
