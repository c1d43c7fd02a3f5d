//! Scenes of the cases, built in code.

use glam::DVec3;

use crate::scene::*;

/// A 16×16 image with box filter from the origin towards −z, depth 8, 16 samples, and nothing in it.
pub(crate) fn empty() -> Scene {
    Scene {
        source: "check".into(),
        camera: Camera {
            position: DVec3::ZERO,
            target: DVec3::NEG_Z,
            up: DVec3::Y,
            horizontal_fov: 60.0,
            ..Camera::default()
        },
        film: Film { width: 16, height: 16, filter: PixelFilter::Box, transfer: Transfer::Srgb, ..Film::default() },
        integrator: Integrator { max_depth: 8, samples: 16, russian_roulette: None, indirect: true },
        ..Scene::default()
    }
}

/// How scenes are put together.
pub(crate) trait Build {
    fn material(&mut self, surface: Surface) -> u32;
    fn sphere(&mut self, center: DVec3, radius: f64, surface: Surface);
    fn mesh(&mut self, positions: &[DVec3], triangles: &[[u32; 3]], surface: Surface) -> &mut Mesh;
    fn quad(&mut self, corners: [DVec3; 4], surface: Surface);
    fn cuboid(&mut self, lo: DVec3, hi: DVec3, surface: Surface);
    fn light(&mut self, position: DVec3, power: f64);
    fn size(&mut self, side: u32, samples: u32);
}

impl Build for Scene {
    fn material(&mut self, surface: Surface) -> u32 {
        let index = self.materials.len();
        self.materials.push(Material::new(format!("{index}"), surface));
        index as u32
    }

    fn sphere(&mut self, center: DVec3, radius: f64, surface: Surface) {
        let material = self.material(surface);
        self.spheres.push(Sphere { center, radius, material, inward: false });
    }

    fn mesh(&mut self, positions: &[DVec3], triangles: &[[u32; 3]], surface: Surface) -> &mut Mesh {
        let material = self.material(surface);
        let index = self.meshes.len();
        self.meshes.push(Mesh {
            name: format!("mesh {index}"),
            positions: positions.to_vec(),
            vertex_normals: vec![],
            triangles: triangles.to_vec(),
            triangle_materials: vec![material; triangles.len()],
            normals: Normals::Flat,
            ..Mesh::default()
        });
        &mut self.meshes[index]
    }

    fn quad(&mut self, corners: [DVec3; 4], surface: Surface) {
        self.mesh(&corners, &[[0, 1, 2], [0, 2, 3]], surface);
    }

    /// Normals point outward.
    fn cuboid(&mut self, lo: DVec3, hi: DVec3, surface: Surface) {
        let (positions, triangles) = cuboid(lo, hi);
        self.mesh(&positions, &triangles, surface);
    }

    /// A point light of equal power in all channels.
    fn light(&mut self, position: DVec3, power: f64) {
        self.lights.push(Light::Point { position, power: [power; 3] });
    }

    fn size(&mut self, side: u32, samples: u32) {
        (self.film.width, self.film.height, self.integrator.samples) = (side, side, samples);
    }
}

pub(crate) fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

pub(crate) fn diffuse(reflectance: f64) -> Surface {
    Surface::diffuse([reflectance; 3])
}

pub(crate) fn mirror(reflectance: f64) -> Surface {
    Surface::mirror([reflectance; 3])
}

pub(crate) fn glass(ior: f64) -> Surface {
    Surface::dielectric(ior)
}

pub(crate) fn emitter(radiance: f64) -> Surface {
    Surface::emitter([radiance; 3])
}

/// Corners and outward triangles of a box.
pub(crate) fn cuboid(lo: DVec3, hi: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let at = |i: u32| {
        let pick = |bit: u32, lo: f64, hi: f64| if i >> bit & 1 == 0 { lo } else { hi };
        v(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z))
    };
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ((0..8).map(at).collect(), triangles)
}

/// An icosahedron, each triangle split into four `levels` times, pushed out onto the sphere: a closed mesh.
pub(crate) fn icosphere(center: DVec3, radius: f64, levels: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points: Vec<DVec3> = [
        (-1.0, g, 0.0),
        (1.0, g, 0.0),
        (-1.0, -g, 0.0),
        (1.0, -g, 0.0),
        (0.0, -1.0, g),
        (0.0, 1.0, g), //
        (0.0, -1.0, -g),
        (0.0, 1.0, -g),
        (g, 0.0, -1.0),
        (g, 0.0, 1.0),
        (-g, 0.0, -1.0),
        (-g, 0.0, 1.0),
    ]
    .map(|(x, y, z)| v(x, y, z).normalize())
    .to_vec();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut split = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push((points[i as usize] + points[j as usize]).normalize());
                    points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            split.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = split;
    }
    // Single precision, so that the device and the host see one mesh.
    let place = |p: &DVec3| (center + radius * *p).as_vec3().as_dvec3();
    (points.iter().map(place).collect(), triangles)
}

/// A square of 2·half in the plane through `center` with the given axes, as n×n×2 triangles.
pub(crate) fn grid(center: DVec3, x: DVec3, y: DVec3, n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let step = |i: u32| 2.0 * f64::from(i) / f64::from(n) - 1.0;
    let positions = (0..=n)
        .flat_map(|j| (0..=n).map(move |i| (i, j)))
        .map(|(i, j)| (center + step(i) * x + step(j) * y).as_vec3().as_dvec3())
        .collect();
    let at = |i, j| j * (n + 1) + i;
    let triangles = (0..n)
        .flat_map(|j| (0..n).map(move |i| (i, j)))
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
        .collect();
    (positions, triangles)
}

/// The report's kind of room: six wall spheres, a mirror ball, a glass ball, a grey ball, a small mesh, one light.
/// Every coordinate is a multiple of 2⁻⁷, so that moving the scene by an integer is exact.
pub(crate) fn room() -> Scene {
    let mut scene = empty();
    scene.camera.position = v(0.0, 0.0, 55.0);
    scene.camera.target = v(0.0, 0.0, 0.0);
    scene.size(32, 4);
    scene.integrator.max_depth = 6;
    for (axis, reflectance) in [
        (v(1.0, 0.0, 0.0), 0.75),
        (v(-1.0, 0.0, 0.0), 0.25),
        (v(0.0, 1.0, 0.0), 0.5),
        (v(0.0, -1.0, 0.0), 0.625),
        (v(0.0, 0.0, 1.0), 0.5),
        (v(0.0, 0.0, -1.0), 0.875),
    ] {
        scene.sphere(1000.0 * axis, 940.0, diffuse(reflectance));
    }
    scene.sphere(v(-22.0, -30.0, -8.0), 14.0, mirror(0.9375));
    scene.sphere(v(20.0, -32.5, 6.0), 12.0, glass(1.5));
    scene.sphere(v(0.0, 10.0, -30.0), 9.0, diffuse(0.75));
    scene.cuboid(v(-6.0, -40.0, 4.0), v(5.5, -20.25, 13.75), diffuse(0.625));
    scene.light(v(5.0, 38.0, 10.0), 40_000.0);
    scene
}

/// A room without a BVH, in which neighbouring pixels see different parts of what is around them.
pub(crate) fn screened_room() -> Scene {
    let mut scene = empty();
    scene.size(32, 4);
    scene.cuboid(v(-3.0, -2.0, -9.0), v(3.0, 2.0, 1.0), diffuse(0.75));
    scene.sphere(v(-1.8, 1.0, -7.0), 0.6, mirror(0.875));
    scene.sphere(v(0.25, -1.2, -5.5), 0.7, diffuse(0.5));
    // Light comes from behind a screen: most of it is indirect.
    scene.quad([v(-0.5, 0.3, -6.0), v(2.5, 0.3, -6.0), v(2.5, 2.0, -4.5), v(-0.5, 2.0, -4.5)], diffuse(0.625));
    // Cells of the size of a group of pixels, by turns light and dark: its members see the light of different ones.
    for i in 0..7 {
        let x = -2.25 + 0.75 * f64::from(i);
        for (x, light) in [(x - 0.01, i % 2 == 0), (x + 0.01, i % 2 == 1)] {
            let side = [v(x, -2.0, -9.0), v(x, -2.0, -7.5), v(x, 2.0, -7.5), v(x, 2.0, -9.0)];
            scene.quad(side, diffuse(if light { 0.9375 } else { 0.0625 }));
        }
    }
    scene.light(v(1.0, 1.6, -7.0), 60.0);
    scene.integrator.max_depth = 5;
    scene
}

/// The same with a BVH.
pub(crate) fn divided_room() -> Scene {
    let mut scene = screened_room();
    let (positions, triangles) = icosphere(v(-1.0, -1.0, -5.0), 0.8, 1);
    scene.mesh(&positions, &triangles, diffuse(0.5));
    // More balls than constants hold: some are in the BVH.
    for i in 0..20 {
        let (x, y) = (f64::from(i % 5), f64::from(i / 5));
        scene.sphere(v(0.6 + 0.45 * x, -1.6 + 0.45 * y, -6.5 - 0.2 * x), 0.18, diffuse(0.875));
    }
    scene
}

/// A wall with stripes of mirrors, and a ball of glass, in which neighbouring pixels see diffuse surfaces after different
/// numbers of hits, and light is followed over few.
pub(crate) fn mirrored_wall() -> Scene {
    let mut scene = empty();
    scene.camera.horizontal_fov = 30.0;
    scene.cuboid(v(-3.0, -2.0, -8.0), v(3.0, 2.0, 1.0), diffuse(0.9375));
    for i in 0..8 {
        let left = -2.1 + 0.54 * f64::from(i);
        let (right, z) = (left + 0.27, -7.75);
        scene.quad([v(left, -2.0, z), v(right, -2.0, z), v(right, 2.0, z), v(left, 2.0, z)], mirror(0.9375));
    }
    // What they show is darker than what is between them.
    scene.quad([v(-3.0, -2.0, 0.5), v(-3.0, 2.0, 0.5), v(3.0, 2.0, 0.5), v(3.0, -2.0, 0.5)], diffuse(0.25));
    scene.sphere(v(-0.75, -0.75, -6.0), 0.4, glass(1.5));
    // Light comes from behind a screen.
    scene.quad([v(-2.5, 1.0, -6.0), v(2.5, 1.0, -6.0), v(2.5, 1.0, -1.0), v(-2.5, 1.0, -1.0)], diffuse(0.9375));
    scene.light(v(0.0, 1.5, -3.5), 60.0);
    scene.integrator.max_depth = 3;
    scene
}

/// A box of a room with emitters of all kinds, some of which touch what they light, a mirror, glass and a point light.
pub(crate) fn emitters() -> Scene {
    let mut scene = empty();
    scene.camera.target = v(0.0, -0.25, -5.0);
    scene.integrator.max_depth = 4;
    let (lo, hi) = (v(-3.0, -2.0, -8.0), v(3.0, 2.5, 2.0));
    scene.cuboid(lo, hi, diffuse(0.625));
    // On the floor: a sphere that touches it, and a screen that stands on it.
    scene.sphere(v(-1.5, -1.25, -5.0), 0.75, emitter(2.0));
    scene.quad([v(1.0, -2.0, -6.5), v(2.5, -2.0, -5.0), v(2.5, 0.0, -5.0), v(1.0, 0.0, -6.5)], emitter(1.5));
    scene.quad([v(-1.0, 2.25, -6.0), v(1.0, 2.25, -6.0), v(1.0, 2.25, -4.0), v(-1.0, 2.25, -4.0)], emitter(3.0));
    let (positions, triangles) = icosphere(v(0.25, 0.5, -5.5), 0.625, 1);
    scene.mesh(&positions, &triangles, emitter(1.0));
    scene.sphere(v(0.5, -1.25, -4.25), 0.5, glass(1.5));
    scene.sphere(v(-1.75, 0.75, -5.5), 0.625, mirror(0.875));
    scene.light(v(0.0, 1.5, -2.0), 20.0);
    scene
}
