//! JUnit XML, as continuous integration reads it.

use std::fmt::Write;

use crate::check::report::{Report, Verdict};
use crate::host::host_name;

/// The report as JUnit XML: a suite for each device, a test for each case. It is valid by the schema of Ant's JUnit task (JUnit.xsd of
/// Windy Road Technology) as by that of Jenkins' xUnit plugin (junit-10.xsd).
pub fn junit(report: &Report) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    let host = host_name().unwrap_or_else(|| "localhost".to_owned());
    for (id, device) in report.devices.iter().enumerate() {
        let failures = device.count(Verdict::Fail) + device.count(Verdict::UnexpectedPass);
        let skipped = device.cases.iter().filter(|case| case.verdict.is_skip()).count();
        let errors = device.cases.len() - failures - skipped - device.count(Verdict::Pass);
        let suite = escape(&format!("{} [{}]", device.device, device.driver));
        // Writing to a String cannot fail.
        let _ = writeln!(
            xml,
            "  <testsuite package=\"photolith\" id=\"{id}\" name=\"{suite}\" timestamp=\"{}\" hostname=\"{}\" tests=\"{}\" \
             failures=\"{failures}\" errors=\"{errors}\" skipped=\"{skipped}\" time=\"{:.3}\">",
            date_time(device.started),
            escape(&host),
            device.cases.len(),
            device.seconds
        );
        xml.push_str("    <properties>\n");
        for (name, value) in [
            ("photolith", report.version.as_str()),
            ("device", &device.device),
            ("driver", &device.driver),
            ("lanes", &device.lanes.to_string()),
            ("vulkan", &device.api_version),
            ("cpu", &device.host_cpu),
            ("sizes", if device.full { "full" } else { "quick" }),
            ("validation", if device.validation { "on" } else { "off" }),
        ] {
            let _ = writeln!(xml, "      <property name=\"{name}\" value=\"{}\"/>", escape(value));
        }
        for fact in &device.facts {
            let (name, value) = (escape(&fact.name), escape(&fact.value));
            let _ = writeln!(xml, "      <property name=\"fact: {name}\" value=\"{value}\"/>");
        }
        xml.push_str("    </properties>\n");
        let mut details = String::new();
        for case in &device.cases {
            let (topic, name) = case.name.split_once('/').unwrap_or(("photolith", &case.name));
            let _ = write!(
                xml,
                "    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3}\"",
                escape(topic),
                escape(name),
                case.seconds
            );
            let measured = case.measured.map_or("no number".to_owned(), |m| format!("{m:e}"));
            let message = format!(
                "{} {measured}, allowed {:e}{}",
                case.quantity,
                case.threshold,
                case.message.as_ref().map_or(String::new(), |m| format!(": {m}"))
            );
            let message = escape(&message);
            let _ = match case.verdict {
                Verdict::Pass => writeln!(xml, "/>"),
                verdict if verdict.is_skip() => {
                    let message = format!("{}: {message}", verdict.word());
                    writeln!(xml, "><skipped message=\"{message}\">{message}</skipped></testcase>")
                }
                verdict => {
                    let is_failure = matches!(verdict, Verdict::Fail | Verdict::UnexpectedPass);
                    let tag = if is_failure { "failure" } else { "error" };
                    let kind = escape(verdict.word());
                    writeln!(xml, "><{tag} type=\"{kind}\" message=\"{message}\">{message}</{tag}></testcase>")
                }
            };
            if !case.detail.is_empty() {
                let _ = writeln!(details, "{}: {}", escape(&case.name), escape(&case.detail));
            }
        }
        let _ = writeln!(xml, "    <system-out>{details}</system-out>\n    <system-err></system-err>\n  </testsuite>");
    }
    xml.push_str("</testsuites>\n");
    xml
}

/// A time in UTC as ISO 8601 writes it, from seconds since 1970.
fn date_time(seconds: u64) -> String {
    let (days, of_day) = (seconds / 86_400, seconds % 86_400);
    let (mut year, mut day) = (1970, days);
    let is_leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let length = |year: u64| if is_leap(year) { 366 } else { 365 };
    while day >= length(year) {
        day -= length(year);
        year += 1;
    }
    let february = length(year) - 337;
    let mut month = 1;
    for days in [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        if day < days {
            break;
        }
        day -= days;
        month += 1;
    }
    let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    format!("{year:04}-{month:02}-{:02}T{hour:02}:{minute:02}:{second:02}", day + 1)
}

/// Text for XML 1.0, where most control characters are not allowed at all.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::Fact;
    use crate::check::report::{CaseReport, DeviceReport};

    #[test]
    fn escapes() {
        assert_eq!(escape("a<b & \"c\"\u{1}\n>"), "a&lt;b &amp; &quot;c&quot;\u{fffd} &gt;");
    }

    #[test]
    fn dates() {
        assert_eq!(date_time(0), "1970-01-01T00:00:00");
        assert_eq!(date_time(951_827_696), "2000-02-29T12:34:56");
        assert_eq!(date_time(1_798_761_599), "2026-12-31T23:59:59");
    }

    /// The names of the attributes of all elements of a kind.
    fn attributes(xml: &str, element: &str) -> Vec<Vec<String>> {
        let opened = xml.split('<').filter_map(|part| part.strip_prefix(element)?.strip_prefix([' ', '>', '/']));
        let names = |part: &str| {
            let tag = part.split('>').next().unwrap_or_default();
            tag.split('"').step_by(2).filter_map(|name| Some(name.trim().strip_suffix('=')?.to_owned())).collect()
        };
        opened.map(names).collect()
    }

    /// What both schemas ask for and allow: attributes, order of elements, forms of numbers.
    #[test]
    fn reports_are_valid_by_the_schemas_in_use() {
        let case = |name: &str, verdict| CaseReport {
            name: name.to_owned(),
            what: String::new(),
            oracle: String::new(),
            quantity: "error".to_owned(),
            threshold: 1e-3,
            measured: Some(0.5),
            detail: "5 rays & <more>".to_owned(),
            seconds: 0.25,
            verdict,
            message: Some("\"why\"\u{1b}".to_owned()),
        };
        let cases = vec![
            case("a/pass", Verdict::Pass),
            case("a/fail", Verdict::Fail),
            case("b/error", Verdict::DeviceLost),
            case("b/known", Verdict::ExpectedFail),
            case("b/later", Verdict::NotRun),
            case("b/lacking", Verdict::NotSupported),
        ];
        let device = DeviceReport {
            device: "lavapipe".to_owned(),
            driver: "Mesa".to_owned(),
            kind: "CPU".to_owned(),
            lanes: 8,
            api_version: "1.3.0".to_owned(),
            host_cpu: "a < b".to_owned(),
            full: false,
            validation: true,
            facts: vec![Fact { name: "a \"fact\"".to_owned(), value: "0".to_owned() }],
            cases,
            started: 1_700_000_000,
            seconds: 1e-9,
        };
        let xml = junit(&Report::new(vec![device.clone(), device]));
        assert_eq!(attributes(&xml, "testsuites"), [[""; 0]]);
        let suite =
            ["package", "id", "name", "timestamp", "hostname", "tests", "failures", "errors", "skipped", "time"];
        assert_eq!(attributes(&xml, "testsuite"), [suite, suite]);
        assert_eq!(attributes(&xml, "property").len(), 18);
        assert!(attributes(&xml, "property").iter().all(|names| *names == ["name", "value"]));
        assert!(attributes(&xml, "testcase").iter().all(|names| *names == ["classname", "name", "time"]));
        assert_eq!(attributes(&xml, "failure"), [["type", "message"]; 2]);
        assert_eq!(attributes(&xml, "error"), [["type", "message"]; 2]);
        assert_eq!(attributes(&xml, "skipped"), [["message"]; 6]);
        for words in [
            "id=\"1\"",
            "timestamp=\"2023-11-14T22:13:20\"",
            "tests=\"6\" failures=\"1\" errors=\"1\" skipped=\"3\" time=\"0.000\"",
            "classname=\"a\" name=\"pass\" time=\"0.250\"/>",
            "a/pass: 5 rays &amp; &lt;more&gt;",
            "name=\"fact: a &quot;fact&quot;\" value=\"0\"",
            ">unsupported: error 5e-1, allowed 1e-3",
        ] {
            assert!(xml.contains(words), "{words}: {xml}");
        }
        let order: Vec<_> = ["<properties>", "<testcase", "<system-out>", "<system-err>", "</testsuite>"]
            .into_iter()
            .map(|tag| xml.find(tag).expect(tag))
            .collect();
        assert!(order.is_sorted(), "{xml}");
        assert!(!xml.contains('\u{1b}'));
    }
}
