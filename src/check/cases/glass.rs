//! Fresnel, Snell and what follows from them.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use crate::check::probe::{Function, PathInput, RayInput, Words};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, emitter, empty, glass, v};
use crate::check::statistics::{mean_and_error, worst, z_score};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle;
use crate::render::{RenderSettings, SampleMap};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "glass/fresnel",
        what: "reflectance over all angles, indices 1/3 to 3, dense around the critical angle",
        oracle: "f64",
        quantity: "worst absolute error (infinite: outside [0, 1])",
        threshold: 1e-5,
        full_only: false,
        measure: fresnel,
    },
    Case {
        name: "glass/fresnel-grazing",
        what: "cosines 1e-8 to 1e-3 and 0",
        oracle: "f64",
        quantity: "worst absolute error",
        threshold: 1e-6,
        full_only: false,
        measure: grazing,
    },
    Case {
        name: "glass/directions",
        what: "reflected and refracted directions at random normals",
        oracle: "Snell's law in f64",
        quantity: "worst absolute error, away from the critical angle",
        threshold: 2e-6,
        full_only: false,
        measure: directions,
    },
    Case {
        name: "glass/slab-normal",
        what: "light through a slab at normal incidence, ior 1.5",
        oracle: "T = (1−R)/(1+R) = 0.923077",
        quantity: "deviation in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: slab_normal,
    },
    Case {
        name: "glass/slab-shift",
        what: "rays through a slab at angles up to 75°, ior 1.1 to 2.5",
        oracle: "lateral shift d sinθ (1 − cosθ/√(n² − sin²θ))",
        quantity: "worst error over the thickness",
        threshold: 1e-5,
        full_only: false,
        measure: slab_shift,
    },
    Case {
        name: "glass/index-one",
        what: "a glass sphere of ior 1 before a lit scene",
        oracle: "the scene without it",
        quantity: "mean absolute difference of pixels",
        threshold: 1e-4,
        full_only: false,
        measure: |lab| index(lab, 1.0),
    },
    Case {
        name: "glass/index-nearly-one",
        what: "the same, ior 1.0001",
        oracle: "the scene without it, seen the same but for 1e-4",
        quantity: "mean absolute difference of pixels",
        threshold: 2e-4,
        full_only: false,
        measure: |lab| index(lab, 1.0001),
    },
    Case {
        name: "glass/total-reflection",
        what: "rays from inside a glass sphere",
        oracle: "none gets out where a·sinψ/R > 1/n, and a share of 1 − F elsewhere",
        quantity: "deviation in standard errors (infinite: a ray got out)",
        threshold: 4.0,
        full_only: false,
        measure: total_reflection,
    },
];

fn fresnel(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(18);
    let inputs: Vec<_> = (0..lab.size(1 << 18, 1 << 24))
        .map(|i| {
            let eta = if i % 8 == 0 { rng.between(0.9999, 1.0001) } else { 3f64.powf(rng.between(-1.0, 1.0)) };
            let critical = (1.0 - eta * eta).max(0.0).sqrt();
            let cosine = match i % 2 {
                0 => rng.uniform(),
                _ => (critical + rng.between(-1.0, 1.0) * 10f64.powf(rng.between(-8.0, -2.0))).clamp(0.0, 1.0),
            };
            Words::of(&[cosine as f32, eta as f32])
        })
        .collect();
    fresnel_error(lab, &inputs)
}

fn fresnel_error(lab: &Lab, inputs: &[Words]) -> Result<Measured, CheckError> {
    let outputs = lab.function(Function::Fresnel, inputs)?;
    let error = |(i, o): (&Words, &Words)| {
        let f = f64::from(o.x[0]);
        let exact = oracle::fresnel(f64::from(i.x[0]), f64::from(i.x[1]));
        if (0.0..=1.0).contains(&f) { (f - exact).abs() } else { f64::INFINITY }
    };
    Ok(Measured::new(worst(inputs.iter().zip(&outputs).map(error)), format!("{} pairs", inputs.len())))
}

fn grazing(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(19);
    let inputs: Vec<_> = (0..1 << 14)
        .map(|i| {
            let cosine = if i % 16 == 0 { 0.0 } else { 10f64.powf(rng.between(-8.0, -3.0)) };
            Words::of(&[cosine as f32, [1.5f32, 1.1, 2.5, 1.0][i % 4]])
        })
        .collect();
    fresnel_error(lab, &inputs)
}

fn directions(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(17);
    let inputs: Vec<_> = (0..lab.size(1 << 17, 1 << 22))
        .map(|_| {
            let normal = rng.direction32();
            let mut d = rng.direction32();
            if d.dot(normal) > 0.0 {
                d = -d;
            }
            let ior = rng.between(1.05, 2.5) as f32;
            Words { x: [d.x, d.y, d.z, ior], y: [normal.x, normal.y, normal.z, [0.0, 0.9999999][rng.below(2)]] }
        })
        .collect();
    let outputs = lab.function(Function::Dielectric, &inputs)?;
    let mut errors = Vec::new();
    for (i, o) in inputs.iter().zip(&outputs) {
        let part = |w: [f32; 4]| DVec3::new(f64::from(w[0]), f64::from(w[1]), f64::from(w[2]));
        let (d, n) = (part(i.x).normalize(), part(i.y).normalize());
        let expected =
            if o.x[3] > 0.0 { oracle::refract(d, n, f64::from(i.x[3])) } else { Some(oracle::reflect(d, n)) };
        errors.push(expected.map_or(f64::INFINITY, |e| (part(o.x) - e).length()));
        // Which way is taken is u's to say, and F lies between the two values of u.
        if (o.x[3] > 0.0) != (i.y[3] > 0.5) {
            errors.push(f64::INFINITY);
        }
    }
    Ok(Measured::new(worst(errors), format!("{} directions", inputs.len())))
}

fn slab(thickness: f64, ior: f64, half: f64) -> Scene {
    let mut scene = empty();
    scene.cuboid(v(-half, -half, -2.0 - thickness), v(half, half, -2.0), glass(ior));
    scene
}

fn slab_normal(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = slab(0.5, 1.5, 50.0);
    scene.quad([v(-99.0, -99.0, -9.0), v(99.0, -99.0, -9.0), v(99.0, 99.0, -9.0), v(-99.0, 99.0, -9.0)], emitter(1.0));
    scene.camera.horizontal_fov = 0.5;
    scene.integrator.max_depth = 32;
    scene.size(32, lab.size(256, 16384) as u32);
    let image = lab.render(&scene)?;
    let values = image.channel(0);
    let (mean, error) = mean_and_error(&values);
    Ok(Measured::new(z_score(&values, 12.0 / 13.0), format!("T = {mean:.6} ± {error:.1e}")))
}

fn slab_shift(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(17);
    let mut errors = Vec::new();
    let mut through = 0;
    for ior in [1.1, 1.5, 2.5] {
        let thickness = 0.5;
        let mut probe = lab.scatter(&slab(thickness, ior, 64.0))?;
        let scale = probe.scale();
        let paths: Vec<_> = (0..lab.size(1 << 12, 1 << 18))
            .map(|i| {
                let (sin, cos) = rng.between(0.0, 75f64.to_radians()).sin_cos();
                let turn = TAU * rng.uniform();
                let d = v(sin * turn.cos(), sin * turn.sin(), -cos).as_vec3();
                PathInput::new(RayInput::new(Vec3::ZERO, d), rng.bits() & 4095, i as u32)
            })
            .collect();
        let first = probe.run(&paths)?;
        // Into the slab, and out on its other side.
        let inner: Vec<_> = paths
            .iter()
            .zip(&first)
            .filter(|(_, r)| r.alive != 0 && r.direction[2] < 0.0)
            .map(|(p, r)| (*p, r.next(p)))
            .collect();
        let second = probe.run(&inner.iter().map(|p| p.1).collect::<Vec<_>>())?;
        for ((start, _), end) in inner.iter().zip(&second).filter(|(_, r)| r.alive != 0 && r.direction[2] < 0.0) {
            through += 1;
            let d = DVec3::from(start.ray.direction.map(f64::from)).normalize();
            let exit = DVec3::from(end.origin.map(f64::from)) / scale;
            let sin = (1.0 - d.z * d.z).sqrt();
            let shift = thickness * sin * (1.0 + d.z / (ior * ior - sin * sin).sqrt());
            let straight = (exit - exit.dot(d) * d).length();
            errors.push((straight - shift).abs() / thickness);
            let out = DVec3::from(end.direction.map(f64::from));
            errors.push((out - d).length());
        }
    }
    // With the index upside down hardly a ray would pass.
    if through == 0 {
        errors.push(f64::INFINITY);
    }
    Ok(Measured::new(worst(errors), format!("{through} rays, 3 indices")))
}

fn index(lab: &Lab, ior: f64) -> Result<Measured, CheckError> {
    let mut scene = empty();
    for i in 0..4 {
        let x = -4.0 + 2.0 * f64::from(i);
        let corners = [v(x, -5.0, -9.0), v(x + 2.0, -5.0, -9.0), v(x + 2.0, 5.0, -9.0), v(x, 5.0, -9.0)];
        scene.quad(corners, emitter(0.2 + 0.25 * f64::from(i)));
    }
    scene.background = [0.3; 3];
    scene.size(32, 256);
    // Pixels that show glass would have other random numbers.
    let settings = |scene: &Scene| RenderSettings { sample_map: SampleMap::Off, ..lab.settings(scene) };
    let without = lab.render_with(&scene, &settings(&scene))?;
    scene.sphere(v(0.1, 0.05, -4.0), 1.5, glass(ior));
    let with = lab.render_with(&scene, &settings(&scene))?;
    let (a, b) = (with.channel(0), without.channel(0));
    let mean = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len() as f64;
    Ok(Measured::new(mean, format!("{}×{} pixels", 32, 32)))
}

fn total_reflection(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(21);
    let (ior, radius, a) = (1.5, 2.0, 1.8);
    let mut scene = empty();
    // The camera is inside, off centre.
    scene.camera.position = v(a, 0.0, 0.0);
    scene.camera.target = v(3.0, 0.5, 0.0);
    scene.sphere(DVec3::ZERO, radius, glass(ior));
    scene.sphere(v(0.0, 0.0, 50.0), 1.0, diffuse(0.5));
    let mut probe = lab.scatter(&scene)?;
    let paths: Vec<_> = (0..lab.size(1 << 16, 1 << 22))
        .map(|i| PathInput::new(RayInput::new(Vec3::ZERO, rng.direction32()), rng.bits() & 4095, i as u32))
        .collect();
    let records = probe.run(&paths)?;
    let (mut out, mut expected, mut variance, mut escaped) = (0.0, 0.0, 0.0, 0usize);
    for (path, record) in paths.iter().zip(&records) {
        let d = DVec3::from(path.ray.direction.map(f64::from)).normalize();
        let sin = a * (1.0 - d.x * d.x).sqrt() / radius;
        let crossed = record.self_id & crate::check::probe::INSIDE == 0;
        if sin > (1.0 + 1e-6) / ior {
            escaped += usize::from(crossed);
        } else if sin < (1.0 - 1e-6) / ior {
            let t = 1.0 - oracle::fresnel((1.0 - sin * sin).sqrt(), 1.0 / ior);
            out += f64::from(u8::from(crossed));
            expected += t;
            variance += t * (1.0 - t);
        }
    }
    let z = (out - expected).abs() / variance.sqrt();
    let z = if escaped > 0 { f64::INFINITY } else { z };
    Ok(Measured::new(z, format!("{out} of {} rays get out, expected {expected:.0}", paths.len())))
}
