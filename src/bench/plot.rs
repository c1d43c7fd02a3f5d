//! Log–log plots as SVG.

use std::io::Write as _;
use std::path::Path;

use plotters::coord::combinators::{BindKeyPoints, IntoLogRange};
use plotters::prelude::*;

use crate::bench::error::BenchError;
use crate::files;

/// Points of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// For the legend.
    pub label: String,
    /// Positive coordinates; others are left out.
    pub points: Vec<(f64, f64)>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Above the panel.
    pub title: String,
    /// Quantity and unit.
    pub x_label: String,
    /// Quantity and unit.
    pub y_label: String,
    /// Base of the x axis' ticks: 2 for counts that double, or 10.
    pub x_base: f64,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// Panels in rows of so many.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
}

/// Size of a panel, pixels.
const PANEL: (u32, u32) = (520, 400);

/// Okabe and Ito's colours, which people with any kind of colour vision tell apart.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

impl Figure {
    /// Draws to an .svg file.
    ///
    /// # Errors
    /// Another extension, nothing to draw, or the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), BenchError> {
        let fail = |problem: String| BenchError::Plot { path: path.to_owned(), problem };
        check_path(path)?;
        let text = self.svg().map_err(fail)?;
        Ok(files::write_whole(path, |out| out.write_all(text.as_bytes()))?)
    }

    /// Draws as SVG text.
    fn svg(&self) -> Result<String, String> {
        let rows = self.panels.len().div_ceil(self.columns.max(1));
        let size = (PANEL.0 * self.columns as u32, PANEL.1 * rows as u32);
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
            root.fill(&WHITE).map_err(|e| e.to_string())?;
            for (panel, area) in self.panels.iter().zip(root.split_evenly((rows, self.columns))) {
                panel.draw(&area)?;
            }
            root.present().map_err(|e| e.to_string())?;
        }
        Ok(text)
    }
}

/// Checks, before an hour of measuring, that a plot can be written to `path`.
///
/// # Errors
/// The extension is not .svg, or the file cannot be written.
pub fn check_path(path: &Path) -> Result<(), BenchError> {
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg")) {
        return Err(BenchError::Plot { path: path.to_owned(), problem: "a plot is written as .svg".to_owned() });
    }
    Ok(files::check_writable(path)?)
}

impl Panel {
    /// Whether there is anything to draw.
    pub fn has_points(&self) -> bool {
        self.series.iter().flat_map(|s| &s.points).any(drawable)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, plotters::coord::Shift>) -> Result<(), String> {
        let series: Vec<(&str, Vec<(f64, f64)>)> = self
            .series
            .iter()
            .map(|s| (s.label.as_str(), s.points.iter().copied().filter(drawable).collect()))
            .collect();
        let points = || series.iter().flat_map(|s| &s.1);
        if points().next().is_none() {
            return Err(format!("{}: there is no point to draw", self.title));
        }
        let xs = range(points().map(|p| p.0));
        let ys = range(points().map(|p| p.1));
        let text = |size: u32| ("sans-serif", size).into_font();
        let x_ticks = ticks(xs, self.x_base);
        let y_ticks = ticks(ys, 10.0);
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, text(16))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(70)
            .build_cartesian_2d(
                (xs.0..xs.1).log_scale().with_key_points(x_ticks.labelled).with_light_points(x_ticks.light),
                (ys.0..ys.1).log_scale().with_key_points(y_ticks.labelled).with_light_points(y_ticks.light),
            )
            .map_err(|e| e.to_string())?;
        chart
            .configure_mesh()
            .bold_line_style(RGBColor(205, 205, 205))
            .light_line_style(RGBColor(238, 238, 238))
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_label_formatter(&|v| tick(*v))
            .y_label_formatter(&|v| tick(*v))
            .axis_desc_style(text(14))
            .label_style(text(13))
            .draw()
            .map_err(|e| e.to_string())?;
        let several = series.len() > 1;
        for (i, (label, points)) in series.into_iter().enumerate() {
            let color = COLORS[i % COLORS.len()];
            let line = chart
                .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))
                .map_err(|e| e.to_string())?;
            if several {
                line.label(label)
                    .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], color.stroke_width(2)));
            }
            chart.draw_series(points.iter().map(|&p| Circle::new(p, 3, color.filled()))).map_err(|e| e.to_string())?;
        }
        if several {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::LowerLeft)
                .background_style(WHITE.mix(0.85))
                .border_style(RGBColor(190, 190, 190))
                .label_font(text(13))
                .draw()
                .map_err(|e| e.to_string())?;
        }
        Ok(())
    }
}

/// Whether a point has a place on logarithmic axes.
fn drawable(point: &(f64, f64)) -> bool {
    [point.0, point.1].iter().all(|&v| v > 0.0 && v.is_finite())
}

/// Smallest and largest value with a margin, at least a factor of ten apart so that there are ticks.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (lo, hi) = values.fold((f64::INFINITY, 0f64), |(lo, hi), v| (lo.min(v), hi.max(v)));
    let margin = 1.25 * (10.0 * lo / hi).max(1.0).sqrt();
    (lo / margin, hi * margin)
}

/// Where lines of the grid are.
struct Ticks {
    labelled: Vec<f64>,
    light: Vec<f64>,
}

/// Powers of two for base 2; else powers of ten, with 2 and 5 between them where there are few.
fn ticks((lo, hi): (f64, f64), base: f64) -> Ticks {
    let powers = |base: f64, digits: &[f64]| -> Vec<f64> {
        let first = lo.log(base).floor() as i32;
        let last = hi.log(base).ceil() as i32;
        let all = (first..=last).flat_map(|i| digits.iter().map(move |d| d * base.powi(i)));
        all.filter(|v| (lo..=hi).contains(v)).collect()
    };
    if base == 2.0 {
        // At most a dozen numbers.
        let step = ((hi / lo).log2() / 12.0).ceil().max(1.0) as usize;
        let all = powers(2.0, &[1.0]);
        return Ticks { labelled: all.iter().copied().step_by(step).collect(), light: all };
    }
    let labelled = powers(10.0, if hi / lo < 300.0 { &[1.0, 2.0, 5.0] } else { &[1.0] });
    Ticks { labelled, light: powers(10.0, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]) }
}

/// A tick's number, short: 256, 0.02, 1e-5, 3e6.
fn tick(v: f64) -> String {
    if (1e-3..1e5).contains(&v) { format!("{}", (v * 1e6).round() / 1e6) } else { format!("{v:.0e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(points: Vec<(f64, f64)>) -> Figure {
        let series = ["first", "second"].map(|label| Series { label: label.to_owned(), points: points.clone() });
        let panel = Panel {
            title: "A & B".to_owned(),
            x_label: "samples per pixel".to_owned(),
            y_label: "RMSE".to_owned(),
            x_base: 2.0,
            series: series.to_vec(),
        };
        Figure { panels: vec![panel; 2], columns: 2 }
    }

    #[test]
    fn a_figure_has_its_labels_ticks_and_points() {
        let svg = figure(vec![(1.0, 0.1), (16.0, 0.025), (256.0, 0.0), (f64::NAN, 1.0)]).svg().unwrap();
        for text in ["A &amp; B", "samples per pixel", "RMSE", "first", "second", "0.1"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg.matches("<circle").count(), 2 * 2 * 2);
    }

    #[test]
    fn nothing_to_draw_is_an_error() {
        assert!(!figure(vec![(1.0, 0.0), (f64::NAN, 1.0)]).panels[0].has_points());
        assert!(figure(vec![(1.0, 1.0)]).panels[0].has_points());
        assert!(figure(vec![(1.0, 0.0)]).svg().unwrap_err().contains("A & B"));
        let error = figure(vec![(1.0, 1.0)]).write(Path::new("plot.pdf")).unwrap_err().to_string();
        assert!(error.contains("plot.pdf") && error.contains(".svg"), "{error}");
    }

    #[test]
    fn ticks_and_their_numbers() {
        let near = |found: Vec<f64>, expected: &[f64]| {
            assert_eq!(found.len(), expected.len(), "{found:?}");
            assert!(found.iter().zip(expected).all(|(f, e)| (f / e - 1.0).abs() < 1e-12), "{found:?}");
        };
        near(ticks((0.03, 0.3), 10.0).labelled, &[0.05, 0.1, 0.2]);
        near(ticks((0.5, 2e4), 10.0).labelled, &[1.0, 10.0, 100.0, 1e3, 1e4]);
        near(ticks((0.8, 5.0), 2.0).labelled, &[1.0, 2.0, 4.0]);
        assert!(ticks((1.0, 1e9), 2.0).labelled.len() <= 12);
        assert_eq!([256.0, 0.02, 1e-5, 3e6].map(tick), ["256", "0.02", "1e-5", "3e6"]);
    }
}
