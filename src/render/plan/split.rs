//! How many invocations take the samples of a pixel (shaders/lib/split.glsl).
//! What the numbers below gain: docs/notebook.md, "Several invocations for a pixel".

/// Of a pixel, at most.
const MOST: u64 = 8;
/// At least, where some pixels take much longer than others and the device holds an invocation for each.
const FEW: u64 = 4;
/// Samples that are recorded, over all pixels, at most: 64 MiB.
const RECORDED: u64 = 1 << 22;

/// Who takes the samples of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Split {
    /// Invocations, a power of two.
    pub invocations: u32,
    /// Samples of a pixel in a dispatch, at most.
    pub most_samples: u32,
}

/// What bounds the choice.
pub(crate) struct Bounds {
    /// Whether some pixels take much longer than others, because their rays traverse a BVH.
    pub uneven: bool,
    /// Invocations for a pixel that a workgroup has room for.
    pub invocations: u32,
    /// Samples that a buffer has room for.
    pub recorded: u64,
}

impl Split {
    /// One for each pixel.
    pub const NONE: Self = Self { invocations: 1, most_samples: u32::MAX };

    /// As many as are `wanted`, or as make `busy` of an image of so many slots, each of which gets so many samples, and at least [`FEW`]
    /// where pixels are uneven; within bounds.
    pub fn of(wanted: Option<u32>, busy: u64, slots: u64, samples: u32, bounds: &Bounds) -> Self {
        let least = if bounds.uneven && slots <= busy { FEW } else { 0 };
        let fit = (busy / slots.max(1)).max(least).min(u64::from(samples)).min(MOST) as u32;
        let invocations = 1 << wanted.unwrap_or(fit).min(bounds.invocations).max(1).ilog2();
        let most_samples = (RECORDED.min(bounds.recorded) / slots.max(1)).min(u64::from(samples)) as u32;
        // An image that is so large is not split.
        if invocations == 1 || most_samples == 0 { Self::NONE } else { Self { invocations, most_samples } }
    }

    /// Samples to make room for, in dispatches of up to so many slots: whole blocks of the image, and so of whole workgroups.
    pub fn recorded(self, slots: u64) -> u64 {
        if self == Self::NONE { 0 } else { slots * u64::from(self.most_samples) }
    }
}

#[cfg(test)]
mod tests {
    use super::{Bounds, RECORDED, Split};

    const ALL: Bounds = Bounds { uneven: false, invocations: 32, recorded: u64::MAX };

    #[test]
    fn small_images_are_split() {
        let of = |slots, samples| Split::of(None, 1 << 19, slots, samples, &ALL).invocations;
        assert_eq!([1 << 16, 1 << 17, 1 << 18, 1 << 19, 1 << 30].map(|slots| of(slots, 64)), [8, 4, 2, 1, 1]);
        assert_eq!([1, 2, 3, 7, 100].map(|samples| of(4096, samples)), [1, 2, 2, 4, 8]);
        assert_eq!(Split::of(None, 0, 64, 64, &ALL), Split::NONE);
        assert_eq!(Split::of(Some(1), 1 << 19, 64, 64, &ALL), Split::NONE);
        let uneven = Bounds { uneven: true, ..ALL };
        let of = |slots| Split::of(None, 1 << 19, slots, 64, &uneven).invocations;
        assert_eq!([1 << 16, 1 << 17, 1 << 19, (1 << 19) + 1].map(of), [8, 4, 4, 1]);
        let four = Bounds { invocations: 4, ..ALL };
        assert_eq!([3, 4, 100].map(|n| Split::of(Some(n), 0, 64, 64, &four).invocations), [2, 4, 4]);
        assert_eq!(Split::of(Some(4), 0, 1 << 23, 64, &ALL), Split::NONE);
    }

    #[test]
    fn there_is_room_for_what_is_noted() {
        assert_eq!(Split::NONE.recorded(1 << 16), 0);
        let of = |samples, recorded| Split::of(Some(8), 0, 10_240, samples, &Bounds { recorded, ..ALL });
        // Few samples need little, and a small buffer has room for few.
        assert_eq!((of(3, u64::MAX).most_samples, of(3, u64::MAX).recorded(10_240)), (3, 30_720));
        assert_eq!(of(1000, u64::MAX).most_samples, 409);
        for recorded in [0, 1 << 13, 1 << 16, 1 << 20, RECORDED] {
            assert!(of(1000, recorded).recorded(10_240) <= recorded, "{recorded}");
        }
        assert_eq!(of(1000, 1 << 13), Split::NONE);
    }
}
