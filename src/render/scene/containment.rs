//! What lies inside of a sphere, what outside.

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::{Scene, Sphere};

/// Where something is as seen from the surface of a sphere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    Inside,
    Outside,
    /// On both sides, or on the surface.
    Across,
}

/// Whether no light goes through a sphere's surface.
pub(crate) fn is_opaque(sphere: &Sphere, scene: &Scene) -> bool {
    let surface = scene.surface(sphere.material);
    !surface.is_dielectric() && !surface.is_transmissive()
}

/// Where a point of the scene is.
pub(crate) fn place_of_point(sphere: &Sphere, point: DVec3) -> Place {
    let distance = point.distance(sphere.center);
    match rounding(sphere) {
        slack if distance < sphere.radius - slack => Place::Inside,
        slack if distance > sphere.radius + slack => Place::Outside,
        _ => Place::Across,
    }
}

/// By which places are wrong that were meant to be on the surface.
fn rounding(sphere: &Sphere) -> f64 {
    1e-12 * (sphere.radius + sphere.center.length())
}

/// The surfaces of a scene that emit.
pub(crate) struct Emitters {
    /// By their indices.
    spheres: Vec<usize>,
    triangles: Vec<[DVec3; 3]>,
}

impl Emitters {
    /// Those of a scene.
    pub fn of(scene: &Scene) -> Self {
        let emits: Vec<bool> = scene.materials.iter().map(|m| m.surface.emits()).collect();
        if !emits.contains(&true) {
            return Self { spheres: Vec::new(), triangles: Vec::new() };
        }
        let spheres = (0..scene.spheres.len()).filter(|&i| emits[scene.spheres[i].material as usize]).collect();
        let mut triangles = Vec::new();
        for mesh in &scene.meshes {
            let of_mesh = mesh.triangles.par_iter().zip(&mesh.triangle_materials);
            let emitting = of_mesh.filter(|(_, material)| emits[**material as usize]);
            triangles.par_extend(emitting.map(|(corners, _)| corners.map(|v| mesh.positions[v as usize])));
        }
        Self { spheres, triangles }
    }

    /// Whether all of them, but for the sphere itself, are wholly on one side of the sphere with this index. They may touch it.
    pub fn are_all(&self, place: Place, index: usize, scene: &Scene) -> bool {
        let sphere = &scene.spheres[index];
        let mut others = self.spheres.iter().filter(|&&i| i != index).map(|&i| &scene.spheres[i]);
        others.all(|other| place_of_sphere(sphere, other) == place)
            && self.triangles.par_iter().all(|triangle| place_of_triangle(sphere, triangle) == place)
    }
}

/// Where the surface of another sphere is.
fn place_of_sphere(sphere: &Sphere, other: &Sphere) -> Place {
    let distance = sphere.center.distance(other.center);
    let slack = rounding(sphere) + rounding(other);
    // Apart, or the other one around this one.
    if distance >= sphere.radius + other.radius - slack || other.radius >= distance + sphere.radius - slack {
        return Place::Outside;
    }
    if distance + other.radius <= sphere.radius + slack { Place::Inside } else { Place::Across }
}

fn place_of_triangle(sphere: &Sphere, corners: &[DVec3; 3]) -> Place {
    let slack = rounding(sphere);
    let [a, b, c] = corners.map(|corner| corner - sphere.center);
    // Most are farther away than they are large.
    let size = a.distance(b).max(a.distance(c));
    if a.length() - size >= sphere.radius || distance_to_triangle(a, b, c) >= sphere.radius - slack {
        return Place::Outside;
    }
    if [a, b, c].iter().all(|p| p.length() <= sphere.radius + slack) { Place::Inside } else { Place::Across }
}

/// Of the origin from a triangle.
fn distance_to_triangle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let normal = (b - a).cross(c - a);
    let edges = [(a, b), (b, c), (c, a)];
    if normal != DVec3::ZERO && edges.iter().all(|(p, q)| normal.cross(q - p).dot(*p) <= 0.0) {
        return (normal.dot(a) / normal.length()).abs();
    }
    let to_edge = |&(p, q): &(DVec3, DVec3)| {
        let along = (q - p).length_squared();
        let t = if along > 0.0 { (-p.dot(q - p) / along).clamp(0.0, 1.0) } else { 0.0 };
        (p + t * (q - p)).length()
    };
    edges.iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: Sphere = Sphere { center: DVec3::new(1.0, 2.0, 3.0), radius: 2.0, inward: false, material: 0 };

    fn ball(at: DVec3, radius: f64) -> Sphere {
        Sphere { center: BALL.center + at, radius, ..BALL }
    }

    #[test]
    fn spheres_are_apart_within_around_or_across() {
        let place = |x: f64, radius: f64| place_of_sphere(&BALL, &ball(x * DVec3::X, radius));
        assert_eq!([place(3.1, 1.0), place(3.0, 1.0), place(0.5, 2.6), place(0.0, 2.0)], [Place::Outside; 4]);
        assert_eq!([place(0.9, 1.0), place(1.0, 1.0)], [Place::Inside; 2]);
        assert_eq!([place(2.9, 1.0), place(1.1, 1.0), place(0.5, 2.4)], [Place::Across; 3]);
    }

    #[test]
    fn triangles_are_where_their_nearest_and_farthest_points_are() {
        let place = |corners: [[f64; 3]; 3]| place_of_triangle(&BALL, &corners.map(|c| BALL.center + DVec3::from(c)));
        // Before a face, an edge and a corner: apart, touching, across.
        for (x, expected) in [(2.1, Place::Outside), (2.0, Place::Outside), (1.9, Place::Across)] {
            assert_eq!(place([[x, -9.0, -9.0], [x, 9.0, -9.0], [x, 0.0, 9.0]]), expected);
            assert_eq!(place([[x, -9.0, 0.0], [x, 9.0, 0.0], [9.0, 0.0, 9.0]]), expected);
            assert_eq!(place([[x, 0.0, 0.0], [9.0, 5.0, 0.0], [9.0, -5.0, 1.0]]), expected);
        }
        assert_eq!(place([[1.0, 0.0, 0.0], [0.0, 1.9, 0.0], [-2.0, 0.0, 0.0]]), Place::Inside);
        // All corners are outside, but not what is between them; corners on the sphere, and no area.
        assert_eq!(place([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]]), Place::Across);
        assert_eq!(place([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, -2.0]]), Place::Inside);
        assert_eq!(place([[3.0, 0.0, 0.0]; 3]), Place::Outside);
        assert_eq!(place([[-9.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, 0.0, 0.0]]), Place::Across);
    }

    /// Against distances to many of its points.
    #[test]
    fn the_distance_is_that_of_the_nearest_point() {
        let mut random = crate::accel::random_numbers(21);
        let mut point = || 4.0 * DVec3::from([0; 3].map(|_| f64::from(random()))) - 2.0;
        for _ in 0..200 {
            let [a, b, c] = [point(), point(), point()];
            let distance = distance_to_triangle(a, b, c);
            let n = 120;
            let points = (0..=n).flat_map(|i| (0..=n - i).map(move |j| (f64::from(i), f64::from(j))));
            let at = |(i, j): (f64, f64)| a + (b - a) * (i / f64::from(n)) + (c - a) * (j / f64::from(n));
            let nearest = points.map(|ij| at(ij).length()).fold(f64::INFINITY, f64::min);
            assert!(distance <= nearest + 1e-9 && nearest - distance < 0.05, "{distance}, {nearest}");
        }
    }
}
