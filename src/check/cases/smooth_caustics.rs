//! Light that is traced to and from surfaces whose shading normals are not those of their faces.

use crate::check::Case;
use crate::check::cases::materials::{pbr, smooth_ball};
use crate::check::cases::oracle::against_oracle;
use crate::check::scenes::{Build, diffuse, emitter, empty, glass, mirror, v};
use crate::scene::{Normals, Scene};

pub(super) const CASES: &[Case] = &[Case {
    name: "oracle/caustics-smooth",
    what: "a mirror, glass and what they light, all of coarse meshes with smooth normals",
    oracle: "path tracer in f64",
    quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
    threshold: 1.0,
    full_only: false,
    measure: |lab| against_oracle(lab, &smooth_caustics()),
}];

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
