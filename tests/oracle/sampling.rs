//! Chi-squared tests of what is drawn at random, at a level of 0.1% each, with fixed seeds.

use std::f64::consts::TAU;

use glam::DVec3;
use photolith::oracle::{Pcg64, cosine_hemisphere, film_offset};
use photolith::scene::PixelFilter;

use crate::*;

/// Draws `n` bin indices and compares their counts with equal probabilities.
#[track_caller]
fn assert_equal_bins(bins: usize, n: u32, mut draw: impl FnMut() -> usize) {
    let mut counts = vec![0u32; bins];
    for _ in 0..n {
        counts[draw()] += 1;
    }
    let expected = f64::from(n) / bins as f64;
    let statistic: f64 = counts.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
    // Wilson and Hilferty 1931; 3.0902 is the normal quantile of 0.999
    let k = (bins - 1) as f64;
    let critical = k * (1.0 - 2.0 / (9.0 * k) + 3.0902 * (2.0 / (9.0 * k)).sqrt()).powi(3);
    assert!(statistic < critical, "chi-squared {statistic} exceeds {critical} ({bins} bins)");
}

fn bin(u: f64, bins: usize) -> usize {
    ((u * bins as f64) as usize).min(bins - 1)
}

fn turn(y: f64, x: f64) -> f64 {
    y.atan2(x) / TAU + 0.5
}

#[test]
fn uniform_numbers_are_uniform_and_pixels_independent() {
    let mut rng = Pcg64::for_pixel(1, 2);
    assert_equal_bins(256, 200_000, || bin(rng.uniform(), 16) * 16 + bin(rng.uniform(), 16));
    let mut pixel = 0;
    assert_equal_bins(256, 200_000, || {
        pixel += 1;
        let first = |seed, pixel| bin(Pcg64::for_pixel(seed, pixel).uniform(), 16);
        first(9, pixel) * 16 + first(9, pixel + 1)
    });
    let mut seed = 0;
    assert_equal_bins(256, 200_000, || {
        seed += 1;
        let first = |seed| bin(Pcg64::for_pixel(seed, 5).uniform(), 16);
        first(seed) * 16 + first(seed + 1)
    });
}

#[test]
fn hemisphere_is_cosine_weighted() {
    for (seed, normal) in [(1, DVec3::Y), (2, DVec3::NEG_Z), (3, v(0.6, -0.48, 0.64))] {
        let mut rng = Pcg64::new(48, seed);
        let tangent = normal.any_orthogonal_vector().normalize();
        let bitangent = normal.cross(tangent);
        // the cumulative distribution of the cosine is its square
        assert_equal_bins(400, 200_000, || {
            let d = cosine_hemisphere(normal, &mut rng);
            let cosine = d.dot(normal);
            assert!(cosine >= 0.0 && (d.length() - 1.0).abs() < 1e-15);
            bin(cosine * cosine, 20) * 20 + bin(turn(d.dot(bitangent), d.dot(tangent)), 20)
        });
    }
}

#[test]
fn gaussian_filter_has_a_deviation_of_half_a_pixel() {
    let mut rng = Pcg64::new(48, 4);
    // the cumulative distribution of the radius is 1 - exp(-r² / 2σ²)
    assert_equal_bins(400, 200_000, || {
        let p = film_offset(PixelFilter::Gaussian, &mut rng) - 0.5;
        bin(1.0 - (-p.length_squared() / (2.0 * 0.25)).exp(), 20) * 20 + bin(turn(p.y, p.x), 20)
    });
    assert_mean(0.25, 0.01, 100_000, || (film_offset(PixelFilter::Gaussian, &mut rng).x - 0.5).powi(2));
}

#[test]
fn box_filter_fills_the_pixel() {
    let mut rng = Pcg64::new(48, 5);
    assert_equal_bins(400, 200_000, || {
        let p = film_offset(PixelFilter::Box, &mut rng);
        assert!((0.0..1.0).contains(&p.x) && (0.0..1.0).contains(&p.y));
        bin(p.x, 20) * 20 + bin(p.y, 20)
    });
}

/// The test itself must have teeth: an unweighted hemisphere and a filter 2% too wide are found.
#[test]
fn wrong_distributions_are_found() {
    let found = |draw: &mut dyn FnMut() -> usize| {
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| assert_equal_bins(20, 200_000, draw))).is_err()
    };
    let mut rng = Pcg64::new(48, 6);
    assert!(found(&mut || bin(rng.uniform().powi(2), 20)));
    let mut rng = Pcg64::new(48, 7);
    assert!(found(&mut || {
        let p = 1.02 * (film_offset(PixelFilter::Gaussian, &mut rng) - 0.5);
        bin(1.0 - (-p.length_squared() / 0.5).exp(), 20)
    }));
}
