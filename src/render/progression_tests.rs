//! Tests of adaptive sampling on made-up samples, many times over.

use super::allocation::{Goal, Ladder};
use super::film::Film;
use super::layout::FilmSlot;
use super::progression::Progression;
use super::tiles::part_of_change;

const SIDE: u32 = 32;
/// A sample is 1, and rarely brighter.
const BRIGHT: f64 = 9.0;
/// One of so many samples is bright.
const RARITY: u64 = 512;
const EXPECTED: f64 = 1.0 + (BRIGHT - 1.0) / RARITY as f64;

/// A sample, as a pure function of its place (Steele, Lea and Flood's SplitMix64).
fn sample(trial: u64, slot: u64, index: u64) -> f64 {
    let mut z = (trial << 40 ^ slot << 20 ^ index).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for shift in [30, 27] {
        z = (z ^ z >> shift).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    if (z ^ z >> 31).is_multiple_of(RARITY) { BRIGHT } else { 1.0 }
}

/// Runs to the goal and returns the progression.
fn run(trial: u64) -> Progression {
    let goal = Goal { variance: 0.03 * 0.03, mean_samples: None };
    let mut image = Progression::new(Ladder::new(1 << 12, None), SIDE, SIDE);
    loop {
        let wanting: Vec<_> = image.wanting().collect();
        for &t in &wanting {
            let rung = image.tiles[t].next_rung();
            let slots: Vec<_> = (0..64)
                .map(|i| {
                    let count = image.ladder.count(rung);
                    let sum: f64 = (0..count).map(|n| sample(trial, (t * 64 + i) as u64, u64::from(n))).sum();
                    FilmSlot { sum: [sum as f32; 3], count, ..FilmSlot::default() }
                })
                .collect();
            let Progression { ladder, tiles, .. } = &mut image;
            tiles[t].read(ladder, &slots);
        }
        if wanting.is_empty() && image.is_finished() {
            return image;
        }
        if wanting.is_empty() {
            image.decide(&goal);
        }
    }
}

fn mean(film: &Film) -> f64 {
    film.mean().iter().map(|p| f64::from(p[0])).sum::<f64>() / f64::from(SIDE * SIDE)
}

/// Mean of trials and its standard error.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt())
}

/// Each half by the counts of the other one is right; by its own counts, it is not: the test could tell.
#[test]
fn exchanged_counts_are_unbiased_and_own_counts_are_not() {
    let (mut exchanged, mut own, mut varied) = (Vec::new(), Vec::new(), 0);
    for trial in 0..400 {
        let image = run(trial);
        let mut film = Film::new(SIDE, SIDE);
        image.develop(&mut film);
        exchanged.push(mean(&film));
        varied += usize::from(film.counts().iter().any(|n| n != &film.counts()[0]));
        let mut film = Film::new(SIDE, SIDE);
        image.develop_by_own_counts(&mut film);
        own.push(mean(&film));
    }
    assert!(varied > 350, "counts vary in {varied} of 400 images only");
    let (mean, error) = mean_and_error(&exchanged);
    assert!((mean - EXPECTED).abs() < 4.0 * error && error < 2e-4, "exchanged: {mean} ± {error}");
    let (mean, error) = mean_and_error(&own);
    assert!((mean - EXPECTED).abs() > 5.0 * error, "own: {mean} ± {error}");
}

/// The noise that is reported is the one that there is.
#[test]
fn the_noise_is_estimated_rightly() {
    let (mut reported, mut true_error) = (Vec::new(), Vec::new());
    for trial in 1000..1100 {
        let image = run(trial);
        let mut film = Film::new(SIDE, SIDE);
        image.develop(&mut film);
        reported.push(image.noise().unwrap().0.powi(2));
        let errors = film.mean().iter().map(|p| (f64::from(p[0]) - EXPECTED).powi(2)).sum::<f64>();
        true_error.push(errors / f64::from(SIDE * SIDE) / (EXPECTED * EXPECTED + 0.01));
    }
    let ratio = (mean_and_error(&reported).0 / mean_and_error(&true_error).0).sqrt();
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

/// Variance a/n + b/n²: from what three doublings change follows how much of the last change is error.
#[test]
fn errors_are_told_from_what_falls_faster() {
    for (a, b) in [(1.0, 0.0), (3.0, 1.0), (1.0, 1.0), (4.0, 5.0)] {
        // Of the variance V of a mean, doubling leaves V/2 or V/4, and changes V/2 or 3V/4.
        let change = |n: f64| 0.5 * a / n + 0.75 * b / (n * n);
        let (before, last) = (change(1.0), change(2.0));
        let error = a / 4.0 + b / 16.0;
        assert!((part_of_change(last / before) * last / error - 1.0).abs() < 1e-12, "{a} {b}");
    }
    // No more than all of it, and no less than two thirds.
    assert_eq!((part_of_change(0.5), part_of_change(3.0), part_of_change(f64::INFINITY)), (1.0, 1.0, 1.0));
    assert!((part_of_change(0.0) - 2.0 / 3.0).abs() < 1e-12);
}
