//! Rays a second, by kind: what the BVH alone is worth, without shading.
//!
//! The rays are those of the scene: one camera ray through a random point of each pixel, and where it meets a surface
//! the shadow ray and the continuation that the path tracer makes there. They can be written to a file, so that other
//! tracers can be timed with the same ones ([`dump`]).

mod dump;

use std::ops::ControlFlow;

use serde::Serialize;

use crate::Context;
use crate::check::CheckError;
use crate::check::probe::{BATCH, PathInput, Query, RayInput, RayProbe, Traced, Traversal};
use crate::oracle::Pcg64;
use crate::render::space::RenderSpace;
use crate::render::space::view::View;
use crate::render::{Choice as _, RenderSettings};
use crate::scene::Scene;

use crate::bench::error::BenchError;
use crate::bench::machine::cpu_seconds;
use crate::bench::statistics::median;

pub use crate::bench::rays::dump::dump;

/// Timed repetitions of each kind.
const REPEATS: usize = 15;
/// Pixels of a tile: neighbouring rays in memory are neighbours in the image.
const TILE: u32 = 8;

/// Why a ray is traced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RayKind {
    /// From the camera: closest hit.
    Primary,
    /// To a light: any hit.
    Shadow,
    /// On from a surface: closest hit.
    Bounce,
}

impl RayKind {
    /// All of them, in the order of a path.
    pub const ALL: [Self; 3] = [Self::Primary, Self::Shadow, Self::Bounce];

    /// For tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Shadow => "shadow",
            Self::Bounce => "bounce",
        }
    }

    fn query(self) -> Query {
        if self == Self::Shadow { Query::Any } else { Query::Closest }
    }
}

/// The rates of a kind of ray.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RayRate {
    /// Which.
    pub kind: RayKind,
    /// How many there are.
    pub rays: usize,
    /// How many of them meet something.
    pub hits: usize,
    /// Rays a second, millions: the median over repetitions.
    pub mrays_per_s: Option<f64>,
    /// The same of the fastest repetition.
    pub best_mrays_per_s: Option<f64>,
    /// Steps through the BVH per ray; 0 for a ray that misses the BVH's boxes.
    pub steps_per_ray: Option<f64>,
    /// CPU time of the whole process for a ray, nanoseconds, where the system tells: what a CPU driver spends, whatever
    /// else the machine does meanwhile.
    pub cpu_ns_per_ray: Option<f64>,
}

/// A scene's rates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RaysReport {
    /// Its file.
    pub scene: String,
    /// How triangles are found: the setting's name.
    pub accel: &'static str,
    /// Triangles.
    pub triangles: usize,
    /// Repetitions.
    pub repeats: usize,
    /// By kind.
    pub rates: Vec<RayRate>,
}

/// Rays of one kind, and what they met.
pub struct RaySet {
    rays: Vec<RayInput>,
    found: Vec<Traced>,
}

/// Makes the rays of a scene and times them. `on_kind` is told each kind before it is timed; if it breaks, those so far are
/// returned.
///
/// # Errors
/// The device fails, or its limits or memory are exceeded; [`BenchError::Interrupted`] if `on_kind` breaks at the first.
pub fn measure(
    context: &Context,
    scene: &Scene,
    settings: &RenderSettings,
    mut on_kind: impl FnMut(RayKind) -> ControlFlow<()>,
) -> Result<(RaysReport, Vec<RaySet>), BenchError> {
    let fail = |source| BenchError::Rays { scene: scene.source.clone(), source };
    let sets = make(context, scene, settings).map_err(fail)?;
    let mut traversal = Traversal::new(context, scene, settings).map_err(fail)?;
    // Counting takes time, so it has a pipeline of its own.
    let counting = RenderSettings { count_steps: true, ..settings.clone() };
    let mut counted = Traversal::new(context, scene, &counting).map_err(fail)?;
    let mut rates = Vec::new();
    let mut traced = Vec::new();
    for (kind, rays) in RayKind::ALL.into_iter().zip(sets) {
        if on_kind(kind).is_break() {
            break;
        }
        let Times { found, wall, cpu } = time(&mut traversal, &rays, kind).map_err(fail)?;
        let steps = count_steps(&mut counted, &rays, kind).map_err(fail)?;
        let rate = |seconds: f64| (!rays.is_empty()).then(|| rays.len() as f64 / seconds / 1e6);
        rates.push(RayRate {
            kind,
            rays: rays.len(),
            hits: found.iter().filter(|f| f.id >= 0).count(),
            mrays_per_s: rate(median(&wall)),
            best_mrays_per_s: rate(wall.iter().copied().fold(f64::INFINITY, f64::min)),
            steps_per_ray: (!rays.is_empty()).then(|| steps as f64 / rays.len() as f64),
            cpu_ns_per_ray: (!rays.is_empty()).then(|| median(&cpu) / rays.len() as f64 * 1e9).filter(|&ns| ns > 0.0),
        });
        traced.push(RaySet { rays, found });
    }
    if rates.is_empty() {
        return Err(BenchError::Interrupted);
    }
    let report = RaysReport {
        scene: scene.source.clone(),
        accel: settings.accel.name(),
        triangles: scene.triangle_count(),
        repeats: REPEATS,
        rates,
    };
    Ok((report, traced))
}

/// What tracing some rays gave and took.
struct Times {
    found: Vec<Traced>,
    /// Seconds of each repetition.
    wall: Vec<f64>,
    /// CPU seconds of each repetition; 0 where they are not known.
    cpu: Vec<f64>,
}

fn time(traversal: &mut Traversal, rays: &[RayInput], kind: RayKind) -> Result<Times, CheckError> {
    let mut times = Times { found: Vec::with_capacity(rays.len()), wall: vec![0.0; REPEATS], cpu: vec![0.0; REPEATS] };
    for batch in rays.chunks(BATCH) {
        traversal.load(batch)?;
        for (wall, cpu) in times.wall.iter_mut().zip(&mut times.cpu) {
            let before = cpu_seconds();
            *wall += traversal.trace(kind.query())?;
            *cpu += cpu_seconds() - before;
        }
        times.found.extend(traversal.found()?);
    }
    Ok(times)
}

fn count_steps(traversal: &mut Traversal, rays: &[RayInput], kind: RayKind) -> Result<u64, CheckError> {
    let mut steps = 0;
    for batch in rays.chunks(BATCH) {
        traversal.load(batch)?;
        traversal.trace(kind.query())?;
        steps += traversal.found()?.iter().map(|f| u64::from(f.steps)).sum::<u64>();
    }
    Ok(steps)
}

/// Rays of each kind, in the order of [`RayKind::ALL`].
fn make(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<[Vec<RayInput>; 3], CheckError> {
    let primary = camera_rays(scene, settings);
    // A path that may end at its first hit would have no continuation.
    let mut scene = scene.clone();
    scene.integrator.max_depth = scene.integrator.max_depth.max(2);
    scene.integrator.indirect = true;
    scene.integrator.russian_roulette = None;
    let paths: Vec<_> = primary.iter().enumerate().map(|(i, &ray)| PathInput::new(ray, i as u32, 0)).collect();
    let scattered = RayProbe::scatter(context, &scene, settings)?.run(&paths)?;
    let shadow = scattered.iter().filter(|r| r.shadow.t_max > 0.0).map(|r| r.shadow).collect();
    let alive = scattered.iter().zip(&paths).filter(|(r, _)| r.id >= 0 && r.alive != 0);
    let bounce = alive.map(|(r, path)| r.next(path).ray).collect();
    Ok([primary, shadow, bounce])
}

/// A ray through a random point of each pixel, tile by tile.
fn camera_rays(scene: &Scene, settings: &RenderSettings) -> Vec<RayInput> {
    let view = View::of(scene, RenderSpace::of(scene).length(1.0));
    let (width, height) = (scene.film.width, scene.film.height);
    let mut random = Pcg64::for_pixel(u64::from(settings.seed), 0);
    let mut uniform = move || random.uniform() as f32;
    let tiles = (0..height.div_ceil(TILE)).flat_map(|y| (0..width.div_ceil(TILE)).map(move |x| (x * TILE, y * TILE)));
    let pixels = tiles.flat_map(|(x0, y0)| (0..TILE * TILE).map(move |i| (x0 + i % TILE, y0 + i / TILE)));
    pixels
        .filter(|&(x, y)| x < width && y < height)
        .map(|(x, y)| {
            let x = (x as f32 + uniform()) * (2.0 / width as f32) - 1.0;
            let y = 1.0 - (y as f32 + uniform()) * (2.0 / height as f32);
            let [origin, direction] = view.ray(f64::from(x), f64::from(y)).map(|v| v.as_vec3());
            RayInput::new(origin, direction.normalize())
        })
        .collect()
}
