//! The mean of two images that share no random numbers, and its noise.

use super::film::{Film, pixel_of_slot, slot_count};
use super::tiles::TILE;
use crate::image::metrics::RELATIVE_OFFSET;

/// The mean of two films, the first of which has this part of a pixel whose samples are so many in either.
///
/// Also its noise and that of its noisiest tile, roots of mean relative variance; `None` if a pixel lacks samples of either.
/// If variances are V and W, and the parts p and q, that of the mean is p²V + q²W, which pq(V + W) is for p = q = 1/2, and for
/// parts that go with samples if variances go against them. The square of the difference is V + W in the mean. (What it is relative
/// to: [`scale`].)
pub(crate) fn mean_of(films: &[Film; 2], part: impl Fn(u32, u32) -> f64) -> (Film, Option<(f64, f64)>) {
    let [a, b] = films;
    let (width, height) = (a.width(), a.height());
    let mut mean = Film::new(width, height);
    let (mut error, mut noisiest) = (0.0, 0.0f64);
    let slots = slot_count(width, height) as u32;
    for tile in (0..slots).step_by(TILE) {
        let (mut error_of_tile, mut pixels) = (0.0, 0.0);
        for pixel in (tile..tile + TILE as u32).filter_map(|slot| pixel_of_slot(slot, width, height)) {
            let (n, m) = (a.counts()[pixel], b.counts()[pixel]);
            let p = part(n, m);
            let value = |film: &Film, c: usize| film.sums()[pixel][c] / f64::from(film.counts()[pixel].max(1));
            let values: [[f64; 2]; 3] = std::array::from_fn(|c| [value(a, c), value(b, c)]);
            let means = values.map(|[x, y]| p * x + (1.0 - p) * y);
            mean.put(pixel, means.map(|x| x * f64::from(n + m)), n + m);
            for [x, y] in &values {
                error_of_tile += p * (1.0 - p) * (x - y).powi(2) / scale(*x, *y);
            }
            pixels += 1.0;
        }
        error += error_of_tile;
        if pixels > 0.0 {
            noisiest = noisiest.max(error_of_tile / (3.0 * pixels));
        }
    }
    let known = films.iter().all(|film| film.counts().iter().all(|&n| n > 0));
    let noise = (error / (3.0 * a.counts().len() as f64)).sqrt();
    (mean, known.then(|| (noise, noisiest.sqrt())))
}

/// The square of what an error of a radiance is relative to, of which there are two estimates: of the smaller one. In their mean a
/// rare bright sample would hide the error that it is.
fn scale(x: f64, y: f64) -> f64 {
    x.abs().min(y.abs()).powi(2) + RELATIVE_OFFSET
}

/// The mean of the squares of what has changed from one film to another, relative to the smaller value ([`scale`]).
pub(crate) fn change(from: &Film, to: &Film) -> f64 {
    let mut sum = 0.0;
    for (before, after) in from.mean().iter().zip(to.mean()) {
        for (x, y) in before.iter().zip(after) {
            let (x, y) = (f64::from(*x), f64::from(y));
            sum += (y - x).powi(2) / scale(x, y);
        }
    }
    sum / (3.0 * to.counts().len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A film all of whose pixels have the same mean, with so many samples.
    fn film(mean: f64, samples: u32) -> Film {
        let mut film = Film::new(9, 5);
        (0..45).for_each(|pixel| film.put(pixel, [mean * f64::from(samples); 3], samples));
        film
    }

    #[test]
    fn two_films_make_one() {
        let (mean, noise) = mean_of(&[film(1.0, 6), film(2.0, 2)], |_, _| 0.5);
        assert_eq!((mean.mean()[44], mean.counts()[44]), ([1.5; 3], 8));
        let expected = (0.25 / (1.0 + RELATIVE_OFFSET)).sqrt();
        let (noise, noisiest) = noise.expect("samples in both");
        assert!((noise - expected).abs() < 1e-12 && (noisiest - expected).abs() < 1e-12, "{noise} {noisiest}");
        let by_samples = |n: u32, m: u32| f64::from(n) / f64::from(n + m);
        let (mean, noise) = mean_of(&[film(1.0, 6), film(2.0, 2)], by_samples);
        assert_eq!(mean.mean()[0], [1.25; 3]);
        assert!((noise.expect("samples").0 - expected * 0.75f64.sqrt()).abs() < 1e-12);
        let (mean, noise) = mean_of(&[film(1.0, 6), film(0.0, 0)], by_samples);
        assert_eq!((mean.mean()[7], noise), ([1.0; 3], None));
    }

    #[test]
    fn the_noisiest_tile_is_found() {
        let mut odd = film(1.0, 4);
        // The ninth column is of the second tile.
        odd.put(8, [0.0; 3], 4);
        let (_, noise) = mean_of(&[film(1.0, 4), odd], |_, _| 0.5);
        let (noise, noisiest) = noise.expect("samples");
        assert!((noisiest / noise - 3.0).abs() < 1e-9, "{noisiest} {noise}");
    }

    #[test]
    fn a_bright_sample_does_not_hide_the_error_that_it_is() {
        assert_eq!(change(&film(1.0, 4), &film(1.0, 8)), 0.0);
        let expected = 1.0 / (1.0 + RELATIVE_OFFSET);
        assert!((change(&film(1.0, 4), &film(2.0, 8)) - expected).abs() < 1e-9);
        assert!((change(&film(2.0, 4), &film(1.0, 8)) - expected).abs() < 1e-9);
    }
}
