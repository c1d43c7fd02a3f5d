//! Cameras that are no pinholes, against what follows from their geometry.

use std::f64::consts::PI;

use glam::DVec3;

use crate::check::scenes::{Build, emitter, empty};
use crate::check::statistics::relative;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::scene::{Lens, PixelFilter, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "camera/orthographic-silhouette",
        what: "a luminous sphere of radius 1, far off the axis' depth, in parallel rays: a disc of radius 1",
        oracle: "closed form: πr² over the area of the picture, and the disc's place",
        quantity: "worst relative error of the part of the picture, and of the disc's middle",
        threshold: 3e-3,
        full_only: false,
        measure: silhouette,
    },
    Case {
        name: "camera/circle-of-confusion",
        what: "a small luminous disc out of focus, behind and before the plane in focus",
        oracle: "closed form: an even disc of radius R·|z − f|/(z·f) on the image plane at distance 1",
        quantity: "worst relative error of the second moment of its light, and of its sum",
        threshold: 2e-2,
        full_only: false,
        measure: confusion,
    },
];

/// The sum of an image, its middle, and the mean squared distance from there, in pixels.
fn moments(lab: &Lab, scene: &Scene) -> Result<(f64, [f64; 2], f64), CheckError> {
    let film = lab.render(scene)?;
    let (width, height) = (scene.film.width as usize, scene.film.height as usize);
    let green = film.channel(1);
    let at = |i: usize| [(i % width) as f64 + 0.5, (i / width) as f64 + 0.5];
    let light = |i: usize| green[i];
    let all = 0..width * height;
    let sum: f64 = all.clone().map(light).sum();
    let middle = [0, 1].map(|axis| all.clone().map(|i| light(i) * at(i)[axis]).sum::<f64>() / sum);
    let squared = |i: usize| (0..2).map(|axis| (at(i)[axis] - middle[axis]).powi(2)).sum::<f64>();
    let moment = all.map(|i| light(i) * squared(i)).sum::<f64>() / sum;
    Ok((sum, middle, moment))
}

fn silhouette(lab: &Lab) -> Result<Measured, CheckError> {
    let mut worst: f64 = 0.0;
    for depth in [2.0, 40.0] {
        let mut scene = empty();
        scene.size(64, 256);
        scene.camera.orthographic_width = Some(8.0);
        scene.sphere(DVec3::new(1.5, -1.0, -depth), 1.0, emitter(1.0));
        let (sum, [x, y], _) = moments(lab, &scene)?;
        // A unit is 8 pixels.
        worst = worst.max(relative(sum, PI * 64.0));
        worst = worst.max(relative(x, 32.0 + 12.0)).max(relative(y, 32.0 + 8.0));
    }
    Ok(Measured::new(worst, "64x64 pixels, spheres at two depths"))
}

fn confusion(lab: &Lab) -> Result<Measured, CheckError> {
    let mut worst: f64 = 0.0;
    let (radius, focus) = (0.25, 4.0);
    for depth in [2.5, 8.0] {
        let mut scene = empty();
        scene.size(64, lab.size(1024, 4096) as u32);
        scene.film.filter = PixelFilter::Box;
        scene.camera.lens = Some(Lens { radius, focus });
        scene.camera.horizontal_fov = 20.0;
        // A flat polygon of 32 corners: a disc, seen head-on.
        let small = 0.02 * depth;
        let corner = |i: u32| {
            let angle = 2.0 * PI * f64::from(i) / 32.0;
            DVec3::new(small * angle.cos(), small * angle.sin(), -depth)
        };
        let corners: Vec<DVec3> = (0..32).map(corner).collect();
        let triangles: Vec<[u32; 3]> = (1..31).map(|i| [0, i, i + 1]).collect();
        scene.mesh(&corners, &triangles, emitter(1.0));
        let (sum, _, moment) = moments(lab, &scene)?;
        let pixels = 32.0 / 10f64.to_radians().tan();
        let area = 16.0 * (2.0 * PI / 32.0).sin() * (0.02 * pixels).powi(2);
        // Of a regular polygon of n corners: R²·(2 + cos(2π/n))/6.
        let of_disc = (0.02 * pixels).powi(2) * (2.0 + (2.0 * PI / 32.0).cos()) / 6.0;
        let blur = pixels * radius * (depth - focus).abs() / (depth * focus);
        let of_pixel = 1.0 / 6.0;
        worst = worst.max(relative(sum, area));
        worst = worst.max(relative(moment - of_pixel, of_disc + blur * blur / 2.0));
    }
    Ok(Measured::new(worst, "64x64 pixels, discs at two depths"))
}
