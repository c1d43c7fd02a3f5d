//! How certain differences between pixels are.

use rayon::prelude::*;

use crate::render::gradient::surfaces::{CLASSES, DiffusePlaces};
use crate::render::reuse::pilot_statistics::PilotPair;

/// How many times as certain as a pixel's value a difference may be taken to be: more gains little, but takes more steps
/// to make use of.
const MAX_WEIGHT: f32 = 32.0;

/// How many times as certain the differences of each class are as the pixels' own values.
pub(crate) type ClassWeights = [f32; CLASSES];

/// What the pilot pass shows of neighbours of each class.
pub(crate) fn class_weights(pairs: &[PilotPair], places: &DiffusePlaces) -> ClassWeights {
    // In parallel, and added up in their order.
    let add = |mut a: PairSums, b: PairSums| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a = [a[0] + b[0], a[1] + b[1]]);
        a
    };
    let sum = |pairs: &[PilotPair]| {
        let mut sums = PairSums::default();
        for pair in pairs {
            let Some(class) = places.class(pair.pixel, pair.side) else { continue };
            sums[class] = [sums[class][0] + pair.values, sums[class][1] + pair.difference];
        }
        sums
    };
    let parts: Vec<_> = pairs.par_chunks(PAIRS_TOGETHER).map(sum).collect();
    weights(&parts.into_iter().fold(PairSums::default(), add))
}

/// Pairs that are added up together.
const PAIRS_TOGETHER: usize = 2048;

/// Sums of squares over the pairs of each class: of values, and of differences.
type PairSums = [[f64; 2]; CLASSES];

/// The inverse of the variance of differences, that of values being 1.
fn weights(sums: &PairSums) -> ClassWeights {
    let all = sums.iter().fold([0.0; 2], |[a, b], sum| [a + sum[0], b + sum[1]]);
    // Where there are few pairs, as in all.
    sums.map(|[values, difference]| {
        let weight = (values + 0.01 * all[0]) / (difference + 0.01 * all[1]);
        if weight.is_nan() { 0.0 } else { (weight as f32).min(MAX_WEIGHT) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn certainty_is_variance_of_values_over_that_of_differences() {
        let mut sums = [[0.0; 2]; CLASSES];
        assert_eq!(weights(&sums), [0.0; CLASSES]);
        sums[0] = [100.0, 0.0];
        assert_eq!(weights(&sums), [MAX_WEIGHT; CLASSES]);
        sums[1] = [100.0, 25.0];
        let found = weights(&sums);
        assert!((found[1] - 102.0 / 25.25).abs() < 1e-5 && found[2] == 8.0, "{found:?}");
    }
}
