//! Scenes made larger, smaller, brighter, moved and turned.

use glam::DVec3;

use crate::check::cases::light::translate;
use crate::check::lab::{Rendered, pixels_that_differ};
use crate::check::scenes::{Build, diffuse, emitters, empty, room, v};
use crate::check::statistics::{relative, worst};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::scene::{Light, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "scale/power-of-two",
        what: "a room × 2^±20, light power × 2^±40",
        oracle: "the room as it is",
        quantity: "pixels whose bits differ",
        threshold: 0.0,
        full_only: false,
        measure: power_of_two,
    },
    Case {
        name: "scale/decades",
        what: "a room × 1e-6 … 1e6",
        oracle: "the room as it is",
        quantity: "worst relative difference of the mean",
        threshold: 1e-4,
        full_only: false,
        measure: decades,
    },
    Case {
        name: "scale/intensity",
        what: "light power × 2^±90",
        oracle: "the room as it is, × 2^±90",
        quantity: "pixels whose single-precision mean differs",
        threshold: 0.0,
        full_only: false,
        measure: intensity,
    },
    Case {
        name: "scale/overflow",
        what: "powers 1e30 and 1e-30, and light so near that radiance overflows",
        oracle: "the film stays finite, and what overflowed is counted",
        quantity: "pixels that are not finite (infinite: not counted)",
        threshold: 0.0,
        full_only: false,
        measure: overflow,
    },
    Case {
        name: "scale/translation",
        what: "a room moved by 1e3 … 1e7 on all axes",
        oracle: "the room as it is",
        quantity: "pixels whose bits differ",
        threshold: 0.0,
        full_only: false,
        measure: translation,
    },
    Case {
        name: "scale/axes",
        what: "direct light in a room whose axes are permuted",
        oracle: "the room as it is",
        quantity: "relative difference of the mean",
        threshold: 1e-5,
        full_only: false,
        measure: axes,
    },
    Case {
        name: "scale/emitters",
        what: "a room lit by emitters × 2^±20, radiance × 2^±40",
        oracle: "the room as it is, × 2^±40",
        quantity: "pixels whose single-precision mean differs",
        threshold: 0.0,
        full_only: false,
        measure: brighter_emitters,
    },
];

/// Scales lengths and the power of lights.
fn scaled(scene: &Scene, length: f64, power: f64) -> Scene {
    let mut scene = scene.clone();
    scene.camera.position *= length;
    scene.camera.target *= length;
    for s in &mut scene.spheres {
        s.center *= length;
        s.radius *= length;
    }
    scene.meshes.iter_mut().flat_map(|m| &mut m.positions).for_each(|p| *p *= length);
    for light in &mut scene.lights {
        if let Light::Point { position, power: own } = light {
            *position *= length;
            *own = own.map(|x| x * power);
        }
    }
    scene
}

fn power_of_two(lab: &Lab) -> Result<Measured, CheckError> {
    let scene = room();
    let image = lab.render(&scene)?;
    let mut differ = 0;
    for k in [-20, 20] {
        let other = lab.render(&scaled(&scene, 2f64.powi(k), 2f64.powi(2 * k)))?;
        differ += image.differing(&other);
    }
    Ok(pixels_that_differ(&image.film, differ, "2 × 1024 pixels"))
}

fn mean_difference(a: &Rendered, b: &Rendered, factor: f64) -> f64 {
    let (a, b) = (a.mean(), b.mean());
    worst((0..3).map(|c| relative(a[c] * factor, b[c])))
}

fn decades(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = room();
    // Enough samples that a path which takes another turn at an edge does not matter.
    scene.size(32, lab.size(128, 2048) as u32);
    let image = lab.render(&scene)?;
    let mut off = 0.0;
    let scales: &[f64] = if lab.full { &[1e-6, 1e-5, 1e-3, 0.1, 10.0, 1e3, 1e6] } else { &[1e-6, 1e6] };
    for &s in scales {
        let other = lab.render(&scaled(&scene, s, s * s))?;
        off = worst([off, mean_difference(&image, &other, 1.0)]);
    }
    Ok(Measured::new(off, format!("{} scales", scales.len())))
}

fn intensity(lab: &Lab) -> Result<Measured, CheckError> {
    let scene = room();
    let usual = lab.render(&scene)?.film;
    let image = usual.mean();
    let mut differ = 0;
    for k in [-90, 90] {
        let factor = 2f64.powi(k);
        let other = lab.render(&scaled(&scene, 1.0, factor))?.film.mean();
        let same = |a: &[f32; 3], b: &[f32; 3]| (0..3).all(|c| f64::from(a[c]) * factor == f64::from(b[c]));
        differ += image.iter().zip(&other).filter(|(a, b)| !same(a, b)).count();
    }
    Ok(pixels_that_differ(&usual, differ, "2 × 1024 pixels"))
}

fn overflow(lab: &Lab) -> Result<Measured, CheckError> {
    let scene = room();
    let (mut bad_pixels, mut reported) = (0, 0);
    for factor in [1e30 / 40_000.0, 1e-30] {
        let image = lab.render(&scaled(&scene, 1.0, factor))?;
        bad_pixels += image.film.sums().iter().filter(|s| s.iter().any(|x| !x.is_finite())).count();
        reported += image.statistics.bad_samples;
    }
    let expected = reported;
    // A light of 1e36 just above a plane: what arrives near its foot is beyond single precision.
    let mut near = empty();
    near.quad([v(-1.0, -1.0, -3.0), v(1.0, -1.0, -3.0), v(1.0, 1.0, -3.0), v(-1.0, 1.0, -3.0)], diffuse(0.5));
    near.light(v(0.0, 0.0, -3.0 + 1e-5), 1e30);
    near.camera.horizontal_fov = 1e-5;
    near.size(16, 64);
    let image = lab.render(&scaled(&near, 1.0, 1e6))?;
    bad_pixels += image.film.sums().iter().filter(|s| s.iter().any(|x| !x.is_finite())).count();
    let counted = image.statistics.bad_samples;
    if counted == 0 || expected > 0 {
        return Ok(Measured::new(f64::INFINITY, format!("{counted} samples counted, {expected} where none overflows")));
    }
    Ok(Measured::new(bad_pixels as f64, format!("{counted} samples overflowed and were counted")))
}

fn translation(lab: &Lab) -> Result<Measured, CheckError> {
    let scene = room();
    let image = lab.render(&scene)?;
    let mut differ = 0;
    let mut first = None;
    for distance in [1e3, 1e5, 1e7] {
        let mut other = scene.clone();
        translate(&mut other, v(distance, -2.0 * distance, 0.5 * distance));
        let wrong = image.differing(&lab.render(&other)?);
        if wrong > 0 && first.is_none() {
            first = Some(distance);
        }
        differ += wrong;
    }
    let detail = first.map_or("1e3, 1e5 and 1e7 give the same bits".to_owned(), |d| format!("differs from {d:e} on"));
    Ok(pixels_that_differ(&image.film, differ, detail))
}

fn axes(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = room();
    scene.integrator.indirect = false;
    scene.size(32, lab.size(64, 1024) as u32);
    let image = lab.render(&scene)?;
    let turn = |p: DVec3| DVec3::new(p.y, p.z, p.x);
    let mut other = scene.clone();
    other.camera.position = turn(other.camera.position);
    other.camera.target = turn(other.camera.target);
    other.camera.up = turn(other.camera.up);
    other.spheres.iter_mut().for_each(|s| s.center = turn(s.center));
    other.meshes.iter_mut().flat_map(|m| &mut m.positions).for_each(|p| *p = turn(*p));
    for position in other.lights.iter_mut().filter_map(|light| light.position_mut()) {
        *position = turn(*position);
    }
    let turned = lab.render(&other)?;
    Ok(Measured::new(mean_difference(&turned, &image, 1.0), "1024 pixels"))
}

fn brighter_emitters(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = emitters();
    scene.size(32, 4);
    // Of a point light, the power goes with the square of lengths.
    scene.lights.clear();
    let usual = lab.render(&scene)?.film;
    let image = usual.mean();
    let mut differ = 0;
    for k in [-20, 20] {
        let factor = 2f64.powi(2 * k);
        let mut other = scaled(&scene, 2f64.powi(k), 1.0);
        for material in &mut other.materials {
            material.surface.emission = material.surface.emission.map(|x| x * factor);
        }
        let other = lab.render(&other)?.film.mean();
        let same = |a: &[f32; 3], b: &[f32; 3]| (0..3).all(|c| f64::from(a[c]) * factor == f64::from(b[c]));
        differ += image.iter().zip(&other).filter(|(a, b)| !same(a, b)).count();
    }
    Ok(pixels_that_differ(&usual, differ, "2 × 1024 pixels"))
}
