//! The image that agrees best with noisy values of its pixels and with less noisy differences between neighbours (the
//! screened Poisson equation; Bhat et al., "Fourier analysis of the 2D screened Poisson equation for gradient domain
//! problems", ECCV 2008).

use glam::Vec4;
use rayon::prelude::*;

/// Steps of the iteration. An image is exact in the mean after any number of them, since each is linear in what is known, and
/// what is known exactly stays as it is.
const STEPS: usize = 20;

/// What is known of a pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Known {
    /// Certainty of its value: the inverse of its variance, in any unit; above 0.
    pub certainty: f32,
    /// Certainty of the differences from its neighbours on the right and below, in the same unit; 0 where there is none.
    pub right: f32,
    pub down: f32,
    /// What the values in hand lack of these differences, times the certainty.
    pub lacking_right: Vec4,
    pub lacking_down: Vec4,
}

/// An array of a number for each pixel of an image, row by row, with a border of zeros.
struct Bordered<T> {
    stride: usize,
    all: Vec<T>,
}

impl<T: Copy + Default + Send + Sync> Bordered<T> {
    fn new(width: usize, height: usize) -> Self {
        Self { stride: width + 2, all: vec![T::default(); (width + 2) * (height + 2)] }
    }

    fn of(width: usize, height: usize, value: impl Fn(usize) -> T + Sync) -> Self {
        let mut new = Self::new(width, height);
        new.rows_mut().enumerate().for_each(|(y, row)| {
            row.iter_mut().enumerate().for_each(|(x, t)| *t = value(y * width + x));
        });
        new
    }

    /// The rows of the image.
    fn rows_mut(&mut self) -> impl IndexedParallelIterator<Item = &mut [T]> {
        let (stride, end) = (self.stride, self.all.len() - self.stride);
        self.all[stride..end].par_chunks_mut(stride).map(move |row| &mut row[1..stride - 1])
    }

    /// Row `y`, moved by so many columns and rows.
    fn row(&self, y: usize, columns: isize, rows: isize) -> &[T] {
        let first = (self.stride * (y + 1) + 1).wrapping_add_signed(columns + rows * self.stride as isize);
        &self.all[first..first + self.stride - 2]
    }
}

/// What is to be added to the values of an image `width` pixels wide: c with the least Σ a c² + Σ w (c − c′ − d)², over pixels
/// of certainty a, and pairs of certainty w whose values lack d. In the mean over noise without bias c is 0.
///
/// By Chebyshev's iteration (Golub and Varga 1961) after Jacobi's scaling, which bounds the eigenvalues from above by 2, and
/// from below by the least share of a pixel's certainty in all that bears on it.
pub(super) fn solve(known: &[Known], width: usize) -> Vec<Vec4> {
    let height = known.len() / width;
    let left = |p: usize| if p.is_multiple_of(width) { Known::default() } else { known[p - 1] };
    let up = |p: usize| if p >= width { known[p - width] } else { Known::default() };
    // Of all pairs that a pixel is in.
    let inverse = |p: usize| {
        let Known { certainty, right, down, .. } = known[p];
        1.0 / (certainty + right + down + left(p).right + up(p).down)
    };
    // The neighbours' shares, left, right, up and down; and where the iteration would end without them.
    let rows = Bordered::of(width, height, |p| {
        let Known { right, down, lacking_right, lacking_down, .. } = known[p];
        let (left, up) = (left(p), up(p));
        let target = lacking_right + lacking_down - left.lacking_right - up.lacking_down;
        let inverse = inverse(p);
        (inverse * Vec4::new(left.right, right, up.down, down), inverse * target)
    });
    let least = (0..known.len()).into_par_iter().map(|p| known[p].certainty * inverse(p)).reduce(|| 1.0, f32::min);
    let (center, radius) = ((2.0 + least) / 2.0, (2.0 - least) / 2.0);

    let mut values = Bordered::<Vec4>::new(width, height);
    let mut next = Bordered::<Vec4>::new(width, height);
    let mut direction = Bordered::<Vec4>::new(width, height);
    let mut size = 1.0 / center;
    let mut momentum = 0.0;
    for step in 0..STEPS {
        if step > 0 {
            let half = radius * size / 2.0;
            momentum = if step == 1 { 2.0 * half * half } else { half * half };
            size = 1.0 / (center - momentum / size);
        }
        next.rows_mut().zip(direction.rows_mut()).enumerate().for_each(|(y, (next, direction))| {
            let [l, r] = [-1, 1].map(|columns| values.row(y, columns, 0));
            let [u, o] = [-1, 1].map(|rows| values.row(y, 0, rows));
            let (here, row) = (values.row(y, 0, 0), rows.row(y, 0, 0));
            let count = next.len();
            let direction = &mut direction[..count];
            let [l, r, u, o] = [l, r, u, o].map(|values| &values[..count]);
            let (here, row) = (&here[..count], &row[..count]);
            for x in 0..count {
                let (share, target) = row[x];
                let around = share.x * l[x] + share.y * r[x] + (share.z * u[x] + share.w * o[x]);
                direction[x] = (target - here[x]) + around + momentum * direction[x];
                next[x] = here[x] + size * direction[x];
            }
        });
        std::mem::swap(&mut values, &mut next);
    }
    (0..height).flat_map(|y| values.row(y, 0, 0).iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane with 5×3 pixels whose values are wrong by 1 in one of them, and all differences known.
    fn known(certainty: f32) -> Vec<Known> {
        let wrong = |p: usize| if p == 7 { Vec4::ONE } else { Vec4::ZERO };
        let pixel = |p: usize| {
            let right = if p % 5 < 4 { certainty } else { 0.0 };
            let down = if p < 10 { certainty } else { 0.0 };
            // The true differences are 0.
            let lacking = |q: usize, w: f32| if w > 0.0 { w * (wrong(q) - wrong(p)) } else { Vec4::ZERO };
            Known {
                certainty: 1.0,
                right,
                down,
                lacking_right: lacking(p + 1, right),
                lacking_down: lacking(p + 5, down),
            }
        };
        (0..15).map(pixel).collect()
    }

    #[test]
    fn an_error_is_spread_over_all_that_are_known_to_be_alike() {
        let found = solve(&known(1.0), 5);
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

    #[test]
    fn what_agrees_with_the_differences_stays() {
        let mut flat = known(1.0);
        flat.iter_mut().for_each(|k| (k.lacking_right, k.lacking_down) = (Vec4::ZERO, Vec4::ZERO));
        assert!(solve(&flat, 5).iter().all(|c| *c == Vec4::ZERO));
        // No differences are known.
        assert!(solve(&known(0.0), 5).iter().all(|c| *c == Vec4::ZERO));
    }
}
