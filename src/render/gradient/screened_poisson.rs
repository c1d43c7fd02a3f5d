//! The image that agrees best with noisy values of its pixels and with less noisy differences between neighbours (the
//! screened Poisson equation; Bhat et al., "Fourier analysis of the 2D screened Poisson equation for gradient domain
//! problems", ECCV 2008).

use std::mem::swap;
use std::ops::Range;

use bytemuck::{Pod, Zeroable, zeroed_vec};
use glam::Vec4;
use rayon::prelude::*;

/// Steps of the iteration. An image is exact in the mean after any number of them, since each is linear in what is known, and
/// what is known exactly stays as it is.
const STEPS: usize = 20;

/// What is known of a pixel.
#[derive(Debug, Clone, Copy, Default, Zeroable)]
pub(crate) struct Observation {
    /// Certainty of its value: the inverse of its variance, in any unit; above 0.
    pub weight: f32,
    /// Certainty of the differences from its neighbours on the right and below, in the same unit; 0 where there is none.
    pub right: f32,
    pub down: f32,
    /// What the values in hand lack of these differences, times the certainty.
    pub residual_right: Vec4,
    pub residual_down: Vec4,
}

/// Columns and rows of a block of the image, which takes half of the steps while it is in a core's cache, with as many pixels around it.
const BLOCK: [usize; 2] = [128, 32];

/// What does not change from step to step, of a pixel: the shares of its neighbours, left, right, up and down, and where it would
/// be without them.
#[derive(Clone, Copy, Zeroable)]
struct Fixed {
    shares: Vec4,
    target: Vec4,
}

/// What changes: the value, and the direction in which it went.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct State {
    value: Vec4,
    direction: Vec4,
}

/// How far a step goes, and how much of the direction before it keeps.
#[derive(Clone, Copy)]
struct Step {
    size: f32,
    momentum: f32,
}

/// Chebyshev's iteration for eigenvalues of Jacobi's between these.
fn chebyshev(least: f32, greatest: f32) -> [Step; STEPS] {
    let (center, radius) = ((greatest + least) / 2.0, (greatest - least) / 2.0);
    let mut size = 1.0 / center;
    std::array::from_fn(|step| {
        let mut momentum = 0.0;
        if step > 0 {
            let half = radius * size / 2.0;
            momentum = if step == 1 { 2.0 * half * half } else { half * half };
            size = 1.0 / (center - momentum / size);
        }
        Step { size, momentum }
    })
}

/// What is known of all pixels of an image, ready to be solved.
pub(crate) struct System {
    width: usize,
    fixed: Vec<Fixed>,
    steps: [Step; STEPS],
}

impl System {
    /// `known` tells what is known of the pixel in a column and row, of some twice.
    pub fn of([width, height]: [usize; 2], known: impl Fn([usize; 2]) -> Observation + Sync) -> Self {
        // Memory is handed out when it is written, by many threads; if it were read first, twice.
        let mut fixed = zeroed_vec::<Fixed>(width * height);
        let bands = fixed.par_chunks_mut(BLOCK[1] * width).enumerate();
        let least = bands.map(|(band, fixed)| fix(&known, BLOCK[1] * band, width, fixed)).reduce(|| 1.0, f32::min);
        Self { width, fixed, steps: chebyshev(least, 2.0) }
    }

    /// What is to be added to the values: c with the least Σ a c² + Σ w (c − c′ − d)², over pixels of certainty a, and pairs of certainty
    /// w whose values lack d. In the mean over noise without bias c is 0. It lies in the memory that is given to work in, three
    /// vectors for each pixel, whatever these are: to be handed more takes as long as the work.
    ///
    /// By Chebyshev's iteration (Golub and Varga 1961) after Jacobi's scaling, which bounds the eigenvalues from above by 2, and
    /// from below by the least share of a pixel's certainty in all that bears on it.
    pub fn solve<'a>(&self, memory: &'a mut [[Vec4; 3]]) -> &'a [Vec4] {
        let (states, values) = memory.as_flattened_mut().split_at_mut(2 * self.fixed.len());
        let states: &mut [State] = bytemuck::cast_slice_mut(states);
        let (first, second) = self.steps.split_at(STEPS / 2);
        self.advance(None, first, states, |value, direction| State { value, direction });
        self.advance(Some(states), second, values, |value, _| value);
        values
    }

    /// Puts what becomes of all pixels in some steps into `results`, from these states or, if there are none, from 0.
    fn advance<T: Send>(
        &self,
        states: Option<&[State]>,
        steps: &[Step],
        results: &mut [T],
        result: impl Fn(Vec4, Vec4) -> T + Sync,
    ) {
        let (width, rows) = (self.width, BLOCK[1]);
        results.par_chunks_mut(rows * width).enumerate().for_each(|(band, results)| {
            let mut scratch = Scratch::default();
            for first in (0..width).step_by(BLOCK[0]) {
                let block = [first..(first + BLOCK[0]).min(width), rows * band..rows * band + results.len() / width];
                scratch.advance(&self.fixed, states, width, &block, steps);
                let [columns, rows] = block;
                for (y, row) in rows.zip(results.chunks_mut(width)) {
                    let place = scratch.place(columns.start, y);
                    for (of_pixel, place) in row[columns.clone()].iter_mut().zip(place..) {
                        *of_pixel = result(scratch.values[place], scratch.directions[place]);
                    }
                }
            }
        });
    }
}

/// Fills in what does not change, of rows from `first_row` on. Returns the least share of a pixel's certainty in all that bears on it.
fn fix(known: &impl Fn([usize; 2]) -> Observation, first_row: usize, width: usize, fixed: &mut [Fixed]) -> f32 {
    let mut above: Vec<Observation> = match first_row.checked_sub(1) {
        Some(y) => (0..width).map(|x| known([x, y])).collect(),
        None => vec![Observation::default(); width],
    };
    let mut least: f32 = 1.0;
    for (y, row) in (first_row..).zip(fixed.chunks_mut(width)) {
        let mut left = Observation::default();
        for (x, (fixed, up)) in row.iter_mut().zip(&mut above).enumerate() {
            let here = known([x, y]);
            let Observation { weight, right, down, residual_right, residual_down } = here;
            // Of all pairs that the pixel is in.
            let inverse = 1.0 / (weight + right + down + left.right + up.down);
            let target = residual_right + residual_down - left.residual_right - up.residual_down;
            let shares = inverse * Vec4::new(left.right, right, up.down, down);
            *fixed = Fixed { shares, target: inverse * target };
            least = least.min(weight * inverse);
            (left, *up) = (here, here);
        }
    }
    least
}

/// A block of the image and what is around it, during some steps.
#[derive(Default)]
struct Scratch {
    /// The column and row of the first pixel that is there, and pixels from one row to the next: with a border around them.
    first: [usize; 2],
    stride: usize,
    values: Vec<Vec4>,
    next: Vec<Vec4>,
    directions: Vec<Vec4>,
}

impl Scratch {
    /// Where the pixel in a column and row is.
    fn place(&self, x: usize, y: usize) -> usize {
        (y + 1 - self.first[1]) * self.stride + x + 1 - self.first[0]
    }

    /// Takes the pixels of a block on by some steps, from these states or, if there are none, from 0.
    fn advance(
        &mut self,
        fixed: &[Fixed],
        states: Option<&[State]>,
        width: usize,
        [columns, rows]: &[Range<usize>; 2],
        steps: &[Step],
    ) {
        let height = fixed.len() / width;
        // Pixels that are `more` away from the block, in the image.
        let around = |more: usize| {
            [(columns, width), (rows, height)]
                .map(|(range, end)| range.start.saturating_sub(more)..(range.end + more).min(end))
        };
        let [x, y] = around(steps.len());
        (self.first, self.stride) = ([x.start, y.start], x.len() + 2);
        // The border stays 0 where it lies outside.
        let places = self.stride * (y.len() + 2);
        for part in [&mut self.values, &mut self.next, &mut self.directions] {
            part.clear();
            part.resize(places, Vec4::ZERO);
        }
        if let Some(states) = states {
            for y in y {
                let first = self.place(x.start, y);
                for (i, state) in states[y * width..][x.clone()].iter().enumerate() {
                    self.values[first + i] = state.value;
                    self.directions[first + i] = state.direction;
                }
            }
        }
        for (done, step) in steps.iter().enumerate() {
            let [x, y] = around(steps.len() - 1 - done);
            for y in y {
                let (first, count) = (self.place(x.start, y), x.len());
                let row = |first: usize| &self.values[first..first + count];
                let [here, left, right] = [row(first), row(first - 1), row(first + 1)];
                let [up, down] = [row(first - self.stride), row(first + self.stride)];
                let fixed = &fixed[y * width + x.start..][..count];
                let directions = &mut self.directions[first..first + count];
                let next = &mut self.next[first..first + count];
                for i in 0..count {
                    let Fixed { shares, target } = fixed[i];
                    let sides = shares.x * left[i] + shares.y * right[i] + (shares.z * up[i] + shares.w * down[i]);
                    directions[i] = (target - here[i]) + sides + step.momentum * directions[i];
                    next[i] = here[i] + step.size * directions[i];
                }
            }
            swap(&mut self.values, &mut self.next);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solve([width, height]: [usize; 2], known: &[Observation]) -> Vec<Vec4> {
        let system = System::of([width, height], |[x, y]| known[y * width + x]);
        system.solve(&mut vec![[Vec4::NAN; 3]; known.len()]).to_vec()
    }

    /// A plane with 5×3 pixels whose values are wrong by 1 in one of them, and all differences known.
    fn known(weight: f32) -> Vec<Observation> {
        let wrong = |p: usize| if p == 7 { Vec4::ONE } else { Vec4::ZERO };
        let pixel = |p: usize| {
            let right = if p % 5 < 4 { weight } else { 0.0 };
            let down = if p < 10 { weight } else { 0.0 };
            // The true differences are 0.
            let residual = |q: usize, w: f32| if w > 0.0 { w * (wrong(q) - wrong(p)) } else { Vec4::ZERO };
            Observation {
                weight: 1.0,
                right,
                down,
                residual_right: residual(p + 1, right),
                residual_down: residual(p + 5, down),
            }
        };
        (0..15).map(pixel).collect()
    }

    #[test]
    fn an_error_is_spread_over_all_that_are_known_to_be_alike() {
        let found = solve([5, 3], &known(1.0));
        // The sum stays, and the best compromise is one to which nothing can be added.
        let sum: f32 = found.iter().map(|c| c.x).sum();
        assert!(sum.abs() < 1e-5, "{sum}");
        let values: Vec<_> = found.iter().enumerate().map(|(p, c)| c.x + if p == 7 { 1.0 } else { 0.0 }).collect();
        let at = |x: usize, y: usize| if x < 5 { values.get(5 * y + x) } else { None };
        for (p, value) in values.iter().enumerate() {
            let (x, y) = (p % 5, p / 5);
            let around =
                [at(x.wrapping_sub(1), y), at(x + 1, y), y.checked_sub(1).and_then(|y| at(x, y)), at(x, y + 1)];
            let slope: f32 = around.into_iter().flatten().map(|other| value - other).sum();
            assert!((found[p].x + slope).abs() < 1e-4, "{p}: {} and {slope}", found[p].x);
        }
        assert!((0.1..0.4).contains(&values[7]), "{}", values[7]);
    }

    /// In an image of several blocks, what comes of each is what comes of it without blocks.
    #[test]
    fn blocks_leave_no_seams() {
        let sizes = [[BLOCK[0] + 70, 2 * BLOCK[1] + 3], BLOCK, BLOCK.map(|side| side + 1), [1, 70], [170, 1]];
        sizes.into_iter().for_each(has_no_seams);
    }

    fn has_no_seams([width, height]: [usize; 2]) {
        let pixel = |p: usize| {
            let noise = |salt: usize| ((p * 7919 + salt * 104_729) % 1013) as f32 / 1013.0;
            let right = if (p + 1).is_multiple_of(width) { 0.0 } else { 30.0 * noise(1) };
            let down = if p + width >= width * height { 0.0 } else { 30.0 * noise(2) };
            let residual = |w: f32, salt| w * Vec4::splat(noise(salt) - 0.5);
            Observation {
                weight: 1.0,
                right,
                down,
                residual_right: residual(right, 3),
                residual_down: residual(down, 4),
            }
        };
        let known: Vec<_> = (0..width * height).map(pixel).collect();
        let found = solve([width, height], &known);
        // The same iteration, written down as it is.
        let at = |values: &[f32], p: Option<usize>| p.map_or(0.0, |p| values[p]);
        let none = Observation::default();
        let sides = |p: usize| {
            let left = (!p.is_multiple_of(width)).then(|| p - 1);
            let up = p.checked_sub(width);
            (left, up, left.map_or(none, |q| known[q]), up.map_or(none, |q| known[q]))
        };
        let inverse = |p: usize| {
            let (_, _, left, up) = sides(p);
            1.0 / (known[p].weight + known[p].right + known[p].down + left.right + up.down)
        };
        let least = (0..known.len()).map(|p| known[p].weight * inverse(p)).fold(1.0, f32::min);
        let (mut values, mut directions) = (vec![0.0f32; known.len()], vec![0.0f32; known.len()]);
        for Step { size, momentum } in chebyshev(least, 2.0) {
            let before = values.clone();
            for p in 0..known.len() {
                let (left, up, of_left, of_up) = sides(p);
                let right = (known[p].right > 0.0).then_some(p + 1);
                let down = (known[p].down > 0.0).then_some(p + width);
                let pulls = of_left.right * at(&before, left)
                    + of_up.down * at(&before, up)
                    + known[p].right * at(&before, right)
                    + known[p].down * at(&before, down);
                let residual =
                    known[p].residual_right + known[p].residual_down - of_left.residual_right - of_up.residual_down;
                directions[p] = inverse(p) * (residual.x + pulls) - before[p] + momentum * directions[p];
                values[p] = before[p] + size * directions[p];
            }
        }
        let worst = found.iter().zip(&values).map(|(a, b)| (a.x - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-5 && values.iter().any(|v| v.abs() > 0.05), "{worst}");
    }

    #[test]
    fn what_agrees_with_the_differences_stays() {
        let mut flat = known(1.0);
        flat.iter_mut().for_each(|k| (k.residual_right, k.residual_down) = (Vec4::ZERO, Vec4::ZERO));
        assert!(solve([5, 3], &flat).iter().all(|c| *c == Vec4::ZERO));
        // No differences are known.
        assert!(solve([5, 3], &known(0.0)).iter().all(|c| *c == Vec4::ZERO));
    }
}
