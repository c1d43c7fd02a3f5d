//! Light from maps on planes, against integrals over the hemisphere.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::check::scenes::{Build, diffuse, empty, v};
use crate::check::statistics::mean_and_error;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::scene::{Environment, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "environment/gradient",
        what: "a map of radiance 1 + 0.9 ω·d around diffuse planes of several slopes",
        oracle: "closed form: ρ (1 + 0.6 n·d)",
        quantity: "deviation of the mean, over 5e-4 of it and four standard errors",
        threshold: 1.0,
        full_only: false,
        measure: gradient,
    },
    Case {
        name: "environment/hot-texel",
        what: "a map of one bright texel: in the middle, at the seam, at a pole, beside it; turned; around diffuse planes",
        oracle: "the bilinear hat, integrated in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: hot_texel,
    },
];

/// Of the planes, on the side of the camera.
const NORMALS: [[f64; 3]; 4] = [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.8, 0.6], [-0.48, -0.6, 0.64]];
const REFLECTANCE: f64 = 0.5;

/// A plane with such a normal that fills the view, in a map.
fn plane(normal: DVec3, map: Environment, samples: u32) -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 1;
    scene.camera.horizontal_fov = 10.0;
    scene.environment = Some(map);
    let (across, along) = normal.any_orthonormal_pair();
    let corner = |x: f64, y: f64| DVec3::new(0.0, 0.0, -4.0) + 8.0 * (x * across + y * along);
    scene.quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], diffuse(REFLECTANCE));
    scene.size(16, samples);
    scene
}

fn map(width: u32, height: u32, radiance: impl Fn(u32, u32) -> f64) -> Environment {
    let texel = |i: u32| [radiance(i % width, i / width) as f32; 3];
    let texels: Vec<_> = (0..width * height).map(texel).collect();
    let name = "map".to_owned();
    Environment { name, width, height, texels: texels.into(), rotation: 0.0, scale: 1.0, visible: true }
}

/// What the place (u, v) of a map shows: its middle is at −z, +x to the right of it, and the top at +y.
fn direction([x, y]: [f64; 2]) -> DVec3 {
    let (phi, theta) = (TAU * (x - 0.5), PI * y);
    DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

/// A deviation in units of what is allowed.
fn deviation(lab: &Lab, scene: &Scene, expected: f64) -> Result<f64, CheckError> {
    let (mean, error) = mean_and_error(&lab.render(scene)?.channel(1));
    Ok((mean - expected).abs() / (5e-4 * expected + 4.0 * error))
}

fn gradient(lab: &Lab) -> Result<Measured, CheckError> {
    let (width, height) = (512, 256);
    let mut off: f64 = 0.0;
    for axis in [v(0.0, 1.0, 0.0), v(0.6, -0.64, 0.48)] {
        let centre =
            |x: u32, y: u32| [(f64::from(x) + 0.5) / f64::from(width), (f64::from(y) + 0.5) / f64::from(height)];
        let map = map(width, height, |x, y| 1.0 + 0.9 * direction(centre(x, y)).dot(axis));
        for normal in NORMALS.map(DVec3::from) {
            let scene = plane(normal, map.clone(), lab.size(256, 4096) as u32);
            off = off.max(deviation(lab, &scene, REFLECTANCE * (1.0 + 0.6 * normal.dot(axis)))?);
        }
    }
    Ok(Measured::new(off, "8 planes, 256 pixels each"))
}

/// Irradiance from a map of one texel of radiance 1, on a plane, of directions turned about +y: midpoints of the hat's support.
fn irradiance([width, height]: [u32; 2], hot: [u32; 2], turn: f64, normal: DVec3) -> f64 {
    const STEPS: u32 = 64;
    let hat = |distance: f64| (1.0 - distance.abs()).max(0.0);
    let step = 1.0 / f64::from(STEPS);
    let mut sum = 0.0;
    for i in 0..3 * STEPS {
        for j in 0..3 * STEPS {
            // From the middle of the texel, in texels. Beyond the first and the last row these go on.
            let [x, y] = [i, j].map(|i| (f64::from(i) + 0.5) * step - 1.5);
            let row = f64::from(hot[1]) + 0.5 + y;
            if !(0.0..f64::from(height)).contains(&row) {
                continue;
            }
            let clamped = row.clamp(0.5, f64::from(height) - 0.5) - 0.5 - f64::from(hot[1]);
            let place = [(f64::from(hot[0]) + 0.5 + x) / f64::from(width), row / f64::from(height)];
            let turned = glam::DQuat::from_rotation_y(turn) * direction(place);
            let solid_angle = (PI * place[1]).sin() * (TAU / f64::from(width)) * (PI / f64::from(height)) * step * step;
            sum += hat(x) * hat(clamped) * solid_angle * normal.dot(turned).max(0.0);
        }
    }
    sum
}

fn hot_texel(lab: &Lab) -> Result<Measured, CheckError> {
    let size = [32, 16];
    let mut off: f64 = 0.0;
    // The texel, the turn in degrees, and a plane that it shines on.
    for (hot, turn, normal) in [
        ([16, 8], 180.0, NORMALS[1]),
        ([0, 7], 0.0, NORMALS[0]),
        ([31, 5], -40.0, NORMALS[2]),
        ([5, 0], 0.0, NORMALS[2]),
        ([20, 1], 15.0, NORMALS[2]),
        ([3, 15], 0.0, NORMALS[3]),
    ] {
        let map = map(size[0], size[1], |x, y| if [x, y] == hot { 100.0 } else { 0.0 });
        let scene = plane(normal.into(), Environment { rotation: turn, ..map }, lab.size(256, 4096) as u32);
        let expected = REFLECTANCE / PI * 100.0 * irradiance(size, hot, turn.to_radians(), normal.into());
        off = off.max(deviation(lab, &scene, expected)?);
    }
    Ok(Measured::new(off, "6 planes, 256 pixels each"))
}
