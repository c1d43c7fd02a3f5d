//! Intersections: precision, watertightness, and rays that must miss.

use std::collections::HashMap;

use glam::DVec3;
use photolith::oracle::trace::closest_hit;
use photolith::oracle::{Pcg64, Primitive, Ray};
use photolith::scene::*;

use crate::*;

#[test]
fn huge_walls_keep_their_distance() {
    let mut rng = Pcg64::new(23, 0);
    for radius in [1e3, 1e5] {
        let mut scene = empty();
        let center = v(0.0, -radius - 1.0, 0.0);
        scene.sphere(center, radius, diffuse(1.0));
        for _ in 0..10_000 {
            // aim at a known point of the wall: the hit is at t = 1 by construction
            let target =
                center + radius * v(0.01 * (rng.uniform() - 0.5), 1.0, 0.01 * (rng.uniform() - 0.5)).normalize();
            let origin = target + v(3.0 * rng.uniform(), 0.1 + 5.0 * rng.uniform(), 0.0);
            let seen = hit(&scene, origin, target - origin);
            assert!((seen.t - 1.0).abs() < 1e-7);
            assert!((seen.position - target).length() < 1e-7);
        }
    }
}

#[test]
fn rays_do_not_hit_what_they_leave() {
    let mut rng = Pcg64::new(25, 0);
    let mut scene = empty();
    let center = v(1e4, -3.0, 5.0);
    scene.sphere(center, 0.7, diffuse(1.0));
    scene.mesh(&[v(9.0, 0.0, 0.0), v(0.0, 9.0, 1e3), v(-9.0, -9.0, 0.1)], &[[0, 1, 2]], diffuse(1.0));
    for _ in 0..100_000 {
        let on_sphere = hit(&scene, center, uniform_direction(&mut rng));
        let direction = uniform_direction(&mut rng);
        let next = closest_hit(&scene, &on_sphere.spawn(direction)).filter(|h| h.primitive == on_sphere.primitive);
        let outwards = direction.dot(on_sphere.position - center) >= 0.0;
        match next {
            None => assert!(outwards),
            Some(next) => {
                assert!(!outwards);
                assert_close((next.position - center).length(), 0.7, 1e-10);
                let chord = (next.position - on_sphere.position).length();
                assert!((chord - next.t).abs() < 1e-11);
            }
        }
        let on_triangle = hit(&scene, v(0.0, 0.0, 500.0), v(0.0, rng.uniform(), -99.0));
        let back = closest_hit(&scene, &on_triangle.spawn(direction));
        assert!(back.is_none_or(|h| h.primitive != on_triangle.primitive));
    }
}

/// A unit sphere of 20 · 4^level triangles.
fn icosphere(level: u32, offset: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut points = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        points.extend([v(0.0, a, b), v(a, b, 0.0), v(b, 0.0, a)].map(DVec3::normalize));
    }
    let mut faces = Vec::new();
    let adjacent = |i: usize, j: usize| points[i].dot(points[j]) > 0.4;
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if adjacent(i, j) && adjacent(j, k) && adjacent(i, k) {
                    faces.push([i, j, k].map(|x| x as u32));
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in faces {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push((points[i as usize] + points[j as usize]).normalize());
                    points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = finer;
    }
    (points.iter().map(|p| *p + offset).collect(), faces)
}

#[test]
fn closed_meshes_have_no_cracks() {
    let mut rng = Pcg64::new(26, 0);
    for offset in [DVec3::ZERO, v(148_376.0, 1234.0, -223_423.0)] {
        let (points, faces) = icosphere(2, offset);
        let mut scene = empty();
        scene.mesh(&points, &faces, diffuse(1.0));
        for _ in 0..20_000 {
            let origin = offset + 0.5 * uniform_direction(&mut rng);
            let face = faces[(rng.next_u64() % faces.len() as u64) as usize].map(|i| points[i as usize]);
            let on_edge = face[0].lerp(face[1], rng.uniform());
            for target in [face[0], on_edge] {
                assert!((hit(&scene, origin, target - origin).t - 1.0).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn triangles_report_normal_side_and_the_lowest_index() {
    let mut scene = empty();
    let corners = [v(0.0, 0.0, 0.0), v(2.0, 0.0, 0.0), v(0.0, 2.0, 0.0)];
    let degenerate = [[0, 0, 0], [0, 1, 1]];
    scene.mesh(&corners, &degenerate, diffuse(1.0));
    scene.mesh(&corners, &[[0, 1, 2], [0, 1, 2]], diffuse(1.0));
    scene.mesh(&corners, &[[0, 2, 1]], diffuse(1.0));
    let above = hit(&scene, v(0.5, 0.5, 3.0), DVec3::NEG_Z);
    assert_eq!((above.t, above.front, above.normal), (3.0, true, DVec3::Z));
    assert_eq!((above.primitive, above.material), (Primitive::Triangle(1, 0), 1));
    let below = hit(&scene, v(0.5, 0.5, -3.0), v(0.0, 0.0, 2.0));
    assert_eq!((below.t, below.front, below.normal), (1.5, false, DVec3::NEG_Z));
    assert!(closest_hit(&scene, &Ray::new(v(1.1, 1.1, 3.0), DVec3::NEG_Z)).is_none());
    assert!(closest_hit(&scene, &Ray::new(v(0.5, 0.5, 3.0), DVec3::Z)).is_none());
    assert!(closest_hit(&scene, &Ray::new(v(0.5, 0.0, -1.0), v(1.0, 0.0, 0.0))).is_none());
}

#[test]
fn smooth_normals_are_interpolated_by_area() {
    let mut scene = empty();
    let normals = [v(0.6, 0.0, 0.8), v(-0.6, 0.0, 0.8), v(0.0, 0.6, 0.8)];
    let mesh = scene.mesh(&[v(0.0, 0.0, 0.0), v(4.0, 0.0, 0.0), v(0.0, 4.0, 0.0)], &[[0, 1, 2]], diffuse(1.0));
    (mesh.normals, mesh.vertex_normals) = (Normals::Smooth, normals.to_vec());
    let expected = (0.25 * normals[0] + 0.5 * normals[1] + 0.25 * normals[2]).normalize();
    for (z, sign) in [(1.0, 1.0), (-1.0, -1.0)] {
        let seen = hit(&scene, v(2.0, 1.0, z), v(0.0, 0.0, -z));
        assert!((seen.shading_normal - sign * expected).length() < 1e-15);
        assert_eq!(seen.normal, v(0.0, 0.0, sign));
    }
}

#[test]
fn rays_that_are_not_rays_miss() {
    let mut scene = empty();
    scene.sphere(DVec3::ZERO, 1.0, diffuse(1.0));
    scene.quad(floor(0.0, 1.0), diffuse(1.0));
    let (nan, infinite) = (DVec3::splat(f64::NAN), DVec3::splat(f64::INFINITY));
    for (origin, direction) in [
        (nan, DVec3::X),
        (DVec3::ZERO, nan),
        (v(0.0, f64::NAN, 0.0), DVec3::Y),
        (infinite, DVec3::X),
        (v(0.0, 0.5, 0.0), infinite),
        (v(0.0, 0.5, 0.0), DVec3::ZERO),
    ] {
        assert!(closest_hit(&scene, &Ray::new(origin, direction)).is_none(), "{origin} {direction}");
    }
}
