//! Where a sample falls on the film, and the ray that it sees along.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::oracle::{Pcg64, Ray};
use crate::scene::{PixelFilter, Scene, unit};

/// Draws a point by the pixel filter, in pixels from the upper left corner of the pixel.
pub fn film_offset(filter: PixelFilter, rng: &mut Pcg64) -> DVec2 {
    let (u, v) = (rng.uniform(), rng.uniform());
    match filter {
        PixelFilter::Box => DVec2::new(u, v),
        // Box and Muller 1958; 1 - u is never 0.
        PixelFilter::Gaussian => DVec2::splat(0.5) + 0.5 * (-2.0 * (1.0 - u).ln()).sqrt() * DVec2::from_angle(TAU * v),
    }
}

/// Draws a point of the unit disc.
pub fn lens_offset(rng: &mut Pcg64) -> DVec2 {
    let (u, v) = (rng.uniform(), rng.uniform());
    u.sqrt() * DVec2::from_angle(TAU * v)
}

/// The ray of unit direction that leaves the camera through a point of the film, and a point of its lens, whose radius is 1. (A pinhole
/// has one point.)
///
/// `film` is in pixels from the upper left corner of the image, y downwards; pixels are square.
pub fn primary_ray(scene: &Scene, film: DVec2, lens: DVec2) -> Ray {
    let camera = &scene.camera;
    // A scene that has been checked has these directions.
    let direction = |v| unit(v).unwrap_or(DVec3::NAN);
    let forward = direction(camera.target - camera.position);
    let right = direction(forward.cross(direction(camera.up)));
    let up = right.cross(forward);
    let (width, height) = (f64::from(scene.film.width), f64::from(scene.film.height));
    let half_width = match camera.orthographic_width {
        Some(width) => 0.5 * width,
        None => (0.5 * camera.horizontal_fov.to_radians()).tan(),
    };
    let pixel = 2.0 * half_width / width;
    let aside = right * (pixel * (film.x - 0.5 * width)) + up * (pixel * (0.5 * height - film.y));
    let (origin, direction) = match camera.orthographic_width {
        Some(_) => (camera.position + aside, forward),
        None => (camera.position, forward + aside),
    };
    match camera.lens {
        None => Ray::new(origin, direction.normalize()),
        Some(of) => {
            let on_lens = of.radius * (lens.x * right + lens.y * up);
            Ray::new(origin + on_lens, (of.focus * direction - on_lens).normalize())
        }
    }
}
