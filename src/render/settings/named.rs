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
        ("independent", Self::Independent, "A hash: independent numbers, with more noise"),
        ("pcg", Self::Pcg, "PCG (O'Neill 2014), slower"),
    ];
}

impl Choice for TriangleTest {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("watertight", Self::Watertight, "Woop, Benthin and Wald (2013): no leaks between triangles"),
        ("moller-trumbore", Self::MollerTrumbore, "Möller and Trumbore (1997); may leak at shared edges"),
    ];
}

impl Choice for Accel {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        (
            "auto",
            Self::Auto,
            "The hierarchy, or on GPUs ray queries where a trial shows that they are faster; same image",
        ),
        ("bvh", Self::Bvh, "A bounding volume hierarchy"),
        ("none", Self::None, "Every triangle is tested"),
        ("ray-query", Self::RayQuery, "The device's ray queries find leaves of the hierarchy; same image"),
        (
            "ray-query-triangles",
            Self::RayQueryTriangles,
            "Experimental: ray queries test triangles, in the device's own way; another image at edges",
        ),
    ];
}

impl Choice for Scheduler {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "Whichever is fastest on the device"),
        ("inline", Self::Inline, "Each lane traverses the BVH for each of its rays at once"),
        ("interleaved", Self::Interleaved, "Lanes whose rays are done shade while others traverse; not with reuse"),
        ("queue", Self::Queue, "Rays wait until a whole subgroup traverses the BVH together"),
    ];
}

impl Choice for Reuse {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "Where a pilot pass shows that it pays; on GPUs in long renderings only"),
        ("always", Self::Always, "Wherever the scene and the device allow it"),
        ("off", Self::Off, "Never"),
    ];
}

impl Choice for Gradients {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "With reuse, from 2 samples per pixel on, where the pilot pass shows that they pay"),
        ("off", Self::Off, "Never"),
    ];
}

impl Choice for SampleMap {
    const ALL: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "Where it pays, in the time of as many samples everywhere"),
        ("off", Self::Off, "Never"),
    ];
}

impl Choice for LightSamples {
    const ALL: &'static [(&'static str, Self, &'static str)] =
        &[("auto", Self::Auto, "Four, with reuse and more light than a point"), ("one", Self::One, "One")];
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
        assert_eq!(names::<Accel>(), ["auto", "bvh", "none", "ray-query", "ray-query-triangles"]);
        assert_eq!(names::<Scheduler>(), ["auto", "inline", "interleaved", "queue"]);
        assert_eq!(names::<Reuse>(), ["auto", "always", "off"]);
        assert_eq!(names::<LightSamples>(), ["auto", "one"]);
        for names in [names::<Gradients>(), names::<SampleMap>(), names::<LightTracing>()] {
            assert_eq!(names, ["auto", "off"]);
        }
    }
}
