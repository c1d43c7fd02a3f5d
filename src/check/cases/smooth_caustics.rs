//! Light that is traced to and from surfaces whose shading normals are not those of their faces.

use crate::check::Case;
use crate::check::cases::materials::{pbr, smooth_ball};
use crate::check::cases::oracle::against_oracle;
use crate::check::scenes::{Build, diffuse, emitter, empty, glass, mirror, v};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[Case {
    name: "oracle/caustics-smooth",
    what: "a mirror, glass and what they light, all of coarse meshes with smooth normals",
    oracle: "path tracer in f64",
    quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
    threshold: 1.0,
    full_only: false,
    measure: |lab| against_oracle(lab, &smooth_caustics()),
}];

/// A lamp that shines up at a mirror: all else gets its light from there. Normals of the meshes differ much from those of their faces.
fn smooth_caustics() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 3;
    scene.camera.target = v(0.0, -0.5, -5.0);
    scene.camera.horizontal_fov = 60.0;
    scene.quad([v(-1.5, 0.0, -3.5), v(1.5, 0.0, -3.5), v(1.5, 0.0, -6.5), v(-1.5, 0.0, -6.5)], emitter(9.0));
    scene.quad([v(-4.0, -2.0, 2.0), v(4.0, -2.0, 2.0), v(4.0, -2.0, -9.0), v(-4.0, -2.0, -9.0)], diffuse(0.75));
    smooth_ball(&mut scene, v(0.0, 6.5, -5.0), 4.5, mirror(0.875));
    smooth_ball(&mut scene, v(0.25, 1.0, -5.0), 0.5, glass(1.5));
    smooth_ball(&mut scene, v(-1.5, -1.4, -4.5), 0.8, diffuse(0.75));
    smooth_ball(&mut scene, v(1.5, -1.9, -5.0), 1.0, diffuse(0.625));
    // No light path goes on from here.
    smooth_ball(&mut scene, v(0.2, -1.75, -4.0), 0.5, pbr([0.9, 0.7, 0.5], 0.0, 0.4));
    scene
}
