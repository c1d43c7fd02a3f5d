//! Which techniques are used, as a list: `auto`, `auto,-gradients`, `none,+reuse`.

use std::str::FromStr;

use crate::render::settings::table::{Audience, Setting};
use crate::render::settings::{RenderSettings, Reuse};

/// A list of techniques: `auto` (the default), `none` or `all`, and names with `+` or `-`. Later items replace earlier ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TechniqueList(Vec<(&'static Setting, &'static str)>);

/// The settings that are techniques, each with its values where it is asked for and where it is switched off.
fn all() -> impl Iterator<Item = (&'static Setting, &'static str, &'static str)> {
    Setting::ALL.iter().filter_map(|setting| match setting.audience {
        Audience::Technique { on, off } => Some((setting, on, off)),
        Audience::Everyone | Audience::Developers => None,
    })
}

impl TechniqueList {
    /// Each technique's name, and what it does.
    pub fn explain() -> impl Iterator<Item = (&'static str, &'static str)> {
        all().map(|(setting, ..)| (setting.name, setting.what))
    }

    /// What a list may hold.
    pub fn expected() -> String {
        let names: Vec<_> = Self::explain().map(|(name, _)| name).collect();
        format!("auto, none, all, or + or - and one of {}", names.join(", "))
    }

    /// Switches them.
    pub fn apply(&self, settings: &mut RenderSettings) {
        for (setting, value) in &self.0 {
            // Values of the table itself.
            let _ = setting.set(settings, value);
        }
    }
}

impl FromStr for TechniqueList {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut values = Vec::new();
        let mut asked_for = Vec::new();
        for (i, item) in text.split(',').map(str::trim).enumerate() {
            let of_all = |value: fn((&'static Setting, &'static str, &'static str)) -> &'static str| {
                all().map(move |row| (row.0, value(row))).collect::<Vec<_>>()
            };
            match item {
                "auto" | "none" | "all" if i > 0 => {
                    return Err(format!("'{item}' comes first in a list, expected + or - and a name after it"));
                }
                "auto" => {}
                "none" => values = of_all(|row| row.2),
                "all" => values = of_all(|row| row.1),
                _ => {
                    let (used, name) = match (item.strip_prefix('+'), item.strip_prefix('-')) {
                        (Some(name), _) => (true, name),
                        (_, Some(name)) => (false, name),
                        _ => return Err(format!("'{item}' is no technique, expected {}", Self::expected())),
                    };
                    let Some((setting, on, off)) = all().find(|row| row.0.name == name) else {
                        return Err(format!("'{item}' is no technique, expected {}", Self::expected()));
                    };
                    values.push((setting, if used { on } else { off }));
                    asked_for.retain(|other| *other != name);
                    if used {
                        asked_for.push(name);
                    }
                }
            }
        }
        let techniques = Self(values);
        let mut settings = RenderSettings::default();
        techniques.apply(&mut settings);
        check(&settings, &asked_for)?;
        Ok(techniques)
    }
}

/// Whether what is asked for by name is possible together. What is left to the renderer never contradicts.
fn check(settings: &RenderSettings, asked_for: &[&str]) -> Result<(), String> {
    let needs_reuse = ["gradients", "light-samples"].into_iter().find(|name| asked_for.contains(name));
    if let (Some(name), Reuse::Off) = (needs_reuse, settings.reuse) {
        return Err(format!("'+{name}' needs reuse, which is off: expected +reuse too"));
    }
    if asked_for.contains(&"light-tracing") && settings.reuse == Reuse::Always {
        return Err("light-tracing and reuse exclude each other, expected one of them".to_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::settings::{Gradients, LightSamples, LightTracing, SampleMap};

    fn settings(text: &str) -> RenderSettings {
        let mut settings = RenderSettings::default();
        text.parse::<TechniqueList>().unwrap().apply(&mut settings);
        settings
    }

    #[test]
    fn lists_switch_what_they_name() {
        let auto = RenderSettings::default();
        let none = RenderSettings {
            reuse: Reuse::Off,
            gradients: Gradients::Off,
            sample_map: SampleMap::Off,
            light_samples: LightSamples::One,
            light_tracing: LightTracing::Off,
            ..auto.clone()
        };
        assert_eq!(settings("auto"), auto);
        assert_eq!(settings("none"), none);
        assert_eq!(settings("all"), RenderSettings { reuse: Reuse::Always, ..auto.clone() });
        let without_gradients = RenderSettings { gradients: Gradients::Off, ..auto };
        assert_eq!(settings("auto,-gradients"), without_gradients);
        assert_eq!(settings("-gradients"), without_gradients);
        assert_eq!(settings("+gradients, -gradients"), without_gradients);
        assert_eq!(settings("none,+reuse"), RenderSettings { reuse: Reuse::Always, ..none });
    }

    #[test]
    fn errors_name_what_there_is() {
        for (text, said) in [
            ("", "'' is no technique, expected auto, none, all, or + or - and one of reuse, gradients, sample-map"),
            ("reuse", "'reuse' is no technique"),
            ("auto,+halo", "'+halo' is no technique"),
            ("+reuse,none", "'none' comes first"),
            ("none,+gradients", "'+gradients' needs reuse"),
            ("-reuse,+light-samples", "'+light-samples' needs reuse"),
            ("+reuse,+light-tracing", "exclude each other"),
        ] {
            let error = text.parse::<TechniqueList>().unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
    }
}
