//! Layers over the metallic-roughness model, and dielectrics whose reflection differs from point to point.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use glam::DVec3;

use crate::check::cases::materials::{card, noise, pbr, random_pair, smooth_ball};
use crate::check::cases::oracle::against_oracle;
use crate::check::probe::{Function, Words};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, emitter, empty, v};
use crate::check::statistics::{chi_squared_p, least, mean_and_error, relative, worst};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle::layered;
use crate::oracle::layered::Local;
use crate::scene::{Bsdf, MetallicRoughness, Scene, Surface, Texels, Texture, TextureImage, TextureSlot};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "materials/layer-formula",
        what: "f·cos of layers over the metallic-roughness model, roughness .3 to 1, up to 87 degrees",
        oracle: "the formulas in f64, which share the tables of albedos alone",
        quantity: "worst relative error, where f·cos is above 1e-3",
        threshold: 5e-4,
        full_only: false,
        measure: formula,
    },
    Case {
        name: "materials/layer-reciprocity",
        what: "f(wo, wi) and f(wi, wo) with layers",
        oracle: "each other",
        quantity: "worst relative difference, where f·cos is above 1e-3",
        threshold: 2e-5,
        full_only: false,
        measure: reciprocity,
    },
    Case {
        name: "materials/layer-density",
        what: "directions that are drawn from layers and what is below, in 8 × 16 cells, and the mean of their weights",
        oracle: "the density and f·cos, integrated over cells",
        quantity: "least p-value (χ²), Šidák-corrected, and deviations of means over four standard errors: 1 over p/.001, or that",
        threshold: 1.0,
        full_only: false,
        measure: density,
    },
    Case {
        name: "materials/layer-furnace",
        what: "coats of four roughnesses and sheen of four over white: diffuse, dielectric and metal, under a sky of radiance 1",
        oracle: "1 over what is diffuse; at most 1, and below coats at least .95, over the others",
        quantity: "worst deviation of a sphere's mean, over 5e-4 and four standard errors",
        threshold: 1.0,
        full_only: false,
        measure: furnace,
    },
    Case {
        name: "materials/coats",
        what: "coated bodies, smooth and rough, under a point, an emitter and a sky",
        oracle: "path tracer in f64",
        quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &bodies(&COATS.map(surface))),
    },
    Case {
        name: "materials/sheen",
        what: "bodies with sheen over plastic, metal and what is diffuse, one of them below a coat",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &bodies(&SHEENS.map(surface))),
    },
    Case {
        name: "materials/anisotropy",
        what: "anisotropic metal and plastic, spheres and meshes without tangents, one of them below a coat",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &bodies(&ANISOTROPIC.map(surface))),
    },
    Case {
        name: "materials/layer-frames",
        what: "cards of anisotropic metal, turned, and of black plastic below a coat with normals of its own, under a point alone",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &layer_frames()),
    },
    Case {
        name: "materials/anisotropic-furnace",
        what: "white anisotropic metal and dielectric of three roughnesses and strengths, under a sky of radiance 1",
        oracle: "1",
        quantity: "worst deviation of a sphere's mean, over 3e-3 and four standard errors",
        threshold: 1.0,
        full_only: false,
        measure: anisotropic_furnace,
    },
    Case {
        name: "materials/layer-textures",
        what: "cards with textures of the strength, the roughness and the normals of coats, of sheen and of anisotropy",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &layer_textures()),
    },
    Case {
        name: "materials/specular-textures",
        what: "cards of plastic whose reflection has textures of strength, of colour, and of both",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &specular_textures()),
    },
];

/// A dielectric over a coloured base.
const PLASTIC: MetallicRoughness =
    MetallicRoughness { base_color: [0.8, 0.5, 0.3], metallic: 0.0, roughness: 0.5, ..MetallicRoughness::DEFAULT };

const COATS: [MetallicRoughness; 4] = [
    MetallicRoughness { coat: 1.0, coat_roughness: 0.15, ..PLASTIC },
    MetallicRoughness { coat: 1.0, coat_roughness: 0.4, metallic: 1.0, ..PLASTIC },
    MetallicRoughness { coat: 0.5, coat_roughness: 0.7, roughness: 0.2, ..PLASTIC },
    MetallicRoughness { coat: 0.8, coat_roughness: 0.3, metallic: 0.5, roughness: 1.0, ..PLASTIC },
];

const SHEENS: [MetallicRoughness; 4] = [
    MetallicRoughness { sheen_color: [0.9, 0.6, 0.3], sheen_roughness: 0.6, ..PLASTIC },
    MetallicRoughness { sheen_color: [1.0; 3], sheen_roughness: 0.3, specular: 0.0, ..PLASTIC },
    MetallicRoughness { sheen_color: [0.2, 0.6, 1.0], sheen_roughness: 1.0, metallic: 1.0, ..PLASTIC },
    MetallicRoughness { sheen_color: [1.0, 0.9, 0.5], sheen_roughness: 0.5, coat: 1.0, coat_roughness: 0.3, ..PLASTIC },
];

const ANISOTROPIC: [MetallicRoughness; 4] = [
    MetallicRoughness { anisotropy: 0.8, roughness: 0.3, metallic: 1.0, ..PLASTIC },
    MetallicRoughness { anisotropy: 0.9, anisotropy_rotation: 0.7, roughness: 0.3, metallic: 1.0, ..PLASTIC },
    MetallicRoughness { anisotropy: 1.0, anisotropy_rotation: 2.0, roughness: 0.4, ..PLASTIC },
    MetallicRoughness { anisotropy: 0.6, metallic: 0.5, coat: 0.7, coat_roughness: 0.4, ..PLASTIC },
];

fn surface(model: MetallicRoughness) -> Surface {
    Surface { bsdf: Bsdf::MetallicRoughness(model), ..pbr([0.0; 3], 0.0, 0.0) }
}

/// Four bodies on a floor.
pub(super) fn bodies(surfaces: &[Surface; 4]) -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 4;
    scene.background = [0.5, 0.75, 1.0];
    scene.light(v(2.0, 4.0, -2.0), 150.0);
    scene.quad([v(-2.0, 3.0, -7.0), v(-2.0, 3.0, -5.0), v(0.0, 3.0, -5.0), v(0.0, 3.0, -7.0)], emitter(6.0));
    scene.quad([v(-5.0, -1.0, -1.0), v(5.0, -1.0, -1.0), v(5.0, -1.0, -12.0), v(-5.0, -1.0, -12.0)], diffuse(0.5));
    for (i, &surface) in surfaces.iter().enumerate() {
        let center = v(-2.25 + 1.5 * i as f64, -0.3, -6.0);
        if i % 2 == 0 {
            scene.sphere(center, 0.7, surface);
        } else {
            smooth_ball(&mut scene, center, 0.7, surface);
        }
    }
    scene
}

/// A random model with layers, by six bits each, and two directions above it of which the first has azimuth 0.
struct Layered {
    model: MetallicRoughness,
    bits: u32,
    mu: f32,
    wi: [f32; 3],
}

impl Layered {
    fn random(rng: &mut Rng) -> Self {
        let (base, mu, wi) = random_pair(rng);
        // Of what is smoother the rounding of directions decides.
        let rough = 19 + (rng.bits() >> 8) % 45;
        let any = |rng: &mut Rng| rng.bits() >> 8;
        // One kind of layer or two, and anisotropy of half of them.
        let some = |rng: &mut Rng, of: u32| if any(rng) % 8 < of { any(rng) & 63 } else { 0 };
        let (coat, sheen, anisotropy) = (some(rng, 6), some(rng, 4), some(rng, 4));
        let bits = coat | rough << 6 | sheen << 12 | (19 + any(rng) % 45) << 18 | anisotropy << 24;
        let sixth = |n: u32| f64::from(bits >> (6 * n) & 63) / 63.0;
        let model = MetallicRoughness {
            coat: sixth(0),
            coat_roughness: sixth(1),
            sheen_color: [sixth(2); 3],
            sheen_roughness: sixth(3),
            anisotropy: sixth(4),
            ..base
        };
        Self { model, bits, mu, wi }
    }

    fn words(&self, mu: f32, y: [f32; 3]) -> Words {
        let [base, ..] = self.model.base_color;
        let x = [self.model.metallic as f32, self.model.roughness as f32, base as f32, mu];
        Words { x, y: [y[0], y[1], y[2], f32::from_bits(self.bits)] }
    }
}

/// A scene for which a kernel has all layers.
fn kernel_scene() -> Scene {
    let [.., last] = ANISOTROPIC;
    let models = [COATS[0], SHEENS[0], last, PLASTIC];
    bodies(&models.map(surface))
}

fn formula(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(67);
    let pairs: Vec<_> = (0..lab.size(1 << 14, 1 << 18)).map(|_| Layered::random(&mut rng)).collect();
    let inputs: Vec<_> = pairs.iter().map(|pair| pair.words(pair.mu, pair.wi)).collect();
    let outputs = lab.function_in(&kernel_scene(), Function::Layers, &inputs)?;
    let error = |(pair, out): (&Layered, &Words)| {
        let mu = f64::from(pair.mu);
        let local = |w: DVec3| Local { base: w, coat: w };
        let wo = v((1.0 - mu * mu).sqrt(), 0.0, mu);
        let wi = DVec3::from(pair.wi.map(f64::from)).normalize();
        let exact = layered::eval(&pair.model, local(wo), local(wi)).x;
        if exact > 1e-3 { relative(f64::from(out.x[0]), exact) } else { 0.0 }
    };
    let off = worst(pairs.iter().zip(&outputs).map(error));
    Ok(Measured::new(off, format!("{} pairs of directions", pairs.len())))
}

fn reciprocity(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(68);
    // Isotropic ones: to exchange the directions is to turn both.
    let isotropic = |pair: Layered| Layered { bits: pair.bits & 0xff_ffff, ..pair };
    let pairs: Vec<_> = (0..lab.size(1 << 16, 1 << 20)).map(|_| isotropic(Layered::random(&mut rng))).collect();
    let there: Vec<_> = pairs.iter().map(|pair| pair.words(pair.mu, pair.wi)).collect();
    // The same angle between both, with the azimuth of the other one 0.
    let turned = |pair: &Layered| {
        let [x, y, z] = pair.wi;
        let r = x.hypot(y);
        let sine = (1.0 - pair.mu * pair.mu).sqrt();
        pair.words(z, [sine * x / r, -sine * y / r, pair.mu])
    };
    let back: Vec<_> = pairs.iter().map(turned).collect();
    let scene = kernel_scene();
    let (there, back) =
        (lab.function_in(&scene, Function::Layers, &there)?, lab.function_in(&scene, Function::Layers, &back)?);
    let off = worst(pairs.iter().zip(there.iter().zip(&back)).map(|(pair, (a, b))| {
        let z = pair.wi[2];
        let (a, b) = (f64::from(a.x[0] / z), f64::from(b.x[0] / pair.mu));
        if a * f64::from(z) > 1e-3 { relative(a, b) } else { 0.0 }
    }));
    Ok(Measured::new(off, format!("{} pairs of directions", pairs.len())))
}

/// A direction of the upper hemisphere, by cells of equal solid angle.
fn of_square([s, t]: [f64; 2]) -> [f32; 3] {
    let (sin, cos) = (TAU * t).sin_cos();
    let r = (1.0 - s * s).max(0.0).sqrt();
    [r * cos, r * sin, s].map(|x| x as f32)
}

fn density(lab: &Lab) -> Result<Measured, CheckError> {
    const CELLS: [usize; 2] = [8, 16];
    const FINE: usize = 32;
    let mut rng = Rng::new(69);
    let scene = kernel_scene();
    let (tests, samples) = (8, lab.size(1 << 14, 1 << 18));
    let number = |rng: &mut Rng| (rng.bits() >> 8) as f32 * 2f32.powi(-24);
    let (mut p_values, mut off) = (Vec::new(), 0.0f64);
    for _ in 0..tests {
        let layered = Layered::random(&mut rng);
        let inputs: Vec<_> =
            (0..samples).map(|_| layered.words(layered.mu, [number(&mut rng), number(&mut rng), 0.0])).collect();
        let drawn = lab.function_in(&scene, Function::LayerSample, &inputs)?;
        let [rows, columns] = CELLS.map(|n| n * FINE);
        let places = (0..rows * columns).map(|i| {
            of_square([(0.5 + (i / columns) as f64) / rows as f64, (0.5 + (i % columns) as f64) / columns as f64])
        });
        let inputs: Vec<_> = places.map(|wi| layered.words(layered.mu, wi)).collect();
        let values = lab.function_in(&scene, Function::Layers, &inputs)?;
        let mut counts = vec![0.0; CELLS[0] * CELLS[1] + 1];
        let mut expected = vec![0.0; counts.len()];
        for sample in &drawn {
            let [x, y, z, _] = sample.x.map(f64::from);
            let azimuth = (y.atan2(x) / TAU).rem_euclid(1.0);
            let cell = |u: f64, n: usize| ((u * n as f64) as usize).min(n - 1);
            // Below the surface there is one more.
            let place =
                if z <= 0.0 { counts.len() - 1 } else { cell(z, CELLS[0]) * CELLS[1] + cell(azimuth, CELLS[1]) };
            counts[place] += 1.0;
        }
        let solid_angle = TAU / (rows * columns) as f64;
        let mut albedo = 0.0;
        for (i, value) in values.iter().enumerate() {
            let cell = (i / columns / FINE) * CELLS[1] + i % columns / FINE;
            expected[cell] += samples as f64 * solid_angle * f64::from(value.x[3]);
            albedo += solid_angle * f64::from(value.x[0]);
        }
        let above: f64 = expected.iter().sum();
        let last = expected.len() - 1;
        expected[last] = (samples as f64 - above).max(0.0);
        p_values.push(chi_squared_p(&counts, &expected));
        let weights: Vec<_> = drawn.iter().map(|sample| f64::from(sample.y[0])).collect();
        let (mean, error) = mean_and_error(&weights);
        off = off.max((mean - albedo).abs() / (4.0 * error + 1e-3));
    }
    let p = 1.0 - (1.0 - least(&p_values)).powi(tests);
    let detail = format!("{tests} models of {samples} directions, p = {p:.3}, means off by {off:.2}");
    Ok(Measured::new(off.max(0.001 / p), detail))
}

/// The mean of a white sphere under a sky of radiance 1, and its standard error.
fn in_furnace(lab: &Lab, model: MetallicRoughness) -> Result<(f64, f64), CheckError> {
    let mut scene = empty();
    scene.background = [1.0; 3];
    scene.camera.horizontal_fov = 20.0;
    scene.sphere(v(0.25, -0.125, -4.0), 1.5, surface(MetallicRoughness { base_color: [1.0; 3], ..model }));
    scene.size(32, lab.size(256, 4096) as u32);
    Ok(mean_and_error(&lab.render(&scene)?.channel(1)))
}

fn furnace(lab: &Lab) -> Result<Measured, CheckError> {
    let (mut off, mut lowest) = (0.0f64, 1.0f64);
    for sheen_roughness in [0.15, 0.3, 0.6, 1.0] {
        let model = MetallicRoughness { sheen_color: [1.0; 3], sheen_roughness, ..PLASTIC };
        let (mean, error) = in_furnace(lab, MetallicRoughness { specular: 0.0, ..model })?;
        off = off.max((mean - 1.0).abs() / (5e-4 + 4.0 * error));
        for over in [model, MetallicRoughness { metallic: 1.0, ..model }, MetallicRoughness { coat: 1.0, ..model }] {
            let (mean, error) = in_furnace(lab, over)?;
            off = off.max((mean - 1.0) / (5e-4 + 4.0 * error));
        }
    }
    for coat_roughness in [0.0, 0.2, 0.5, 1.0] {
        let model = MetallicRoughness { coat: 1.0, coat_roughness, ..PLASTIC };
        let (mean, error) = in_furnace(lab, MetallicRoughness { specular: 0.0, ..model })?;
        off = off.max((mean - 1.0).abs() / (5e-4 + 4.0 * error));
        for (metallic, roughness) in [(0.0, 0.2), (0.0, 0.7), (1.0, 0.1), (1.0, 0.8)] {
            let (mean, error) = in_furnace(lab, MetallicRoughness { metallic, roughness, ..model })?;
            off = off.max((mean - 1.0).max(0.95 - mean) / (5e-4 + 4.0 * error));
            lowest = lowest.min(mean);
        }
    }
    Ok(Measured::new(off, format!("36 spheres, 1024 pixels each; the darkest coated one has {lowest:.4}")))
}

fn anisotropic_furnace(lab: &Lab) -> Result<Measured, CheckError> {
    let mut off: f64 = 0.0;
    for (roughness, anisotropy) in [(0.2, 1.0), (0.5, 0.6), (0.8, 0.9)] {
        for metallic in [0.0, 1.0] {
            let (mean, error) = in_furnace(lab, MetallicRoughness { metallic, roughness, anisotropy, ..PLASTIC })?;
            off = off.max((mean - 1.0).abs() / (3e-3 + 4.0 * error));
        }
    }
    Ok(Measured::new(off, "6 spheres, 1024 pixels each"))
}

/// Six cards with textures, seen under a sky and a point.
fn cards(uses: [(MetallicRoughness, &[TextureSlot]); 6]) -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 3;
    scene.background = [0.5, 0.6, 0.7];
    scene.light(v(1.0, 3.0, 0.0), 150.0);
    let mut rng = Rng::new(66);
    let mut normals = noise(&mut rng, 5, 4, 0);
    // They lean by up to a half.
    normals.iter_mut().for_each(|pixel| *pixel = [64 + pixel[0] / 2, 64 + pixel[1] / 2, 250, 255]);
    for texels in [noise(&mut rng, 5, 4, 0), normals] {
        let image = TextureImage { name: String::new(), width: 5, height: 4, texels: Texels::Rgba8(texels) };
        scene.images.push(image);
    }
    for (i, (model, slots)) in uses.into_iter().enumerate() {
        let at = v(-2.4 + 1.6 * (i % 3) as f64, -1.6 + 1.65 * (i / 3) as f64, -5.0);
        card(&mut scene, at, 1.5, surface(model));
        let texture = |slot: TextureSlot| match slot {
            TextureSlot::Normal | TextureSlot::CoatNormal => Texture::new(1, false),
            TextureSlot::SpecularColor | TextureSlot::SheenColor => Texture { uv_set: 1, ..Texture::new(0, true) },
            _ => Texture::new(0, false),
        };
        if let Some(material) = scene.materials.last_mut() {
            material.textures = slots.iter().map(|&slot| (slot, texture(slot))).collect::<BTreeMap<_, _>>();
        }
    }
    scene
}

fn layer_textures() -> Scene {
    let coated = MetallicRoughness { coat: 1.0, coat_roughness: 1.0, ..PLASTIC };
    let metal = MetallicRoughness { metallic: 1.0, ..coated };
    cards([
        (coated, &[TextureSlot::Coat]),
        (metal, &[TextureSlot::CoatRoughness]),
        (MetallicRoughness { coat_roughness: 0.4, ..coated }, &[TextureSlot::CoatNormal]),
        (coated, &[TextureSlot::Coat, TextureSlot::CoatRoughness, TextureSlot::Normal, TextureSlot::CoatNormal]),
        (
            MetallicRoughness { sheen_color: [1.0, 0.8, 0.6], sheen_roughness: 1.0, ..PLASTIC },
            &[TextureSlot::SheenColor, TextureSlot::SheenRoughness],
        ),
        (
            MetallicRoughness { anisotropy: 1.0, anisotropy_rotation: 0.5, metallic: 1.0, ..PLASTIC },
            &[TextureSlot::Anisotropy],
        ),
    ])
}

/// All that is seen is direct light of a point, which has no noise: a highlight in another place is found.
fn layer_frames() -> Scene {
    let black = MetallicRoughness { base_color: [0.0; 3], specular: 0.0, ..PLASTIC };
    let coated = |coat_roughness| MetallicRoughness { coat: 1.0, coat_roughness, ..black };
    let turned = |anisotropy_rotation, roughness| MetallicRoughness {
        anisotropy: 1.0,
        anisotropy_rotation,
        metallic: 1.0,
        roughness,
        ..PLASTIC
    };
    let mut scene = cards([
        (turned(0.8, 0.3), &[]),
        (turned(2.2, 0.4), &[]),
        (turned(1.0, 0.5), &[TextureSlot::Anisotropy]),
        (coated(0.3), &[TextureSlot::CoatNormal]),
        (coated(0.5), &[TextureSlot::CoatNormal]),
        (coated(0.4), &[TextureSlot::CoatNormal, TextureSlot::Normal]),
    ]);
    scene.background = [0.0; 3];
    scene.integrator.max_depth = 1;
    scene
}

fn specular_textures() -> Scene {
    let model = |specular, specular_color, roughness| MetallicRoughness {
        base_color: [0.3, 0.2, 0.1],
        ior: 2.0,
        specular,
        specular_color,
        roughness,
        ..PLASTIC
    };
    let both: &[TextureSlot] = &[TextureSlot::Specular, TextureSlot::SpecularColor];
    cards([
        (model(1.0, [1.0; 3], 0.4), &both[..1]),
        (model(0.8, [1.0, 0.5, 0.2], 0.7), &both[1..]),
        (model(0.9, [12.0, 8.0, 4.0], 0.5), both),
        (model(0.9, [12.0, 8.0, 4.0], 0.5), &[]),
        (model(1.0, [1.0; 3], 0.6), both),
        (MetallicRoughness { metallic: 0.5, ..model(1.0, [0.5, 1.0, 1.0], 0.5) }, both),
    ])
}
