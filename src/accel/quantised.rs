//! Boxes of a node's children in a byte a plane, on a grid of the node's own.
//!
//! Ylitie, Karras and Laine (HPG 2017), section 3.2.

use crate::accel::aabb::Aabb;
use crate::accel::collapse::WIDTH;

/// Boxes of up to four children.
///
/// A plane lies at `origin + 2^(exponent − 127) · q`. Every box is larger than what it stands for by at least
/// [`SLACK`] of a step of the grid. The shader evaluates (origin − o)/d + q · 2^e/d, whose terms are rounded on their
/// own: off by up to 3·2⁻²⁴ of 255 steps, 5e-5 of a step, besides what is relative to the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantised {
    /// Lowest corner of the grid.
    pub origin: [f32; 3],
    /// Biased exponent of a step, for each axis.
    pub exponent: [u8; 3],
    /// For each axis, a byte for each child: its lower face.
    pub lo: [u32; 3],
    /// Its upper face.
    pub hi: [u32; 3],
}

/// Of a step.
const SLACK: f64 = 1.0 / 1024.0;
const STEPS: f64 = 255.0;

impl Quantised {
    /// Boxes around these, of which there are one to four.
    pub fn around(boxes: impl Iterator<Item = Aabb> + Clone) -> Self {
        let whole = boxes.clone().fold(Aabb::EMPTY, Aabb::union);
        let mut q = Self { origin: [0.0; 3], exponent: [0; 3], lo: [0; 3], hi: [0; 3] };
        for axis in 0..3 {
            let (exponent, step, origin) = grid(whole.lo[axis], whole.hi[axis]);
            q.exponent[axis] = exponent;
            q.origin[axis] = origin;
            // A power of two, by which it is as exact to multiply.
            let inverse = 1.0 / step;
            // In range even for the largest floats, whose grid has no room for the slack.
            let position =
                |x: f32, slack: f64| ((f64::from(x) - f64::from(origin)) * inverse + slack).clamp(0.0, STEPS);
            for (child, b) in boxes.clone().enumerate() {
                let lo = position(b.lo[axis], -SLACK) as u32;
                let hi = position(b.hi[axis], SLACK);
                // Up, without a call of a function.
                let hi = hi as u32 + u32::from(hi > f64::from(hi as u32));
                q.lo[axis] |= lo << (8 * child);
                q.hi[axis] |= hi << (8 * child);
            }
        }
        q
    }

    /// The box of a child, as large as it is to the shader.
    pub fn bounds(&self, child: usize) -> [[f64; 3]; 2] {
        assert!(child < WIDTH);
        [self.lo, self.hi].map(|planes| {
            [0, 1, 2].map(|axis| {
                let q = planes[axis] >> (8 * child) & 0xff;
                f64::from(self.origin[axis]) + f64::from(q) * step(self.exponent[axis])
            })
        })
    }
}

fn step(exponent: u8) -> f64 {
    // The bits of 2^(exponent − 127).
    f64::from_bits((u64::from(exponent) + 1023 - 127) << 52)
}

/// The finest grid that covers an interval and the slack on both sides: biased exponent, step, origin.
fn grid(lo: f32, hi: f32) -> (u8, f64, f32) {
    let extent = f64::from(hi) - f64::from(lo);
    let finest = (extent / STEPS).log2().floor().clamp(-126.0, 127.0) as i32 + 127;
    for exponent in finest as u8..254 {
        let step = step(exponent);
        let origin = below(f64::from(lo) - SLACK * step);
        if f64::from(origin) + STEPS * step >= f64::from(hi) + SLACK * step {
            return (exponent, step, origin);
        }
    }
    (254, step(254), lo)
}

/// The largest float that is not above x.
fn below(x: f64) -> f32 {
    let nearest = x as f32;
    let below = if f64::from(nearest) > x { nearest.next_down() } else { nearest };
    below.max(f32::MIN)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn holds(boxes: &[Aabb]) {
        let q = Quantised::around(boxes.iter().copied());
        for (i, b) in boxes.iter().enumerate() {
            let [lo, hi] = q.bounds(i);
            for axis in 0..3 {
                let slack = 0.5 * SLACK * step(q.exponent[axis]);
                assert!(lo[axis] <= f64::from(b.lo[axis]) - slack, "{b:?} {q:?}");
                assert!(hi[axis] >= f64::from(b.hi[axis]) + slack, "{b:?} {q:?}");
            }
        }
        // Not much larger either: a step on each side, and three units in the last place.
        let whole = boxes.iter().fold(Aabb::EMPTY, |a, &b| a.union(b));
        for axis in 0..3 {
            let far = f64::from(whole.lo[axis].abs().max(whole.hi[axis].abs()));
            let extent = f64::from(whole.hi[axis]) - f64::from(whole.lo[axis]);
            let largest = extent / 126.0 + 3.0 * far * f64::from(f32::EPSILON) + 1e-35;
            assert!(step(q.exponent[axis]) <= largest, "{boxes:?}: step {}", step(q.exponent[axis]));
        }
    }

    #[test]
    fn boxes_hold_what_they_stand_for() {
        let mut random = crate::accel::random_numbers(7);
        for i in 0..20_000 {
            let size = 10f32.powi(i % 17 - 12);
            let far = 10f32.powi(i % 13 - 6);
            let center = far * (Vec3::new(random(), random(), random()) - 0.5);
            let boxes: Vec<_> = (0..1 + i % 4)
                .map(|_| {
                    let p = center + size * Vec3::new(random(), random(), random());
                    Aabb { lo: p, hi: p + 0.3 * size * Vec3::new(random(), random(), random()) }
                })
                .collect();
            holds(&boxes);
        }
    }

    #[test]
    fn extreme_boxes() {
        let at = |x: f32, y: f32| Aabb { lo: Vec3::splat(x), hi: Vec3::splat(y) };
        holds(&[at(0.0, 0.0)]);
        holds(&[at(1.0, 1.0), at(1.0, 1.0)]);
        holds(&[at(0.0, f32::MIN_POSITIVE)]);
        holds(&[at(-1e37, 1e37), at(0.0, 1.0)]);
        holds(&[at(16_777_216.0, 16_777_218.0)]);
        let whole = Quantised::around(std::iter::once(at(f32::MIN, f32::MAX)));
        assert_eq!((whole.lo, whole.hi[0] > 0), ([0; 3], true));
    }
}
