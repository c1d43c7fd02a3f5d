//! Dual buffers: two films that share no random numbers. Their mean is the image, their difference tells its variance
//! (Rousselle, Knaus and Zwicker, "Adaptive rendering with non-local means filtering", ACM Trans. Graph. 31(6), 2012).

use crate::image::metrics::RELATIVE_OFFSET;
use crate::render::film::Film;
use crate::render::film::tiling::{TILE, pixel_of_slot, slot_count};

/// What each half counts in the mean of a pixel. Where one half has no sample, it counts nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weighting {
    /// Both the same.
    Equal,
    /// In proportion to its samples: without bias only if these do not depend on what they show.
    BySamples,
}

impl Weighting {
    /// The weight of the first half, if both have so many samples.
    fn of_first(self, first: u32, second: u32) -> f64 {
        let both = first > 0 && second > 0;
        if first == second || (both && self == Self::Equal) {
            0.5
        } else {
            f64::from(first) / (f64::from(first) + f64::from(second))
        }
    }
}

/// Roots of mean relative variance (see [`Adaptive`](crate::render::Adaptive)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Noise {
    /// Of the image.
    pub image: f64,
    /// Of the tile of 8×8 pixels that has most.
    pub noisiest_tile: f64,
}

/// The two halves.
#[derive(Debug, Clone)]
pub(crate) struct DualFilms(pub [Film; 2]);

impl DualFilms {
    /// The mean of both, with its variance, and its noise. Variance and noise are unknown if a pixel has no sample in one of them.
    ///
    /// Let V and W be the variances of the halves x and y, and p and q = 1 − p their weights. The variance of the mean is
    /// p²V + q²W; E(x − y)² is V + W. So pq(x − y)² is an estimate of it: without bias for p = q = 1/2, and for weights in
    /// proportion to samples if variances go against them. Noise is relative to the [square](scale) of the radiance.
    pub fn mean(&self, weighting: Weighting) -> (Film, Option<Noise>) {
        let [a, b] = &self.0;
        let (width, height) = (a.width(), a.height());
        let mut mean = Film::new(width, height);
        let mut variance = vec![[0.0; 3]; a.counts().len()];
        let (mut sum, mut noisiest) = (0.0, 0.0f64);
        let slots = slot_count(width, height) as u32;
        for tile in (0..slots).step_by(TILE) {
            let (mut of_tile, mut pixels) = (0.0, 0.0);
            for pixel in (tile..tile + TILE as u32).filter_map(|slot| pixel_of_slot(slot, width, height)) {
                let (n, m) = (a.counts()[pixel], b.counts()[pixel]);
                let p = weighting.of_first(n, m);
                let value = |film: &Film, c: usize| film.sums()[pixel][c] / f64::from(film.counts()[pixel].max(1));
                let values: [[f64; 2]; 3] = std::array::from_fn(|c| [value(a, c), value(b, c)]);
                let samples = n.saturating_add(m);
                mean.put(pixel, values.map(|[x, y]| f64::from(samples) * (p * x + (1.0 - p) * y)), samples);
                let variances = values.map(|[x, y]| p * (1.0 - p) * (x - y).powi(2));
                variance[pixel] = variances.map(|v| v as f32);
                of_tile += variances.iter().zip(&values).map(|(v, [x, y])| v / scale(*x, *y)).sum::<f64>();
                pixels += 1.0;
            }
            sum += of_tile;
            if pixels > 0.0 {
                noisiest = noisiest.max(of_tile / (3.0 * pixels));
            }
        }
        let known = self.0.iter().all(|film| film.counts().iter().all(|&n| n > 0));
        if !known {
            return (mean, None);
        }
        let image = (sum / (3.0 * variance.len() as f64)).sqrt();
        mean.set_variance(variance);
        (mean, Some(Noise { image, noisiest_tile: noisiest.sqrt() }))
    }
}

/// The square of what an error of a radiance is relative to, of which there are two estimates: of the smaller one. In their mean a
/// rare bright sample would hide the error that it is.
fn scale(x: f64, y: f64) -> f64 {
    x.abs().min(y.abs()).powi(2) + RELATIVE_OFFSET
}

/// The mean of the squares of what has changed from one film to another, relative to the [smaller value](scale).
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
        let dual = DualFilms([film(1.0, 6), film(2.0, 2)]);
        let (mean, noise) = dual.mean(Weighting::Equal);
        assert_eq!((mean.mean()[44], mean.counts()[44]), ([1.5; 3], 8));
        // The sample variance of 1 and 2 is 1/2, that of their mean half of it.
        assert_eq!(mean.variance().expect("samples in both")[44], [0.25; 3]);
        let expected = (0.25 / (1.0 + RELATIVE_OFFSET)).sqrt();
        let Noise { image, noisiest_tile } = noise.expect("samples in both");
        assert!((image - expected).abs() < 1e-12 && (noisiest_tile - expected).abs() < 1e-12, "{noise:?}");
        let (mean, noise) = dual.mean(Weighting::BySamples);
        assert_eq!((mean.mean()[0], mean.variance().expect("samples")[0]), ([1.25; 3], [0.1875; 3]));
        assert!((noise.expect("samples").image - expected * 0.75f64.sqrt()).abs() < 1e-12);
        for weighting in [Weighting::Equal, Weighting::BySamples] {
            let (mean, noise) = DualFilms([film(1.0, 6), film(0.0, 0)]).mean(weighting);
            assert_eq!((mean.mean()[7], mean.variance(), noise), ([1.0; 3], None, None));
        }
    }

    #[test]
    fn the_noisiest_tile_is_found() {
        let mut odd = film(1.0, 4);
        // The ninth column is of the second tile.
        odd.put(8, [0.0; 3], 4);
        let (_, noise) = DualFilms([film(1.0, 4), odd]).mean(Weighting::Equal);
        let Noise { image, noisiest_tile } = noise.expect("samples");
        assert!((noisiest_tile / image - 3.0).abs() < 1e-9, "{noisiest_tile} {image}");
    }

    #[test]
    fn a_bright_sample_does_not_hide_the_error_that_it_is() {
        assert_eq!(change(&film(1.0, 4), &film(1.0, 8)), 0.0);
        let expected = 1.0 / (1.0 + RELATIVE_OFFSET);
        assert!((change(&film(1.0, 4), &film(2.0, 8)) - expected).abs() < 1e-9);
        assert!((change(&film(2.0, 4), &film(1.0, 8)) - expected).abs() < 1e-9);
    }
}
