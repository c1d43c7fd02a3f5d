//! Errors that are means over pixels and channels.

use serde::Serialize;

use crate::image::metrics::Pair;

/// Keeps relative errors finite where the reference is dark; radiance.
pub const RELATIVE_OFFSET: f64 = 1e-2;

/// Means over all finite pixels and their channels, with x from the image and r from the reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pointwise {
    /// mean (x−r)².
    pub mse: f64,
    /// √mse.
    pub rmse: f64,
    /// mean (x−r)² / (r² + 1e-2) (Rousselle et al., "Adaptive Sampling and Reconstruction using Greedy Error
    /// Minimization", 2011).
    pub rel_mse: f64,
    /// mean |x−r| / (|r| + 1e-2).
    pub mape: f64,
    /// 10·log10(peak² / mse), decibels, of unclamped radiance; `None` (infinite) where the mse is 0.
    pub psnr: Option<f64>,
}

impl Pointwise {
    /// Measures; the pair has at least one finite pixel.
    pub(super) fn measure(pair: &Pair, peak: f64) -> Self {
        let (mut count, mut squared, mut relative, mut percentage) = (0.0, 0.0, 0.0, 0.0);
        for (_, x, r) in pair.finite_pixels() {
            for (x, r) in x.into_iter().zip(r) {
                let difference = x - r;
                count += 1.0;
                squared += difference * difference;
                relative += difference * difference / (r * r + RELATIVE_OFFSET);
                percentage += difference.abs() / (r.abs() + RELATIVE_OFFSET);
            }
        }
        let mse = squared / count;
        Self {
            mse,
            rmse: mse.sqrt(),
            rel_mse: relative / count,
            mape: percentage / count,
            psnr: (mse > 0.0).then(|| 10.0 * (peak * peak / mse).log10()),
        }
    }
}
