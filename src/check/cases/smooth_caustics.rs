//! Light that is traced to and from surfaces whose shading normals are not those of their faces.

use crate::check::cases::materials::{pbr, smooth_ball};
use crate::check::cases::oracle::against_oracle;
use crate::check::scenes::{Build, diffuse, emitter, empty, glass, mirror, v};
use crate::check::Case;
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "oracle/caustics-smooth",
        what: "glass, mirrors and what they light, of coarse meshes with smooth normals, and varnish",
        oracle: "path tracer in f64",
        quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &smooth_caustics()),
    },
];

/// A room in which normals of meshes differ much from those of their faces.
fn smooth_caustics() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 6;
    scene.cuboid(v(-3.0, -2.0, -8.0), v(3.0, 2.5, 2.0), diffuse(0.5));
    scene.quad([v(-1.5, 2.25, -6.5), v(1.5, 2.25, -6.5), v(1.5, 2.25, -3.5), v(-1.5, 2.25, -3.5)], emitter(3.0));
    smooth_ball(&mut scene, v(-1.25, -0.5, -5.0), 0.75, glass(1.5));
    smooth_ball(&mut scene, v(1.5, -0.5, -5.25), 0.75, mirror(0.875));
    smooth_ball(&mut scene, v(0.0, -1.5, -4.25), 0.9, diffuse(0.75));
    smooth_ball(&mut scene, v(-2.25, -2.0, -5.5), 1.0, diffuse(0.625));
    // No light path goes on from here.
    smooth_ball(&mut scene, v(2.5, -1.75, -4.25), 0.75, pbr([0.9, 0.7, 0.5], 0.0, 0.4));
    let floor = [v(0.5, -1.9, -7.5), v(0.5, -1.9, -5.0), v(2.5, -1.9, -5.0), v(2.5, -1.9, -7.5)];
    scene.quad(floor, pbr([0.5, 0.7, 0.9], 0.0, 0.5));
    scene
}
