//! What a benchmark found, as plain data for JSON, and as tables, CSV and figures.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde::Serialize;

use crate::bench::format::{Column, cell, exponent, quoted, significant, table};
use crate::bench::growth::{GrowthReport, GrowthRow};
use crate::bench::machine::Machine;
use crate::bench::plot::{Figure, Panel, Series};
use crate::bench::rays::{RayRate, RaysReport};
use crate::bench::reference::{Origin, Reference};
use crate::bench::summary::{ConfigurationSummary, Row, TimeToTarget};

/// Version of the JSON that a [`Report`] becomes.
pub const SCHEMA: &str = "photolith-bench-2";

/// Everything that was measured in one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Where.
    #[serde(flatten)]
    pub machine: Machine,
    /// Run time against error, scene by scene.
    pub scenes: Vec<SceneReport>,
    /// Cost against size.
    pub growth: Option<GrowthReport>,
    /// Rays a second, scene by scene.
    pub rays: Vec<RaysReport>,
}

/// One scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneReport {
    /// Its file.
    pub scene: String,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Surface hits of a path.
    pub max_depth: u32,
    /// Renderings of each number of samples: where the run was interrupted, those of the seeds that were complete.
    pub seeds: u32,
    /// What errors are measured against.
    pub reference: ReferenceReport,
    /// RMSE that times are given for: asked for, or the smallest that every configuration reached.
    pub target_rmse: Option<f64>,
    /// One for each configuration.
    pub configurations: Vec<ConfigurationSummary>,
}

/// A reference in words and numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReferenceReport {
    /// Where it came from.
    pub origin: Origin,
    /// The file it is in.
    pub file: Option<PathBuf>,
    /// Samples per pixel.
    pub samples: Option<u64>,
    /// Root of its mean variance, radiance: errors below it are not reported.
    pub noise_rmse: f64,
}

impl ReferenceReport {
    /// Of a reference.
    pub fn of(reference: &Reference) -> Self {
        Self {
            origin: reference.origin,
            file: reference.file.clone(),
            samples: reference.samples,
            noise_rmse: reference.noise_mse.sqrt(),
        }
    }
}

impl SceneReport {
    /// Rows whose error is below the reference's noise floor: configuration and samples.
    pub fn withheld(&self) -> Vec<(&str, u32)> {
        let rows = self.configurations.iter().flat_map(|c| c.rows.iter().map(|r| (c.label.as_str(), r)));
        rows.filter(|(_, r)| r.below_noise_floor).map(|(label, r)| (label, r.samples)).collect()
    }
}

const ROW_COLUMNS: [Column<Row>; 13] = [
    ("samples", |r| r.samples.to_string()),
    ("wall s", |r| significant(Some(r.render_s))),
    ("device s", |r| significant(r.device_s)),
    ("Msamples/s", |r| significant(Some(r.msamples_per_s))),
    ("Mrays/s", |r| significant(Some(r.mrays_per_s))),
    ("RMSE", |r| significant(r.rmse)),
    ("±", |r| significant(r.rmse_half_width)),
    ("relMSE", |r| significant(r.rel_mse)),
    ("MAPE", |r| significant(r.mape)),
    ("FLIP", |r| significant(r.flip)),
    ("bias %", |r| format!("{:+.3}", 100.0 * r.bias)),
    ("± %", |r| r.bias_half_width.map_or_else(|| "-".to_owned(), |w| format!("{:.3}", 100.0 * w))),
    ("1/(MSE·s)", |r| significant(r.efficiency)),
];

const GROWTH_COLUMNS: [Column<GrowthRow>; 11] = [
    ("size", |r| r.size.to_string()),
    ("set-up s", |r| significant(Some(r.setup_s))),
    ("build s", |r| significant(r.build_s)),
    ("Mprimitives/s", |r| significant(r.mprimitives_per_s)),
    ("bytes each", |r| significant(r.bytes_per_primitive)),
    ("BVH depth", |r| r.bvh_depth.map_or_else(|| "-".to_owned(), |d| d.to_string())),
    ("steps/ray", |r| significant(r.steps_per_ray)),
    ("rays/sample", |r| significant(Some(r.rays_per_sample))),
    ("wall s", |r| significant(Some(r.render_s))),
    ("Msamples/s", |r| significant(Some(r.msamples_per_s))),
    ("Mrays/s", |r| significant(Some(r.mrays_per_s))),
];

const RAY_COLUMNS: [Column<RayRate>; 7] = [
    ("rays", |r| r.kind.name().to_owned()),
    ("number", |r| r.rays.to_string()),
    ("hits %", |r| format!("{:.1}", 100.0 * r.hits as f64 / r.rays.max(1) as f64)),
    ("Mrays/s", |r| significant(r.mrays_per_s)),
    ("best", |r| significant(r.best_mrays_per_s)),
    ("steps/ray", |r| significant(r.steps_per_ray)),
    ("CPU ns/ray", |r| significant(r.cpu_ns_per_ray)),
];

impl Report {
    /// For a terminal, or as a section of a Markdown document.
    pub fn text(&self, markdown: bool) -> String {
        let mut out = String::new();
        let m = &self.machine;
        let cpu = m.cpu.as_deref().unwrap_or("unknown CPU");
        let commit = m.commit.as_deref().unwrap_or("unknown");
        let _ = writeln!(
            out,
            "{} ({}); {cpu}, {} threads; photolith {}, commit {commit}; {}",
            m.device, m.driver, m.threads, m.version, m.date
        );
        for scene in &self.scenes {
            out.push('\n');
            scene.write(&mut out, markdown);
        }
        if let Some(growth) = &self.growth {
            out.push('\n');
            growth.write(&mut out, markdown);
        }
        for rays in &self.rays {
            out.push('\n');
            rays.write(&mut out, markdown);
        }
        out
    }

    /// One line for each row, with a heading.
    pub fn csv(&self) -> String {
        let mut out = String::new();
        if let Some(growth) = &self.growth {
            out.push_str("grows,size,setup_s,build_s,bytes_per_primitive,bvh_depth,steps_per_ray,rays_per_sample,");
            out.push_str("render_s,ns_per_sample,mrays_per_s,device_bytes\n");
            for r in &growth.rows {
                let _ = writeln!(
                    out,
                    "{},{},{},{},{},{},{},{},{},{},{},{}",
                    growth.grows.name(),
                    r.size,
                    cell(r.setup_s),
                    cell(r.build_s),
                    cell(r.bytes_per_primitive),
                    cell(r.bvh_depth.map(f64::from)),
                    cell(r.steps_per_ray),
                    cell(r.rays_per_sample),
                    cell(r.render_s),
                    cell(r.ns_per_sample),
                    cell(r.mrays_per_s),
                    r.device_bytes
                );
            }
            return out;
        }
        if !self.rays.is_empty() {
            out.push_str(
                "scene,triangles,accel,kind,rays,hits,mrays_per_s,best_mrays_per_s,steps_per_ray,cpu_ns_per_ray\n",
            );
            for scene in &self.rays {
                for r in &scene.rates {
                    let (name, kind) = (quoted(&scene.scene), r.kind.name());
                    let (rate, best, cpu) = (cell(r.mrays_per_s), cell(r.best_mrays_per_s), cell(r.cpu_ns_per_ray));
                    let (n, accel, steps) = (scene.triangles, scene.accel, cell(r.steps_per_ray));
                    let _ =
                        writeln!(out, "{name},{n},{accel},{kind},{},{},{rate},{best},{steps},{cpu}", r.rays, r.hits);
                }
            }
            return out;
        }
        out.push_str("scene,configuration,samples,setup_s,compile_s,render_s,device_s,msamples_per_s,mrays_per_s,");
        out.push_str("steps_per_ray,mse,rmse,rmse_half_width,rel_mse,mape,flip,bias,bias_half_width,efficiency\n");
        for scene in &self.scenes {
            for c in &scene.configurations {
                for r in &c.rows {
                    let _ = writeln!(
                        out,
                        "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                        quoted(&scene.scene),
                        quoted(&c.label),
                        r.samples,
                        cell(c.setup_s),
                        cell(c.compile_s),
                        cell(r.render_s),
                        cell(r.device_s),
                        cell(r.msamples_per_s),
                        cell(r.mrays_per_s),
                        cell(c.steps_per_ray),
                        cell(r.mse),
                        cell(r.rmse),
                        cell(r.rmse_half_width),
                        cell(r.rel_mse),
                        cell(r.mape),
                        cell(r.flip),
                        cell(r.bias),
                        cell(r.bias_half_width),
                        cell(r.efficiency)
                    );
                }
            }
        }
        out
    }

    /// Error over samples and over time for each scene; time, building and steps over size. Panels without a point are left
    /// out; `None` if no other is there.
    pub fn figure(&self) -> Option<Figure> {
        let (panels, columns) = match &self.growth {
            Some(growth) => (growth.panels(), usize::MAX),
            None => (self.scenes.iter().flat_map(SceneReport::panels).collect(), 2),
        };
        let panels: Vec<_> = panels.into_iter().filter(Panel::has_points).collect();
        (!panels.is_empty()).then(|| Figure { columns: columns.min(panels.len()), panels })
    }

    /// Whether nothing was measured.
    pub fn is_empty(&self) -> bool {
        self.scenes.is_empty() && self.rays.is_empty() && self.growth.as_ref().is_none_or(|g| g.rows.is_empty())
    }
}

impl SceneReport {
    fn write(&self, out: &mut String, markdown: bool) {
        let mark = if markdown { "### " } else { "" };
        let r = &self.reference;
        let origin = match r.origin {
            Origin::Given => "given",
            Origin::Renderer => "renderer, independent numbers",
            Origin::Oracle => "oracle",
        };
        let samples = r.samples.map_or_else(String::new, |n| format!(", {n} samples per pixel"));
        let _ = writeln!(out, "{mark}{}", self.scene);
        if markdown {
            out.push('\n');
        }
        let _ = writeln!(
            out,
            "{}×{}, depth {}, {} {}; reference: {origin}{samples}, noise {}",
            self.width,
            self.height,
            self.max_depth,
            self.seeds,
            if self.seeds == 1 { "seed" } else { "seeds" },
            significant(Some(r.noise_rmse))
        );
        for c in &self.configurations {
            let steps =
                c.steps_per_ray.map_or_else(String::new, |s| format!("; {} BVH steps a ray", significant(Some(s))));
            let rays = c.rows.last().map_or(0.0, |r| r.rays_per_sample);
            let slope =
                c.slope.as_ref().map_or_else(String::new, |s| format!("; RMSE ∝ samples^({})", exponent(Some(s))));
            let _ = writeln!(
                out,
                "\n{}: set-up {} s, of which pipeline {} s; {} rays a sample{steps}{slope}",
                if markdown { format!("**{}**", c.label) } else { c.label.clone() },
                significant(Some(c.setup_s)),
                significant(Some(c.compile_s)),
                significant(Some(rays)),
            );
            if markdown {
                out.push('\n');
            }
            out.push_str(&table(&ROW_COLUMNS, &c.rows, markdown));
        }
        let Some(target) = self.target_rmse else { return };
        let _ = writeln!(out, "\nTime to an RMSE of {}:\n", significant(Some(target)));
        let columns: [Column<ConfigurationSummary>; 5] = [
            ("configuration", |c| c.label.clone()),
            ("wall s", |c| significant(c.time_to_target.map(|t| t.seconds))),
            ("samples", |c| significant(c.time_to_target.map(|t| t.samples))),
            ("time per sample, × first", |c| significant(c.relative_time)),
            ("", |c| remark(c).to_owned()),
        ];
        out.push_str(&table(&columns, &self.configurations, markdown));
    }

    fn panels(&self) -> [Panel; 2] {
        let name = self.scene.rsplit(['/', '\\']).next().unwrap_or(&self.scene);
        let panel = |x_label: &str, x_base, x: fn(&Row) -> f64| Panel {
            title: format!("{name}, {}×{}", self.width, self.height),
            x_label: x_label.to_owned(),
            y_label: "RMSE (radiance)".to_owned(),
            x_base,
            series: self
                .configurations
                .iter()
                .map(|c| Series {
                    label: c.label.clone(),
                    points: c.rows.iter().filter_map(|r| Some((x(r), r.rmse?))).collect(),
                })
                .collect(),
        };
        [panel("samples per pixel", 2.0, |r| f64::from(r.samples)), panel("wall time (s)", 10.0, |r| r.render_s)]
    }
}

impl RaysReport {
    fn write(&self, out: &mut String, markdown: bool) {
        let mark = if markdown { "### " } else { "" };
        let _ = writeln!(out, "{mark}{}, {} triangles, {}\n", self.scene, self.triangles, self.accel);
        out.push_str(&table(&RAY_COLUMNS, &self.rates, markdown));
    }
}

impl GrowthReport {
    fn write(&self, out: &mut String, markdown: bool) {
        let mark = if markdown { "### Growth with " } else { "growth with " };
        let _ = writeln!(out, "{mark}{}\n", self.grows.name());
        out.push_str(&table(&GROWTH_COLUMNS, &self.rows, markdown));
        let _ = writeln!(
            out,
            "\n{} samples per pixel; time per sample ∝ size^({}), building ∝ size^({}), steps per ray ∝ size^({})",
            self.samples,
            exponent(self.time_exponent.as_ref()),
            exponent(self.build_exponent.as_ref()),
            exponent(self.steps_exponent.as_ref())
        );
        if let Some(ended) = &self.ended {
            let _ = writeln!(out, "ended early at {ended}");
        }
    }

    fn panels(&self) -> Vec<Panel> {
        type Quantity = fn(&GrowthRow) -> Option<f64>;
        let quantities: [(&str, Quantity); 3] = [
            ("time per sample (ns)", |r| Some(r.ns_per_sample)),
            ("BVH build (s)", |r| r.build_s),
            ("BVH steps per ray", |r| r.steps_per_ray.filter(|&s| s > 0.0)),
        ];
        quantities
            .into_iter()
            .map(|(y_label, value)| Panel {
                title: format!("{y_label} against {}", self.grows.name()),
                x_label: self.grows.name().to_owned(),
                y_label: y_label.to_owned(),
                x_base: 10.0,
                series: vec![Series {
                    label: String::new(),
                    points: self.rows.iter().filter_map(|r| Some((r.size as f64, value(r)?))).collect(),
                }],
            })
            .collect()
    }
}
/// What else there is to say of a time to a target.
fn remark(configuration: &ConfigurationSummary) -> &'static str {
    match configuration.time_to_target {
        Some(TimeToTarget { extrapolated: true, .. }) => "extrapolated",
        None if configuration.below_target => "below it with the fewest samples",
        _ => "",
    }
}
