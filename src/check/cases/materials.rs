//! The metallic-roughness model, textures, coverage, and light from all around.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::check::cases::oracle::against_oracle;
use crate::check::probe::{Function, Words};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, emitter, empty, icosphere, mirror, v};
use crate::check::statistics::{mean_and_error, relative, worst};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle::metallic_roughness;
use crate::scene::{
    Bsdf, Coverage, Environment, Light, MetallicRoughness, Normals, Scene, Surface, Texels, Texture, TextureImage,
    TextureSlot, Wrap,
};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "materials/formula",
        what: "f·cos of the metallic-roughness model, roughness .3 to 1, up to 87 degrees",
        oracle: "the formulas in f64, which share the table of albedos alone",
        quantity: "worst relative error, where f·cos is above 1e-3",
        threshold: 5e-4,
        full_only: false,
        measure: formula,
    },
    Case {
        name: "materials/reciprocity",
        what: "f(wo, wi) and f(wi, wo) of the metallic-roughness model",
        oracle: "each other",
        quantity: "worst relative difference, where f·cos is above 1e-3",
        threshold: 1e-5,
        full_only: false,
        measure: reciprocity,
    },
    Case {
        name: "materials/furnace",
        what: "spheres of metal, of dielectric over white, and of one that reflects all, ten roughnesses, under a sky of radiance 1",
        oracle: "1",
        quantity: "worst deviation of a sphere's mean, over 5e-4 and four standard errors",
        threshold: 1.0,
        full_only: false,
        measure: furnace,
    },
    Case {
        name: "materials/lights",
        what: "bodies of metal and plastic, smooth and rough, on a rough floor, under a point, an emitter and a sky",
        oracle: "path tracer in f64",
        quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &lights()),
    },
    Case {
        name: "materials/textures",
        what: "textures of colour, metalness, roughness, normals and emission, of 8 and 16 bits and floats, wrapped in all ways; \
               vertex colours",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &textures()),
    },
    Case {
        name: "materials/coverage",
        what: "alpha by texture, factor and vertex colour, as a threshold and as a part, culled backs, and their shadows",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &coverage()),
    },
    Case {
        name: "materials/spots",
        what: "spots of several cones, one of a range, parallel light and a point of a range on rough bodies",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &spots()),
    },
    Case {
        name: "environment/oracle",
        what: "a map with a small sun, turned, on mirrors, rough bodies and a diffuse floor",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &sunny(false)),
    },
    Case {
        name: "environment/with-lights",
        what: "the same map, not seen by the camera, with a point, an emitter, a polygon before it and shared paths",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &sunny(true)),
    },
    Case {
        name: "environment/constant",
        what: "a map of radiance 1 on a metal, a dielectric and a diffuse sphere of reflectance 1",
        oracle: "1",
        quantity: "deviation of the mean, over 5e-4 and four standard errors",
        threshold: 1.0,
        full_only: false,
        measure: constant_map,
    },
];

fn map(width: u32, height: u32, texels: Vec<[f32; 3]>) -> Environment {
    let name = "map".to_owned();
    Environment { name, width, height, texels: texels.into(), rotation: 0.0, scale: 1.0, visible: true }
}

fn spots() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 2;
    scene.quad(
        [v(-5.0, -1.5, -1.0), v(5.0, -1.5, -1.0), v(5.0, -1.5, -12.0), v(-5.0, -1.5, -12.0)],
        pbr([0.8; 3], 0.0, 0.5),
    );
    scene.sphere(v(0.0, -0.5, -6.0), 1.0, diffuse(0.7));
    smooth_ball(&mut scene, v(-2.2, -0.6, -5.5), 0.8, pbr([0.9, 0.7, 0.4], 1.0, 0.5));
    let spot = |x: f64, inner: f64, outer: f64, range: f64| Light::Spot {
        position: v(x, 2.5, -4.0),
        direction: v(-0.3 * x, -4.0, -1.5),
        intensity: [20.0, 18.0, 15.0],
        inner,
        outer,
        range,
    };
    scene.lights = vec![spot(-2.0, 10.0, 35.0, f64::INFINITY), spot(0.5, 0.0, 50.0, 6.0), spot(2.0, 180.0, 180.0, 4.5)];
    scene.lights.push(Light::Directional { direction: v(1.0, -1.0, -0.5), irradiance: [0.3, 0.4, 0.5] });
    scene
}

/// A map with a sky, a ground and a sun of a pixel.
fn sunny(with_lights: bool) -> Scene {
    let (width, height) = (24, 12);
    let mut rng = Rng::new(65);
    let number = |rng: &mut Rng| (rng.bits() >> 8) as f32 * 2f32.powi(-24);
    let mut texels: Vec<[f32; 3]> = (0..width * height)
        .map(|i| {
            if i / width < height / 2 { [0.3, 0.5, 0.9] } else { [0.3, 0.2, 0.1] }.map(|x| x * (0.5 + number(&mut rng)))
        })
        .collect();
    texels[(3 * width + 15) as usize] = [60.0, 50.0, 40.0];
    let mut scene = empty();
    scene.integrator.max_depth = 4;
    scene.environment =
        Some(Environment { rotation: 70.0, scale: 0.8, visible: !with_lights, ..map(width, height, texels) });
    scene.quad([v(-5.0, -1.5, -1.0), v(5.0, -1.5, -1.0), v(5.0, -1.5, -12.0), v(-5.0, -1.5, -12.0)], diffuse(0.6));
    scene.sphere(v(-1.8, -0.5, -6.0), 0.9, mirror(0.9));
    scene.sphere(v(0.2, -0.5, -6.0), 0.9, pbr([0.9, 0.7, 0.4], 1.0, 0.3));
    smooth_ball(&mut scene, v(2.2, -0.6, -6.0), 0.9, pbr([0.5, 0.7, 0.8], 0.0, 0.6));
    if with_lights {
        scene.light(v(0.0, 3.0, -4.0), 60.0);
        scene.quad([v(-3.0, 2.0, -7.0), v(-3.0, 2.0, -6.0), v(-2.0, 2.0, -6.0), v(-2.0, 2.0, -7.0)], emitter(8.0));
    }
    scene
}

fn constant_map(lab: &Lab) -> Result<Measured, CheckError> {
    let mut off: f64 = 0.0;
    for surface in [pbr([1.0; 3], 1.0, 0.4), pbr([1.0; 3], 0.0, 0.7), diffuse(1.0)] {
        let mut scene = empty();
        scene.environment = Some(map(5, 3, vec![[1.0; 3]; 15]));
        scene.camera.horizontal_fov = 20.0;
        scene.sphere(v(0.25, -0.125, -4.0), 1.5, surface);
        scene.size(32, lab.size(256, 4096) as u32);
        let (mean, error) = mean_and_error(&lab.render(&scene)?.channel(1));
        off = off.max((mean - 1.0).abs() / (5e-4 + 4.0 * error));
    }
    Ok(Measured::new(off, "3 spheres, 1024 pixels each"))
}

pub(super) fn pbr(base: [f64; 3], metallic: f64, roughness: f64) -> Surface {
    let model = MetallicRoughness { base_color: base, metallic, roughness, ..MetallicRoughness::default() };
    Surface { bsdf: Bsdf::MetallicRoughness(model), ..diffuse(0.0) }
}

/// A random model, and two directions above it of which the first has azimuth 0; some of them grazing.
pub(super) fn random_pair(rng: &mut Rng) -> (MetallicRoughness, f32, [f32; 3]) {
    let number = |rng: &mut Rng| (rng.bits() >> 8) as f32 * 2f32.powi(-24);
    let cosine = |rng: &mut Rng| 0.05 + 0.95 * number(rng).powi(2);
    let (mu, z) = (cosine(rng), cosine(rng));
    let azimuth = std::f32::consts::TAU * number(rng);
    let r = (1.0 - z * z).sqrt();
    let model = MetallicRoughness {
        base_color: [f64::from(number(rng)); 3],
        metallic: f64::from(number(rng)),
        // Of what is smoother, or more grazing, the rounding of directions decides.
        roughness: f64::from(0.3 + 0.7 * number(rng)),
        ..MetallicRoughness::default()
    };
    (model, mu, [r * azimuth.cos(), r * azimuth.sin(), z])
}

fn words(m: &MetallicRoughness, mu: f32, wi: [f32; 3]) -> Words {
    let [base, ..] = m.base_color;
    Words { x: [m.metallic as f32, m.roughness as f32, base as f32, mu], y: [wi[0], wi[1], wi[2], 0.0] }
}

fn formula(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(61);
    let pairs: Vec<_> = (0..lab.size(1 << 16, 1 << 20)).map(|_| random_pair(&mut rng)).collect();
    let inputs: Vec<_> = pairs.iter().map(|(m, mu, wi)| words(m, *mu, *wi)).collect();
    let outputs = lab.function_in(&lights(), Function::Lobes, &inputs)?;
    let error = |((m, mu, wi), out): (&(MetallicRoughness, f32, [f32; 3]), &Words)| {
        let mu = f64::from(*mu);
        let wo = v((1.0 - mu * mu).sqrt(), 0.0, mu);
        let exact = metallic_roughness::eval(m, wo, DVec3::from(wi.map(f64::from)).normalize()).x;
        if exact > 1e-3 { relative(f64::from(out.x[0]), exact) } else { 0.0 }
    };
    let off = worst(pairs.iter().zip(&outputs).map(error));
    Ok(Measured::new(off, format!("{} pairs of directions", pairs.len())))
}

fn reciprocity(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(62);
    let pairs: Vec<_> = (0..lab.size(1 << 16, 1 << 20)).map(|_| random_pair(&mut rng)).collect();
    let there: Vec<_> = pairs.iter().map(|(m, mu, wi)| words(m, *mu, *wi)).collect();
    // The same angle between both, with the azimuth of the other one 0.
    let back: Vec<_> = pairs
        .iter()
        .map(|(m, mu, [x, y, z])| {
            let r = x.hypot(*y);
            let sine = (1.0 - mu * mu).sqrt();
            words(m, *z, [sine * x / r, -sine * y / r, *mu])
        })
        .collect();
    let (there, back) =
        (lab.function_in(&lights(), Function::Lobes, &there)?, lab.function_in(&lights(), Function::Lobes, &back)?);
    let off = worst(pairs.iter().zip(there.iter().zip(&back)).map(|((_, mu, [.., z]), (a, b))| {
        let (a, b) = (f64::from(a.x[0] / z), f64::from(b.x[0] / mu));
        if a * f64::from(*z) > 1e-3 { relative(a, b) } else { 0.0 }
    }));
    Ok(Measured::new(off, format!("{} pairs of directions", pairs.len())))
}

fn furnace(lab: &Lab) -> Result<Measured, CheckError> {
    let mut off: f64 = 0.0;
    let white = MetallicRoughness { base_color: [1.0; 3], metallic: 0.0, ..MetallicRoughness::default() };
    let all = MetallicRoughness { specular_color: [25.0; 3], ..white };
    for model in [white, MetallicRoughness { metallic: 1.0, ..white }, all] {
        for step in 1..=10 {
            let model = MetallicRoughness { roughness: f64::from(step) / 10.0, ..model };
            let mut scene = empty();
            scene.background = [1.0; 3];
            scene.camera.horizontal_fov = 20.0;
            scene.sphere(v(0.25, -0.125, -4.0), 1.5, Surface { bsdf: Bsdf::MetallicRoughness(model), ..diffuse(0.0) });
            scene.size(32, lab.size(256, 4096) as u32);
            let (mean, error) = mean_and_error(&lab.render(&scene)?.channel(1));
            off = off.max((mean - 1.0).abs() / (5e-4 + 4.0 * error));
        }
    }
    Ok(Measured::new(off, "30 spheres, 1024 pixels each"))
}

fn lights() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 4;
    scene.background = [0.5, 0.75, 1.0];
    scene.light(v(2.0, 4.0, -2.0), 150.0);
    scene.quad([v(-2.0, 3.0, -7.0), v(-2.0, 3.0, -5.0), v(0.0, 3.0, -5.0), v(0.0, 3.0, -7.0)], emitter(6.0));
    scene.quad(
        [v(-5.0, -1.0, -1.0), v(5.0, -1.0, -1.0), v(5.0, -1.0, -12.0), v(-5.0, -1.0, -12.0)],
        pbr([0.5, 0.6, 0.7], 0.0, 0.4),
    );
    for (i, (metallic, roughness)) in [(1.0, 0.15), (0.0, 0.3), (0.5, 0.6), (1.0, 1.0)].into_iter().enumerate() {
        let center = v(-2.25 + 1.5 * i as f64, -0.3, -6.0);
        let surface = pbr([0.9, 0.6, 0.3], metallic, roughness);
        if i % 2 == 0 {
            scene.sphere(center, 0.7, surface);
        } else {
            smooth_ball(&mut scene, center, 0.7, surface);
        }
    }
    scene
}

pub(super) fn smooth_ball(scene: &mut Scene, center: DVec3, radius: f64, surface: Surface) {
    let (positions, triangles) = icosphere(center, radius, 1);
    let mesh = scene.mesh(&positions, &triangles, surface);
    mesh.vertex_normals = positions.iter().map(|p| (*p - center).normalize().as_vec3().as_dvec3()).collect();
    mesh.normals = Normals::Smooth;
}

/// A picture of random codes.
pub(super) fn noise(rng: &mut Rng, width: u32, height: u32, least: u8) -> Vec<[u8; 4]> {
    let code = |rng: &mut Rng| ((rng.bits() >> 8) as u8).max(least);
    (0..width * height).map(|_| [code(rng), code(rng), code(rng), code(rng)]).collect()
}

/// A vertical square with coordinates of textures, tangents along x and y.
pub(super) fn card(scene: &mut Scene, at: DVec3, size: f64, surface: Surface) -> usize {
    let corners =
        [v(0.0, 0.0, 0.0), v(size, 0.0, 0.0), v(size, size, 0.0), v(0.0, size, 0.0)].map(|corner| at + corner);
    let mesh = scene.mesh(&corners, &[[0, 1, 2], [0, 2, 3]], surface);
    mesh.uvs = [
        vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
        vec![[-1.3, 2.1], [1.7, 2.1], [1.7, -0.9], [-1.3, -0.9]],
    ];
    mesh.tangents = vec![[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]; 4];
    scene.meshes.len() - 1
}

fn textures() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 3;
    scene.background = [0.25; 3];
    scene.light(v(1.0, 3.0, 0.0), 150.0);
    let mut rng = Rng::new(63);
    let wide =
        |codes: Vec<[u8; 4]>| codes.into_iter().map(|pixel| pixel.map(|code| (u16::from(code) * 257) ^ 0x5a)).collect();
    let floats =
        |codes: Vec<[u8; 4]>| codes.into_iter().map(|pixel| pixel.map(|code| f32::from(code) / 200.0)).collect();
    for (width, height, texels) in [
        (5, 3, Texels::Rgba8(noise(&mut rng, 5, 3, 0))),
        (4, 7, Texels::Rgba16(wide(noise(&mut rng, 4, 7, 0)))),
        (3, 3, Texels::Rgba32F(floats(noise(&mut rng, 3, 3, 0)))),
        // Normals lean by up to a half.
        (
            4,
            4,
            Texels::Rgba8(
                noise(&mut rng, 4, 4, 0).iter().map(|&[x, y, ..]| [64 + x / 2, 64 + y / 2, 250, 255]).collect(),
            ),
        ),
    ] {
        scene.images.push(TextureImage { name: format!("{width} × {height}"), width, height, texels });
    }
    let color = Texture { wrap: [Wrap::Repeat, Wrap::Mirror], uv_set: 1, ..Texture::new(0, true) };
    let tilted = [[0.8, 0.6, 0.3], [-0.6, 0.8, -0.2]];
    let uses: [(Surface, &[(TextureSlot, Texture)]); 6] = [
        (pbr([1.0; 3], 0.0, 0.7), &[(TextureSlot::BaseColor, color)]),
        (
            pbr([0.8, 0.7, 0.6], 1.0, 1.0),
            &[(
                TextureSlot::MetallicRoughness,
                Texture { wrap: [Wrap::Clamp; 2], uv_set: 1, ..Texture::new(1, false) },
            )],
        ),
        (pbr([0.9; 3], 1.0, 0.5), &[(TextureSlot::Normal, Texture::new(3, false))]),
        (
            diffuse(0.9),
            &[
                (TextureSlot::BaseColor, Texture { nearest: true, transform: tilted, ..Texture::new(1, false) }),
                (TextureSlot::Normal, Texture::new(3, false)),
            ],
        ),
        (
            Surface { emission: [2.0, 1.0, 0.5], ..diffuse(0.5) },
            &[(TextureSlot::Emission, Texture { transform: tilted, ..Texture::new(2, false) })],
        ),
        (diffuse(1.0), &[]),
    ];
    for (i, (surface, textures)) in uses.into_iter().enumerate() {
        let at = v(-2.4 + 1.6 * (i % 3) as f64, -1.6 + 1.65 * (i / 3) as f64, -5.0);
        let mesh = card(&mut scene, at, 1.5, surface);
        let material = scene.materials.len() - 1;
        scene.materials[material].textures = textures.iter().copied().collect::<BTreeMap<_, _>>();
        if textures.is_empty() {
            scene.meshes[mesh].colors =
                vec![[1.0, 0.2, 0.1, 1.0], [0.2, 1.0, 0.3, 1.0], [0.1, 0.4, 1.0, 1.0], [0.7; 4]];
        }
    }
    scene.quad([v(-5.0, -1.7, -1.0), v(5.0, -1.7, -1.0), v(5.0, -1.7, -12.0), v(-5.0, -1.7, -12.0)], diffuse(0.6));
    scene
}

pub(super) fn coverage() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 3;
    scene.background = [0.25; 3];
    scene.lights.push(Light::Point { position: v(0.5, 1.0, 3.0), power: [400.0; 3] });
    let mut rng = Rng::new(64);
    let texels = Texels::Rgba8(noise(&mut rng, 6, 6, 30));
    scene.images.push(TextureImage { name: "alpha".to_owned(), width: 6, height: 6, texels });
    let texture = BTreeMap::from([(TextureSlot::BaseColor, Texture::new(0, true))]);
    let glowing = Surface { emission: [3.0; 3], two_sided: true, ..diffuse(0.5) };
    let uses = [
        (diffuse(0.8), Coverage::Mask(0.5), true, false),
        (pbr([0.8; 3], 0.0, 0.6), Coverage::Blend, true, false),
        (glowing, Coverage::Blend, true, false),
        (diffuse(0.8), Coverage::Blend, false, false),
        (diffuse(0.8), Coverage::Opaque, false, true),
        (pbr([0.8; 3], 1.0, 0.6), Coverage::Blend, false, true),
    ];
    for (i, (surface, coverage, is_textured, culls_back)) in uses.into_iter().enumerate() {
        let at = v(-2.4 + 1.6 * (i % 3) as f64, -1.5 + 1.6 * (i / 3) as f64, -4.5 - 0.2 * i as f64);
        let mesh = card(&mut scene, at, 1.5, surface);
        let last = scene.materials.len() - 1;
        let material = &mut scene.materials[last];
        (material.coverage, material.culls_back, material.alpha) = (coverage, culls_back, 0.75);
        if is_textured {
            material.textures = texture.clone();
        }
        if i >= 4 {
            // Seen from behind.
            scene.meshes[mesh].triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        if i == 3 {
            scene.meshes[mesh].colors =
                vec![[1.0, 0.5, 0.5, 0.1], [1.0, 1.0, 1.0, 0.9], [0.5, 1.0, 1.0, 0.6], [1.0, 1.0, 0.5, 1.0]];
        }
    }
    scene.quad([v(-6.0, -4.0, -7.0), v(6.0, -4.0, -7.0), v(6.0, 5.0, -7.0), v(-6.0, 5.0, -7.0)], diffuse(0.7));
    scene
}
