//! How many invocations take the samples of a pixel (shaders/lib/split.glsl).
//!
//! Four of them for 256×256 pixels of 64 samples take .51 to .59 of the time where there is a mesh (.76 if it is of glass), .56 to .95
//! in rooms of balls and boxes (H200; eight .96 to 1.1 of that). For 512×512 pixels they take .77 to 1.23, for 1024×1024 two 1.05 to
//! 1.6: more than the device holds at a time only wait.

/// Of a pixel, at most.
const MOST: u64 = 8;
/// Samples that are noted, over all pixels, at most: 64 MiB.
const NOTED: u64 = 1 << 22;

/// Who takes the samples of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Split {
    /// Invocations, a power of two.
    pub invocations: u32,
    /// Samples of a pixel in a dispatch, at most.
    pub most_samples: u32,
}

impl Split {
    /// One of each.
    pub const NONE: Self = Self { invocations: 1, most_samples: u32::MAX };

    /// As many as are `wanted`, or as make `busy` of an image of so many slots, each of which gets so many samples; but not more
    /// than `most`.
    pub fn of(wanted: Option<u32>, busy: u64, slots: u64, samples: u32, most: u32) -> Self {
        let fit = (busy / slots.max(1)).min(u64::from(samples)).min(MOST) as u32;
        let invocations = 1 << wanted.unwrap_or(fit).min(most).max(1).ilog2();
        // An image that is so large is not split.
        let most_samples = (NOTED / slots.max(1)).min(u64::from(u32::MAX)) as u32;
        if invocations == 1 || most_samples == 0 { Self::NONE } else { Self { invocations, most_samples } }
    }

    /// Samples to make room for, in dispatches of up to so many slots, of which workgroups take whole numbers.
    pub fn noted(self, slots: u64, workgroup: u32) -> u64 {
        match self {
            Self::NONE => 0,
            _ => slots.next_multiple_of(u64::from(workgroup)) * u64::from(self.most_samples),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Split;

    #[test]
    fn small_images_are_split() {
        let of = |slots, samples| Split::of(None, 1 << 19, slots, samples, 32).invocations;
        assert_eq!([1 << 16, 1 << 17, 1 << 18, 1 << 19, 1 << 30].map(|slots| of(slots, 64)), [8, 4, 2, 1, 1]);
        assert_eq!([1, 2, 3, 7, 100].map(|samples| of(4096, samples)), [1, 2, 2, 4, 8]);
        assert_eq!(Split::of(None, 0, 64, 64, 32), Split::NONE);
        assert_eq!(Split::of(Some(1), 1 << 19, 64, 64, 32), Split::NONE);
        assert_eq!([3, 4, 100].map(|n| Split::of(Some(n), 0, 64, 64, 4).invocations), [2, 4, 4]);
        assert_eq!(Split::of(Some(4), 0, 1 << 23, 64, 32), Split::NONE);
    }

    #[test]
    fn there_is_room_for_what_is_noted() {
        assert_eq!(Split::NONE.noted(1 << 16, 128), 0);
        let split = Split::of(None, 1 << 19, 60_000, 64, 32);
        assert_eq!((split.most_samples, split.noted(60_000, 128)), (69, 69 * 60_032));
    }
}
