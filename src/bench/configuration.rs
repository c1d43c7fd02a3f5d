//! What is set side by side: settings that change the time or the noise of an image, never its expectation.

use std::str::FromStr;

use crate::render::{
    Accel, Adaptive, Choice, Feature, Gradients, LightSamples, LightTracing, RenderSettings, Reuse, SampleMap, Sampler,
    Scheduler, TriangleTest,
};

use crate::bench::error::BenchError;

/// One way to render a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// What differs from the others, for tables and plots.
    pub label: String,
    /// Settings; the number of samples and the seed are the benchmark's.
    pub settings: RenderSettings,
    /// First hit that may end a path at random (`Some(None)`: never) instead of the scene's.
    pub roulette: Option<Option<u32>>,
    /// Vulkan device instead of the default.
    pub device: Option<String>,
}

impl Configuration {
    /// The settings as they are.
    pub fn plain(settings: &RenderSettings) -> Self {
        Self { label: "default".to_owned(), settings: settings.clone(), roulette: None, device: None }
    }
}

/// A setting and the values it takes, written `KEY=VALUE,VALUE…`.
///
/// Keys and values are those of the options of `photolith render` (`sampler`, `accel`, `intersection`, `scheduler`, `reuse`,
/// `gradients`, `sample-map`, `light-samples`, `light-tracing`: see [`Choice`]), and `sampling` (uniform, dual: in two
/// independent halves), `features` (specialised, general, or `+` and one of [`Feature::ALL`] that is compiled although not
/// needed), `roulette` (off, or the first hit), `device` (index, name or UUID).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Vary {
    key: Key,
    values: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    Sampler,
    Accel,
    Intersection,
    Scheduler,
    Reuse,
    Gradients,
    SampleMap,
    LightSamples,
    LightTracing,
    Sampling,
    Features,
    Roulette,
    Device,
}

const KEYS: [(&str, Key); 13] = [
    ("sampler", Key::Sampler),
    ("accel", Key::Accel),
    ("intersection", Key::Intersection),
    ("scheduler", Key::Scheduler),
    ("reuse", Key::Reuse),
    ("gradients", Key::Gradients),
    ("sample-map", Key::SampleMap),
    ("light-samples", Key::LightSamples),
    ("light-tracing", Key::LightTracing),
    ("sampling", Key::Sampling),
    ("features", Key::Features),
    ("roulette", Key::Roulette),
    ("device", Key::Device),
];

/// The names of a setting's values: `a, b or c`.
fn one_of<T: Choice>() -> String {
    let names: Vec<_> = T::ALL.iter().map(|value| value.0).collect();
    let (last, others) = names.split_last().unwrap_or((&"", &[]));
    format!("{} or {last}", others.join(", "))
}

/// Gives a setting the value of that name; false if it has none.
fn choose<T: Choice>(setting: &mut T, name: &str) -> bool {
    T::named(name).map(|value| *setting = value).is_some()
}

impl Key {
    fn name(self) -> &'static str {
        KEYS.iter().find(|k| k.1 == self).map_or("", |k| k.0)
    }

    /// What its values are.
    fn expected(self) -> String {
        match self {
            Self::Sampler => one_of::<Sampler>(),
            Self::Accel => one_of::<Accel>(),
            Self::Intersection => one_of::<TriangleTest>(),
            Self::Scheduler => one_of::<Scheduler>(),
            Self::Reuse => one_of::<Reuse>(),
            Self::Gradients => one_of::<Gradients>(),
            Self::SampleMap => one_of::<SampleMap>(),
            Self::LightSamples => one_of::<LightSamples>(),
            Self::LightTracing => one_of::<LightTracing>(),
            Self::Sampling => "uniform or dual".to_owned(),
            Self::Features => {
                let names = Feature::ALL.map(|(name, _)| name).join(", ");
                format!("specialised, general, or + and one of {names}")
            }
            Self::Roulette => "off or the first hit that may end a path, at least 1".to_owned(),
            Self::Device => "an index, a name or a UUID".to_owned(),
        }
    }

    /// Sets `value`; false if it is none of this key's.
    fn set(self, value: &str, c: &mut Configuration) -> bool {
        let s = &mut c.settings;
        match (self, value) {
            (Self::Sampler, name) => return choose(&mut s.sampler, name),
            (Self::Accel, name) => return choose(&mut s.accel, name),
            (Self::Intersection, name) => return choose(&mut s.triangle_test, name),
            (Self::Scheduler, name) => return choose(&mut s.scheduler, name),
            (Self::Reuse, name) => return choose(&mut s.reuse, name),
            (Self::Gradients, name) => return choose(&mut s.gradients, name),
            (Self::SampleMap, name) => return choose(&mut s.sample_map, name),
            (Self::LightSamples, name) => return choose(&mut s.light_samples, name),
            (Self::LightTracing, name) => return choose(&mut s.light_tracing, name),
            (Self::Sampling, "uniform") => s.adaptive = None,
            // All samples, in two halves.
            (Self::Sampling, "dual") => s.adaptive = Some(Adaptive { noise: 0.0 }),
            (Self::Features, "specialised") => (s.general, s.unneeded) = (false, None),
            (Self::Features, "general") => (s.general, s.unneeded) = (true, None),
            (Self::Features, feature) => {
                let found = Feature::ALL.iter().find(|(name, _)| feature.strip_prefix('+') == Some(*name));
                let Some(&(_, feature)) = found else { return false };
                (s.general, s.unneeded) = (false, Some(feature));
            }
            (Self::Roulette, "off") => c.roulette = Some(None),
            (Self::Roulette, first) => match first.parse() {
                Ok(first) if first > 0 => c.roulette = Some(Some(first)),
                _ => return false,
            },
            (Self::Device, device) if !device.is_empty() => c.device = Some(device.to_owned()),
            _ => return false,
        }
        true
    }
}

impl Vary {
    /// Checks settings that are to be varied together: each once.
    ///
    /// # Errors
    /// [`BenchError::Vary`] for one that is there again.
    pub fn check(varied: &[Self]) -> Result<(), BenchError> {
        let again = varied.iter().enumerate().find(|(i, v)| varied[..*i].iter().any(|earlier| earlier.key == v.key));
        again.map_or(Ok(()), |(_, vary)| {
            let name = vary.key.name();
            let problem = format!("'{name}' is given twice, expected all its values in one list");
            Err(BenchError::Vary { text: format!("{name}={}", vary.values.join(",")), problem })
        })
    }

    /// The fewest samples per pixel that all values can render.
    pub fn least_samples(&self) -> u32 {
        let dual = self.key == Key::Sampling && self.values.iter().any(|v| v == "dual");
        if dual { Adaptive::LEAST_SAMPLES } else { 1 }
    }
}

impl FromStr for Vary {
    type Err = BenchError;

    fn from_str(text: &str) -> Result<Self, BenchError> {
        let error = |problem: String| BenchError::Vary { text: text.to_owned(), problem };
        let names = || KEYS.map(|k| k.0).join(", ");
        let (key, values) =
            text.split_once('=').ok_or_else(|| error(format!("expected KEY=VALUE,VALUE with one of {}", names())))?;
        let &(_, key) = KEYS
            .iter()
            .find(|k| k.0 == key)
            .ok_or_else(|| error(format!("unknown setting '{key}', expected one of {}", names())))?;
        let values: Vec<_> = values.split(',').map(|v| v.trim().to_owned()).collect();
        let mut scratch = Configuration::plain(&RenderSettings::default());
        for (i, value) in values.iter().enumerate() {
            if values[..i].contains(value) {
                return Err(error(format!("the value '{value}' twice, expected different ones")));
            }
            if !key.set(value, &mut scratch) {
                return Err(error(format!("the value '{value}', expected {}", key.expected())));
            }
        }
        Ok(Self { key, values })
    }
}

/// Every combination of the values: the first setting varies slowest.
pub fn combine(settings: &RenderSettings, varied: &[Vary]) -> Vec<Configuration> {
    let mut all = vec![Configuration { label: String::new(), ..Configuration::plain(settings) }];
    // A setting of one value says nothing that tells configurations apart, unless there is nothing else.
    let several = varied.iter().any(|v| v.values.len() > 1);
    for vary in varied {
        all = all
            .iter()
            .flat_map(|base| {
                vary.values.iter().map(|value| {
                    let mut c = base.clone();
                    // Values were checked when they were parsed.
                    vary.key.set(value, &mut c);
                    if vary.values.len() > 1 || !several {
                        let comma = if c.label.is_empty() { "" } else { ", " };
                        c.label = format!("{}{comma}{}={value}", c.label, vary.key.name());
                    }
                    c
                })
            })
            .collect();
    }
    for c in &mut all {
        if c.label.is_empty() {
            c.label = "default".to_owned();
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_combinations_in_order() {
        let varied: Vec<Vary> =
            ["sampler=sobol,independent", "accel=bvh", "roulette=off,3"].map(|t| t.parse().unwrap()).to_vec();
        let all = combine(&RenderSettings::default(), &varied);
        let labels: Vec<_> = all.iter().map(|c| c.label.as_str()).collect();
        assert_eq!(
            labels,
            [
                "sampler=sobol, roulette=off",
                "sampler=sobol, roulette=3",
                "sampler=independent, roulette=off",
                "sampler=independent, roulette=3"
            ]
        );
        assert_eq!((all[3].settings.sampler, all[3].roulette), (Sampler::Independent, Some(Some(3))));
        assert_eq!(all[0].roulette, Some(None));
        assert_eq!(combine(&RenderSettings::default(), &[])[0].label, "default");
        assert_eq!(combine(&RenderSettings::default(), &varied[1..2])[0].label, "accel=bvh");
    }

    #[test]
    fn errors_say_what_was_expected() {
        for (text, said) in [
            ("sampler", "expected KEY=VALUE"),
            ("colour=red", "unknown setting 'colour'"),
            ("sampler=sobol,halton", "'halton', expected sobol, independent or pcg"),
            ("scheduler=fast", "'fast', expected auto, inline, interleaved or queue"),
            ("roulette=0", "'0', expected off or the first hit"),
            ("features=+halo", "'+halo', expected specialised, general, or + and one of"),
            ("device=", "'', expected an index"),
            ("sampler=sobol,pcg,sobol", "the value 'sobol' twice"),
        ] {
            let error = text.parse::<Vary>().unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        let varied = ["sampler=sobol", "accel=bvh", "sampler=pcg"].map(|t| t.parse::<Vary>().unwrap());
        assert!(Vary::check(&varied[..2]).is_ok());
        let error = Vary::check(&varied).unwrap_err().to_string();
        assert!(error.contains("'sampler=pcg' cannot be varied: 'sampler' is given twice"), "{error}");
    }
}
