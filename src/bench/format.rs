//! Cells, tables and fields.

use std::fmt::Write as _;

use crate::bench::statistics::PowerLaw;

/// A column: heading, and the cell of a row.
pub(super) type Column<R> = (&'static str, fn(&R) -> String);

/// Three significant digits; `-` for what is not known.
pub(super) fn significant(value: Option<f64>) -> String {
    let Some(v) = value else { return "-".to_owned() };
    let magnitude = v.abs().log10().floor();
    if v == 0.0 || !v.is_finite() {
        v.to_string()
    } else if (-3.0..6.0).contains(&magnitude) {
        format!("{v:.*}", (2.0 - magnitude).max(0.0) as usize)
    } else {
        format!("{v:.2e}")
    }
}

/// Cells as text: aligned columns, or a Markdown table.
pub(super) fn table<R>(columns: &[Column<R>], rows: &[R], markdown: bool) -> String {
    let mut lines: Vec<Vec<String>> = vec![columns.iter().map(|c| c.0.to_owned()).collect()];
    lines.extend(rows.iter().map(|r| columns.iter().map(|c| c.1(r)).collect()));
    let width = |i: usize| lines.iter().map(|l| l[i].chars().count()).max().unwrap_or(0);
    let widths: Vec<_> = (0..columns.len()).map(width).collect();
    let mut text = String::new();
    for (number, line) in lines.iter().enumerate() {
        let cells: Vec<_> = line.iter().zip(&widths).map(|(cell, &w)| format!("{cell:>w$}")).collect();
        if markdown {
            let _ = writeln!(text, "| {} |", cells.join(" | "));
            if number == 0 {
                let rule: Vec<_> =
                    widths.iter().map(|w| format!("{}:", "-".repeat(w.saturating_sub(1).max(2)))).collect();
                let _ = writeln!(text, "| {} |", rule.join(" | "));
            }
        } else {
            let _ = writeln!(text, "{}", format!("  {}", cells.join("  ")).trim_end());
        }
    }
    text
}

/// An exponent with its interval.
pub(super) fn exponent(law: Option<&PowerLaw>) -> String {
    law.map_or_else(
        || "-".to_owned(),
        |l| match l.half_width {
            Some(w) => format!("{:.3} ± {w:.3}", l.exponent),
            None => format!("{:.3}", l.exponent),
        },
    )
}

/// A CSV field of a number; empty for what is not known or not finite.
pub(super) fn cell(value: impl Into<Option<f64>>) -> String {
    value.into().filter(|v| v.is_finite()).map_or_else(String::new, |v| v.to_string())
}

/// A CSV field that may hold commas or quotes (RFC 4180).
pub(super) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits() {
        for (v, text) in [
            (0.0, "0"),
            (1.0, "1.00"),
            (12.34, "12.3"),
            (123_456.0, "123456"),
            (0.001_234, "0.00123"),
            (1e-7, "1.00e-7"),
        ] {
            assert_eq!(significant(Some(v)), text);
        }
        assert_eq!(significant(None), "-");
    }

    #[test]
    fn tables_line_up_and_fields_are_quoted() {
        let columns: [Column<u32>; 2] = [("n", |r| r.to_string()), ("square", |r| (r * r).to_string())];
        assert_eq!(table(&columns, &[3, 12], false), "   n  square\n   3       9\n  12     144\n");
        assert_eq!(table(&columns, &[3], true), "| n | square |\n| --: | -----: |\n| 3 |      9 |\n");
        assert_eq!(quoted("a, \"b\""), "\"a, \"\"b\"\"\"");
        assert_eq!(quoted("plain"), "plain");
        assert_eq!([0.5, 12.0, f64::NAN, f64::INFINITY].map(cell), ["0.5", "12", "", ""]);
        assert_eq!(cell(None), "");
    }
}
