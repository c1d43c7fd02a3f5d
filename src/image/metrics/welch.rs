//! Welch's t-test of two noisy images: could they have the same expectation?
//!
//! B. L. Welch, "The generalization of 'Student's' problem when several different population variances are
//! involved", Biometrika 34 (1947); corrected for the number of tests after Z. Šidák, JASA 62 (1967).

use serde::Serialize;

use crate::image::Variance;
use crate::image::metrics::Pair;
use crate::image::metrics::student::two_sided_p;
use crate::image::metrics::tiles::{TILE_SIDE, Tile, tiles};

/// Why the test could not be done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum Untestable {
    /// Only the reference carries an estimate of its noise.
    #[error("the image carries no estimate of its noise")]
    Image,
    /// Only the image carries an estimate of its noise.
    #[error("the reference carries no estimate of its noise")]
    Reference,
    /// Neither image carries an estimate of its noise.
    #[error("neither image carries an estimate of its noise")]
    Both,
}

/// One of a family's tests.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TestedValue {
    /// First column of the tested pixels.
    pub x: u32,
    /// First row of the tested pixels.
    pub y: u32,
    /// 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// Difference of the means over its standard error.
    pub t: f64,
    /// Degrees of freedom (Welch and Satterthwaite).
    pub dof: f64,
    /// Probability of a |t| at least this large between images of equal expectation.
    pub p: f64,
}

/// Many tests of one kind, at a common level.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Family {
    /// Number of tests: regions times channels, less those without finite values or variances.
    pub tests: usize,
    /// Level of each test, 1 − (1 − α)^(1/tests).
    pub alpha_each: f64,
    /// Tests with p below that level.
    pub rejected: usize,
    /// The test with the smallest p.
    pub worst: Option<TestedValue>,
}

/// The three families of tests, each with the level α as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Welch {
    /// α.
    pub alpha: f64,
    /// Each pixel: finds local errors, but is blind to a small bias everywhere.
    pub pixels: Family,
    /// Each tile of [`TILE_SIDE`]².
    pub tiles: Family,
    /// The mean of the image: finds the smallest bias.
    pub mean: Family,
}

impl Welch {
    /// Tests at level `alpha` for each family; pixels are taken to be independent of each other.
    pub(super) fn test(pair: &Pair, alpha: f64) -> Result<Self, Untestable> {
        let variances = match (pair.image.variance(), pair.reference.variance()) {
            (Some(image), Some(reference)) => (image, reference),
            (None, Some(_)) => return Err(Untestable::Image),
            (Some(_), None) => return Err(Untestable::Reference),
            (None, None) => return Err(Untestable::Both),
        };
        let family = |side| Family::test(pair, variances, side, alpha);
        Ok(Self { alpha, pixels: family(1), tiles: family(TILE_SIDE), mean: family(u32::MAX) })
    }

    /// Whether any test of any family rejects that the images have the same expectation.
    pub fn rejects(&self) -> bool {
        [&self.pixels, &self.tiles, &self.mean].iter().any(|family| family.rejected > 0)
    }
}

impl Family {
    fn test(pair: &Pair, variances: (&Variance, &Variance), side: u32, alpha: f64) -> Self {
        let side = side.min(pair.image.width().max(pair.image.height()));
        let values: Vec<TestedValue> = tiles(pair.image.width(), pair.image.height(), side)
            .flat_map(|tile| test_tile(pair, variances, tile))
            .flatten()
            .collect();
        // ln_1p and exp_m1 keep the digits that 1 − (1 − α)^(1/m) would lose.
        let alpha_each = -(f64::ln_1p(-alpha) / values.len().max(1) as f64).exp_m1();
        Self {
            tests: values.len(),
            alpha_each,
            rejected: values.iter().filter(|value| value.p < alpha_each).count(),
            worst: values.into_iter().min_by(|a, b| a.p.total_cmp(&b.p).then(b.t.abs().total_cmp(&a.t.abs()))),
        }
    }
}

/// A sum of differences with its variance, and what its degrees of freedom are made of.
#[derive(Default, Clone, Copy)]
struct Sum {
    difference: f64,
    variance: f64,
    /// Σ variance² / (batches − 1).
    variance_squared: f64,
    pixels: usize,
}

impl Sum {
    fn add(&mut self, x: f64, r: f64, variances: [(f64, u32); 2]) {
        self.difference += x - r;
        self.pixels += 1;
        for (variance, batches) in variances {
            self.variance += variance;
            self.variance_squared += variance * variance / f64::from(batches - 1);
        }
        // Pixels are stored in single precision: a rounding of half an ulp is no error of the renderer.
        let ulp = f64::from(f32::EPSILON) / 2.0;
        self.variance += ulp * ulp * (x * x + r * r);
    }

    fn test(self, tile: Tile, channel: usize) -> Option<TestedValue> {
        if self.pixels == 0 {
            return None;
        }
        let t = if self.difference == 0.0 { 0.0 } else { self.difference / self.variance.sqrt() };
        // No variance at all, or only that of rounding: as if known exactly.
        let dof = (self.variance * self.variance / self.variance_squared).min(1e12);
        let dof = if dof.is_nan() { 1e12 } else { dof };
        Some(TestedValue { x: tile.x, y: tile.y, channel, t, dof, p: two_sided_p(t, dof) })
    }
}

fn test_tile(pair: &Pair, (image, reference): (&Variance, &Variance), tile: Tile) -> [Option<TestedValue>; 3] {
    let mut sums = [Sum::default(); 3];
    for i in tile.indices() {
        let Some((x, r)) = pair.finite(i) else { continue };
        for (c, sum) in sums.iter_mut().enumerate() {
            let of = |v: &Variance| (f64::from(v.of_mean[i][c]), v.batches);
            let variances = [of(image), of(reference)];
            if variances.iter().all(|(v, _)| v.is_finite() && *v >= 0.0) {
                sum.add(x[c], r[c], variances);
            }
        }
    }
    [0, 1, 2].map(|c| sums[c].test(tile, c))
}
