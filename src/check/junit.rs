//! JUnit XML, as continuous integration reads it.

use std::fmt::Write;

use super::report::{Report, Verdict};

/// The report as JUnit XML: a suite for each device, a test for each case.
pub fn junit(report: &Report) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"photolith check\">\n");
    for device in &report.devices {
        let failures = device.count(Verdict::Fail) + device.count(Verdict::UnexpectedPass);
        let skipped = device.count(Verdict::NotRun) + device.count(Verdict::ExpectedFail);
        let errors = device.cases.len() - failures - skipped - device.count(Verdict::Pass);
        let suite = escape(&format!("{} [{}]", device.device, device.driver));
        // Writing to a String cannot fail.
        let _ = writeln!(
            xml,
            "  <testsuite name=\"{suite}\" tests=\"{}\" failures=\"{failures}\" errors=\"{errors}\" \
             skipped=\"{skipped}\" time=\"{:.3}\">",
            device.cases.len(),
            device.seconds
        );
        for case in &device.cases {
            let (topic, name) = case.name.split_once('/').unwrap_or(("", &case.name));
            let _ = write!(
                xml,
                "    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3}\">",
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
            let tag = match case.verdict {
                Verdict::Pass => None,
                Verdict::Fail | Verdict::UnexpectedPass => Some("failure"),
                Verdict::ExpectedFail | Verdict::NotRun => Some("skipped"),
                _ => Some("error"),
            };
            if let Some(tag) = tag {
                let _ = write!(xml, "<{tag} message=\"{}\"/>", escape(&message));
            }
            let _ = writeln!(xml, "<system-out>{}</system-out></testcase>", escape(&case.detail));
        }
        xml.push_str("  </testsuite>\n");
    }
    xml.push_str("</testsuites>\n");
    xml
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
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escape;

    #[test]
    fn escapes() {
        assert_eq!(escape("a<b & \"c\"\u{1}\n>"), "a&lt;b &amp; &quot;c&quot;\u{fffd} &gt;");
    }
}
