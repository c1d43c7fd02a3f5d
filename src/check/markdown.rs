//! The measured table as Markdown: one row a case, one column a device.

use std::fmt::Write;

use crate::check::cases;
use crate::check::mutations::held_by;
use crate::check::report::{Report, Verdict, combined};
use crate::render::Mutation;

/// The page docs/accuracy.md: what was measured on each device, side by side.
pub fn markdown(reports: &[Report]) -> String {
    let devices = combined(reports);
    let mut page = String::from(
        "# Accuracy\n\n\
         Written by `photolith check --markdown`; `photolith check` measures the same on any Vulkan device. Each case \
         is held against an oracle that shares no code with the shaders; it passes if the measured number is at most \
         the threshold. Full sizes, and what GPUs have shown, are in [accuracy-full.md](accuracy-full.md).\n\n## Devices\n\n| | device | driver | host CPU | sizes | cases | time |\n|---|---|---|---|---|---|---|\n",
    );
    // Writing to a String cannot fail.
    for (i, d) in devices.iter().enumerate() {
        let _ = writeln!(
            page,
            "| {} | {} | {} | {} | {} | {} of {} pass{} | {:.0} s |",
            label(i),
            cell(&d.device),
            cell(&d.driver),
            cell(&d.host_cpu),
            if d.full { "full" } else { "quick" },
            d.count(Verdict::Pass),
            d.cases.len(),
            d.others(),
            d.seconds
        );
    }
    page.push_str("\n## The drivers' arithmetic\n\n| fact |");
    heads(&mut page, devices.len());
    page.push_str("|---|");
    page.push_str(&"---|".repeat(devices.len()));
    page.push('\n');
    let mut facts: Vec<&str> = Vec::new();
    for fact in devices.iter().flat_map(|d| &d.facts) {
        if !facts.contains(&fact.name.as_str()) {
            facts.push(&fact.name);
        }
    }
    for name in facts {
        let _ = write!(page, "| {} |", cell(name));
        for d in &devices {
            let value = d.facts.iter().find(|f| f.name == name).map_or("", |f| f.value.as_str());
            let _ = write!(page, " {} |", cell(value));
        }
        page.push('\n');
    }
    let mut names: Vec<&str> = Vec::new();
    for case in devices.iter().flat_map(|d| &d.cases) {
        if !names.contains(&case.name.as_str()) {
            names.push(&case.name);
        }
    }
    // In the order of the suite, whatever was run first.
    names.sort_by_key(|name| cases().position(|c| c.name == *name).unwrap_or(usize::MAX));
    let mut topic = "";
    for name in names {
        let this = name.split('/').next().unwrap_or("");
        if this != topic {
            topic = this;
            let _ = write!(page, "\n## {topic}\n\n| case | what | oracle | quantity | threshold |");
            heads(&mut page, devices.len());
            let _ = writeln!(page, "|---|---|---|---|---|{}", "---|".repeat(devices.len()));
        }
        let found: Vec<_> = devices.iter().map(|d| (d.full, d.cases.iter().find(|c| c.name == name))).collect();
        let Some(case) = found.iter().find_map(|f| f.1) else { continue };
        let _ = write!(
            page,
            "| `{name}` | {} | {} | {} | {} |",
            cell(&case.what),
            cell(&case.oracle),
            cell(&case.quantity),
            number(case.threshold)
        );
        for (full, case) in found {
            let text = case.map_or("–".to_owned(), |c| match (c.verdict, c.measured) {
                // What was not counted on the quick sizes is told with its size.
                (Verdict::Pass, Some(m)) if full => {
                    format!("{} ({}; {:.0} s)", number(m), cell(&c.detail), c.seconds)
                }
                (Verdict::Pass, Some(m)) => number(m),
                (verdict, Some(m)) => format!("{} ({})", number(m), verdict.word()),
                (verdict, None) => verdict.word().to_owned(),
            });
            let _ = write!(page, " {text} |");
        }
        page.push('\n');
    }
    page.push_str(
        "\n## What holds what\n\nEach of these is broken on purpose in the tests, and the case named must then fail.\n\n\
         | broken | cases that fail |\n|---|---|\n",
    );
    for mutation in Mutation::ALL {
        let cases: Vec<_> = held_by(mutation).iter().map(|c| format!("`{c}`")).collect();
        let _ = writeln!(page, "| {} | {} |", mutation.describe(), cases.join(", "));
    }
    page
}

fn heads(page: &mut String, devices: usize) {
    for i in 0..devices {
        let _ = write!(page, " {} |", label(i));
    }
    page.push('\n');
}

fn label(index: usize) -> char {
    char::from(b'A' + (index % 26) as u8)
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

fn number(x: f64) -> String {
    match x {
        0.0 => "0".to_owned(),
        x if x.abs() >= 0.1 && x.abs() < 1e6 => format!("{}", (x * 1000.0).round() / 1000.0),
        x => format!("{x:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_every_case_of_the_quick_size() {
        let page = include_str!("../../docs/accuracy.md");
        for case in cases().filter(|case| !case.full_only) {
            assert!(page.contains(&format!("| `{}` |", case.name)), "{}", case.name);
        }
    }
}
