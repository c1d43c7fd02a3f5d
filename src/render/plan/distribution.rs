//! How the work of a dispatch is handed out (shaders/lib/work.glsl).

use crate::render::film::tiling::BLOCK_TILES;
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::layout::queue;

/// Workgroups for each thread where they draw. A driver may have more threads than the program knows of, and a workgroup that finds
/// nothing to draw costs next to nothing.
const GROUPS_OF_THREAD: u32 = 4;
/// Pieces for each thread that a dispatch is to have.
const WORK_ITEMS_PER_THREAD: u32 = 64;

/// To whom the pieces of work go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum WorkDistribution {
    /// Each to a workgroup of its own.
    ToWorkgroups,
    /// To a few workgroups of the queue, which draw, for so many threads of a CPU; a piece may be several tiles.
    Drawn { threads: u32 },
    /// Without a queue: each subgroup draws once. There are half as many workgroups again as pieces, but at most so many: of two
    /// threads, each of which has an equal share of them, one may do up to three times as much as the other.
    DrawnOnce { most: u32 },
}

impl WorkDistribution {
    /// Of the queue, whose loops have such a budget, for so many threads of a CPU, with a driver of which this is known.
    pub fn of_queue(loop_budget: u32, threads: u32, traits: &DriverTraits) -> Self {
        // What the driver bounds an invocation by would bound all that it draws.
        if loop_budget == 0 && traits.loop_budget == 0 { Self::Drawn { threads } } else { Self::ToWorkgroups }
    }

    /// Whether workgroups or subgroups draw.
    pub fn is_drawn(self) -> bool {
        matches!(self, Self::Drawn { .. } | Self::DrawnOnce { .. })
    }

    /// Pieces of a dispatch, at most, if there can be so many workgroups.
    pub fn most_work_items(self, most_workgroups: u32) -> u32 {
        if matches!(self, Self::Drawn { .. }) { u32::MAX } else { most_workgroups }
    }

    /// Workgroups of a dispatch of so many pieces.
    pub fn workgroups(self, work_items: u32) -> u32 {
        match self {
            Self::ToWorkgroups => work_items,
            Self::Drawn { threads } => work_items.min(threads.saturating_mul(GROUPS_OF_THREAD)),
            Self::DrawnOnce { most } => work_items.saturating_add(work_items.div_ceil(2)).min(most),
        }
    }

    /// The binary logarithm of the tiles that are a piece in a dispatch that takes every n-th of the tiles from such a one on,
    /// `tiles` of them, for so many new samples of each pixel.
    ///
    /// At the end of a piece few lanes are busy: with 64 paths that takes longer than the rest.
    pub fn tile_bits(self, first_tile: u32, tiles: u32, n: u32, samples: u32) -> u32 {
        let Self::Drawn { threads } = self else { return 0 };
        let fit = (queue::PATHS / queue::TILE / samples.max(1)).min(tiles / (WORK_ITEMS_PER_THREAD * threads));
        let most = fit.clamp(1, BLOCK_TILES).ilog2();
        if n > 1 { 0 } else { most.min(first_tile.trailing_zeros()) }
    }
}

#[cfg(test)]
mod tests {
    use super::WorkDistribution;

    #[test]
    fn few_workgroups_draw() {
        let threads = 2;
        assert_eq!(WorkDistribution::ToWorkgroups.workgroups(1000), 1000);
        let drawn = WorkDistribution::Drawn { threads };
        assert_eq!([0, 1, 7, 1000].map(|work_items| drawn.workgroups(work_items)), [0, 1, 7, 8]);
    }

    #[test]
    fn subgroups_that_draw_once_are_enough_and_not_too_many() {
        let drawn = WorkDistribution::DrawnOnce { most: 1200 };
        assert_eq!([0, 1, 7, 1000, 1200].map(|work_items| drawn.workgroups(work_items)), [0, 2, 11, 1200, 1200]);
        assert_eq!(drawn.most_work_items(1200), 1200);
        assert_eq!(WorkDistribution::Drawn { threads: 2 }.most_work_items(1200), u32::MAX);
    }

    #[test]
    fn few_samples_are_taken_in_many_tiles_of_a_block() {
        let bits = |first, tiles, samples| WorkDistribution::Drawn { threads: 2 }.tile_bits(first, tiles, 1, samples);
        assert_eq!([1, 2, 4, 5, 8, 17, 32].map(|samples| bits(0, 1 << 16, samples)), [5, 4, 3, 2, 2, 0, 0]);
        // Each thread gets many pieces.
        assert_eq!([1, 255, 256, 1024, 1 << 20].map(|tiles| bits(0, tiles, 1)), [0, 0, 1, 3, 5]);
        assert_eq!([1, 2, 12, 48, 64].map(|first| bits(first, 1 << 16, 1)), [0, 1, 2, 4, 5]);
        assert_eq!(WorkDistribution::Drawn { threads: 2 }.tile_bits(0, 1 << 16, 8, 1), 0);
        assert_eq!(WorkDistribution::ToWorkgroups.tile_bits(0, 1 << 16, 1, 1), 0);
    }
}
