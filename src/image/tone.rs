//! Exposure and tone curves of 8-bit output.

use rayon::prelude::*;

use crate::image::Image;
use crate::scene::Tone;

/// Luminance that auto exposure gives what shows geometry, in the mean of logarithms.
const MIDDLE_GREY: f64 = 0.18;
/// Pixels darker than this part of the median of what is lit count as not lit, and auto exposure leaves them out.
const DARKEST: f64 = 1e-3;
/// Auto exposure is a multiple of one over this.
const STEPS_PER_STOP: f64 = 3.0;
/// Share of a pixel from which on it shows geometry.
const SHOWS: f32 = 0.5;

/// Rec. 709.
fn luminance(rgb: [f32; 3]) -> f64 {
    let [r, g, b] = rgb.map(f64::from);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The exposure, in stops, by which the mean logarithm of luminance becomes that of 0.18, over the lit pixels half of which geometry covers
/// at least; `covered` is empty where that is unknown, and all count. 0 where nothing is lit.
pub fn auto_exposure(image: &Image, covered: &[f32]) -> f64 {
    let counts = |i: usize| covered.get(i).is_none_or(|share| *share >= SHOWS);
    let geometry = image.pixels().iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, p)| luminance(*p));
    let mut lit: Vec<f64> = geometry.filter(|l| l.is_finite() && *l > 0.0).collect();
    lit.sort_by(f64::total_cmp);
    let Some(median) = lit.get(lit.len() / 2) else { return 0.0 };
    let lit = &lit[lit.partition_point(|l| *l < DARKEST * median)..];
    let mean_logarithm = lit.iter().map(|l| l.log2()).sum::<f64>() / lit.len() as f64;
    ((MIDDLE_GREY.log2() - mean_logarithm) * STEPS_PER_STOP).round() / STEPS_PER_STOP
}

impl Tone {
    /// All of them, by name.
    pub const ALL: [(&'static str, Self); 3] = [("none", Self::None), ("neutral", Self::Neutral), ("agx", Self::Agx)];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, tone)| *tone == self).map_or("", |row| row.0)
    }

    /// What linear light becomes, before the transfer curve.
    pub fn map(self, rgb: [f64; 3]) -> [f64; 3] {
        match self {
            Self::None => rgb,
            Self::Neutral => neutral(rgb),
            Self::Agx => agx(rgb),
        }
    }
}

/// Khronos PBR Neutral tone mapper, specification 1.0.
fn neutral(rgb: [f64; 3]) -> [f64; 3] {
    const START: f64 = 0.8 - 0.04;
    const DESATURATION: f64 = 0.15;
    let rgb = rgb.map(|c| c.max(0.0));
    let least = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let rgb = rgb.map(|c| c - offset);
    let peak = rgb[0].max(rgb[1]).max(rgb[2]);
    if peak < START {
        return rgb;
    }
    let d = 1.0 - START;
    let new_peak = 1.0 - d * d / (peak + d - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    rgb.map(|c| c * new_peak / peak * (1.0 - white) + new_peak * white)
}

/// AgX (Sobotka), its base look, by the polynomial of Wrensch, "Minimal AgX implementation" (2023).
fn agx(rgb: [f64; 3]) -> [f64; 3] {
    const INSET: [[f64; 3]; 3] = [
        [0.842_479_062_253_094, 0.078_433_599_999_999_2, 0.079_223_745_147_764_3],
        [0.042_328_242_261_012_3, 0.878_468_636_469_772, 0.079_166_127_460_543_1],
        [0.042_375_654_905_705_1, 0.078_433_6, 0.879_142_973_793_104],
    ];
    const OUTSET: [[f64; 3]; 3] = [
        [1.196_879_005_120_17, -0.098_020_881_140_136_8, -0.099_029_744_079_720_5],
        [-0.052_896_851_757_456_2, 1.151_903_129_904_17, -0.098_961_176_844_843_3],
        [-0.052_971_635_514_443_8, -0.098_043_450_117_124_1, 1.151_073_672_641_16],
    ];
    const STOPS: [f64; 2] = [-12.473_93, 4.026_069];
    let times = |m: [[f64; 3]; 3], v: [f64; 3]| m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
    let curve = |c: f64| {
        let x = ((c.max(1e-10).log2().clamp(STOPS[0], STOPS[1])) - STOPS[0]) / (STOPS[1] - STOPS[0]);
        let coefficients = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232];
        coefficients.into_iter().fold(0.0, |sum, k| sum * x + k)
    };
    let encoded = times(OUTSET, times(INSET, rgb.map(|c| c.max(0.0))).map(curve));
    encoded.map(|c| c.max(0.0).powf(2.2))
}

impl Image {
    /// The image as 8-bit output shows it: exposed by so many stops, then by the tone curve. What alpha leaves of a pixel is what is
    /// exposed.
    pub fn displayed(&self, stops: f64, tone: Tone) -> Self {
        let mut image = self.clone();
        if stops == 0.0 && tone == Tone::None {
            return image;
        }
        let gain = stops.exp2();
        let alpha = self.alpha();
        image.pixels_mut().par_iter_mut().enumerate().for_each(|(i, pixel)| {
            let alpha = alpha.map_or(1.0, |alpha| f64::from(alpha[i]));
            if alpha > 0.0 {
                *pixel = tone.map(pixel.map(|c| f64::from(c) / alpha * gain)).map(|c| (c * alpha) as f32);
            }
        });
        image
    }

    /// The image without what is seen of a constant background beside what covers so much of each pixel, which becomes its alpha.
    ///
    /// # Errors
    /// [`ImageError::Count`](crate::image::ImageError) unless there is one value for each pixel.
    pub fn without_background(
        mut self,
        covered: Vec<f32>,
        background: [f64; 3],
    ) -> Result<Self, crate::image::ImageError> {
        for (pixel, &alpha) in self.pixels_mut().iter_mut().zip(&covered) {
            for (c, &light) in pixel.iter_mut().zip(&background) {
                *c = if alpha > 0.0 { (f64::from(*c) - f64::from(1.0 - alpha) * light).max(0.0) as f32 } else { 0.0 };
            }
        }
        self.with_alpha(covered)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn auto_exposure_is_in_thirds_and_looks_at_geometry() {
        let image = Image::from_pixels(2, 1, vec![[0.09; 3], [50.0; 3]]).unwrap();
        assert_eq!(auto_exposure(&image, &[1.0, 0.0]), 1.0);
        let thirds = auto_exposure(&image, &[]) * 3.0;
        assert!(thirds < 0.0 && thirds == thirds.round());
        assert_eq!(auto_exposure(&Image::new(2, 2).unwrap(), &[]), 0.0);
        assert_eq!(auto_exposure(&image, &[0.0, 0.0]), 0.0);
        let unlit = Image::from_pixels(5, 1, vec![[0.0; 3], [1e-9; 3], [0.09; 3], [0.09; 3], [0.09; 3]]).unwrap();
        assert_eq!(auto_exposure(&unlit, &[]), 1.0);
    }

    #[test]
    fn curves_keep_grey_grey_and_stay_in_range() {
        for (name, tone) in Tone::ALL.into_iter().skip(1) {
            let mut before = -1.0;
            for stop in -20..=20 {
                let [r, g, b] = tone.map([0.18 * f64::from(stop).exp2(); 3]);
                assert!((r - g).abs() < 1e-3 && (g - b).abs() < 1e-3, "{name} {stop}: {r} {g} {b}");
                assert!((0.0..=1.02).contains(&g) && g >= before - 1e-3, "{name} {stop}: {g}");
                before = g;
            }
        }
        // 0.5 - 0.04: below the knee Neutral only takes away the reflection at normal incidence.
        assert!(Tone::Neutral.map([0.5, 0.3, 0.2]).iter().zip([0.46, 0.26, 0.16]).all(|(a, b)| (a - b).abs() < 1e-12));
        // Peak 10 - 0 of pure red: 1 - 0.24²/(10 - 0.52), and so much white.
        let peak = 1.0 - 0.24 * 0.24 / 9.48;
        let white = 1.0 - 1.0 / (0.15 * (10.0 - peak) + 1.0);
        let [r, g, _] = Tone::Neutral.map([10.0, 0.0, 0.0]);
        assert!((r - peak).abs() < 1e-12 && (g - peak * white).abs() < 1e-12);
    }

    #[test]
    fn what_covers_nothing_is_taken_out() {
        let image = Image::from_pixels(3, 1, vec![[2.0; 3], [1.5, 1.0, 1.25], [0.5; 3]]).unwrap();
        let image = image.without_background(vec![0.0, 0.5, 1.0], [2.0, 1.0, 2.0]).unwrap();
        assert_eq!(image.pixels(), [[0.0; 3], [0.5, 0.5, 0.25], [0.5; 3]]);
        assert_eq!(image.alpha(), Some(&[0.0, 0.5, 1.0][..]));
        // Half covered by radiance 1, twice as bright.
        assert_eq!(image.displayed(1.0, Tone::None).pixels()[1][0], 1.0);
    }
}
