//! When an image that has the same number of samples in each pixel has reached a noise.

use crate::render::settings::Adaptive;

/// Samples of a pixel are taken in steps of so many parts of those there are.
const STEPS: u32 = 8;

/// The noise at which an image is to stop, and the most samples per pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stopping {
    /// Mean relative variance.
    variance: f64,
    most: u32,
}

impl Stopping {
    /// For each half of an image that is to have a noise, with `most` samples per pixel in both halves together.
    pub fn of_half(adaptive: &Adaptive, most: u32) -> Self {
        Self { variance: 2.0 * adaptive.noise.powi(2), most: most / 2 }
    }

    /// Most samples per pixel.
    pub fn most(&self) -> u32 {
        self.most
    }

    /// Samples per pixel after which the noise is looked at: they double.
    pub fn rungs(self) -> impl Iterator<Item = u32> {
        let next = move |&n: &u32| (n < self.most).then(|| n.saturating_mul(2).min(self.most));
        std::iter::successors(Some(2.min(self.most)), next)
    }

    /// Samples per pixel at which the goal is expected to be reached, from `samples` on, which have the variance given if there is
    /// an estimate. It is taken to fall as with independent samples (in seven scenes a doubling divided it by 2.0 to 2.8).
    pub fn expected(&self, samples: u32, variance: Option<f64>) -> f64 {
        let most = f64::from(self.most);
        variance.map_or(most, |variance| (f64::from(samples) * (variance / self.variance).max(1.0)).min(most))
    }

    /// Samples per pixel that suffice, if these are fewer than twice as many as there are.
    pub fn decide(&self, samples: u32, variance: Option<f64>) -> Option<u32> {
        let step = (samples / STEPS).max(1);
        let residual = (self.expected(samples, variance) - f64::from(samples)).ceil() as u32;
        let wanted = samples.saturating_add(residual.next_multiple_of(step)).min(self.most);
        (samples == self.most || wanted / 2 < samples).then_some(wanted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stopping(noise: f64, most: u32) -> Stopping {
        Stopping::of_half(&Adaptive { noise }, most)
    }

    #[test]
    fn rungs_double_up_to_the_most() {
        let rungs = |most| stopping(0.1, most).rungs().collect::<Vec<_>>();
        assert_eq!((rungs(40), rungs(64)), (vec![2, 4, 8, 16, 20], vec![2, 4, 8, 16, 32]));
        assert_eq!((rungs(2), rungs(6), rungs(u32::MAX).len()), (vec![1], vec![2, 3], 31));
    }

    /// Climbs with a variance that falls as samples^(−exponent) from 1 on, and returns the samples.
    fn climb(noise: f64, most: u32, exponent: f64) -> u32 {
        let stopping = stopping(noise, most);
        let variance = |samples: u32| f64::from(samples).powf(-exponent);
        stopping
            .rungs()
            .find_map(|samples| stopping.decide(samples, (samples > 2).then(|| variance(samples))))
            .expect("a decision at the last rung")
    }

    #[test]
    fn as_many_samples_as_the_noise_asks_for() {
        for (exponent, most_more) in [(1.0, 1.2), (1.2, 1.3)] {
            for noise in [0.2, 0.1, 0.03, 0.01] {
                // The mean of two halves has half the variance of one.
                let exact = (2.0 * f64::powi(noise, 2)).powf(-1.0 / exponent);
                let found = f64::from(climb(noise, 1 << 29, exponent));
                assert!(
                    found >= exact.floor() && found <= 4f64.max(most_more * exact),
                    "{exponent} {noise}: {found} {exact}"
                );
            }
        }
        assert_eq!(climb(1e-6, 1000, 1.0), 500);
        assert_eq!(climb(1e-6, 5, 1.0), 2);
        assert_eq!(climb(0.0, 1000, 1.0), 500);
    }

    #[test]
    fn what_has_no_noise_is_soon_over() {
        assert_eq!(stopping(0.1, 1000).decide(4, Some(0.0)), Some(4));
        // A sample that is not finite leaves none to be told: on to the end, but not at once.
        assert_eq!(stopping(0.1, 1000).decide(8, Some(f64::INFINITY)), None);
        assert_eq!(stopping(0.1, 1000).decide(4, None), None);
        assert_eq!(stopping(0.1, 6).decide(2, None), Some(3));
    }
}
