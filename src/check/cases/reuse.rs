//! Paths that serve several pixels, and images made from differences between these, against the same without.

use crate::check::lab::Rendered;
use crate::check::scenes::{
    Build, diffuse, divided_room, emitter, emitters, empty, icosphere, mirrored_wall, screened_room, v,
};
use crate::check::statistics::z_score;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::{Gradients, LightSamples, RenderSettings, Renderer, Reuse, SampleMap, Scheduler};
use crate::scene::{Bsdf, Environment, MetallicRoughness, Normals, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "reuse/paths",
        what: "a room with cells at its wall: by the records of the queue, paths serve pixels that may not see their second hits",
        oracle: "each path by itself",
        quantity: "deviation of the image's contrast in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, divided_room(), Meet::Records, [SHARED, ALONE]),
    },
    Case {
        name: "reuse/lanes",
        what: "the same room without a BVH: paths meet in the lanes of a subgroup",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, screened_room(), Meet::Lanes, [SHARED, ALONE]),
    },
    Case {
        name: "reuse/mirrors-paths",
        what: "stripes of mirrors, a ball of glass and a body, depth 3: only light met after as many hits is shared",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, with_body(mirrored_wall(), Normals::Flat), Meet::Records, [SHARED, ALONE]),
    },
    Case {
        name: "reuse/mirrors-lanes",
        what: "the same without the body",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, mirrored_wall(), Meet::Lanes, [SHARED, ALONE]),
    },
    Case {
        name: "reuse/smooth-paths",
        what: "a coarse body with smooth normals: what a pixel's own path may not use, it gets from others",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, with_body(screened_room(), Normals::Smooth), Meet::Records, [SHARED, ALONE]),
    },
    Case {
        name: "reuse/smooth-lanes",
        what: "the same in the lanes of a subgroup",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, with_body(screened_room(), Normals::Smooth), Meet::Lanes, [SHARED, ALONE]),
    },
    Case {
        name: "gradients/paths",
        what: "a room with cells at its wall, made from the differences between its pixels: by the records of the queue",
        oracle: "the same without",
        quantity: "deviation of the image's contrast in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, divided_room(), Meet::Records, [COMPARED, SHARED]),
    },
    Case {
        name: "gradients/lanes",
        what: "the same room without a BVH: paths meet in the lanes of a subgroup",
        oracle: "the same without",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, screened_room(), Meet::Lanes, [COMPARED, SHARED]),
    },
    Case {
        name: "gradients/emitters-paths",
        what: "a room with emitters, which neighbours sample alike, a mirror and glass: by the records of the queue",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, emitters(), Meet::Records, [COMPARED, ALONE]),
    },
    Case {
        name: "gradients/emitters-lanes",
        what: "the same in the lanes of a subgroup",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, emitters(), Meet::Lanes, [COMPARED, ALONE]),
    },
    Case {
        name: "sample-map/paths",
        what: "the room with emitters, whose noisy parts get more samples than others: by the records of the queue",
        oracle: "as many samples everywhere",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, emitters(), Meet::Records, [UNEVEN, COMPARED]),
    },
    Case {
        name: "sample-map/lanes",
        what: "the same in the lanes of a subgroup",
        oracle: "as many samples everywhere",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, emitters(), Meet::Lanes, [UNEVEN, COMPARED]),
    },
    Case {
        name: "sample-map/records",
        what: "the same with a body of smooth normals: by the records of the queue",
        oracle: "each path by itself, as many everywhere",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, with_body(emitters(), Normals::Smooth), Meet::Records, [UNEVEN, ALONE]),
    },
    Case {
        name: "sample-map/two",
        what: "the same of two samples, of which no pixel has less: by the records of the queue",
        oracle: "two samples everywhere",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast(lab, emitters(), Meet::Records, [UNEVEN_OF_TWO, COMPARED]),
    },
    Case {
        name: "light-samples/paths",
        what: "the room with emitters, of which first diffuse hits get four samples: by the records of the queue",
        oracle: "one sample of them",
        quantity: "the same of contrast and of the mean, the larger one",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast_and_mean(lab, emitters(), Meet::Records, [COMPARED, ONE_LIGHT]),
    },
    Case {
        name: "light-samples/lanes",
        what: "the same in the lanes of a subgroup",
        oracle: "one sample of them",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast_and_mean(lab, emitters(), Meet::Lanes, [COMPARED, ONE_LIGHT]),
    },
    Case {
        name: "reuse/parts-paths",
        what: "varnished walls, varnished metal, a smooth body that glows, a mirror and glass: the diffuse parts of surfaces are shared",
        oracle: "each path by itself",
        quantity: "the same of contrast and of the mean",
        threshold: 4.0,
        full_only: false,
        measure: |lab| {
            contrast_and_mean(lab, varnished(with_body(emitters(), Normals::Smooth)), Meet::Records, [COMPARED, ALONE])
        },
    },
    Case {
        name: "reuse/parts-lanes",
        what: "the same in the lanes of a subgroup",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| {
            contrast_and_mean(lab, varnished(with_body(emitters(), Normals::Smooth)), Meet::Lanes, [SHARED, ALONE])
        },
    },
    Case {
        name: "reuse/parts-sky",
        what: "the same surfaces in the open, under a map of light and an emitter",
        oracle: "each path by itself",
        quantity: "the same",
        threshold: 4.0,
        full_only: false,
        measure: |lab| contrast_and_mean(lab, varnished(yard()), Meet::Records, [COMPARED, ALONE]),
    },
];

/// In the open, with a smooth body.
fn yard() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 4;
    scene.quad([v(-4.0, -2.0, 0.0), v(4.0, -2.0, 0.0), v(4.0, -2.0, -8.0), v(-4.0, -2.0, -8.0)], diffuse(0.7));
    scene.quad([v(-4.0, -2.0, -8.0), v(4.0, -2.0, -8.0), v(4.0, 2.0, -8.0), v(-4.0, 2.0, -8.0)], diffuse(0.5));
    scene.quad([v(1.5, 0.0, -6.0), v(2.5, 0.0, -6.0), v(2.5, 0.0, -5.0), v(1.5, 0.0, -5.0)], emitter(6.0));
    let texels: Vec<_> = (0..32).map(|i| [if i % 8 == 2 { 3.0 } else { 0.4 }; 3]).collect();
    let name = "map".to_owned();
    scene.environment = Some(Environment {
        name,
        width: 8,
        height: 4,
        texels: texels.into(),
        rotation: 30.0,
        scale: 1.0,
        visible: true,
    });
    with_body(scene, Normals::Smooth)
}

/// What is diffuse gets varnish or is a varnished metal, and the last material glows.
fn varnished(mut scene: Scene) -> Scene {
    for (i, material) in scene.materials.iter_mut().enumerate() {
        if let Bsdf::Diffuse { reflectance } = material.surface.bsdf {
            let (metallic, roughness) = ([0.0, 0.3][i % 2], [0.25, 0.5, 0.9][i % 3]);
            let model =
                MetallicRoughness { base_color: reflectance, metallic, roughness, ..MetallicRoughness::DEFAULT };
            material.surface.bsdf = Bsdf::MetallicRoughness(model);
        }
    }
    if let Some(last) = scene.materials.last_mut() {
        last.surface.emission = [0.25; 3];
    }
    scene
}

/// With a body of few triangles.
fn with_body(mut scene: Scene, normals: Normals) -> Scene {
    let center = v(0.0, -1.25, -4.5);
    let (positions, triangles) = icosphere(center, 0.7, 1);
    let mesh = scene.mesh(&positions, &triangles, diffuse(0.75));
    if normals == Normals::Smooth {
        mesh.vertex_normals = positions.iter().map(|p| (*p - center).normalize().as_vec3().as_dvec3()).collect();
        mesh.normals = normals;
    }
    scene
}

/// Where the paths of a group meet.
#[derive(Clone, Copy)]
enum Meet {
    /// In the lanes of a subgroup, as they end.
    Lanes,
    /// In the lanes of a subgroup, fetched from memory when all have ended.
    Records,
}

/// How paths serve several pixels.
#[derive(Clone, Copy)]
struct Way {
    reuse: Reuse,
    gradients: Gradients,
    sample_map: SampleMap,
    light_samples: LightSamples,
    /// Per pixel, if not as many as usual.
    samples: Option<u32>,
}

const SHARED: Way = Way {
    reuse: Reuse::Always,
    gradients: Gradients::Off,
    sample_map: SampleMap::Off,
    light_samples: LightSamples::Auto,
    samples: None,
};
const ALONE: Way = Way { reuse: Reuse::Off, light_samples: LightSamples::One, ..SHARED };
const COMPARED: Way = Way { gradients: Gradients::Auto, ..SHARED };
const UNEVEN: Way = Way { sample_map: SampleMap::Auto, ..COMPARED };
const UNEVEN_OF_TWO: Way = Way { samples: Some(2), ..UNEVEN };
const ONE_LIGHT: Way = Way { light_samples: LightSamples::One, ..COMPARED };

const SEEDS: u32 = 12;

/// How far the contrast of the scene's image is from that of one that is made in another way. Contrast is the sum of all
/// pixels, each times how much brighter than the mean it is in a third image, of other seeds.
fn contrast(lab: &Lab, scene: Scene, meet: Meet, ways: [Way; 2]) -> Result<Measured, CheckError> {
    compare(lab, scene, meet, ways, false)
}

/// The same of contrast and of the mean, which tells of light that is lost everywhere.
fn contrast_and_mean(lab: &Lab, scene: Scene, meet: Meet, ways: [Way; 2]) -> Result<Measured, CheckError> {
    compare(lab, scene, meet, ways, true)
}

fn compare(
    lab: &Lab,
    mut scene: Scene,
    meet: Meet,
    [one, another]: [Way; 2],
    and_mean: bool,
) -> Result<Measured, CheckError> {
    // What noise a tile has is told by 25 tiles: in an image of few, all would get the same samples. Nor are there maps of many.
    let (side, few, many) = if one.sample_map == SampleMap::Auto { (96, 8, 64) } else { (32, 40, 1024) };
    scene.size(side, one.samples.unwrap_or(lab.size(few, many) as u32));
    let scheduler = match meet {
        Meet::Lanes => Scheduler::Inline,
        Meet::Records => Scheduler::Queue,
    };
    let mut unused = false;
    let mut images = |way: Way, first_seed: u32| -> Result<Vec<Vec<f64>>, CheckError> {
        let Way { reuse, gradients, sample_map, light_samples, .. } = way;
        let settings =
            RenderSettings { reuse, gradients, sample_map, light_samples, scheduler, ..lab.settings(&scene) };
        let mut renderer = Renderer::new(&lab.context, &scene, &settings)?;
        let (mut compared, mut uneven) = (false, false);
        let mut image = |seed| {
            renderer.set_seed(seed);
            let rendered = Rendered::by(&mut renderer)?;
            compared |= rendered.statistics.gradients;
            uneven |= rendered.film.counts().windows(2).any(|counts| counts[0] != counts[1]);
            Ok(rendered.channel(1))
        };
        let images = (first_seed..first_seed + SEEDS).map(&mut image).collect();
        unused |= (gradients == Gradients::Auto && !compared) || (sample_map == SampleMap::Auto && !uneven);
        images
    };
    let (with, without, other) = (images(one, 0)?, images(another, 0)?, images(another, SEEDS)?);
    let pixels = other[0].len();
    let sums: Vec<f64> = (0..pixels).map(|p| other.iter().map(|image| image[p]).sum()).collect();
    let mean = sums.iter().sum::<f64>() / pixels as f64;
    let contrast = |image: &[f64]| image.iter().zip(&sums).map(|(x, sum)| x * (sum / mean - 1.0)).sum::<f64>();
    if unused {
        return Ok(Measured::new(f64::INFINITY, "no image is made in the way that is compared"));
    }
    if with.iter().zip(&without).all(|(a, b)| a == b) {
        return Ok(Measured::new(f64::INFINITY, "both ways give the same image"));
    }
    // In standard errors, and percent.
    let deviation = |of: &dyn Fn(&[f64]) -> f64| {
        let differences: Vec<f64> = with.iter().zip(&without).map(|(a, b)| of(a) - of(b)).collect();
        let relative = differences.iter().sum::<f64>() / without.iter().map(|image| of(image)).sum::<f64>();
        (z_score(&differences, 0.0).abs(), 100.0 * relative)
    };
    let (of_contrast, percent) = deviation(&contrast);
    let detail = format!("{SEEDS} seeds, {percent:.2}%");
    if !and_mean {
        return Ok(Measured::new(of_contrast, detail));
    }
    let (of_mean, percent) = deviation(&|image| image.iter().sum());
    let worse = if of_mean > of_contrast { of_mean } else { of_contrast };
    Ok(Measured::new(worse, format!("{detail}, mean {percent:.3}%")))
}
