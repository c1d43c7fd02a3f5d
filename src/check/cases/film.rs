//! The film's sums.

use crate::check::probe::Kernel;
use crate::check::scenes::room;
use crate::check::statistics::{relative, worst};
use crate::check::{Case, CheckError, Lab, Measured};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "film/long-sum",
        what: "4e6 (full: 1e9) synthetic samples a pixel, in dispatches of 65,000 or less",
        oracle: "exact sums in integers",
        quantity: "worst relative error of the mean",
        threshold: 1e-8,
        full_only: false,
        measure: long_sum,
    },
    Case {
        name: "film/after-firefly",
        what: "4e6 samples of 0.1 after one of 1e8",
        oracle: "exact sums",
        quantity: "relative error of what was added",
        threshold: 1e-8,
        full_only: false,
        measure: after_firefly,
    },
];

/// shaders/lib/sampler.glsl, hash.
fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

fn long_sum(lab: &Lab) -> Result<Measured, CheckError> {
    // A subgroup or so of pixels: their number costs nothing up to there.
    let slots = 8u32;
    let per_dispatch = 50_000u32;
    let dispatches = lab.size(80, 20_000) as u32;
    let total = per_dispatch * dispatches;
    let mut probe = lab.kernel::<[u32; 4], [u32; 4]>(&room(), Kernel::ACCUMULATE, slots as usize)?;
    let film = probe.accumulate(slots, per_dispatch, dispatches)?;
    let mut errors = Vec::new();
    for (slot, sums) in film.iter().enumerate() {
        if sums.count != total {
            errors.push(f64::INFINITY);
        }
        let offset = (slot as u32).wrapping_mul(2_654_435_761);
        let (mut first, mut second) = (0u128, 0f64);
        if slot < 2 || !lab.full {
            for k in 0..total {
                let x = hash(k.wrapping_add(offset)) >> 8;
                first += u128::from(x);
                // As the shader rounds it: 1e-3·x in single precision.
                second += f64::from(1e-3f32 * (x as f32 * 2f32.powi(-24)));
            }
            let of = |c: usize| sums.total(c);
            errors.push(relative(of(0), first as f64 / 2f64.powi(24)));
            errors.push(relative(of(1), second));
        }
        let constant = sums.total(2);
        errors.push(relative(constant, f64::from(0.1f32) * f64::from(total)));
    }
    Ok(Measured::new(worst(errors), format!("{total} samples a pixel, {slots} pixels")))
}

fn after_firefly(lab: &Lab) -> Result<Measured, CheckError> {
    let (slots, per_dispatch, dispatches) = (8u32, 50_000u32, 80u32);
    let mut probe = lab.kernel::<[u32; 4], [u32; 4]>(&room(), Kernel::ACCUMULATE_AFTER_FIREFLY, slots as usize)?;
    let film = probe.accumulate(slots, per_dispatch, dispatches)?;
    let total = per_dispatch * dispatches;
    let exact = f64::from(0.1f32) * f64::from(total);
    let error = |sums: &crate::render::kernel::layout::FilmSlot| {
        let complete = sums.count == total + 1;
        if complete { relative(sums.total(2) - 1e8, exact) } else { f64::INFINITY }
    };
    Ok(Measured::new(worst(film.iter().map(error)), format!("{total} samples a pixel, {slots} pixels")))
}
