//! The settings that have a name: how options, `bench --vary`, metadata and checkpoints explain, spell, read and write them.

use std::ops::RangeInclusive;

use crate::render::settings::RenderSettings;
use crate::render::settings::feature::{Feature, FeatureFlags};
use crate::render::settings::named::Choice;

/// Who a setting is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Audience {
    /// People who render: an option.
    Everyone,
    /// The same, as a name in [`TechniqueList`](crate::render::TechniqueList): its value where the technique is asked for, and where it is
    /// switched off.
    Technique {
        /// With `+`.
        on: &'static str,
        /// With `-`.
        off: &'static str,
    },
    /// People who work on the renderer: an option that the short help does not show.
    Developers,
}

/// The values of a setting, as text.
#[derive(Debug, Clone)]
pub enum Values {
    /// Names, and what each does; the first is the default.
    Names(Vec<(&'static str, &'static str)>),
    /// `off`, the default, or `on`.
    Switch,
    /// A number.
    Number(RangeInclusive<u32>),
    /// A number, or `auto`, the default.
    NumberOrAuto(RangeInclusive<u32>),
}

impl Values {
    /// What they are, in a sentence that goes on from "expected".
    pub fn expected(&self) -> String {
        match self {
            Self::Names(names) => {
                let names: Vec<_> = names.iter().map(|(name, _)| *name).collect();
                let (last, others) = names.split_last().unwrap_or((&"", &[]));
                format!("{} or {last}", others.join(", "))
            }
            Self::Switch => "off or on".to_owned(),
            Self::Number(range) => format!("an integer from {} to {}", range.start(), range.end()),
            Self::NumberOrAuto(range) => format!("auto or an integer from {} to {}", range.start(), range.end()),
        }
    }
}

/// One setting.
pub struct Setting {
    /// The option, without its hyphens, and the key of `bench --vary`.
    pub name: &'static str,
    /// What it decides, in a short sentence without a full stop.
    pub what: &'static str,
    /// Who it is for.
    pub audience: Audience,
    /// The key in the metadata of images and checkpoints, if the image may depend on the setting.
    pub metadata: Option<&'static str>,
    values: fn() -> Values,
    get: fn(&RenderSettings) -> String,
    set: fn(&mut RenderSettings, &str) -> bool,
}

impl std::fmt::Debug for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Setting {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Setting {}

/// The columns of a setting whose type is a [`Choice`], a `bool`, a `u32`, or an `Option<u32>`.
macro_rules! column {
    ($field:ident) => {
        (|| names(|s| s.$field), |s| s.$field.name().to_owned(), |s, text| replace(&mut s.$field, Choice::named(text)))
    };
    ($field:ident on or off) => {
        (
            || Values::Switch,
            |s| if s.$field { "on" } else { "off" }.to_owned(),
            |s, text| replace(&mut s.$field, ["off", "on"].iter().position(|name| *name == text).map(|i| i == 1)),
        )
    };
    ($field:ident in $range:expr) => {
        (|| Values::Number($range), |s| s.$field.to_string(), |s, text| replace(&mut s.$field, number(text, $range)))
    };
    ($field:ident auto or $range:expr) => {
        (
            || Values::NumberOrAuto($range),
            |s| s.$field.map_or("auto".to_owned(), |n| n.to_string()),
            |s, text| {
                let value = if text == "auto" { Some(None) } else { number(text, $range).map(Some) };
                replace(&mut s.$field, value)
            },
        )
    };
}

type Columns = (fn() -> Values, fn(&RenderSettings) -> String, fn(&mut RenderSettings, &str) -> bool);

impl Setting {
    const fn new(
        name: &'static str,
        audience: Audience,
        metadata: Option<&'static str>,
        (values, get, set): Columns,
        what: &'static str,
    ) -> Self {
        Self { name, what, audience, metadata, values, get, set }
    }

    /// All of them, in the order in which they are shown.
    pub const ALL: &'static [Self] = {
        use Audience::{Developers, Everyone, Technique};
        &[
            Self::new("seed", Everyone, Some("Seed"), column!(seed in 0..=u32::MAX), "Selects the random numbers"),
            Self::new(
                "reuse",
                Technique { on: "always", off: "off" },
                Some("Reuse"),
                column!(reuse),
                "Eight neighbouring pixels share their indirect light",
            ),
            Self::new(
                "gradients",
                Technique { on: "auto", off: "off" },
                Some("Gradients"),
                column!(gradients),
                "The image is made from its pixels and from differences between them; needs reuse",
            ),
            Self::new(
                "sample-map",
                Technique { on: "auto", off: "off" },
                Some("SampleMap"),
                column!(sample_map),
                "Noisy parts of the image, edges of emitters and what is seen through glass get more samples",
            ),
            Self::new(
                "light-samples",
                Technique { on: "auto", off: "one" },
                Some("LightSamples"),
                column!(light_samples),
                "The first diffuse surface of a path samples four lights instead of one; needs reuse",
            ),
            Self::new(
                "light-tracing",
                Technique { on: "auto", off: "off" },
                Some("LightTracing"),
                column!(light_tracing),
                "Light is also traced from emitters, through glass and by mirrors; not together with reuse",
            ),
            Self::new("sampler", Developers, Some("Sampler"), column!(sampler), "Random numbers"),
            Self::new("intersection", Developers, Some("Intersection"), column!(triangle_test), "Ray–triangle test"),
            Self::new("accel", Developers, Some("Accel"), column!(accel), "How triangles are found"),
            Self::new("scheduler", Developers, None, column!(scheduler), "When rays traverse the BVH; same image"),
            Self::new(
                "features",
                Developers,
                None,
                (feature_values, feature_name, set_feature),
                "What is compiled into the kernel: specialised, general, or + and a feature (see info); same image",
            ),
            Self::new(
                "workgroup",
                Developers,
                None,
                column!(workgroup_size auto or 1..=1024),
                "Invocations of a workgroup; same image",
            ),
            Self::new(
                "samples-per-dispatch",
                Developers,
                None,
                column!(samples_per_dispatch auto or 1..=u32::MAX),
                "Samples per pixel of one dispatch; same image",
            ),
            Self::new(
                "loop-budget",
                Developers,
                Some("LoopBudget"),
                column!(loop_budget auto or 0..=u32::MAX),
                "Loop iterations of an invocation, 0 for no bound; same image unless the pilot pass does not fit",
            ),
            Self::new(
                "count-steps",
                Developers,
                None,
                column!(count_steps on or off),
                "Count the steps of BVH traversal; a little slower",
            ),
        ]
    };

    /// The one of that name.
    pub fn named(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|setting| setting.name == name)
    }

    /// The values that it may have.
    pub fn values(&self) -> Values {
        (self.values)()
    }

    /// Its value.
    pub fn get(&self, settings: &RenderSettings) -> String {
        (self.get)(settings)
    }

    /// Sets its value.
    ///
    /// # Errors
    /// What was expected, if `value` is none of the setting's.
    pub fn set(&self, settings: &mut RenderSettings, value: &str) -> Result<(), String> {
        if (self.set)(settings, value) { Ok(()) } else { Err(self.values().expected()) }
    }
}

/// Sets what there is a value for; false without one.
fn replace<T>(place: &mut T, value: Option<T>) -> bool {
    value.map(|value| *place = value).is_some()
}

fn number(text: &str, range: RangeInclusive<u32>) -> Option<u32> {
    text.parse().ok().filter(|n| range.contains(n))
}

fn names<T: Choice>(_: fn(&RenderSettings) -> T) -> Values {
    Values::Names(T::ALL.iter().map(|&(name, _, what)| (name, what)).collect())
}

fn feature_values() -> Values {
    let always = [("specialised", "What the scene needs"), ("general", "Everything")];
    let one_more = FeatureFlags::TABLE.iter().map(|row| (row.one_more, "What the scene needs, and this"));
    Values::Names(always.into_iter().chain(one_more).collect())
}

fn feature_name(settings: &RenderSettings) -> String {
    match settings.unneeded {
        _ if settings.general => "general".to_owned(),
        None => "specialised".to_owned(),
        Some(feature) => format!("+{}", feature.name()),
    }
}

fn set_feature(settings: &mut RenderSettings, text: &str) -> bool {
    let (general, unneeded) = match text {
        "specialised" => (false, None),
        "general" => (true, None),
        other => {
            let found = Feature::ALL.into_iter().find(|(name, _)| other.strip_prefix('+') == Some(*name));
            let Some((_, feature)) = found else { return false };
            (false, Some(feature))
        }
    };
    (settings.general, settings.unneeded) = (general, unneeded);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each setting reads what it writes, changes only itself, and begins with its default.
    #[test]
    fn values_are_read_as_they_are_written() {
        let default = RenderSettings::default();
        for setting in Setting::ALL {
            let values = match setting.values() {
                Values::Names(names) => names.into_iter().map(|(name, _)| name.to_owned()).collect(),
                Values::Switch => vec!["off".to_owned(), "on".to_owned()],
                Values::Number(range) => vec![range.start().to_string(), range.end().to_string()],
                Values::NumberOrAuto(range) => {
                    vec!["auto".to_owned(), range.start().to_string(), range.end().to_string()]
                }
            };
            assert_eq!(setting.get(&default), values[0], "{setting:?}");
            for value in &values {
                let mut settings = default.clone();
                assert_eq!(setting.set(&mut settings, value), Ok(()), "{setting:?}={value}");
                assert_eq!(setting.get(&settings), *value, "{setting:?}");
                assert_eq!(settings == default, *value == values[0], "{setting:?}={value}");
                let others = Setting::ALL.iter().filter(|other| *other != setting);
                others.for_each(|other| assert_eq!(other.get(&settings), other.get(&default), "{setting:?}={value}"));
            }
            let mut settings = default.clone();
            assert!(setting.set(&mut settings, "purple").unwrap_err().contains(&*values[0]), "{setting:?}");
            assert_eq!(settings, default);
            if let Audience::Technique { on, off } = setting.audience {
                assert!([on, off].iter().all(|value| values.iter().any(|v| v == value)), "{setting:?}");
            }
        }
    }

    #[test]
    fn names_and_keys_are_there_once() {
        for (i, setting) in Setting::ALL.iter().enumerate() {
            assert!(!Setting::ALL[..i].contains(setting), "{setting:?}");
            let same_key = |other: &Setting| setting.metadata.is_some() && other.metadata == setting.metadata;
            assert!(!Setting::ALL[..i].iter().any(same_key), "{setting:?}");
        }
    }
}
