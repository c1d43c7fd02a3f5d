//! What is set side by side: settings that change the time or the noise of an image, never its expectation.

use std::str::FromStr;

use crate::render::{Adaptive, Audience, RenderSettings, Setting};

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
/// Keys and values are those of the table of settings ([`Setting::ALL`], but for the seed), and `sampling` (uniform, dual: in two
/// independent halves), `roulette` (off, or the first hit), `device` (index, name or UUID).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Vary {
    key: Key,
    values: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    Setting(&'static Setting),
    Sampling,
    Roulette,
    Device,
}

impl Key {
    fn all() -> impl Iterator<Item = Self> {
        let varied = |setting: &&Setting| setting.audience != Audience::Everyone;
        let settings = Setting::ALL.iter().filter(varied).map(Self::Setting);
        settings.chain([Self::Sampling, Self::Roulette, Self::Device])
    }

    fn name(self) -> &'static str {
        match self {
            Self::Setting(setting) => setting.name,
            Self::Sampling => "sampling",
            Self::Roulette => "roulette",
            Self::Device => "device",
        }
    }

    /// Sets `value`.
    ///
    /// # Errors
    /// What was expected, if it is none of this key's.
    fn set(self, value: &str, c: &mut Configuration) -> Result<(), String> {
        let expected = |what: &str| Err(what.to_owned());
        match (self, value) {
            (Self::Setting(setting), _) => return setting.set(&mut c.settings, value),
            (Self::Sampling, "uniform") => c.settings.adaptive = None,
            // All samples, in two halves.
            (Self::Sampling, "dual") => c.settings.adaptive = Some(Adaptive { noise: 0.0 }),
            (Self::Sampling, _) => return expected("uniform or dual"),
            (Self::Roulette, "off") => c.roulette = Some(None),
            (Self::Roulette, first) => match first.parse() {
                Ok(first) if first > 0 => c.roulette = Some(Some(first)),
                _ => return expected("off or the first hit that may end a path, at least 1"),
            },
            (Self::Device, "") => return expected("an index, a name or a UUID"),
            (Self::Device, device) => c.device = Some(device.to_owned()),
        }
        Ok(())
    }
}

impl Vary {
    /// The keys, with commas between them.
    pub fn keys() -> String {
        Key::all().map(Key::name).collect::<Vec<_>>().join(", ")
    }

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
        let (key, values) = text
            .split_once('=')
            .ok_or_else(|| error(format!("expected KEY=VALUE,VALUE with one of {}", Self::keys())))?;
        let key = Key::all()
            .find(|k| k.name() == key)
            .ok_or_else(|| error(format!("unknown setting '{key}', expected one of {}", Self::keys())))?;
        let values: Vec<_> = values.split(',').map(|v| v.trim().to_owned()).collect();
        let mut scratch = Configuration::plain(&RenderSettings::default());
        for (i, value) in values.iter().enumerate() {
            if values[..i].contains(value) {
                return Err(error(format!("the value '{value}' twice, expected different ones")));
            }
            key.set(value, &mut scratch)
                .map_err(|expected| error(format!("the value '{value}', expected {expected}")))?;
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
                    let _ = vary.key.set(value, &mut c);
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
    use crate::render::Sampler;

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
            ("features=+halo", "'+halo', expected specialised, general, +diffuse"),
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
