//! The report of a comparison, as a table and as JSON.

use std::fmt::Write;
use std::path::Path;

use photolith::image::Image;
use photolith::image::metrics::{
    Bias, CONFIDENCE, Comparison, Estimate, Family, NoiseMse, NonFinite, Pointwise, Untestable, Welch, WorstPixel,
};
use serde::Serialize;

use super::{Check, CompareArgs, Heatmap, HeatmapOf};

/// Everything there is to say; the fields are those of the JSON schema.
#[derive(Serialize)]
pub(super) struct Report<'a> {
    schema: &'static str,
    image: &'a Path,
    reference: &'a Path,
    width: u32,
    height: u32,
    pass: bool,
    checks: Vec<Check>,
    non_finite: NonFinite,
    #[serde(flatten)]
    pointwise: Pointwise,
    psnr_peak: f64,
    flip: f64,
    flip_ppd: f64,
    bias: Bias,
    bias_confidence: f64,
    noise_mse: NoiseMse,
    welch: Option<&'a Welch>,
    /// Which image lacks a noise estimate; null when the test could be done.
    welch_lacks: Option<Untestable>,
    worst: &'a [WorstPixel],
    heatmap: Option<Heatmap>,
}

impl<'a> Report<'a> {
    pub(super) fn new(
        args: &'a CompareArgs,
        image: &Image,
        comparison: &'a Comparison,
        checks: Vec<Check>,
        heatmap: Option<Heatmap>,
    ) -> Self {
        Self {
            schema: "photolith-compare-1",
            image: &args.image,
            reference: &args.reference,
            width: image.width(),
            height: image.height(),
            pass: checks.iter().all(|check| check.pass),
            checks,
            non_finite: comparison.non_finite,
            pointwise: comparison.pointwise,
            psnr_peak: args.psnr_peak,
            flip: comparison.flip,
            flip_ppd: args.ppd,
            bias: comparison.bias,
            bias_confidence: CONFIDENCE,
            noise_mse: comparison.noise_mse,
            welch: comparison.welch.as_ref().ok(),
            welch_lacks: comparison.welch.as_ref().err().copied(),
            worst: &comparison.worst,
            heatmap,
        }
    }

    /// Whether all thresholds are kept.
    pub(super) fn pass(&self) -> bool {
        self.pass
    }

    /// One line.
    pub(super) fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self).map(|line| line + "\n")
    }

    /// Some twenty lines for people.
    pub(super) fn table(&self) -> String {
        let mut table = Table { checks: &self.checks, text: String::new() };
        let size = format!("({}x{})", self.width, self.height);
        table.line("image", format_args!("{} {size}", self.image.display()));
        table.line("reference", format_args!("{} {size}", self.reference.display()));
        table.blank();
        if let NonFinite { count, first: Some([x, y]) } = self.non_finite {
            let note = format!("NaN or infinite pixels, left out; the first at ({x}, {y})");
            table.row("non-finite", "non_finite", &count.to_string(), &note);
        }
        let p = &self.pointwise;
        table.row("MSE", "mse", &scientific(p.mse), &self.noise());
        table.row("RMSE", "rmse", &scientific(p.rmse), "");
        table.row("relMSE", "rel_mse", &scientific(p.rel_mse), "");
        table.row("MAPE", "mape", &scientific(p.mape), "");
        let psnr = p.psnr.map_or("infinite".to_owned(), |psnr| format!("{psnr:.2} dB"));
        table.row("PSNR", "psnr", &psnr, &format!("peak {}", self.psnr_peak));
        table.row("FLIP", "flip", &format!("{:.6}", self.flip), &format!("{} pixels per degree", self.flip_ppd));
        table.bias("bias R", &self.bias.r);
        table.bias("bias G", &self.bias.g);
        table.bias("bias B", &self.bias.b);
        table.bias("bias Y", &self.bias.luminance);
        table.row("|bias|", "bias", &scientific(self.bias.largest()), "the largest of these");
        table.blank();
        match (self.welch, self.welch_lacks) {
            (Some(welch), _) => table.welch(welch),
            (_, Some(lacks)) => table.line("Welch", format_args!("not tested: {lacks}")),
            _ => {}
        }
        table.worst(self.worst);
        if let Some(Heatmap { file, of, max }) = &self.heatmap {
            let of = match of {
                HeatmapOf::Difference => "RMS difference",
                HeatmapOf::Relative => "relative RMS difference",
                HeatmapOf::Flip => "FLIP",
            };
            table.blank();
            table.line(
                "heat map",
                format_args!("{}: {of}, black 0 to pale yellow {max:.5e}; green: NaN", file.display()),
            );
        }
        if !self.checks.is_empty() {
            table.blank();
            let failed: Vec<_> = self.checks.iter().filter(|c| !c.pass).map(|c| c.metric).collect();
            match failed[..] {
                [] => table.line("verdict", format_args!("pass")),
                _ => table.line("verdict", format_args!("FAIL: {}", failed.join(", "))),
            }
        }
        table.text
    }

    fn noise(&self) -> String {
        let of = |name: &str, mse: Option<f64>| mse.map(|mse| format!("{name} {mse:.3e}"));
        let parts: Vec<_> = [of("image", self.noise_mse.image), of("reference", self.noise_mse.reference)]
            .into_iter()
            .flatten()
            .collect();
        if parts.is_empty() { String::new() } else { format!("of which noise: {}", parts.join(", ")) }
    }
}

fn scientific(value: f64) -> String {
    format!("{value:.5e}")
}

/// Lines of label, value, note and, where there is a threshold, how it was met.
struct Table<'a> {
    checks: &'a [Check],
    text: String,
}

impl Table<'_> {
    fn blank(&mut self) {
        self.text.push('\n');
    }

    fn line(&mut self, label: &str, content: std::fmt::Arguments) {
        self.text.push_str(&format!("{label:<11}{content}"));
        self.text.push('\n');
    }

    fn row(&mut self, label: &str, metric: &str, value: &str, note: &str) {
        let verdict = self.checks.iter().find(|check| check.metric == metric).map_or(String::new(), |check| {
            let verdict = if check.pass { "pass" } else { "FAIL" };
            match metric {
                "welch" | "non_finite" => verdict.to_owned(),
                "psnr" => format!("at least {}: {verdict}", check.limit),
                _ => format!("at most {}: {verdict}", check.limit),
            }
        });
        // The column is there only when there are thresholds.
        let verdict = if self.checks.is_empty() { verdict } else { format!("{verdict:<21} ") };
        let line = format!("{label:<11}{value:<24}{verdict}{note}");
        self.text.push_str(line.trim_end());
        self.text.push('\n');
    }

    fn bias(&mut self, label: &str, estimate: &Estimate) {
        let half_width = estimate.half_width.map_or(String::new(), |w| format!(" ± {w:.2e}"));
        let relative = estimate.relative.map_or(String::new(), |r| format!("{:+.3}% of the reference", 100.0 * r));
        self.row(label, "", &format!("{:+.4e}{half_width}", estimate.mean), &relative);
    }

    fn welch(&mut self, welch: &Welch) {
        self.row(
            "Welch",
            "welch",
            if welch.rejects() { "rejects" } else { "does not reject" },
            &format!("α {:e}", welch.alpha),
        );
        let families = [("pixels", &welch.pixels), ("tiles", &welch.tiles), ("mean", &welch.mean)];
        for (name, Family { tests, rejected, alpha_each, worst }) in families {
            let worst = worst.as_ref().map_or(String::new(), |w| {
                let channel = ["R", "G", "B"].get(w.channel).unwrap_or(&"?");
                let p = if w.p > 0.0 { format!("{:.2e}", w.p) } else { "below 1e-300".to_owned() };
                format!(", smallest p {p} (t {:+.2}) at ({}, {}) {channel}", w.t, w.x, w.y)
            });
            let counts = format!("{rejected} of {tests} below p {alpha_each:.2e}{worst}");
            self.line("", format_args!("{name:<8}{counts}"));
        }
    }

    fn worst(&mut self, worst: &[WorstPixel]) {
        if worst.is_empty() {
            return;
        }
        self.blank();
        let _ = writeln!(self.text, "{:>6} {:>6}  {:<12}  {:<36}  reference", "x", "y", "RMS error", "image");
        let rgb = |[r, g, b]: [f32; 3]| format!("{r:<11.5} {g:<11.5} {b:<11.5}");
        for w in worst {
            let line = format!("{:>6} {:>6}  {:<12.5e}  {:<36}  {}", w.x, w.y, w.error, rgb(w.image), rgb(w.reference));
            self.text.push_str(line.trim_end());
            self.text.push('\n');
        }
    }
}
