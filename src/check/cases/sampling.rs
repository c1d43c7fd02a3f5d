//! Arithmetic that everything rests on, and the distributions of the samplers.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::check::probe::{Function, Words};
use crate::check::rng::Rng;
use crate::check::scenes::room;
use crate::check::statistics::{chi_squared_p, correlation, kolmogorov, least, worst};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::RenderSettings;
use crate::scene::PixelFilter;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "sampling/error-free",
        what: "two_sum and two_product",
        oracle: "f64: sum + error is exact",
        quantity: "pairs that are not exact",
        threshold: 0.0,
        full_only: false,
        measure: error_free,
    },
    Case {
        name: "sampling/cos-sin",
        what: "cos and sin of 2πu for u in [0, 1]",
        oracle: "f64",
        quantity: "worst absolute error",
        threshold: 4e-7,
        full_only: false,
        measure: cos_sin,
    },
    Case {
        name: "sampling/log",
        what: "logarithm on (0, 1], dense near 1",
        oracle: "f64",
        quantity: "worst error over max(|ln x|, 0.5)",
        threshold: 5e-7,
        full_only: false,
        measure: log,
    },
    Case {
        name: "sampling/atan",
        what: "arc tangent of both signs, 0, from 2^-30 to 2^30 and infinity",
        oracle: "f64",
        quantity: "worst absolute error",
        threshold: 4e-7,
        full_only: false,
        measure: atan,
    },
    Case {
        name: "sampling/basis",
        what: "bases around random and axis-aligned normals",
        oracle: "orthonormal and right-handed",
        quantity: "worst deviation",
        threshold: 5e-7,
        full_only: false,
        measure: basis,
    },
    Case {
        name: "sampling/domain",
        what: "directions and filter offsets at u = 0, 1 − 2^-24 and between",
        oracle: "finite, unit length, on the normal's side",
        quantity: "worst deviation of the length (ulp; infinite: not in the domain)",
        threshold: 4.0,
        full_only: false,
        measure: domain,
    },
    Case {
        name: "sampling/chi-squared",
        what: "cosine hemisphere, Gaussian and box filter, choice between reflection and refraction",
        oracle: "χ² against the density, α = 0.01 over all (Šidák)",
        quantity: "least p-value needed over the least found",
        threshold: 1.0,
        full_only: false,
        measure: chi_squared,
    },
    Case {
        name: "sampling/uniformity",
        what: "each pair of dimensions of the sampler, over pixels, past 2^16 samples",
        oracle: "uniform: Kolmogorov–Smirnov",
        quantity: "worst √n·D (1.95: p = 0.001)",
        threshold: 2.2,
        full_only: false,
        measure: uniformity,
    },
    Case {
        name: "sampling/stratified",
        what: "16, 256 and 4096 samples of a pixel, the first block of them and a later one",
        oracle: "one sample in each interval, and for the film position in each elementary rectangle",
        quantity: "intervals with another number",
        threshold: 0.0,
        full_only: false,
        measure: stratified,
    },
    Case {
        name: "sampling/correlation",
        what: "neighbouring pixels, rows, dimensions and seeds",
        oracle: "|r| < 5/√n",
        quantity: "worst |r|√n",
        threshold: 5.0,
        full_only: false,
        measure: uncorrelated,
    },
];

fn part(w: [f32; 4]) -> DVec3 {
    DVec3::new(f64::from(w[0]), f64::from(w[1]), f64::from(w[2]))
}

fn error_free(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(1);
    let mut value = || (rng.between(-1.0, 1.0) * 2f64.powf(rng.between(-12.0, 12.0))) as f32;
    let inputs: Vec<_> = (0..lab.size(1 << 17, 1 << 24)).map(|_| Words::of(&[value(), value()])).collect();
    let mut wrong = 0;
    for (function, exact) in
        [(Function::TwoSum, (|a, b| a + b) as fn(f64, f64) -> f64), (Function::TwoProduct, |a, b| a * b)]
    {
        for (i, o) in inputs.iter().zip(lab.function(function, &inputs)?) {
            // Both fit into 53 bits: sums of numbers within 2^±12 but for the smallest, products always.
            let (a, b) = (f64::from(i.x[0]), f64::from(i.x[1]));
            let rounded = o.x[0] == exact(a, b) as f32;
            wrong += usize::from(f64::from(o.x[0]) + f64::from(o.x[1]) != exact(a, b) || !rounded);
        }
    }
    Ok(Measured::new(wrong as f64, format!("2 × {} pairs", inputs.len())))
}

fn cos_sin(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(2);
    let mut inputs: Vec<_> = (0..=64).map(|i| Words::of(&[i as f32 / 64.0])).collect();
    inputs.extend((0..lab.size(1 << 17, 1 << 24)).map(|_| Words::of(&[rng.uniform() as f32])));
    let error = |(i, o): (&Words, &Words)| {
        let (sin, cos) = (TAU * f64::from(i.x[0])).sin_cos();
        worst([(f64::from(o.x[0]) - cos).abs(), (f64::from(o.x[1]) - sin).abs()])
    };
    let outputs = lab.function(Function::CosSin, &inputs)?;
    Ok(Measured::new(worst(inputs.iter().zip(&outputs).map(error)), format!("{} angles", inputs.len())))
}

fn log(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(3);
    let inputs: Vec<_> = (0..lab.size(1 << 17, 1 << 24))
        .map(|i| match i % 3 {
            0 => 1.0 - rng.uniform() * 2f64.powi(-8),
            1 => 2f64.powf(rng.between(-24.0, 0.0)),
            _ => 1.0 - (rng.uniform() * 2f64.powi(24)).floor() * 2f64.powi(-24),
        })
        .map(|x| Words::of(&[x as f32]))
        .collect();
    let error = |(i, o): (&Words, &Words)| {
        let exact = f64::from(i.x[0]).ln();
        (f64::from(o.x[0]) - exact).abs() / exact.abs().max(0.5)
    };
    let outputs = lab.function(Function::Log, &inputs)?;
    Ok(Measured::new(worst(inputs.iter().zip(&outputs).map(error)), format!("{} numbers", inputs.len())))
}

fn atan(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(8);
    let mut inputs: Vec<_> = [0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY].map(|x| Words::of(&[x])).into();
    inputs.extend((0..lab.size(1 << 17, 1 << 24)).map(|i| {
        let x = if i % 2 == 0 { rng.between(0.0, 2.0) } else { 2f64.powf(rng.between(-30.0, 30.0)) };
        Words::of(&[if rng.below(2) == 0 { x } else { -x } as f32])
    }));
    let error = |(i, o): (&Words, &Words)| (f64::from(o.x[0]) - f64::from(i.x[0]).atan()).abs();
    let outputs = lab.function(Function::Atan, &inputs)?;
    Ok(Measured::new(worst(inputs.iter().zip(&outputs).map(error)), format!("{} numbers", inputs.len())))
}

fn normals(rng: &mut Rng, n: usize) -> Vec<glam::Vec3> {
    let axes = [glam::Vec3::X, glam::Vec3::Y, glam::Vec3::Z];
    let mut all: Vec<_> = axes.into_iter().flat_map(|a| [a, -a]).collect();
    // Just above and below the pole where a basis could turn over.
    all.extend([-1.0f32, 1.0].map(|z| glam::Vec3::new(1e-5, -1e-6, z).normalize()));
    all.extend((0..n).map(|_| rng.direction32()));
    all
}

fn basis(lab: &Lab) -> Result<Measured, CheckError> {
    let inputs: Vec<_> =
        normals(&mut Rng::new(4), lab.size(1 << 16, 1 << 22)).iter().map(|n| Words::of(&n.to_array())).collect();
    let error = |(i, o): (&Words, &Words)| {
        let (n, t, b) = (part(i.x), part(o.x), part(o.y));
        let off = [n.dot(t), n.dot(b), t.dot(b), t.length() - 1.0, b.length() - 1.0, t.cross(b).dot(n) - 1.0];
        worst(off.map(f64::abs))
    };
    let outputs = lab.function(Function::Basis, &inputs)?;
    Ok(Measured::new(worst(inputs.iter().zip(&outputs).map(error)), format!("{} normals", inputs.len())))
}

/// 1 − 2^-24: the largest number that the sampler gives.
const LAST: f32 = 1.0 - 5.960_464_5e-8;

fn domain(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(47);
    let mut inputs = Vec::new();
    for n in normals(&mut rng, lab.size(1 << 13, 1 << 20)) {
        let mut u = || [0.0, LAST, 0.5, 5.960_464_5e-8, rng.uniform() as f32][rng.below(5)];
        inputs.push(Words { x: [n.x, n.y, n.z, 0.0], y: [u(), u(), 0.0, 0.0] });
    }
    let directions = lab.function(Function::Diffuse, &inputs)?;
    let mut errors: Vec<f64> = inputs
        .iter()
        .zip(&directions)
        .map(|(i, o)| {
            let d = part(o.x);
            // cosθ = √(1 − u) is at least 2^-12, far above rounding.
            if d.dot(part(i.x)) <= 0.0 { f64::INFINITY } else { (d.length() - 1.0).abs() / f64::from(f32::EPSILON) }
        })
        .collect();
    let mut scene = room();
    for filter in [PixelFilter::Box, PixelFilter::Gaussian] {
        scene.film.filter = filter;
        let inputs: Vec<_> =
            [0.0, LAST, 0.5].iter().flat_map(|&a| [0.0, LAST, 0.25].map(|b| Words::of(&[a, b]))).collect();
        // A Gaussian of 24-bit numbers ends at √(2·24·ln 2)/2 = 2.9 pixels.
        let far = if filter == PixelFilter::Box { 0.5 } else { 2.9 };
        for o in lab.function_in(&scene, Function::Filter, &inputs)? {
            let inside = o.x[0].abs() <= far && o.x[1].abs() <= far;
            errors.push(if inside { 0.0 } else { f64::INFINITY });
        }
    }
    Ok(Measured::new(worst(errors), format!("{} directions", inputs.len())))
}

fn chi_squared(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(48);
    let n = lab.size(1 << 17, 1 << 24);
    let uniforms: Vec<[f32; 2]> = (0..n)
        .map(|_| [(rng.bits() >> 8) as f32 * 2f32.powi(-24), (rng.bits() >> 8) as f32 * 2f32.powi(-24)])
        .collect();
    let mut p_values = Vec::new();

    for normal in [DVec3::Z, DVec3::new(0.6, -0.64, -0.48)] {
        let inputs: Vec<_> = uniforms
            .iter()
            .map(|u| Words { x: [normal.x as f32, normal.y as f32, normal.z as f32, 0.0], y: [u[0], u[1], 0.0, 0.0] })
            .collect();
        // Against a frame of the host's own: cos²θ and the azimuth are uniform.
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let mut counts = vec![0.0; 16 * 16];
        for o in lab.function(Function::Diffuse, &inputs)? {
            let d = part(o.x);
            let cos2 = d.dot(normal).powi(2);
            let turn = d.dot(bitangent).atan2(d.dot(tangent)) / TAU + 0.5;
            counts[bin(cos2, 16) * 16 + bin(turn, 16)] += 1.0;
        }
        p_values.push(chi_squared_p(&counts, &vec![n as f64 / 256.0; 256]));
    }

    let mut scene = room();
    let inputs: Vec<_> = uniforms.iter().map(|u| Words::of(u)).collect();
    let normal = Normal::new(0.0, 0.5).map_err(|_| CheckError::Panic("no normal distribution".to_owned()))?;
    for filter in [PixelFilter::Box, PixelFilter::Gaussian] {
        scene.film.filter = filter;
        let mut counts = vec![0.0; 16 * 16];
        for o in lab.function_in(&scene, Function::Filter, &inputs)? {
            let uniform = |x: f32| match filter {
                PixelFilter::Box => f64::from(x) + 0.5,
                PixelFilter::Gaussian => normal.cdf(f64::from(x)),
            };
            counts[bin(uniform(o.x[0]), 16) * 16 + bin(uniform(o.x[1]), 16)] += 1.0;
        }
        p_values.push(chi_squared_p(&counts, &vec![n as f64 / 256.0; 256]));
    }

    for cosine in [0.9f64, 0.3, 0.1] {
        let d = [(1.0 - cosine * cosine).sqrt() as f32, 0.0, -cosine as f32];
        let inputs: Vec<_> =
            uniforms.iter().map(|u| Words { x: [d[0], d[1], d[2], 1.5], y: [0.0, 0.0, 1.0, u[0]] }).collect();
        let reflected = lab.function(Function::Dielectric, &inputs)?.iter().filter(|o| o.x[3] == 0.0).count() as f64;
        let f = crate::oracle::fresnel(f64::from(-d[2]), 1.5);
        let n = n as f64;
        p_values.push(chi_squared_p(&[reflected, n - reflected], &[n * f, n * (1.0 - f)]));
    }
    let least = least(&p_values);
    let needed = 1.0 - 0.99f64.powf(1.0 / p_values.len() as f64);
    Ok(Measured::new(needed / least, format!("{} tests of {n} samples, least p {least:.2e}", p_values.len())))
}

fn bin(u: f64, n: usize) -> usize {
    ((u * n as f64) as usize).min(n - 1)
}

fn pairs(lab: &Lab, inputs: &[[u32; 4]]) -> Result<Vec<[f64; 2]>, CheckError> {
    pairs_of_seed(lab, 0, inputs)
}

fn pairs_of_seed(lab: &Lab, seed: u32, inputs: &[[u32; 4]]) -> Result<Vec<[f64; 2]>, CheckError> {
    let mut scene = room();
    // Table levels for up to 2^20 samples; paths longer than the table's dimensions.
    scene.integrator.samples = 1 << 20;
    scene.integrator.max_depth = 16;
    let words: Vec<_> = inputs.iter().map(|i| Words::of_bits(*i)).collect();
    let settings = RenderSettings { seed, ..lab.settings(&scene) };
    let kernel = Function::SamplePair.kernel();
    let outputs: Vec<Words> = lab.kernel_with(&scene, &settings, kernel, 1)?.run(&words)?;
    Ok(outputs.iter().map(|o| [f64::from(o.x[0]), f64::from(o.x[1])]).collect())
}

fn uniformity(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(46);
    let n = lab.size(1 << 12, 1 << 16) as u32;
    let mut off: f64 = 0.0;
    for (pair, hit) in [(0, 0), (1, 1), (5, 5), (10, 10), (31, 3), (12, 12)] {
        // Random samples of random pixels: independent even of a stratified sequence.
        let inputs: Vec<_> = (0..n).map(|_| [rng.bits() >> 8, rng.bits() >> 12, pair, hit]).collect();
        let values = pairs(lab, &inputs)?;
        for c in 0..2 {
            let mut sorted: Vec<f64> = values.iter().map(|v| v[c]).collect();
            sorted.sort_by(f64::total_cmp);
            off = worst([off, kolmogorov(&sorted)]);
        }
    }
    Ok(Measured::new(off, format!("6 pairs, {n} samples")))
}

fn stratified(lab: &Lab) -> Result<Measured, CheckError> {
    let mut wrong = 0;
    for (pixel, pair) in [(0, 0), (77, 1), (4095, 7)] {
        for log2 in [4u32, 8, 12] {
            let n = 1u32 << log2;
            // A later block of the sequence as well as the first.
            for first in [0, 5 * n] {
                let inputs: Vec<_> = (0..n).map(|i| [pixel, first + i, pair, pair]).collect();
                let values = pairs(lab, &inputs)?;
                for split in 0..=log2 {
                    // Only the first two dimensions of Sobol's sequence are a (0, 2)-sequence.
                    if pair > 0 && split != 0 && split != log2 {
                        continue;
                    }
                    let (columns, rows) = (1usize << split, 1usize << (log2 - split));
                    let mut counts = vec![0u32; n as usize];
                    for v in &values {
                        counts[bin(v[0], columns) * rows + bin(v[1], rows)] += 1;
                    }
                    wrong += counts.iter().filter(|&&c| c != 1).count();
                }
            }
        }
    }
    Ok(Measured::new(wrong as f64, "3 pixels, 2 blocks each"))
}

/// A sample of its own for each pixel.
fn hash_index(i: u32) -> u32 {
    i.wrapping_mul(2_654_435_761) >> 20
}

fn uncorrelated(lab: &Lab) -> Result<Measured, CheckError> {
    let n = lab.size(1 << 14, 1 << 20) as u32;
    let mut off: f64 = 0.0;
    // Offsets of (pixel, pair) between the two numbers. (Samples of one pixel are stratified, hence correlated.)
    for (pixel, pair) in [(1, 0), (64, 0), (4096, 0), (0, 1), (0, 5), (0, 9)] {
        let at = |shift: u32| -> Vec<[u32; 4]> {
            (0..n).map(|i| [3 * i + shift * pixel, hash_index(i), 1 + shift * pair, 1 + shift * pair]).collect()
        };
        let (a, b) = (pairs(lab, &at(0))?, pairs(lab, &at(1))?);
        for (c, d) in [(0, 0), (1, 1), (0, 1)] {
            let both: Vec<_> = a.iter().zip(&b).map(|(a, b)| (a[c], b[d])).collect();
            off = worst([off, correlation(&both).abs() * f64::from(n).sqrt()]);
        }
    }
    let one = pairs(lab, &(0..n).map(|i| [i, 3, 1, 1]).collect::<Vec<_>>())?;
    let both: Vec<_> = one.iter().map(|v| (v[0], v[1])).collect();
    off = worst([off, correlation(&both).abs() * f64::from(n).sqrt()]);
    for seed in [1, 2, 0x8000_0000] {
        let other = pairs_of_seed(lab, seed, &(0..n).map(|i| [i, 3, 1, 1]).collect::<Vec<_>>())?;
        for c in 0..2 {
            let both: Vec<_> = one.iter().zip(&other).map(|(a, b)| (a[c], b[c])).collect();
            off = worst([off, correlation(&both).abs() * f64::from(n).sqrt()]);
        }
    }
    // Mean directions must not drift with the pixel either.
    let ordered: Vec<_> = one.iter().enumerate().map(|(i, v)| (i as f64 * PI, v[0])).collect();
    off = worst([off, correlation(&ordered).abs() * f64::from(n).sqrt()]);
    Ok(Measured::new(off, format!("{n} samples, 6 offsets, 3 seeds")))
}
