//! The oracle against closed forms: whatever the renderer is compared with must itself be right.

mod geometry;
mod optics;
mod paths;
mod radiance;
mod sampling;

use glam::DVec3;
use photolith::oracle::{self, OracleImage, OracleSettings, Pcg64, Ray};
use photolith::scene::*;

/// A scene of an 8 x 8 image, box filter and depth 8, and nothing in it.
fn empty() -> Scene {
    Scene {
        source: "test".into(),
        camera: Camera {
            position: DVec3::ZERO,
            target: DVec3::NEG_Z,
            up: DVec3::Y,
            horizontal_fov: 60.0,
            ..Camera::default()
        },
        film: Film { width: 8, height: 8, filter: PixelFilter::Box, transfer: Transfer::Srgb, ..Film::default() },
        integrator: Integrator { max_depth: 8, samples: 1, russian_roulette: None, indirect: true },
        ..Scene::default()
    }
}

trait Build {
    fn material(&mut self, surface: Surface) -> u32;
    fn sphere(&mut self, center: DVec3, radius: f64, surface: Surface) -> &mut Sphere;
    fn mesh(&mut self, positions: &[DVec3], triangles: &[[u32; 3]], surface: Surface) -> &mut Mesh;
    fn quad(&mut self, corners: [DVec3; 4], surface: Surface) -> &mut Mesh;
    fn light(&mut self, position: DVec3, power: Rgb);
}

impl Build for Scene {
    fn material(&mut self, surface: Surface) -> u32 {
        let index = self.materials.len();
        self.materials.push(Material::new(format!("{index}"), surface));
        index as u32
    }

    fn sphere(&mut self, center: DVec3, radius: f64, surface: Surface) -> &mut Sphere {
        let material = self.material(surface);
        self.spheres.push(Sphere { center, radius, material, inward: false });
        self.spheres.last_mut().unwrap()
    }

    fn mesh(&mut self, positions: &[DVec3], triangles: &[[u32; 3]], surface: Surface) -> &mut Mesh {
        let material = self.material(surface);
        self.meshes.push(Mesh {
            name: "mesh".into(),
            positions: positions.to_vec(),
            vertex_normals: vec![],
            triangles: triangles.to_vec(),
            triangle_materials: vec![material; triangles.len()],
            normals: Normals::Flat,
            ..Mesh::default()
        });
        self.meshes.last_mut().unwrap()
    }

    fn quad(&mut self, corners: [DVec3; 4], surface: Surface) -> &mut Mesh {
        self.mesh(&corners, &[[0, 1, 2], [0, 2, 3]], surface)
    }

    fn light(&mut self, position: DVec3, power: Rgb) {
        self.lights.push(Light::Point { position, power });
    }
}

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn grey(value: f64) -> Rgb {
    [value; 3]
}

fn diffuse(reflectance: f64) -> Surface {
    Surface::diffuse(grey(reflectance))
}

fn mirror(reflectance: f64) -> Surface {
    Surface::mirror(grey(reflectance))
}

fn glass(ior: f64) -> Surface {
    Surface::dielectric(ior)
}

fn emitter(radiance: f64) -> Surface {
    Surface::emitter(grey(radiance))
}

/// A square in the plane y = `height`, `2 * half` wide, seen from above as its front.
fn floor(height: f64, half: f64) -> [DVec3; 4] {
    [(-half, half), (half, half), (half, -half), (-half, -half)].map(|(x, z)| v(x, height, z))
}

fn render(scene: &Scene, samples: u32) -> OracleImage {
    oracle::render(scene, &OracleSettings { samples, seed: 7 })
}

fn trace(scene: &Scene, origin: DVec3, direction: DVec3, rng: &mut Pcg64) -> DVec3 {
    oracle::radiance(scene, Ray::new(origin, direction.normalize()), rng)
}

/// A direction uniform over the sphere.
fn uniform_direction(rng: &mut Pcg64) -> DVec3 {
    let z = 2.0 * rng.uniform() - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * rng.uniform()).sin_cos();
    let r = (1.0 - z * z).sqrt();
    v(r * cos, r * sin, z)
}

/// The closest hit of a ray from `origin`, or a failed test.
fn hit(scene: &Scene, origin: DVec3, direction: DVec3) -> oracle::Hit {
    oracle::trace::closest_hit(scene, &Ray::new(origin, direction)).expect("the ray must hit")
}

#[track_caller]
fn assert_close(value: f64, expected: f64, relative: f64) {
    let error = (value / expected - 1.0).abs();
    assert!(error <= relative, "{value} is not {expected}: relative error {error:e} > {relative:e}");
}

/// Asserts that `n` draws have the mean `expected` within 4 standard errors, and that this is a sharp
/// statement: a standard error of at most `precision`, relative.
#[track_caller]
fn assert_mean(expected: f64, precision: f64, n: u32, mut draw: impl FnMut() -> f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let delta = draw() / expected - 1.0;
        sum += delta;
        squares += delta * delta;
    }
    let mean = sum / f64::from(n);
    let error = ((squares / f64::from(n) - mean * mean) / f64::from(n)).max(0.0).sqrt();
    assert!(error <= precision, "standard error {error:e}, asked for {precision:e}");
    assert!(mean.abs() <= 4.0 * error + 1e-12, "mean is off by {mean:e} relative, standard error {error:e}");
}
