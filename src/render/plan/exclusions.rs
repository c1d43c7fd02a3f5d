//! Which techniques cannot be used together.

use crate::render::error::RenderError;
use crate::render::kernel::Schedule;

/// The techniques of a rendering, once it is decided which are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Combination {
    pub schedule: Schedule,
    /// Every triangle is tested.
    pub brute_force: bool,
    /// Several invocations share a pixel.
    pub split: bool,
    pub reuse: bool,
    pub gradients: bool,
    /// Light samples of a first diffuse hit.
    pub light_samples: u32,
    pub light_tracing: bool,
    /// All rays of the camera start in one point.
    pub pinhole: bool,
    /// What is seen through glass gets more samples.
    pub glass: bool,
}

impl Combination {
    /// Checks what the shaders rely on.
    ///
    /// # Errors
    /// Two techniques exclude each other, or one lacks another that it needs.
    pub fn check(&self) -> Result<(), RenderError> {
        let rules = [
            (self.gradients && !self.reuse, "gradients need reuse"),
            (self.light_samples > 1 && !self.reuse, "several light samples need reuse"),
            (self.glass && !self.light_tracing, "more samples at glass need light tracing"),
            (self.reuse && self.light_tracing, "reuse excludes light tracing"),
            (self.reuse && self.brute_force, "reuse excludes brute force"),
            (self.reuse && self.split, "reuse excludes several invocations for a pixel"),
            (self.reuse && self.schedule == Schedule::Interleaved, "reuse excludes the interleaved scheduler"),
            (self.split && self.schedule == Schedule::Queue, "the queue excludes several invocations for a pixel"),
            (self.light_tracing && !self.pinhole, "light tracing needs a pinhole"),
            (self.light_tracing && self.brute_force, "light tracing excludes brute force"),
        ];
        match rules.iter().find(|(broken, _)| *broken) {
            Some((_, rule)) => Err(RenderError::Settings(format!("techniques contradict each other: {rule}"))),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALONE: Combination = Combination {
        schedule: Schedule::Inline,
        brute_force: false,
        split: false,
        reuse: false,
        gradients: false,
        light_samples: 1,
        light_tracing: false,
        pinhole: true,
        glass: false,
    };

    #[test]
    fn techniques_that_exclude_each_other_are_an_error() {
        let shared = Combination { reuse: true, gradients: true, light_samples: 4, ..ALONE };
        let traced = Combination { light_tracing: true, glass: true, ..ALONE };
        let split = Combination { split: true, ..ALONE };
        for good in [ALONE, shared, traced, split, Combination { schedule: Schedule::Queue, ..shared }] {
            assert!(good.check().is_ok(), "{good:?}");
        }
        for (bad, said) in [
            (Combination { reuse: false, light_samples: 1, ..shared }, "gradients need reuse"),
            (Combination { light_samples: 4, ..ALONE }, "light samples need reuse"),
            (Combination { glass: true, ..ALONE }, "need light tracing"),
            (Combination { light_tracing: true, ..shared }, "excludes light tracing"),
            (Combination { brute_force: true, ..shared }, "excludes brute force"),
            (Combination { split: true, ..shared }, "excludes several invocations"),
            (Combination { schedule: Schedule::Interleaved, ..shared }, "excludes the interleaved scheduler"),
            (Combination { schedule: Schedule::Queue, ..split }, "the queue excludes"),
            (Combination { pinhole: false, ..traced }, "needs a pinhole"),
            (Combination { brute_force: true, ..traced }, "light tracing excludes brute force"),
        ] {
            let error = bad.check().unwrap_err().to_string();
            assert!(error.contains(said), "{bad:?}: {error}");
        }
    }
}
