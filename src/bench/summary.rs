//! From single measurements to one row for each number of samples, a slope and a time to a target.

use serde::Serialize;

use crate::image::metrics::LUMINANCE;

use crate::bench::convergence::{Contender, Measurement};
use crate::bench::reference::Reference;
use crate::bench::statistics::{Mean, PowerLaw, median};

/// All seeds of one configuration at one number of samples. Times are medians over the seeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Samples per pixel.
    pub samples: u32,
    /// Wall seconds, without set-up.
    pub render_s: f64,
    /// Device seconds by timestamps; `None` where the device has none.
    pub device_s: Option<f64>,
    /// Samples per wall second, millions.
    pub msamples_per_s: f64,
    /// Rays (shadow rays included) per wall second, millions.
    pub mrays_per_s: f64,
    /// Rays per sample.
    pub rays_per_sample: f64,
    /// The error is below what the reference can tell: errors, and what follows from them, are withheld.
    pub below_noise_floor: bool,
    /// Mean squared error less the reference's variance.
    pub mse: Option<f64>,
    /// Its root.
    pub rmse: Option<f64>,
    /// Half the width of the interval of `rmse`, from the spread over seeds.
    pub rmse_half_width: Option<f64>,
    /// Relative mean squared error less the reference's share.
    pub rel_mse: Option<f64>,
    /// Mean absolute percentage error (as a fraction), noise of the reference included.
    pub mape: Option<f64>,
    /// Mean FLIP, noise of the reference included.
    pub flip: Option<f64>,
    /// Mean luminance over that of the reference, minus 1.
    pub bias: f64,
    /// Half the width of its interval: the spread over seeds and the reference's own error.
    pub bias_half_width: Option<f64>,
    /// 1/(MSE · wall seconds).
    pub efficiency: Option<f64>,
}

/// When a configuration reaches an error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TimeToTarget {
    /// Wall seconds, without set-up.
    pub seconds: f64,
    /// Samples per pixel.
    pub samples: f64,
    /// The target lies below all errors that were measured.
    pub extrapolated: bool,
}

/// Times are told up to so many times the largest number of samples that was measured.
const FARTHEST: f64 = 4.0;

/// A configuration measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConfigurationSummary {
    /// What differs from the others.
    pub label: String,
    /// Vulkan device.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// Seconds to prepare: BVH, uploads, pipeline.
    pub setup_s: f64,
    /// The pipeline's part of it.
    pub compile_s: f64,
    /// The BVH's part of it.
    pub bvh_build_s: Option<f64>,
    /// Steps through the BVH per ray.
    pub steps_per_ray: Option<f64>,
    /// RMSE against samples.
    pub slope: Option<PowerLaw>,
    /// Wall time over that of the first configuration at the same samples and seed: the median.
    pub relative_time: Option<f64>,
    /// Time to the common target.
    pub time_to_target: Option<TimeToTarget>,
    /// It cannot be told, since the fewest samples that were measured have an error below the target already.
    pub below_target: bool,
    /// One for each number of samples.
    pub rows: Vec<Row>,
}

impl ConfigurationSummary {
    /// Sums up the measurements of configuration `index`.
    pub fn of(index: usize, contender: &Contender<'_>, measurements: &[Measurement], reference: &Reference) -> Self {
        let mut own: Vec<_> = measurements.iter().filter(|m| m.configuration == index).copied().collect();
        own.sort_by_key(|m| m.samples);
        let rows: Vec<_> = own.chunk_by(|a, b| a.samples == b.samples).map(|seeds| row(seeds, reference)).collect();
        let errors: Vec<_> = rows.iter().filter_map(|r| Some((f64::from(r.samples), r.rmse?))).collect();
        let [device, driver] = contender.device.clone();
        Self {
            label: contender.configuration.label.clone(),
            device,
            driver,
            setup_s: contender.setup.setup_seconds,
            compile_s: contender.setup.compile_seconds,
            bvh_build_s: contender.bvh.map(|t| t.build_seconds),
            steps_per_ray: contender.steps_per_ray,
            slope: PowerLaw::fit(&errors),
            relative_time: relative_time(index, measurements),
            time_to_target: None,
            below_target: false,
            rows,
        }
    }

    /// The smallest error that was measured.
    pub fn smallest_rmse(&self) -> Option<f64> {
        self.rows.iter().filter_map(|r| r.rmse).min_by(f64::total_cmp)
    }

    /// Fills in the time to `target` (RMSE), in logarithms: that of a row, interpolated between rows, or beyond the last by the
    /// last two, up to four times its samples. Where the first row is already below the target, the time cannot be told.
    pub fn reach(&mut self, target: f64) {
        let points: Vec<_> =
            self.rows.iter().filter_map(|r| Some((r.rmse?, r.render_s, f64::from(r.samples)))).collect();
        self.below_target = points.first().is_some_and(|p| p.0 < target);
        let met = points.iter().find(|p| p.0 == target);
        let measured = met.map(|&(_, seconds, samples)| TimeToTarget { seconds, samples, extrapolated: false });
        let between = || points.windows(2).find(|w| w[0].0 > target && target > w[1].0)?.try_into().ok();
        let beyond = || points.last_chunk().filter(|_| points.iter().all(|p| p.0 > target)).copied();
        self.time_to_target = measured
            .or_else(|| Some(on_line(between()?, target, false)))
            .or_else(|| Some(on_line(beyond()?, target, true)))
            // Errors that do not fall have no line that reaches the target.
            .filter(|t| t.seconds.is_finite() && points.first().is_some_and(|p| t.samples >= p.2))
            .filter(|t| points.last().is_some_and(|p| t.samples <= FARTHEST * p.2));
    }
}

/// Where the line through two points (error, seconds, samples), straight in logarithms, has the error `target`.
fn on_line([(e0, t0, n0), (e1, t1, n1)]: [(f64, f64, f64); 2], target: f64, extrapolated: bool) -> TimeToTarget {
    let u = (target / e0).ln() / (e1 / e0).ln();
    let at = |a: f64, b: f64| a * (b / a).powf(u);
    TimeToTarget { seconds: at(t0, t1), samples: at(n0, n1), extrapolated }
}

/// Configurations alternate, so that what the machine does meanwhile meets both of a pair.
fn relative_time(index: usize, measurements: &[Measurement]) -> Option<f64> {
    let of = |configuration| measurements.iter().filter(move |m| m.configuration == configuration);
    let ratios: Vec<_> = of(index)
        .filter_map(|m| {
            let first = of(0).find(|f| (f.samples, f.seed) == (m.samples, m.seed))?;
            Some(m.render_seconds / first.render_seconds)
        })
        .collect();
    (!ratios.is_empty()).then(|| median(&ratios))
}

/// Sums up measurements that differ in the seed only.
fn row(seeds: &[Measurement], reference: &Reference) -> Row {
    let column = |f: fn(&Measurement) -> f64| seeds.iter().map(f).collect::<Vec<_>>();
    let mean = |f| Mean::of(&column(f)).mean;
    let first = &seeds[0];
    let render_s = median(&column(|m| m.render_seconds));
    let device_s = median(&column(|m| m.device_seconds));
    let pixels = reference.image.pixels().len() as f64;
    let samples = pixels * f64::from(first.samples);
    let rays = mean(|m| m.rays as f64);

    let squared = Mean::of(&column(|m| m.mse));
    let mse = squared.mean - reference.noise_mse;
    let rel_mse = mean(|m| m.rel_mse) - reference.noise_rel_mse;
    // A NaN, as where the noise of the reference is infinite, tells no more than an error below it.
    let tells = mse >= reference.noise_mse && rel_mse >= reference.noise_rel_mse;
    let below = !tells;
    let known = |v: f64| (!below).then_some(v);

    let bias = Mean::of(&column(|m| m.bias));
    let luminance: f64 = reference
        .image
        .pixels()
        .iter()
        .map(|p| p.iter().zip(LUMINANCE).map(|(&v, w)| f64::from(v) * w).sum::<f64>())
        .sum::<f64>()
        / pixels;
    let reference_error = reference.mean_error / if luminance == 0.0 { 1.0 } else { luminance.abs() };
    // Two standard errors of the reference are its interval of 95%.
    let bias_half_width = bias.half_width.map(|w| w.hypot(2.0 * reference_error));
    Row {
        samples: first.samples,
        render_s,
        device_s: (device_s > 0.0).then_some(device_s),
        msamples_per_s: samples / render_s / 1e6,
        mrays_per_s: rays / render_s / 1e6,
        rays_per_sample: rays / samples,
        below_noise_floor: below,
        mse: known(mse),
        rmse: known(mse.sqrt()),
        // d√x = dx/(2√x).
        rmse_half_width: squared.half_width.and_then(|w| known(w / (2.0 * mse.sqrt()))),
        rel_mse: known(rel_mse),
        mape: known(mean(|m| m.mape)),
        flip: known(mean(|m| m.flip)),
        bias: bias.mean,
        bias_half_width,
        efficiency: known(1.0 / (mse * render_s)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Origin;
    use crate::image::Image;

    fn reference(noise_mse: f64) -> Reference {
        Reference {
            image: Image::from_pixels(2, 1, vec![[1.0; 3]; 2]).unwrap(),
            origin: Origin::Given,
            file: None,
            samples: None,
            noise_mse,
            noise_rel_mse: 0.0,
            mean_error: 0.001,
        }
    }

    fn measurement(samples: u32, seed: u32, seconds: f64, mse: f64) -> Measurement {
        Measurement {
            configuration: 0,
            samples,
            seed,
            render_seconds: seconds,
            device_seconds: 0.0,
            rays: 80,
            mse,
            rel_mse: mse,
            mape: 0.1,
            flip: 0.1,
            bias: 0.01 * f64::from(seed),
        }
    }

    #[test]
    fn the_references_variance_is_subtracted_and_its_floor_kept() {
        let seeds = [measurement(4, 1, 1.0, 0.05), measurement(4, 2, 5.0, 0.07), measurement(4, 3, 2.0, 0.06)];
        let r = row(&seeds, &reference(0.02));
        assert!((r.mse.unwrap() - 0.04).abs() < 1e-12 && (r.rmse.unwrap() - 0.2).abs() < 1e-12);
        assert_eq!((r.render_s, r.device_s, r.rays_per_sample), (2.0, None, 10.0));
        assert!((r.efficiency.unwrap() - 12.5).abs() < 1e-9);
        // 4.302653·0.01/√3 for the seeds, 0.002 for the reference.
        assert!((r.bias - 0.02).abs() < 1e-12);
        assert!((r.bias_half_width.unwrap() - 0.024_841_f64.hypot(0.002)).abs() < 1e-5);
        // 0.06 measured, 0.031 of it the reference's: what is left is less than that.
        let r = row(&seeds, &reference(0.031));
        assert!(r.below_noise_floor && r.mse.is_none() && r.flip.is_none() && r.efficiency.is_none());
        // ∞ − ∞ is no error.
        let lost = row(&[measurement(4, 1, 1.0, f64::INFINITY)], &reference(f64::INFINITY));
        assert!(lost.below_noise_floor && lost.mse.is_none() && lost.rmse_half_width.is_none());
        assert!((r.bias - 0.02).abs() < 1e-12);
    }

    #[test]
    fn times_are_compared_pair_by_pair() {
        // The machine slows down tenfold for the last two seeds.
        let times = [(0, 1, 1.0), (1, 1, 2.0), (0, 2, 10.0), (1, 2, 20.0), (0, 3, 10.0), (1, 3, 25.0)];
        let all = times.map(|(configuration, seed, t)| Measurement { configuration, ..measurement(4, seed, t, 0.1) });
        assert_eq!(relative_time(1, &all), Some(2.0));
        assert_eq!((relative_time(0, &all), relative_time(2, &all)), (Some(1.0), None));
    }

    #[test]
    fn time_to_target() {
        let rows = [(1, 1.0, 1.0), (4, 4.0, 0.25), (16, 16.0, 0.0625)]
            .map(|(n, t, mse)| row(&[measurement(n, 1, t, mse)], &reference(0.0)))
            .to_vec();
        let mut summary = ConfigurationSummary {
            label: String::new(),
            device: String::new(),
            driver: String::new(),
            setup_s: 0.0,
            compile_s: 0.0,
            bvh_build_s: None,
            steps_per_ray: None,
            slope: None,
            relative_time: None,
            time_to_target: None,
            below_target: false,
            rows,
        };
        for (target, seconds, extrapolated) in [
            (1.0, 1.0, false),
            (0.5, 4.0, false),
            (2f64.sqrt() / 4.0, 8.0, false),
            (0.25, 16.0, false),
            (0.5f64.sqrt() / 4.0, 32.0, true),
        ] {
            summary.reach(target);
            let found = summary.time_to_target.unwrap();
            assert!((found.seconds / seconds - 1.0).abs() < 1e-9, "{target}: {found:?}");
            assert!((found.samples / seconds - 1.0).abs() < 1e-9);
            assert_eq!(found.extrapolated, extrapolated);
        }
        // Fewer samples than the least, and more than four times the most: nobody knows.
        for target in [2.0, 100.0, 0.12, 1e-9] {
            summary.reach(target);
            assert_eq!((summary.time_to_target, summary.below_target), (None, target > 1.0), "{target}");
        }
        assert_eq!(summary.smallest_rmse(), Some(0.25));
        // Errors that rise: what was measured is known, and nothing beyond it.
        summary.rows.remove(0);
        summary.rows[1].rmse = Some(0.6);
        summary.reach(0.5);
        assert!(summary.time_to_target.is_some_and(|t| t.samples == 4.0 && !t.extrapolated));
        for target in [0.4, 0.55, 0.7] {
            summary.reach(target);
            assert_eq!(summary.time_to_target, None, "{target}");
        }
        summary.rows.truncate(1);
        summary.reach(0.5);
        assert!(summary.time_to_target.is_some_and(|t| !t.extrapolated));
        summary.reach(0.4);
        assert_eq!(summary.time_to_target, None);
    }
}
