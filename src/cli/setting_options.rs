//! The options of settings, made from their table.

use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};
use photolith::RenderSettings;
use photolith::render::{Audience, Setting, TechniqueList, Values};

use super::heading;

const TECHNIQUES: &str = "techniques";

/// Values of settings, and which techniques are used.
#[derive(Debug, Clone, Default)]
pub struct SettingOptions {
    values: Vec<(&'static Setting, String)>,
    techniques: Option<TechniqueList>,
}

impl SettingOptions {
    /// Of techniques alone.
    pub fn of(techniques: Option<TechniqueList>) -> Self {
        Self { values: Vec::new(), techniques }
    }

    /// Gives settings these values.
    pub fn apply(&self, settings: &mut RenderSettings) {
        for (setting, value) in &self.values {
            // They were checked when they were parsed.
            let _ = setting.set(settings, value);
        }
        if let Some(techniques) = &self.techniques {
            techniques.apply(settings);
        }
    }
}

/// The settings that have an option of their own.
fn options() -> impl Iterator<Item = &'static Setting> {
    Setting::ALL.iter().filter(|setting| !matches!(setting.audience, Audience::Technique { .. }))
}

fn option(setting: &'static Setting) -> Arg {
    let option = Arg::new(setting.name).long(setting.name).help(setting.what);
    let option = match setting.audience {
        Audience::Developers => option.help_heading(heading::DEVELOPERS).hide_short_help(true),
        Audience::Everyone | Audience::Technique { .. } => option.help_heading(heading::QUALITY),
    };
    let checked = move |text: &str| match setting.set(&mut RenderSettings::default(), text) {
        Ok(()) => Ok(text.to_owned()),
        Err(expected) => Err(format!("expected {expected}")),
    };
    match setting.values() {
        Values::Names(names) => {
            let default = names.first().map(|(name, _)| *name);
            // Features are many: `info` lists them.
            let value = |(name, what): (&'static str, &'static str)| {
                PossibleValue::new(name).help(what).hide(name.starts_with('+'))
            };
            let values = names.into_iter().map(value);
            option.value_name("NAME").value_parser(PossibleValuesParser::new(values)).default_value(default)
        }
        Values::Switch => option.action(ArgAction::SetTrue),
        Values::Number(_) | Values::NumberOrAuto(_) => {
            let default = setting.get(&RenderSettings::default());
            let help = format!("{} [default: {default}]", setting.what);
            option.value_name("N").help(help).allow_negative_numbers(true).value_parser(checked)
        }
    }
}

/// What `--techniques` takes, for the long help.
pub fn explain_techniques() -> String {
    let mut help =
        "Which techniques make images less noisy: auto (each where it pays), none, all, or names with + or -, \
                    such as auto,-gradients or none,+reuse (docs/rendering.md):"
            .to_owned();
    for (name, what) in TechniqueList::explain() {
        help.push_str(&format!("\n- {name}: {}{}", what[..1].to_lowercase(), &what[1..]));
    }
    help
}

impl Args for SettingOptions {
    fn augment_args(command: Command) -> Command {
        let techniques = Arg::new(TECHNIQUES)
            .long(TECHNIQUES)
            .value_name("LIST")
            .help("Which techniques make images less noisy, such as auto,-gradients [default: auto]")
            .long_help(explain_techniques() + "\n\n[default: auto]")
            .help_heading(heading::QUALITY)
            .allow_hyphen_values(true)
            .value_parser(value_parser!(TechniqueList));
        command.arg(techniques).args(options().map(option))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for SettingOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let value = |setting: &'static Setting| {
            let value = match setting.values() {
                Values::Switch => matches.get_flag(setting.name).then(|| "on".to_owned()),
                _ => matches.get_one::<String>(setting.name).cloned(),
            };
            value.map(|value| (setting, value))
        };
        let values = options().filter_map(value).collect();
        Ok(Self { values, techniques: matches.get_one::<TechniqueList>(TECHNIQUES).cloned() })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(arguments: &[&str]) -> Result<RenderSettings, clap::Error> {
        let command = SettingOptions::augment_args(Command::new("test").no_binary_name(true));
        let options = SettingOptions::from_arg_matches(&command.try_get_matches_from(arguments)?)?;
        let mut settings = RenderSettings::default();
        options.apply(&mut settings);
        Ok(settings)
    }

    #[test]
    fn each_setting_has_its_option() {
        assert_eq!(parsed(&[]).unwrap(), RenderSettings::default());
        let arguments = "--seed 7 --accel none --workgroup 32 --loop-budget auto --count-steps --features +mirror \
                         --techniques -gradients";
        let settings = parsed(&arguments.split_whitespace().collect::<Vec<_>>()).unwrap();
        let value = |name| Setting::named(name).unwrap().get(&settings);
        let names = ["seed", "accel", "workgroup", "loop-budget", "count-steps", "features", "gradients", "reuse"];
        assert_eq!(names.map(value), ["7", "none", "32", "auto", "on", "+mirror", "off", "auto"]);
    }

    #[test]
    fn errors_say_what_was_expected() {
        for (arguments, said) in [
            (["--seed", "4294967296"], "expected an integer from 0 to 4294967295"),
            (["--workgroup", "1025"], "expected auto or an integer from 1 to 1024"),
            (["--accel", "grid"], "bvh, none"),
            (["--techniques", "fast"], "expected auto, none, all"),
        ] {
            let error = parsed(&arguments).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
