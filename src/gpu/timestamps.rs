//! What a queue's timestamps say.

/// How a queue counts time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timestamps {
    /// Bits of a timestamp that count; they begin at zero again where those are used up.
    valid: u64,
    /// Nanoseconds of a tick.
    period: f32,
}

impl Timestamps {
    /// Of a queue with so many valid bits; `None` if it has none, and no timestamps.
    pub fn of(valid_bits: u32, period: f32) -> Option<Self> {
        let unused = u64::BITS.checked_sub(valid_bits)?;
        (valid_bits > 0 && period > 0.0).then(|| Self { valid: u64::MAX >> unused, period })
    }

    /// Seconds from one timestamp to a later one.
    pub fn seconds_between(&self, start: u64, end: u64) -> f64 {
        (end.wrapping_sub(start) & self.valid) as f64 * f64::from(self.period) * 1e-9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_on_where_the_bits_begin_again() {
        for bits in [36, 48, 63, 64] {
            let timestamps = Timestamps::of(bits, 2.0).expect("timestamps");
            let last = u64::MAX >> (64 - bits);
            for (start, end, ticks) in [(5, 5, 0.0), (1000, 4000, 3000.0), (last, 0, 1.0), (last - 9, 20, 30.0)] {
                let seconds = timestamps.seconds_between(start, end);
                assert!((seconds - ticks * 2e-9).abs() <= 1e-12 * seconds, "{bits}: {start} to {end}: {seconds}");
            }
        }
    }

    #[test]
    fn a_queue_without_valid_bits_has_none() {
        assert_eq!(Timestamps::of(0, 1.0), None);
        assert_eq!(Timestamps::of(64, 0.0), None);
    }
}
