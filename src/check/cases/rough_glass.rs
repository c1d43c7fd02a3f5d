//! Glass of the metallic-roughness model: rough interfaces, thin walls, and what bodies absorb.

use glam::DVec3;

use crate::check::cases::oracle::against_oracle;
use crate::check::probe::{Function, Words};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, emitter, empty, icosphere, v};
use crate::check::statistics::{mean_and_error, relative, worst, z_score};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle::glass::Glass;
use crate::scene::{Bsdf, MetallicRoughness, Normals, Scene, Surface, Texels, Texture, TextureImage, TextureSlot};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "glass/exp",
        what: "e^x for x from −87 to 0",
        oracle: "f64",
        quantity: "worst relative error",
        threshold: 3e-7,
        full_only: false,
        measure: exponential,
    },
    Case {
        name: "glass/rough-formula",
        what: "f·cos of rough glass and thin walls to both sides, from both sides, roughness .3 to 1, ior 1.2 to 2.5",
        oracle: "the formulas in f64, which share the tables of albedos alone",
        quantity: "worst relative error, where f·cos is above 1e-3",
        threshold: 1e-3,
        full_only: false,
        measure: formula,
    },
    Case {
        name: "glass/rough-reciprocity",
        what: "n² f(wo, wi) and n² f(wi, wo) of the same, n the index on the side of the first direction",
        oracle: "each other",
        quantity: "worst relative difference, where f·cos is above 1e-3",
        threshold: 5e-4,
        full_only: false,
        measure: reciprocity,
    },
    Case {
        name: "glass/rough-furnace",
        what: "spheres of glass, ior 1.1, 1.5 and 2.5, and of thin walls, five roughnesses, under a sky of radiance 1, also from within",
        oracle: "1",
        quantity: "worst deviation of a sphere's mean, over 1e-3 and four standard errors",
        threshold: 1.0,
        full_only: false,
        measure: furnace,
    },
    Case {
        name: "glass/wall",
        what: "light through thin tinted walls, smooth and nearly smooth, at 0 and 60 degrees",
        oracle: "T² A/(1 − A² R²)",
        quantity: "worst deviation in standard errors",
        threshold: 4.5,
        full_only: false,
        measure: wall,
    },
    Case {
        name: "glass/absorbing-slab",
        what: "light through an absorbing slab at normal incidence, ior 1.5",
        oracle: "T = (1 − R)² a/(1 − R² a²), a what one way leaves",
        quantity: "worst deviation in standard errors",
        threshold: 4.5,
        full_only: false,
        measure: slab,
    },
    Case {
        name: "glass/amber",
        what: "bodies and lamps within absorbing glass, rough, smooth, with flat and smooth normals, and half opaque; a tinted wall",
        oracle: "path tracer in f64",
        quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &amber()),
    },
];

fn of(model: MetallicRoughness) -> Surface {
    Surface { bsdf: Bsdf::MetallicRoughness(model), ..diffuse(0.0) }
}

/// Clear glass.
fn body(ior: f64, roughness: f64) -> MetallicRoughness {
    MetallicRoughness { metallic: 0.0, roughness, ior, transmission: 1.0, has_volume: true, ..Default::default() }
}

fn thin(tint: [f64; 3], roughness: f64) -> MetallicRoughness {
    MetallicRoughness { base_color: tint, has_volume: false, ..body(1.5, roughness) }
}

fn exponential(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(66);
    let inputs: Vec<_> = (0..1 << 16).map(|_| Words::of(&[rng.between(-87.0, 0.0) as f32])).collect();
    let outputs = lab.function_in(&amber(), Function::Exp, &inputs)?;
    let error = |(i, o): (&Words, &Words)| relative(f64::from(o.x[0]), f64::from(i.x[0]).exp());
    Ok(Measured::new(worst(inputs.iter().zip(&outputs).map(error)), format!("{} numbers", inputs.len())))
}

/// An interface and two directions, of which the first is above it with azimuth 0; some of them grazing.
#[derive(Clone, Copy)]
struct Pair {
    glass: Glass,
    mu: f32,
    wi: [f32; 3],
}

impl Pair {
    fn random(rng: &mut Rng) -> Self {
        let number = |rng: &mut Rng| (rng.bits() >> 8) as f32 * 2f32.powi(-24);
        let cosine = |rng: &mut Rng| 0.05 + 0.95 * number(rng).powi(2);
        let (mu, z) = (cosine(rng), cosine(rng));
        let azimuth = std::f32::consts::TAU * number(rng);
        let r = (1.0 - z * z).sqrt();
        let ior = 1.2 + 1.3 * number(rng);
        let model = MetallicRoughness {
            base_color: [f64::from(number(rng)); 3],
            roughness: f64::from(0.3 + 0.7 * number(rng)),
            has_volume: rng.below(3) > 0,
            ..body(f64::from(ior), 1.0)
        };
        let glass = Glass::of(&model, rng.below(2) == 0);
        let glass = Glass { eta: f64::from(glass.eta as f32), ..glass };
        let z = if rng.below(2) == 0 { z } else { -z };
        Self { glass, mu, wi: [r * azimuth.cos(), r * azimuth.sin(), z] }
    }

    fn words(&self) -> Words {
        let Glass { tint, roughness, eta, is_wall, .. } = self.glass;
        let mu = if is_wall { -self.mu } else { self.mu };
        let [x, y, z] = self.wi;
        Words { x: [eta as f32, roughness as f32, tint.x as f32, 1.0], y: [x, y, z, mu] }
    }

    fn exact(&self) -> f64 {
        let mu = f64::from(self.mu);
        self.glass.eval(v((1.0 - mu * mu).sqrt(), 0.0, mu), DVec3::from(self.wi.map(f64::from)).normalize()).x
    }

    /// The same angles with the directions exchanged.
    fn back(&self) -> Self {
        let [x, y, z] = self.wi;
        let (r, sine) = (x.hypot(y), (1.0 - self.mu * self.mu).sqrt());
        let crosses = z < 0.0;
        let bends = crosses && !self.glass.is_wall;
        let eta = if bends { 1.0 / self.glass.eta } else { self.glass.eta };
        let mu = if crosses { -self.mu } else { self.mu };
        Self { glass: Glass { eta, ..self.glass }, mu: z.abs(), wi: [sine * x / r, -sine * y / r, mu] }
    }
}

fn pairs(lab: &Lab, seed: u64) -> Vec<Pair> {
    let mut rng = Rng::new(seed);
    (0..lab.size(1 << 16, 1 << 20)).map(|_| Pair::random(&mut rng)).collect()
}

fn values(lab: &Lab, pairs: &[Pair]) -> Result<Vec<f64>, CheckError> {
    let inputs: Vec<_> = pairs.iter().map(Pair::words).collect();
    Ok(lab.function_in(&amber(), Function::Glass, &inputs)?.iter().map(|out| f64::from(out.x[0])).collect())
}

fn formula(lab: &Lab) -> Result<Measured, CheckError> {
    let pairs = pairs(lab, 67);
    let error = |(pair, out): (&Pair, &f64)| {
        let exact = pair.exact();
        if exact > 1e-3 { relative(*out, exact) } else { 0.0 }
    };
    let off = worst(pairs.iter().zip(&values(lab, &pairs)?).map(error));
    Ok(Measured::new(off, format!("{} pairs of directions", pairs.len())))
}

fn reciprocity(lab: &Lab) -> Result<Measured, CheckError> {
    let pairs = pairs(lab, 68);
    let back: Vec<_> = pairs.iter().map(Pair::back).collect();
    let (there, back) = (values(lab, &pairs)?, values(lab, &back)?);
    let off = worst(pairs.iter().zip(there.iter().zip(&back)).map(|(pair, (there, back))| {
        let Pair { glass, mu, wi: [.., z] } = *pair;
        let index2 = if z < 0.0 && !glass.is_wall { glass.eta * glass.eta } else { 1.0 };
        let (a, b) = (there / f64::from(z.abs()), index2 * back / f64::from(mu));
        if *there > 1e-3 { relative(a, b) } else { 0.0 }
    }));
    Ok(Measured::new(off, format!("{} pairs of directions", pairs.len())))
}

fn furnace(lab: &Lab) -> Result<Measured, CheckError> {
    let mut off: f64 = 0.0;
    let mut at = String::new();
    let mut spheres = 0;
    for roughness in [0.0, 0.2, 0.45, 0.7, 1.0] {
        let bodies = [1.1, 1.5, 2.5].map(|ior| body(ior, roughness));
        for model in bodies.into_iter().chain([thin([1.0; 3], roughness)]) {
            for within in [false, true] {
                let mut scene = empty();
                scene.background = [1.0; 3];
                scene.integrator.max_depth = 4096;
                scene.camera.horizontal_fov = 20.0;
                scene.sphere(v(0.25, -0.125, if within { -0.5 } else { -4.0 }), 1.5, of(model));
                scene.size(16, lab.size(256, 4096) as u32);
                let (mean, error) = mean_and_error(&lab.render(&scene)?.channel(1));
                let here = (mean - 1.0).abs() / (1e-3 + 4.0 * error);
                if here > off {
                    (off, at) = (here, format!("{mean:.5} at roughness {roughness}, ior {}", model.ior));
                }
                spheres += 1;
            }
        }
    }
    Ok(Measured::new(off, format!("{spheres} spheres, 256 pixels each; worst {at}")))
}

/// A camera before a plane through which light comes from a wall of radiance 1.
fn before_light(lab: &Lab) -> Scene {
    let mut scene = empty();
    scene.quad([v(-6.0, -6.0, -9.0), v(6.0, -6.0, -9.0), v(6.0, 6.0, -9.0), v(-6.0, 6.0, -9.0)], emitter(1.0));
    scene.camera.horizontal_fov = 0.5;
    scene.integrator.max_depth = 64;
    scene.size(32, lab.size(256, 16384) as u32);
    scene
}

fn wall(lab: &Lab) -> Result<Measured, CheckError> {
    let mut off: f64 = 0.0;
    let tint = [1.0, 0.7, 0.25];
    for (degrees, roughness) in [(0.0f64, 0.0), (60.0, 0.0), (0.0, 0.05), (60.0, 0.05)] {
        let mut scene = before_light(lab);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let corner = |x: f64, y: f64| v(cos * x, y, -4.0 - sin * x);
        scene.quad(
            [corner(-2.0, -2.0), corner(2.0, -2.0), corner(2.0, 2.0), corner(-2.0, 2.0)],
            of(thin(tint, roughness)),
        );
        let image = lab.render(&scene)?;
        let r = crate::oracle::fresnel(cos, 1.5);
        for (channel, a) in tint.into_iter().enumerate() {
            let expected = (1.0 - r).powi(2) * a / (1.0 - (a * r).powi(2));
            let values = image.channel(channel);
            let (mean, error) = mean_and_error(&values);
            // Of what is not quite smooth the mean over directions is not the value in the middle.
            let slack = if roughness > 0.0 { 1e-3 } else { 1e-6 };
            off = off.max((mean - expected).abs() / (error + slack));
        }
    }
    Ok(Measured::new(off, "4 walls, 3 tints"))
}

fn slab(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = before_light(lab);
    let (thickness, left) = (0.5, [0.9, 0.5, 0.1]);
    // On a length of 0.25.
    let model = MetallicRoughness {
        attenuation_color: left.map(|a: f64| a.sqrt()),
        attenuation_distance: thickness / 2.0,
        ..body(1.5, 0.0)
    };
    scene.cuboid(v(-50.0, -50.0, -2.0 - thickness), v(50.0, 50.0, -2.0), of(model));
    let image = lab.render(&scene)?;
    let r = 0.04f64;
    let deviation =
        |(channel, a): (usize, f64)| z_score(&image.channel(channel), (1.0 - r).powi(2) * a / (1.0 - (r * a).powi(2)));
    let off = worst(left.into_iter().enumerate().map(deviation));
    Ok(Measured::new(off, "3 channels"))
}

/// Bodies of glass under a lamp and a sky, and what is in them.
fn amber() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 10;
    scene.background = [0.5, 0.75, 1.0];
    scene.quad([v(-5.0, -1.5, -1.0), v(5.0, -1.5, -1.0), v(5.0, -1.5, -12.0), v(-5.0, -1.5, -12.0)], diffuse(0.6));
    scene.quad([v(-2.0, 3.0, -7.0), v(-2.0, 3.0, -5.0), v(1.0, 3.0, -5.0), v(1.0, 3.0, -7.0)], emitter(3.0));
    let orange = |roughness: f64| MetallicRoughness {
        attenuation_color: [0.9, 0.5, 0.1],
        attenuation_distance: 0.8,
        ..body(1.45, roughness)
    };
    // A ball with two balls, a lamp and a point in it.
    scene.sphere(v(-1.5, -0.2, -5.5), 1.25, of(orange(0.0)));
    scene.sphere(v(-1.9, -0.4, -5.25), 0.4, diffuse(0.8));
    scene.sphere(v(-1.1, -0.4, -5.75), 0.3, emitter(4.0));
    scene.light(v(-1.6, 0.4, -5.2), 40.0);
    // Rough meshes.
    for (i, model) in [orange(0.5), MetallicRoughness { transmission: 0.5, base_color: [0.8, 0.9, 0.4], ..orange(0.3) }]
        .into_iter()
        .enumerate()
    {
        let center = v(0.9 + 1.4 * i as f64, -0.7 + 0.6 * i as f64, -5.0 - 0.5 * i as f64);
        let (positions, triangles) = icosphere(center, 0.75, 1);
        let mesh = scene.mesh(&positions, &triangles, of(model));
        if i == 1 {
            mesh.vertex_normals = positions.iter().map(|p| (*p - center).normalize().as_vec3().as_dvec3()).collect();
            mesh.normals = Normals::Smooth;
        }
    }
    scene.sphere(v(0.9, -0.7, -5.0), 0.3, diffuse(0.5));
    scene.quad(
        [v(0.0, -1.0, -3.5), v(1.0, -1.0, -3.75), v(1.0, 1.0, -3.75), v(0.0, 1.0, -3.5)],
        of(thin([0.5, 0.9, 0.6], 0.4)),
    );
    // One whose transmission is a texture's.
    let texels = Texels::Rgba8([0, 80, 160, 255].map(|code| [code, 255, 255, 255]).to_vec());
    scene.images.push(TextureImage { name: "2 × 2".to_owned(), width: 2, height: 2, texels });
    let corners = [v(-3.2, -1.4, -4.5), v(-2.0, -1.4, -4.5), v(-2.0, 0.4, -4.5), v(-3.2, 0.4, -4.5)];
    let mesh = scene.mesh(&corners, &[[0, 1, 2], [0, 2, 3]], of(thin([0.9, 0.6, 0.5], 0.0)));
    mesh.uvs[0] = vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    if let Some(material) = scene.materials.last_mut() {
        material.textures.insert(TextureSlot::Transmission, Texture::new(0, false));
    }
    scene
}
