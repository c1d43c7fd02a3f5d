//! Direct light of point lights.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::check::probe::{PathInput, RayInput};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, empty, grid, v};
use crate::check::statistics::{relative, welch, worst};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "light/closed-form",
        what: "a sphere lit by a point light, ray by ray",
        oracle: "Φρ cosθ/(4π²d²) in f64",
        quantity: "worst relative error × the cosines of light and view",
        threshold: 1e-6,
        full_only: false,
        measure: |lab| closed_form(lab, Met::Sphere),
    },
    Case {
        name: "light/closed-form-triangles",
        what: "a plane of triangles lit by a point light, ray by ray; points are moved off it by the bound on their error",
        oracle: "Φρ cosθ/(4π²d²) in f64",
        quantity: "worst relative error × the cosines of light and view",
        threshold: 2e-6,
        full_only: false,
        measure: |lab| closed_form(lab, Met::Plane { squares: 8 }),
    },
    Case {
        name: "light/closed-form-polygons",
        what: "the same of so few triangles that they are inline polygons, whose bound has a term more",
        oracle: "Φρ cosθ/(4π²d²) in f64",
        quantity: "worst relative error × the cosines of light and view",
        threshold: 3e-6,
        full_only: false,
        measure: |lab| closed_form(lab, Met::Plane { squares: 4 }),
    },
    Case {
        name: "light/shadow-ends",
        what: "shadow rays from a light just above and just below a tilted plane",
        oracle: "above: all arrive; below: none",
        quantity: "shadow rays that are wrong",
        threshold: 0.0,
        full_only: false,
        measure: shadow_ends,
    },
    Case {
        name: "light/on-surface",
        what: "a light on a diffuse sphere and in a corner of the mesh",
        oracle: "finite",
        quantity: "samples that are not finite",
        threshold: 0.0,
        full_only: false,
        measure: on_surface,
    },
    Case {
        name: "light/occluded",
        what: "lights inside an opaque sphere and inside a box",
        oracle: "exactly 0",
        quantity: "largest radiance",
        threshold: 0.0,
        full_only: false,
        measure: occluded,
    },
    Case {
        name: "light/sum",
        what: "6 (full: 24) lights of different power at once, one chosen at each hit",
        oracle: "the sum of the images of each light alone",
        quantity: "deviation of the means in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: sum,
    },
    Case {
        name: "light/occlusion",
        what: "shadow rays in a scene of walls, spheres and a mesh",
        oracle: "f64, away from silhouettes",
        quantity: "share of rays that are wrong",
        threshold: 1e-4,
        full_only: false,
        measure: occlusion,
    },
];

/// What the rays that count meet.
#[derive(Clone, Copy, PartialEq)]
enum Met {
    Sphere,
    /// Cut into so many squares along an edge.
    Plane {
        squares: u32,
    },
}

fn closed_form(lab: &Lab, met: Met) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(7);
    let mut scene = empty();
    let rho = 0.75;
    let center = v(0.5, 0.25, -5.0);
    scene.sphere(center, 1.0, diffuse(rho));
    let (x, y) = (v(6.0, 1.0, 0.5), v(0.5, 5.0, -2.0));
    let plane = v(0.0, -1.0, -9.0);
    // 16 squares are inline polygons, 64 are too many for that; single precision holds the corners of either.
    let squares = if let Met::Plane { squares } = met { squares } else { 8 };
    let (positions, triangles) = grid(plane, x, y, squares);
    scene.mesh(&positions, &triangles, diffuse(rho));
    let (light, power) = (v(1.5, 2.0, -2.0), 80.0);
    scene.light(light, power);
    scene.integrator.max_depth = 1;
    let mut probe = lab.scatter(&scene)?;
    let scale = probe.scale();
    let paths: Vec<_> = (0..lab.size(1 << 15, 1 << 20))
        .map(|i| {
            let target = if i % 2 == 0 {
                center + rng.in_ball()
            } else {
                plane + rng.between(-0.9, 0.9) * x + rng.between(-0.9, 0.9) * y
            };
            PathInput::new(RayInput::new(Vec3::ZERO, target.normalize().as_vec3()), 0, i as u32)
        })
        .collect();
    let records = probe.run(&paths)?;
    let mut errors = Vec::new();
    for (path, record) in paths.iter().zip(&records).filter(|(_, r)| r.lit != 0) {
        let d = DVec3::from(path.ray.direction.map(f64::from)).normalize();
        // The point by f64 from the direction alone.
        let sphere = matches!(probe.primitive(record.id), Some(crate::oracle::Primitive::Sphere(_)));
        if sphere != (met == Met::Sphere) {
            continue;
        }
        let (position, normal) = if sphere {
            let b = center.dot(d);
            let t = b - (b * b - center.length_squared() + 1.0).max(0.0).sqrt();
            (t * d, t * d - center)
        } else {
            // The plane of the mesh as it is in single precision, by its first triangle.
            let [a, b, c] = triangles[0].map(|i| positions[i as usize]);
            let n = (b - a).cross(c - a).normalize();
            let t = a.dot(n) / d.dot(n);
            (t * d, n * -d.dot(n).signum())
        };
        let to = light - position;
        let cosine = to.dot(normal) / to.length();
        // At grazing incidence the rounding of the point itself is magnified by 1/cosine.
        let view = -d.dot(normal);
        if cosine < 0.05 || view < 0.05 {
            continue;
        }
        let exact = power * rho * cosine / (4.0 * PI * PI * to.length_squared());
        errors.push(relative(f64::from(record.radiance[0]), exact) * cosine * view);
    }
    let lit = errors.len();
    if lit < 1000 {
        errors.push(f64::INFINITY);
    }
    Ok(Measured::new(worst(errors), format!("{lit} lit points; 1 unit is {scale} in render space")))
}

fn shadow_ends(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(43);
    let (x, y) = (v(1.0, 0.25, -0.5), v(-0.25, 1.0, 0.75));
    let center = v(0.5, -0.25, -4.0);
    let normal = {
        let n = x.cross(y).normalize();
        if n.dot(center) < 0.0 { n } else { -n }
    };
    let (positions, triangles) = grid(center, x, y, 4);
    let (mut wrong, mut traced) = (0usize, 0usize);
    for height in [1e-3, -1e-3] {
        let mut scene = empty();
        scene.mesh(&positions, &triangles, diffuse(0.5));
        scene.light(center + 0.125 * x + 0.0625 * y + height * normal, 1.0);
        scene.integrator.max_depth = 1;
        let mut probe = lab.scatter(&scene)?;
        let paths: Vec<_> = (0..lab.size(1 << 14, 1 << 20))
            .map(|i| {
                let target = center + rng.between(-0.99, 0.99) * x + rng.between(-0.99, 0.99) * y;
                PathInput::new(RayInput::new(Vec3::ZERO, target.normalize().as_vec3()), 0, i as u32)
            })
            .collect();
        let records = probe.run(&paths)?;
        wrong += records.iter().filter(|r| r.id < 0 || (r.lit != 0) != (height > 0.0)).count();
        traced += records.len();
    }
    Ok(Measured::new(wrong as f64, format!("{traced} shadow rays")))
}

fn on_surface(lab: &Lab) -> Result<Measured, CheckError> {
    let mut bad = 0u64;
    for (i, light) in [v(0.0, 0.0, -3.0), v(-1.0, -1.0, -6.0), v(0.25, 0.5, -6.0)].into_iter().enumerate() {
        let mut scene = empty();
        scene.sphere(v(0.0, 0.0, -4.0), 1.0, diffuse(0.75));
        scene.quad([v(-1.0, -1.0, -6.0), v(4.0, -1.0, -6.0), v(4.0, 4.0, -6.0), v(-1.0, 4.0, -6.0)], diffuse(0.75));
        scene.light(light, 10.0);
        scene.size(64, 64);
        let image = lab.render(&scene)?;
        bad += image.statistics.bad_samples;
        bad += image.film.sums().iter().filter(|s| s.iter().any(|x| !x.is_finite())).count() as u64;
        if i == 2 && image.mean()[0] <= 0.0 {
            return Ok(Measured::new(f64::INFINITY, "nothing is lit"));
        }
    }
    Ok(Measured::new(bad as f64, "3 scenes, 64 samples a pixel"))
}

fn occluded(lab: &Lab) -> Result<Measured, CheckError> {
    let mut largest = 0.0;
    for boxed in [false, true] {
        let mut scene = empty();
        if boxed {
            scene.cuboid(v(-0.5, -0.5, -4.5), v(0.5, 0.5, -3.5), diffuse(0.9));
        } else {
            scene.sphere(v(0.0, 0.0, -4.0), 0.5, diffuse(0.9));
        }
        scene.sphere(v(0.0, 0.0, 0.0), 100.0, diffuse(0.9));
        scene.light(v(0.125, 0.0625, -4.0), 1e6);
        scene.size(32, 64);
        let image = lab.render(&scene)?;
        largest = worst(image.channel(0).into_iter().chain([largest]));
    }
    Ok(Measured::new(largest, "2 scenes, 8 bounces"))
}

fn many_lights(count: usize) -> Scene {
    let mut rng = Rng::new(5);
    let mut scene = empty();
    scene.quad([v(-9.0, -2.0, 1.0), v(9.0, -2.0, 1.0), v(9.0, -2.0, -19.0), v(-9.0, -2.0, -19.0)], diffuse(0.75));
    scene.sphere(v(0.0, -1.0, -6.0), 1.0, diffuse(0.5));
    for _ in 0..count {
        scene.light(
            v(rng.between(-8.0, 8.0), rng.between(-1.0, 4.0), rng.between(-14.0, 0.0)),
            10f64.powf(rng.between(0.0, 2.5)),
        );
    }
    scene.integrator.max_depth = 2;
    scene.size(16, 16);
    scene
}

fn sum(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = many_lights(lab.size(6, 24));
    let lights = std::mem::take(&mut scene.lights);
    let pixels = 256;
    let mut expected = vec![0.0; pixels];
    for light in &lights {
        scene.lights = vec![light.clone()];
        scene.integrator.samples = lab.size(256, 4096) as u32;
        let image = lab.render(&scene)?.channel(0);
        expected.iter_mut().zip(&image).for_each(|(e, x)| *e += x);
    }
    scene.lights = lights;
    scene.integrator.samples = lab.size(4096, 1 << 17) as u32;
    let image = lab.render(&scene)?.channel(0);
    // Pixel by pixel: their difference has mean 0, and its spread is the noise of both.
    let difference: Vec<f64> = image.iter().zip(&expected).map(|(a, b)| a - b).collect();
    let zero = vec![0.0; 2];
    let z = welch(&difference, &zero);
    let mean = image.iter().sum::<f64>() / pixels as f64;
    let (bias, error) = crate::check::statistics::mean_and_error(&difference);
    Ok(Measured::new(
        z,
        format!("{} lights, bias {:+.1e} ± {:.1e} relative", scene.lights.len(), bias / mean, error / mean),
    ))
}

fn occlusion(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(44);
    let mut scene = crate::check::scenes::room();
    // The oracle's rays start where the camera is, and so do render space's coordinates.
    let to_origin = scene.camera.position;
    translate(&mut scene, -to_origin);
    // Shadow rays to a single light are tested from its end; two lights take the general way.
    scene.light(v(-5.0, 30.0, 5.0) - to_origin, 1.0);
    let mut probe = lab.occluded(&scene)?;
    let scale = probe.scale();
    let rays: Vec<_> = (0..lab.size(1 << 15, 1 << 20))
        .map(|_| {
            let mut at = || (scale * (rng.in_cube(38.0) - to_origin)).as_vec3();
            let (from, to) = (at(), at());
            RayInput { t_max: from.distance(to), ..RayInput::new(from, (to - from).normalize()) }
        })
        .collect();
    let records = probe.run(&rays)?;
    let (mut wrong, mut judged) = (0usize, 0usize);
    for (ray, record) in rays.iter().zip(&records) {
        let origin = probe.scene_point(ray.origin);
        let inside = |p: DVec3| scene.spheres.iter().any(|s| p.distance(s.center) < s.radius);
        // Rays from inside of an opaque sphere cannot arise.
        if inside(origin) || inside(origin + DVec3::from(ray.direction.map(f64::from)) * f64::from(ray.t_max) / scale) {
            continue;
        }
        judged += 1;
        let d = DVec3::from(ray.direction.map(f64::from));
        let exact =
            crate::oracle::trace::occluded(&scene, &crate::oracle::Ray::new(origin, d), f64::from(ray.t_max) / scale);
        wrong += usize::from(exact != (record.hidden != 0));
    }
    Ok(Measured::new(wrong as f64 / judged as f64, format!("{wrong} of {judged} rays")))
}

/// Moves everything.
pub(super) fn translate(scene: &mut Scene, by: DVec3) {
    scene.camera.position += by;
    scene.camera.target += by;
    scene.spheres.iter_mut().for_each(|s| s.center += by);
    scene.meshes.iter_mut().flat_map(|m| &mut m.positions).for_each(|p| *p += by);
    for position in scene.lights.iter_mut().filter_map(|light| light.position_mut()) {
        *position += by;
    }
}
