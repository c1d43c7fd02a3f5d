//! The Sobol sequence as the sampler's table wants it.
//!
//! Direction numbers: S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better two-dimensional projections",
//! SIAM J. Sci. Comput. 30 (2008), the first 64 dimensions of their set "new-joe-kuo-6".

pub use crate::scene::MAX_SAMPLES;

use crate::accel::Texel;

use crate::render::film::tiling::MEMBERS;

/// Dimensions of the table.
const DIMENSIONS: usize = 64;
/// Dimensions that share a texel: two pairs.
const DIMENSIONS_OF_TEXEL: usize = 4;
const COLUMNS: usize = DIMENSIONS / DIMENSIONS_OF_TEXEL;
/// Texels between two columns: 2 KiB. A cache of 32 KiB has eight places for what is a multiple of 4 KiB apart, as columns
/// would be; so they are in turns in the two halves of it.
pub const COLUMN_GAP: usize = 128;
/// Rows of a level.
const LEVEL_ROWS: usize = 1 << LEVEL_BITS;
/// Bits of the sample index that a level covers.
pub const LEVEL_BITS: u32 = 10;
/// Levels that [`MAX_SAMPLES`] need.
pub const MAX_LEVELS: u32 = 3;

/// Of each dimension from the second on: the coefficients of its primitive polynomial (without the first and the
/// last, which are 1), and the initial direction integers m₁, m₂, …
const JOE_KUO: [(u32, &[u32]); DIMENSIONS - 1] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
    (19, &[1, 1, 1, 15, 7, 5]),
    (22, &[1, 3, 1, 15, 13, 25]),
    (25, &[1, 1, 5, 5, 19, 61]),
    (1, &[1, 3, 7, 11, 23, 15, 103]),
    (4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, &[1, 1, 3, 13, 7, 35, 63]),
    (8, &[1, 3, 5, 9, 1, 25, 53]),
    (14, &[1, 3, 1, 13, 9, 35, 107]),
    (19, &[1, 3, 1, 5, 27, 61, 31]),
    (21, &[1, 1, 5, 11, 19, 41, 61]),
    (28, &[1, 3, 5, 3, 3, 13, 69]),
    (31, &[1, 1, 7, 13, 1, 19, 1]),
    (32, &[1, 3, 7, 5, 13, 19, 59]),
    (37, &[1, 1, 3, 9, 25, 29, 41]),
    (41, &[1, 3, 5, 13, 23, 1, 55]),
    (42, &[1, 3, 7, 3, 13, 59, 17]),
    (50, &[1, 3, 1, 3, 5, 53, 69]),
    (55, &[1, 1, 5, 5, 23, 33, 13]),
    (56, &[1, 1, 7, 7, 1, 61, 123]),
    (59, &[1, 1, 7, 9, 13, 61, 49]),
    (62, &[1, 3, 3, 5, 3, 55, 33]),
    (14, &[1, 3, 1, 15, 31, 13, 49, 245]),
    (21, &[1, 3, 5, 15, 31, 59, 63, 97]),
    (22, &[1, 3, 1, 11, 11, 11, 77, 249]),
    (38, &[1, 3, 1, 11, 27, 43, 71, 9]),
    (47, &[1, 1, 7, 15, 21, 11, 81, 45]),
    (49, &[1, 3, 7, 3, 25, 31, 65, 79]),
    (50, &[1, 3, 1, 1, 19, 11, 3, 205]),
    (52, &[1, 1, 5, 9, 19, 21, 29, 157]),
    (56, &[1, 3, 7, 11, 1, 33, 89, 185]),
    (67, &[1, 3, 3, 3, 15, 9, 79, 71]),
    (70, &[1, 3, 7, 11, 15, 39, 119, 27]),
    (84, &[1, 1, 3, 1, 11, 31, 97, 225]),
    (97, &[1, 1, 1, 3, 23, 43, 57, 177]),
    (103, &[1, 3, 7, 7, 17, 17, 37, 71]),
    (115, &[1, 3, 1, 5, 27, 63, 123, 213]),
    (122, &[1, 1, 3, 5, 11, 43, 53, 133]),
    (8, &[1, 3, 5, 5, 29, 17, 47, 173, 479]),
    (13, &[1, 3, 3, 11, 3, 1, 109, 9, 69]),
    (16, &[1, 1, 1, 5, 17, 39, 23, 5, 343]),
    (22, &[1, 3, 1, 5, 25, 15, 31, 103, 499]),
    (25, &[1, 1, 1, 11, 11, 17, 63, 105, 183]),
    (44, &[1, 1, 5, 11, 9, 29, 97, 231, 363]),
    (47, &[1, 1, 5, 15, 19, 45, 41, 7, 383]),
    (52, &[1, 3, 7, 7, 31, 19, 83, 137, 221]),
    (55, &[1, 1, 1, 3, 23, 15, 111, 223, 83]),
    (59, &[1, 1, 5, 13, 31, 15, 55, 25, 161]),
    (62, &[1, 1, 3, 13, 25, 47, 39, 87, 257]),
];

/// Levels that indices below `samples` need.
pub fn levels(samples: u32) -> u32 {
    let bits = u32::BITS - samples.saturating_sub(1).leading_zeros();
    bits.div_ceil(LEVEL_BITS).clamp(1, MAX_LEVELS)
}

/// What pixels that share a scramble, those of a group, add (XOR) to their indices, for each bit of their number among
/// them. Sample i of a member being the point of index i ⊕ its offset, the first 2^m samples of one member are a net as
/// good as the sequence's own, and those of all eight, 2^(m+3) points, are nearly one, whatever m is; blocks of indices
/// would be that for one m only. A search found them, for the least `spread_error` (below) of the pairs that the first
/// hits of paths use, alone and together, up to m = 8.
const MEMBER_OFFSETS: [u32; MEMBERS.ilog2() as usize] = [0xa5bf_923d, 0x5110_0de5, 0x0a71_8fb8];

/// The table of `levels` levels, for groups of so many members: columns of texels, which hold two pairs of dimensions
/// each. In a column, row k of level l is the point of index k·2^(10 l), each coordinate bit-reversed (bit 0 is worth
/// ½). A point of any index is the XOR of its rows, since the sequence is linear over GF(2). The lowest level comes
/// first; of that each row is there for each member, one after the other.
pub fn table(levels: u32, members: usize) -> Vec<Texel> {
    let rows = (levels as usize - 1 + members) * LEVEL_ROWS;
    let mut texels = Vec::with_capacity((rows + COLUMN_GAP) * COLUMNS);
    for column in 0..COLUMNS {
        let directions: [[u32; 32]; DIMENSIONS_OF_TEXEL] =
            std::array::from_fn(|d| direction_numbers(DIMENSIONS_OF_TEXEL * column + d));
        for level in 0..levels {
            push_level(&mut texels, &directions, level, if level == 0 { members } else { 1 });
        }
        texels.resize(texels.len() + COLUMN_GAP, [0; 4]);
    }
    texels
}

/// The rows of a level.
fn push_level(texels: &mut Vec<Texel>, directions: &[[u32; 32]; DIMENSIONS_OF_TEXEL], level: u32, members: usize) {
    let first = texels.len();
    for member in 0..members {
        let of_bit = |(bit, offset): (usize, &u32)| if (member >> bit) & 1 == 1 { *offset } else { 0 };
        let offset = MEMBER_OFFSETS.iter().enumerate().map(of_bit).fold(0, |x, o| x ^ o);
        texels.push(directions.each_ref().map(|d| bit_reversed_point(d, offset)));
    }
    for k in 1..LEVEL_ROWS {
        // One row more than that without k's lowest bit.
        let bit = (level * LEVEL_BITS + k.trailing_zeros()) as usize;
        for member in 0..members {
            let previous = texels[first + (k & (k - 1)) * members + member];
            texels.push(std::array::from_fn(|d| previous[d] ^ directions[d][bit].reverse_bits()));
        }
    }
}

/// A coordinate of the point of an index.
fn bit_reversed_point(directions: &[u32; 32], index: u32) -> u32 {
    (0..32).filter(|j| (index >> j) & 1 == 1).fold(0, |x, j| x ^ directions[j].reverse_bits())
}

/// Direction numbers of a dimension: entry j is v_{j+1}·2³².
fn direction_numbers(dimension: usize) -> [u32; 32] {
    if dimension == 0 {
        return std::array::from_fn(|j| 1 << (31 - j));
    }
    let (coefficients, initial) = JOE_KUO[dimension - 1];
    let degree = initial.len();
    let mut v = [0u32; 32];
    for j in 0..32 {
        v[j] = if j < degree {
            initial[j] << (31 - j)
        } else {
            let mut x = v[j - degree] ^ (v[j - degree] >> degree);
            for i in 1..degree {
                if (coefficients >> (degree - 1 - i)) & 1 == 1 {
                    x ^= v[j - i];
                }
            }
            x
        };
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coordinate in [0, 1) of the point of an index, for a member of a group of so many.
    fn point(table: &[Texel], levels: usize, index: usize, (member, members): (usize, usize), dimension: usize) -> f64 {
        let (column, part) = (dimension / DIMENSIONS_OF_TEXEL, dimension % DIMENSIONS_OF_TEXEL);
        let column_size = (members + levels - 1) * LEVEL_ROWS + COLUMN_GAP;
        let of_level = |level: usize| {
            let k = (index >> (10 * level)) & 1023;
            if level == 0 { k * members + member } else { (members + level - 1) * LEVEL_ROWS + k }
        };
        let bits = (0..levels).fold(0, |x, level| x ^ table[column * column_size + of_level(level)][part]);
        f64::from(bits.reverse_bits()) / 4_294_967_296.0
    }

    /// Mean square of the worst-case error of a digital net, randomly shifted, for functions of bounded variation of
    /// first derivatives (Dick and Pillichshammer, J. Complexity 21, 2005).
    fn spread_error(points: &[[f64; 2]]) -> f64 {
        let of = |x: f64| 7.0 / 6.0 - if x > 0.0 { x.log2().floor().exp2() / 2.0 } else { 0.0 };
        points.iter().map(|[x, y]| of(*x) * of(*y)).sum::<f64>() / points.len() as f64 - 1.0
    }

    #[test]
    fn points_of_a_group_are_spread_better_than_independent_ones() {
        let t = table(1, MEMBERS);
        // Of the first four hits of paths, at which most noise arises.
        for pair in 1..=4 {
            let of_member = |m: usize, member| -> Vec<[f64; 2]> {
                (0..1 << m).map(|i| [2 * pair, 2 * pair + 1].map(|d| point(&t, 1, i, (member, MEMBERS), d))).collect()
            };
            let ratio = |m: usize| {
                let together: Vec<_> = (0..MEMBERS).flat_map(|member| of_member(m, member)).collect();
                let independent = spread_error(&of_member(m, 0)) / MEMBERS as f64;
                spread_error(&together) / independent
            };
            let mean = (0..=8).map(ratio).sum::<f64>() / 9.0;
            assert!(mean < 0.6, "pair {pair}: {mean} of the error of independent points");
        }
    }

    #[test]
    fn first_points_are_the_published_ones() {
        // First rows of Joe and Kuo's own example output (in natural, not Gray-code, order).
        let t = table(1, 1);
        let expected = [[0.0, 0.0, 0.0], [0.5, 0.5, 0.5], [0.25, 0.75, 0.75], [0.75, 0.25, 0.25]];
        for (i, row) in expected.iter().enumerate() {
            for (d, x) in row.iter().enumerate() {
                assert_eq!(point(&t, 1, i, (0, 1), d), *x, "point {i}, dimension {d}");
            }
        }
    }

    #[test]
    fn every_dimension_is_stratified_also_beyond_one_level() {
        let t = table(2, 1);
        for d in 0..DIMENSIONS {
            for first in [0, 1 << 12, 3 << 16] {
                let mut seen = vec![false; 4096];
                for i in 0..4096 {
                    seen[(point(&t, 2, first + i, (0, 1), d) * 4096.0) as usize] = true;
                }
                assert!(seen.iter().all(|&s| s), "dimension {d}, block at {first}");
            }
        }
        assert_eq!([levels(1), levels(1024), levels(1025), levels(1 << 20), levels((1 << 20) + 1)], [1, 1, 2, 2, 3]);
    }
}
