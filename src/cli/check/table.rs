//! The suite's progress and result for people: on stdout, or on stderr where stdout carries JSON.

use std::io::{self, IsTerminal, Write};

use photolith::Context;
use photolith::check::{CaseReport, DeviceReport, Verdict};

use crate::cli::output;
use crate::cli::text::{counted, printable};

/// Prints as cases end.
pub struct Table {
    json: bool,
    color: bool,
    printed: anyhow::Result<()>,
}

impl Table {
    /// `json`: stdout is taken.
    pub fn new(json: bool) -> Self {
        let color = io::stdout().is_terminal() && !json && std::env::var_os("NO_COLOR").is_none();
        Self { json, color, printed: Ok(()) }
    }

    /// A device is about to be checked.
    pub fn device(&mut self, context: &Context, cases: usize) {
        let info = context.info();
        let device = format!("{} [{}], {}", info.name, info.driver, context.choice());
        self.line(&format!("{}: {}", printable(&device, &[]), counted(cases, "case", "cases")));
        self.line(&format!("{:<28} {:>10} {:>10}  {:<12} {:>6}  ", "case", "measured", "allowed", "verdict", "s"));
    }

    /// A case is over.
    pub fn case(&mut self, case: &CaseReport) {
        let measured = case.measured.map_or("-".to_owned(), short);
        let word = format!("{:<12}", case.verdict.word());
        let word = match (self.color, case.verdict) {
            (true, Verdict::Pass) => format!("\x1b[32m{word}\x1b[0m"),
            (true, verdict) if verdict.is_skip() => format!("\x1b[33m{word}\x1b[0m"),
            (true, _) => format!("\x1b[31m{word}\x1b[0m"),
            (false, _) => word,
        };
        let remark = printable(case.message.as_deref().unwrap_or(&case.detail), &[]);
        self.line(&format!(
            "{:<28} {measured:>10} {:>10}  {word} {:>6.1}  {remark}",
            case.name,
            short(case.threshold),
            case.seconds
        ));
    }

    /// All cases are over.
    pub fn end(&mut self, report: &DeviceReport) {
        self.line("");
        for fact in &report.facts {
            self.line(&format!("{:<48} {}", fact.name, fact.value));
        }
        self.line("");
        let bad =
            report.cases.iter().filter(|c| c.verdict != Verdict::Pass && c.verdict.counted_as().is_none()).count();
        self.line(&format!(
            "{} of {} cases pass{}{} in {:.1} s",
            report.count(Verdict::Pass),
            report.cases.len(),
            if bad > 0 { format!(", {bad} do not") } else { String::new() },
            report.others(),
            report.seconds
        ));
    }

    /// Whether all lines could be printed.
    ///
    /// # Errors
    /// That of the first line that could not.
    pub fn finish(self) -> anyhow::Result<()> {
        self.printed
    }

    /// No reason to stop measuring, whatever becomes of it.
    fn line(&mut self, text: &str) {
        let line = format!("{}\n", text.trim_end());
        if self.json {
            let _ = io::stderr().write_all(line.as_bytes());
        } else if self.printed.is_ok() {
            self.printed = output::print_bytes(line.as_bytes());
        }
    }
}

fn short(x: f64) -> String {
    match x {
        0.0 => "0".to_owned(),
        x if x.abs() >= 0.01 && x.abs() < 1e5 => format!("{}", (x * 1000.0).round() / 1000.0),
        x => format!("{x:.1e}"),
    }
}
