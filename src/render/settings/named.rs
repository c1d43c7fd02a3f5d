//! The names of values, as options and tables spell them.

use crate::render::settings::{
    Accel, Gradients, LightSamples, LightTracing, Reuse, SampleMap, Sampler, Scheduler, TriangleTest,
};

/// A setting of a few values that have names.
pub trait Choice: Copy + PartialEq + Default + Send + Sync + 'static {
    /// Every value: its name, and what it does in a phrase.
    const ALL: &'static [(&'static str, Self, &'static str)];

    /// The name of a value.
    fn name(self) -> &'static str {
        Self::ALL.iter().find(|value| value.1 == self).map_or("", |value| value.0)
    }

    /// The value of that name.
    fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|value| value.0 == name).map(|value| value.1)
    }
}

impl Choice for Sampler {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("sobol", Self::Sobol, "Owen-scrambled Sobol points"),
        ("independent", Self::Independent, "Independent numbers"),
        ("pcg", Self::Pcg, "PCG (O'Neill 2014), slower; for comparison"),
    ];
}

impl Choice for TriangleTest {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("watertight", Self::Watertight, "Woop, Benthin and Wald: no leaks between triangles"),
        ("moller-trumbore", Self::MollerTrumbore, "Möller and Trumbore (1997); may leak at shared edges"),
    ];
}

impl Choice for Accel {
    const ALL: &'static [(&'static str, Self, &'static str)] =
        &[("bvh", Self::Bvh, "Bounding volume hierarchy"), ("none", Self::None, "None")];
}

impl Choice for Scheduler {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "What is faster on the device"),
        ("inline", Self::Inline, "Each lane traverses the BVH at once"),
        (
            "interleaved",
            Self::Interleaved,
            "Lanes whose rays are done shade while others traverse the BVH (not where paths are reused)",
        ),
        ("queue", Self::Queue, "Paths that need the tree wait, until a whole subgroup traversals it together"),
    ];
}

impl Choice for Reuse {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        (
            "auto",
            Self::Auto,
            "In scenes with indirect light on diffuse surfaces, if a few samples beforehand show that it pays; on GPUs in \
             long renderings",
        ),
        ("always", Self::Always, "The same, whether it pays or not"),
        ("off", Self::Off, "Never"),
    ];
}

impl Choice for Gradients {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "From 2 samples per pixel on, where paths serve several pixels, if most noise is theirs"),
        ("off", Self::Off, "Never"),
    ];
}

impl Choice for SampleMap {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        (
            "auto",
            Self::Auto,
            "Where it pays: half, twice or four times --samples, in the time of as many everywhere (with --samples 1 to 3 \
             nowhere fewer, and up to 1.4 times as many in all); up to 32 times at edges of bright emitters",
        ),
        ("off", Self::Off, "Never"),
    ];
}

impl Choice for LightSamples {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "Four, where paths serve several pixels and there is more than a point light"),
        ("one", Self::One, "One"),
    ];
}

impl Choice for LightTracing {
    const ALL: &'static [(&'static str, Self, &'static str)] =
        &[("auto", Self::Auto, "In scenes with emitters, and glass or mirrors"), ("off", Self::Off, "Never")];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names<T: Choice>() -> Vec<&'static str> {
        for &(name, value, _) in T::ALL {
            assert_eq!(value.name(), name);
            assert!(T::named(name) == Some(value), "{name}");
        }
        assert!(T::named("").is_none());
        // What is not asked for comes first.
        assert!(T::ALL[0].1 == T::default());
        T::ALL.iter().map(|value| value.0).collect()
    }

    #[test]
    fn names_are_those_of_their_values() {
        assert_eq!(names::<Sampler>(), ["sobol", "independent", "pcg"]);
        assert_eq!(names::<TriangleTest>(), ["watertight", "moller-trumbore"]);
        assert_eq!(names::<Accel>(), ["bvh", "none"]);
        assert_eq!(names::<Scheduler>(), ["auto", "inline", "interleaved", "queue"]);
        assert_eq!(names::<Reuse>(), ["auto", "always", "off"]);
        assert_eq!(names::<LightSamples>(), ["auto", "one"]);
        for names in [names::<Gradients>(), names::<SampleMap>(), names::<LightTracing>()] {
            assert_eq!(names, ["auto", "off"]);
        }
    }
}
