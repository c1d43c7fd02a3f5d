//! LDR-FLIP: the difference that a person sees when flipping between two images.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. Symbols are the paper's.
//!
//! The images are shown as they are: radiance clamped to 0..=1, without exposure or tone mapping.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::image::metrics::Pair;
use crate::image::transfer::clamp;
use crate::image::{Image, ImageError};

/// Pixels per degree: a 0.7 m wide display of 3840 pixels, seen from 0.7 m.
pub const DEFAULT_PPD: f64 = 67.0;

/// Exponent of the colour difference, q_c.
const Q_C: f64 = 0.7;
/// Colour differences up to this share of the largest, p_c …
const P_C: f64 = 0.4;
/// … are spread over the errors up to this, p_t.
const P_T: f64 = 0.95;
/// Width of an edge or point, degrees, w.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent of the feature difference, q_f.
const Q_F: f64 = 0.5;

/// The FLIP error of each pixel, 0..=1, row by row from the top. Symmetric but for roundoff.
///
/// `ppd` (pixels per degree of visual angle) is positive; NaN counts as black.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn flip(image: &Image, reference: &Image, ppd: f64) -> Result<Vec<f64>, ImageError> {
    Pair::new(image, reference)?;
    let (color, feature) = (ColorFilters::new(ppd), FeatureFilters::new(ppd));
    let largest = largest_color_difference();
    let [test, reference] = [image, reference].map(|image| {
        let ycxcz = Planes::ycxcz(image);
        (color.perceived(&ycxcz), feature.features(&ycxcz))
    });
    let (colors, features) = (test.0.into_par_iter().zip(reference.0), test.1.into_par_iter().zip(reference.1));
    Ok(colors
        .zip(features)
        .map(|((c0, c1), (f0, f1))| {
            let color = redistribute(hyab(c0, c1).powf(Q_C), largest);
            let feature = (f0[0] - f1[0]).abs().max((f0[1] - f1[1]).abs());
            color.powf(1.0 - (feature / std::f64::consts::SQRT_2).powf(Q_F))
        })
        .collect())
}

/// One value for each pixel.
#[derive(Clone)]
struct Plane {
    width: usize,
    values: Vec<f64>,
}

impl Plane {
    /// Convolves with `kernel_x ⊗ kernel_y` (both of odd length), repeating the border.
    fn filter(&self, kernel_x: &[f64], kernel_y: &[f64]) -> Self {
        let (width, height) = (self.width, self.values.len() / self.width);
        let tap =
            |at: usize, k: usize, kernel: &[f64], end: usize| (at + k).saturating_sub(kernel.len() / 2).min(end - 1);
        let mut rows = vec![0.0; self.values.len()];
        rows.par_chunks_mut(width).zip(self.values.par_chunks(width)).for_each(|(out, row)| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = kernel_x.iter().enumerate().map(|(k, w)| w * row[tap(x, k, kernel_x, width)]).sum();
            }
        });
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            for (k, w) in kernel_y.iter().enumerate() {
                let row = &rows[tap(y, k, kernel_y, height) * width..][..width];
                out.iter_mut().zip(row).for_each(|(out, v)| *out += w * v);
            }
        });
        Self { width, values }
    }
}

/// The opponent channels Y_y, C_x and C_z: a linear cousin of L*a*b*.
struct Planes {
    y: Plane,
    cx: Plane,
    cz: Plane,
}

impl Planes {
    fn ycxcz(image: &Image) -> Self {
        let colors: Vec<[f64; 3]> = image
            .pixels()
            .par_iter()
            .map(|pixel| {
                let [x, y, z] = relative_xyz_from_rgb(pixel.map(|v| clamp(f64::from(v), 1.0)));
                [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
            })
            .collect();
        let [y, cx, cz] =
            [0, 1, 2].map(|c| Plane { width: image.width() as usize, values: colors.iter().map(|v| v[c]).collect() });
        Self { y, cx, cz }
    }
}

/// The contrast sensitivity of the eye for each opponent channel, as sums of Gaussians (Table 1).
struct ColorFilters {
    y: Vec<f64>,
    cx: Vec<f64>,
    /// Weight and kernel of each Gaussian of C_z; the weights add up to 1.
    cz: [(f64, Vec<f64>); 2],
}

impl ColorFilters {
    fn new(ppd: f64) -> Self {
        const B_Y: f64 = 0.0047;
        const B_CX: f64 = 0.0053;
        const CZ: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];
        // Three standard deviations of the widest Gaussian, for all channels.
        let radius = (3.0 * (CZ[0].1 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i64;
        let gaussian = |b: f64| -> Vec<f64> {
            (-radius..=radius).map(|x| (-PI * PI * (x as f64 / ppd).powi(2) / b).exp()).collect()
        };
        let normalized = |kernel: Vec<f64>| -> (f64, Vec<f64>) {
            let sum: f64 = kernel.iter().sum();
            (sum, kernel.into_iter().map(|v| v / sum).collect())
        };
        // a·√(π/b)·g(x)·g(y) weighs as much as its sum over both directions.
        let cz = CZ.map(|(a, b)| {
            let (sum, kernel) = normalized(gaussian(b));
            (a * (PI / b).sqrt() * sum * sum, kernel)
        });
        let total = cz[0].0 + cz[1].0;
        Self {
            y: normalized(gaussian(B_Y)).1,
            cx: normalized(gaussian(B_CX)).1,
            cz: cz.map(|(weight, kernel)| (weight / total, kernel)),
        }
    }

    /// The image as seen, in L*a*b* with Hunt's adjustment (saturation counts for more in bright colours).
    fn perceived(&self, image: &Planes) -> Vec<[f64; 3]> {
        let y = image.y.filter(&self.y, &self.y);
        let cx = image.cx.filter(&self.cx, &self.cx);
        let [cz0, cz1] = self.cz.each_ref().map(|(_, kernel)| image.cz.filter(kernel, kernel));
        (0..y.values.len())
            .into_par_iter()
            .map(|i| {
                let cz = self.cz[0].0 * cz0.values[i] + self.cz[1].0 * cz1.values[i];
                let relative_y = (y.values[i] + 16.0) / 116.0;
                let xyz = [relative_y + cx.values[i] / 500.0, relative_y, relative_y - cz / 200.0];
                hunt_lab_from_rgb(rgb_from_relative_xyz(xyz).map(|v| v.clamp(0.0, 1.0)))
            })
            .collect()
    }
}

/// Detectors of edges and points: first and second derivatives of a Gaussian.
struct FeatureFilters {
    gaussian: Vec<f64>,
    edge: Vec<f64>,
    point: Vec<f64>,
}

impl FeatureFilters {
    fn new(ppd: f64) -> Self {
        let deviation = 0.5 * FEATURE_WIDTH * ppd;
        let radius = (3.0 * deviation).ceil() as i64;
        let kernel = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let values: Vec<f64> =
                (-radius..=radius).map(|x| x as f64 / deviation).map(|x| f(x) * (-0.5 * x * x).exp()).collect();
            // Positive weights add up to 1, negative ones to −1.
            let positive: f64 = values.iter().filter(|v| **v > 0.0).sum();
            let negative: f64 = -values.iter().filter(|v| **v < 0.0).sum::<f64>();
            values
                .into_iter()
                .map(|v| {
                    if v > 0.0 {
                        v / positive
                    } else if v < 0.0 {
                        v / negative
                    } else {
                        0.0
                    }
                })
                .collect()
        };
        Self { gaussian: kernel(&|_| 1.0), edge: kernel(&|x| -x), point: kernel(&|x| x * x - 1.0) }
    }

    /// Strength of edge and point in each pixel, from luminance.
    fn features(&self, image: &Planes) -> Vec<[f64; 2]> {
        let values = image.y.values.iter().map(|y| (y + 16.0) / 116.0).collect();
        let luminance = Plane { width: image.y.width, values };
        let strength = |kernel: &[f64]| {
            let along_x = luminance.filter(kernel, &self.gaussian);
            let along_y = luminance.filter(&self.gaussian, kernel);
            along_x.values.into_iter().zip(along_y.values).map(|(x, y)| x.hypot(y)).collect::<Vec<_>>()
        };
        strength(&self.edge).into_iter().zip(strength(&self.point)).map(|(edge, point)| [edge, point]).collect()
    }
}

/// Compresses the large colour differences into p_t..=1.
fn redistribute(difference: f64, largest: f64) -> f64 {
    let knee = P_C * largest;
    if difference < knee { P_T / knee * difference } else { P_T + (difference - knee) / (largest - knee) * (1.0 - P_T) }
}

/// Abasi, Amani Tehran and Fairchild's metric for large colour differences.
fn hyab([l0, a0, b0]: [f64; 3], [l1, a1, b1]: [f64; 3]) -> f64 {
    (l0 - l1).abs() + (a0 - a1).hypot(b0 - b1)
}

/// Between green and blue, after the exponent.
fn largest_color_difference() -> f64 {
    hyab(hunt_lab_from_rgb([0.0, 1.0, 0.0]), hunt_lab_from_rgb([0.0, 0.0, 1.0])).powf(Q_C)
}

fn hunt_lab_from_rgb(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz_from_rgb(rgb)
        .map(|v| if v > DELTA * DELTA * DELTA { v.cbrt() } else { v / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    let l = 116.0 * y - 16.0;
    let hunt = 0.01 * l;
    [l, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// CIE XYZ of linear sRGB, from the primaries' exact chromaticities.
const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

const RGB_FROM_XYZ: [[f64; 3]; 3] = inverse(XYZ_FROM_RGB);

/// XYZ of R = G = B = 1.
const WHITE: [f64; 3] = [sum(XYZ_FROM_RGB[0]), sum(XYZ_FROM_RGB[1]), sum(XYZ_FROM_RGB[2])];

/// XYZ over that of white.
fn relative_xyz_from_rgb(rgb: [f64; 3]) -> [f64; 3] {
    let xyz = multiply(&XYZ_FROM_RGB, rgb);
    [xyz[0] / WHITE[0], xyz[1] / WHITE[1], xyz[2] / WHITE[2]]
}

fn rgb_from_relative_xyz([x, y, z]: [f64; 3]) -> [f64; 3] {
    multiply(&RGB_FROM_XYZ, [x * WHITE[0], y * WHITE[1], z * WHITE[2]])
}

fn multiply(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

const fn sum(v: [f64; 3]) -> f64 {
    v[0] + v[1] + v[2]
}

/// The inverse of a matrix: its adjugate over its determinant.
const fn inverse(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let [[a, b, c], [d, e, f], [g, h, i]] = m;
    let det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    [
        [(e * i - f * h) / det, (c * h - b * i) / det, (b * f - c * e) / det],
        [(f * g - d * i) / det, (a * i - c * g) / det, (c * d - a * f) / det],
        [(d * h - e * g) / det, (b * g - a * h) / det, (a * e - b * d) / det],
    ]
}

#[cfg(test)]
mod tests;
