//! Metrics against values computed by hand, and the error rates of Welch's test.

use crate::image::Variance;
use crate::image::metrics::*;

fn image(width: u32, height: u32, pixels: &[[f32; 3]]) -> Image {
    Image::from_pixels(width, height, pixels.to_vec()).unwrap()
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 + 1e-6 * expected.abs(), "{found}, expected {expected}");
}

#[test]
fn hand_computed_values() {
    let reference = image(2, 1, &[[0.5, 0.0, 1.0], [2.0, 0.25, 0.0]]);
    let test = image(2, 1, &[[0.75, 0.5, 1.0], [1.0, 0.25, 0.0]]);
    let c = compare(&test, &reference, &CompareOptions { worst: 5, ..Default::default() }).unwrap();
    // Differences 0.25, 0.5, 0 and −1, 0, 0.
    close(c.pointwise.mse, (0.0625 + 0.25 + 1.0) / 6.0);
    close(c.pointwise.rmse, 0.467_707_173_346_742_8);
    close(c.pointwise.rel_mse, (0.0625 / 0.26 + 0.25 / 0.01 + 1.0 / 4.01) / 6.0);
    close(c.pointwise.mape, (0.25 / 0.51 + 0.5 / 0.01 + 1.0 / 2.01) / 6.0);
    close(c.pointwise.psnr.unwrap(), 10.0 * (6.0f64 / 1.3125).log10());
    close(c.bias.r.mean, -0.375);
    close(c.bias.g.mean, 0.25);
    close(c.bias.b.mean, 0.0);
    close(c.bias.luminance.mean, -0.375 * 0.2126 + 0.25 * 0.7152);
    close(c.bias.r.relative.unwrap(), -0.375 / 1.25);
    close(c.bias.largest(), 0.375);
    // Two tiles of one pixel: mean ± t(1 dof)·|d1 − d2|/2, t = 12.7062.
    close(c.bias.r.half_width.unwrap(), 12.706_204_736 * 0.625);
    assert_eq!(c.worst.len(), 2);
    assert_eq!((c.worst[0].x, c.worst[1].x), (1, 0));
    close(c.worst[0].error, (1.0f64 / 3.0).sqrt());
    assert_eq!(c.worst[0].reference, [2.0, 0.25, 0.0]);
    assert_eq!(c.welch, Err(Untestable::Both));
    let bright = compare(&test, &reference, &CompareOptions { psnr_peak: 2.0, ..Default::default() }).unwrap();
    close(bright.pointwise.psnr.unwrap(), 10.0 * (24.0f64 / 1.3125).log10());
}

#[test]
fn equal_images_have_no_error() {
    let reference = Image::from_fn(40, 30, |x, y| [x as f32, y as f32, 0.1]).unwrap();
    let c = compare(&reference, &reference, &CompareOptions::default()).unwrap();
    assert_eq!((c.pointwise.mse, c.pointwise.rel_mse, c.pointwise.mape, c.pointwise.psnr), (0.0, 0.0, 0.0, None));
    assert_eq!((c.flip, c.bias.largest(), c.bias.r.half_width), (0.0, 0.0, Some(0.0)));
}

#[test]
fn non_finite_pixels_are_counted_and_left_out() {
    let reference = image(3, 1, &[[0.5; 3], [0.5; 3], [f32::NAN, 0.0, 0.0]]);
    let test = image(3, 1, &[[0.75; 3], [0.5, f32::INFINITY, 0.5], [0.5; 3]]);
    let c = compare(&test, &reference, &CompareOptions::default()).unwrap();
    assert_eq!(c.non_finite, NonFinite { count: 2, first: Some([1, 0]) });
    close(c.pointwise.mse, 0.0625);
    close(c.bias.g.mean, 0.25);
    let nan = image(1, 1, &[[f32::NAN; 3]]);
    assert!(matches!(compare(&nan, &nan, &CompareOptions::default()), Err(ImageError::NothingFinite)));
    let other = Image::new(1, 3).unwrap();
    let message = compare(&other, &reference, &CompareOptions::default()).unwrap_err().to_string();
    assert_eq!(message, "the image has 1x3 pixels, the reference 3x1");
}

/// SplitMix64 and Box–Muller.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// An image whose pixels are means of `batches` normal values, with the variance estimated from them.
    fn noisy(&mut self, side: u32, batches: u32, mean: f64, deviation_of_mean: f64) -> Image {
        let n = f64::from(batches);
        let deviation = deviation_of_mean * n.sqrt();
        let mut of_mean = Vec::new();
        let image = Image::from_fn(side, side, |_, _| {
            let mut variance = [0.0; 3];
            let pixel = [0, 1, 2].map(|c| {
                let values: Vec<f64> = (0..batches).map(|_| mean + deviation * self.normal()).collect();
                let m = values.iter().sum::<f64>() / n;
                variance[c] = (values.iter().map(|v| (v - m).powi(2)).sum::<f64>() / (n - 1.0) / n) as f32;
                m as f32
            });
            of_mean.push(variance);
            pixel
        });
        image.unwrap().with_variance(Variance { of_mean, batches }).unwrap()
    }
}

fn welch(a: &Image, b: &Image, alpha: f64) -> Welch {
    Welch::test(&Pair::new(a, b).unwrap(), alpha).unwrap()
}

#[test]
fn welch_rejects_equal_noise_as_often_as_it_says() {
    let mut random = Random(1);
    const RUNS: usize = 400;
    let mut rejected = [0; 3];
    for _ in 0..RUNS {
        // Unequal variances and batch counts, small tiles' worth of pixels.
        let (a, b) = (random.noisy(8, 16, 1.0, 0.03), random.noisy(8, 32, 1.0, 0.01));
        let w = welch(&a, &b, 0.05);
        assert_eq!((w.pixels.tests, w.tiles.tests, w.mean.tests), (192, 3, 3));
        for (count, family) in rejected.iter_mut().zip([&w.pixels, &w.tiles, &w.mean]) {
            *count += usize::from(family.rejected > 0);
        }
    }
    // Binomial(400, 0.05): 20 ± 4.4; four deviations either way.
    assert!(rejected.iter().all(|n| (3..=37).contains(n)), "{rejected:?} of {RUNS} at level 0.05");
    // The level of a family in use is far smaller.
    let (a, b) = (random.noisy(64, 16, 1.0, 0.03), random.noisy(64, 16, 1.0, 0.03));
    let w = welch(&a, &b, 1e-4);
    assert!(!w.rejects(), "{w:?}");
    close(w.pixels.alpha_each, 1.0 - (1.0f64 - 1e-4).powf(1.0 / (64.0 * 64.0 * 3.0)));
    assert_eq!((w.pixels.tests, w.tiles.tests, w.mean.tests), (12288, 48, 3));
}

#[test]
fn welch_finds_a_shift_of_one_percent() {
    let mut random = Random(2);
    let reference = random.noisy(64, 16, 1.0, 0.03);
    let shifted = random.noisy(64, 16, 1.01, 0.03);
    // Standard errors: 4% for a pixel's difference (1% is lost), 0.27% for a tile's, 0.07% for the mean's.
    let w = welch(&shifted, &reference, 1e-4);
    assert_eq!((w.pixels.rejected, w.mean.rejected), (0, 3), "{w:?}");
    let worst = w.mean.worst.unwrap();
    assert!(worst.t > 12.0 && worst.p < 1e-30, "{worst:?}");
    // Twice as much, and tiles find it too.
    let w = welch(&random.noisy(64, 16, 1.02, 0.03), &reference, 1e-4);
    assert!(w.tiles.rejected > 40 && w.rejects(), "{w:?}");
    // One pixel far out is found by the pixels' family, and named.
    let mut spot = random.noisy(64, 16, 1.0, 0.03);
    spot.pixels_mut()[64 * 7 + 5][1] += 1.0;
    let w = welch(&spot, &reference, 1e-4);
    let worst = w.pixels.worst.unwrap();
    assert_eq!((w.pixels.rejected, worst.x, worst.y, worst.channel), (1, 5, 7, 1));
}

#[test]
fn welch_by_hand() {
    let with = |value: f32, variance: f32, batches| {
        let v = Variance { of_mean: vec![[variance; 3]], batches };
        Image::from_pixels(1, 1, vec![[value; 3]]).unwrap().with_variance(v).unwrap()
    };
    // t = 0.5/√(0.03 + 0.01) = 2.5; dof = 0.04²/(0.03²/15 + 0.01²/31) = 25.306; p = 2·t.sf(2.5, 25.306).
    let value = welch(&with(1.5, 0.03, 16), &with(1.0, 0.01, 32), 0.05).mean.worst.unwrap();
    close(value.t, 2.5);
    close(value.dof, 25.306122448979593);
    close(value.p, 0.01925313206873679);
    // Without noise: equal up to rounding passes, more does not.
    let exact = with(1.0, 0.0, 16);
    assert!(!welch(&exact, &exact, 1e-4).rejects());
    assert!(!welch(&with(1.0 + f32::EPSILON, 0.0, 16), &exact, 1e-4).rejects());
    assert!(welch(&with(1.00001, 0.0, 16), &exact, 1e-4).rejects());
    // Values that cannot be tested are not counted.
    let w = welch(&with(1.0, f32::NAN, 16), &exact, 1e-4);
    assert_eq!((w.pixels.tests, w.rejects()), (0, false));
    // Only one estimate.
    let plain = Image::from_pixels(1, 1, vec![[1.0; 3]]).unwrap();
    let untestable = |a, b| Welch::test(&Pair::new(a, b).unwrap(), 0.05).unwrap_err();
    assert_eq!(untestable(&exact, &plain), Untestable::Reference);
    assert_eq!(untestable(&plain, &exact), Untestable::Image);
}

#[test]
fn interval_of_the_bias_covers_it() {
    let mut random = Random(3);
    let mut covered = 0;
    const RUNS: usize = 300;
    for _ in 0..RUNS {
        let (a, b) = (random.noisy(20, 2, 1.1, 0.1), random.noisy(20, 2, 1.0, 0.1));
        let e = Bias::measure(&Pair::new(&a, &b).unwrap()).g;
        covered += usize::from((e.mean - 0.1).abs() < e.half_width.unwrap());
    }
    // Binomial(300, 0.95): 285 ± 3.8.
    assert!((269..=298).contains(&covered), "{covered} of {RUNS}");
}

#[test]
fn noise_explains_the_error() {
    let mut random = Random(4);
    let (a, b) = (random.noisy(64, 16, 1.0, 0.03), random.noisy(64, 16, 1.0, 0.02));
    let c = compare(&a, &b, &CompareOptions::default()).unwrap();
    let noise = c.noise_mse.image.unwrap() + c.noise_mse.reference.unwrap();
    assert!((noise / 0.0013 - 1.0).abs() < 0.05 && (c.pointwise.mse / noise - 1.0).abs() < 0.05);
}
