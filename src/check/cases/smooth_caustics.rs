//! Light that is traced to and from surfaces whose shading normals are not those of their faces.

use std::f64::consts::PI;

use glam::DVec3;

use crate::check::cases::materials::{pbr, smooth_ball};
use crate::check::cases::oracle::against_oracle;
use crate::check::scenes::{Build, diffuse, emitter, empty, glass, mirror, v};
use crate::check::statistics::{mean_and_error, worst};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::RenderSettings;
use crate::scene::{Normals, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "oracle/caustics-smooth",
        what: "a mirror, glass and what they light, all of coarse meshes with smooth normals",
        oracle: "path tracer in f64",
        quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &smooth_caustics()),
    },
    Case {
        name: "light-tracing/tilted-normals",
        what: "a floor whose normals all lean towards the camera, under a lamp that a flat mirror shows",
        oracle: "the lamp's image in the mirror, integrated in f64",
        quantity: "worst deviation of a quarter of the rows in standard errors",
        threshold: 5.0,
        full_only: false,
        measure: tilted_normals,
    },
];

/// Radiance, reflectances of floor and mirror.
const LIGHT: [f64; 3] = [8.0, 0.75, 0.875];
/// Where the lamp begins, and its side.
const LAMP: (DVec3, f64) = (DVec3::new(3.0, 0.5, -5.75), 1.5);
const MIRROR_HEIGHT: f64 = 3.0;
const FLOOR_HEIGHT: f64 = -1.0;
const LEANING: DVec3 = DVec3::new(0.0, 0.8, 0.6);
const FIELD_OF_VIEW: f64 = 10.0;

fn tilted_normals(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    // Floor, mirror, and the lamp after these.
    scene.integrator.max_depth = 2;
    scene.camera.target = v(0.0, FLOOR_HEIGHT, -5.0);
    scene.camera.horizontal_fov = FIELD_OF_VIEW;
    let level = |x0: f64, x1: f64, y: f64, z0: f64, z1: f64| [v(x0, y, z0), v(x1, y, z0), v(x1, y, z1), v(x0, y, z1)];
    let (corner, side) = LAMP;
    scene.quad(level(corner.x, corner.x + side, corner.y, corner.z + side, corner.z), emitter(LIGHT[0]));
    scene.quad(level(-20.0, 20.0, MIRROR_HEIGHT, 20.0, -30.0), mirror(LIGHT[2]));
    let floor = level(-2.0, 2.0, FLOOR_HEIGHT, -2.0, -12.0);
    let mesh = scene.mesh(&floor, &[[0, 1, 2], [0, 2, 3]], diffuse(LIGHT[1]));
    mesh.vertex_normals = vec![LEANING; 4];
    mesh.normals = Normals::Smooth;
    let side = 32;
    scene.size(side as u32, 16);
    let exact: Vec<f64> = (0..side * side).map(|i| tilted_radiance(i % side, i / side, side)).collect();
    let mut quarters = vec![Vec::new(); 4];
    for seed in 0..8 {
        let samples = lab.size(256, 4096) as u32;
        let image = lab.render_with(&scene, &RenderSettings { samples, seed, ..lab.settings(&scene) })?;
        let found = image.channel(0);
        for (i, quarter) in quarters.iter_mut().enumerate() {
            let sum = |values: &[f64]| values[i * side * side / 4..][..side * side / 4].iter().sum::<f64>();
            quarter.push(sum(&found) / sum(&exact) - 1.0);
        }
    }
    let means: Vec<_> = quarters.iter().map(|quarter| mean_and_error(quarter)).collect();
    let in_errors = worst(means.iter().map(|(mean, error)| mean.abs() / error));
    let relative = worst(means.iter().map(|(mean, _)| mean.abs()));
    Ok(Measured::new(in_errors, format!("{:.1}% of a quarter", 100.0 * relative)))
}

/// What the middle of a pixel shows: the image of the lamp sends light by the cosine to the leaning normal.
fn tilted_radiance(column: usize, row: usize, side: usize) -> f64 {
    const STEPS: u32 = 16;
    let forward = v(0.0, FLOOR_HEIGHT, -5.0).normalize();
    let (right, up) = (DVec3::X, DVec3::X.cross(forward));
    let extent = (FIELD_OF_VIEW / 2.0).to_radians().tan();
    let across = |i: usize| (2.0 * (i as f64 + 0.5) / side as f64 - 1.0) * extent;
    let direction = forward + across(column) * right - across(row) * up;
    let point = direction * (FLOOR_HEIGHT / direction.y);
    let (corner, length) = LAMP;
    let step = length / f64::from(STEPS);
    let of_part = |i: u32| {
        let (x, z) = (f64::from(i % STEPS) + 0.5, f64::from(i / STEPS) + 0.5);
        let seen = v(corner.x + x * step, 2.0 * MIRROR_HEIGHT - corner.y, corner.z + z * step);
        let to = seen - point;
        to.normalize().dot(LEANING) * to.normalize().y * step * step / to.length_squared()
    };
    LIGHT[0] * LIGHT[1] * LIGHT[2] / PI * (0..STEPS * STEPS).map(of_part).sum::<f64>()
}

/// A lamp that shines up at a wavy mirror: all else gets its light from there. Normals of the meshes differ much from those of their faces.
fn smooth_caustics() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 3;
    scene.camera.target = v(0.0, -0.5, -5.0);
    scene.camera.horizontal_fov = 60.0;
    scene.quad([v(-1.5, 0.35, -3.5), v(1.5, 0.35, -3.5), v(1.5, 0.35, -6.5), v(-1.5, 0.35, -6.5)], emitter(9.0));
    scene.quad([v(-4.0, -2.0, 2.0), v(4.0, -2.0, 2.0), v(4.0, -2.0, -9.0), v(-4.0, -2.0, -9.0)], diffuse(0.75));
    waves(&mut scene);
    smooth_ball(&mut scene, v(0.25, 1.0, -5.0), 0.5, glass(1.5));
    smooth_ball(&mut scene, v(-1.5, -1.4, -4.5), 0.8, diffuse(0.75));
    smooth_ball(&mut scene, v(1.5, -1.9, -5.0), 1.0, diffuse(0.625));
    // No light path goes on from here.
    smooth_ball(&mut scene, v(0.2, -1.75, -4.0), 0.5, pbr([0.9, 0.7, 0.5], 0.0, 0.4));
    scene
}

/// The mirror: few faces, with the normals of waves.
fn waves(scene: &mut Scene) {
    const SIDE: u32 = 6;
    let place = |i: u32| (f64::from(i % SIDE) * 1.6 - 4.0, f64::from(i / SIDE) * 2.0 - 9.0);
    let height = |x: f64, z: f64| 2.5 + 0.3 * (1.1 * x).sin() * (0.9 * z).cos();
    let point = |i| {
        let (x, z) = place(i);
        v(x, height(x, z), z)
    };
    let normal = |i| {
        let (x, z) = place(i);
        let slope = |dx: f64, dz: f64| (height(x + dx, z + dz) - height(x - dx, z - dz)) / 2e-3;
        v(slope(1e-3, 0.0), -1.0, slope(0.0, 1e-3)).normalize().as_vec3().as_dvec3()
    };
    let points: Vec<_> = (0..SIDE * SIDE).map(point).collect();
    let corners = (0..SIDE * (SIDE - 1)).filter(|i| i % SIDE < SIDE - 1);
    let triangles: Vec<_> = corners.flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]]).collect();
    let mesh = scene.mesh(&points, &triangles, mirror(0.875));
    mesh.vertex_normals = (0..SIDE * SIDE).map(normal).collect();
    mesh.normals = Normals::Smooth;
}
