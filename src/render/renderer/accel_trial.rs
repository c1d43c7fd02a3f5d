//! Whether ray queries or the BVH find triangles, where that is left to us: a GPU with ray queries tries both. The image has the same bits.

use std::time::Instant;

use crate::gpu::{Context, DeviceKind};

use crate::render::error::RenderError;
use crate::render::plan::prepared::Prepared;
use crate::render::renderer::Renderer;
use crate::render::settings::{Accel, RenderSettings};

/// Samples of a rendering from which on a trial pays, for which another kernel is compiled: some seconds of work for a GPU.
const WORTH_A_TRIAL: f64 = (1u64 << 30) as f64;
/// Ray queries have to take less than so much of the BVH's time.
const CLEARLY_LESS: f64 = 0.98;

/// Whether to try.
fn is_tried(settings: &RenderSettings, kind: DeviceKind, pixels: f64) -> bool {
    let pays = kind != DeviceKind::Cpu && pixels * f64::from(settings.planned_samples()) >= WORTH_A_TRIAL;
    settings.accel == Accel::Auto && (pays || settings.forces_trial)
}

/// What to render with, if the same work takes so many seconds.
fn faster(by_bvh: f64, by_ray_queries: f64) -> Accel {
    if by_ray_queries < CLEARLY_LESS * by_bvh { Accel::RayQuery } else { Accel::Bvh }
}

/// The faster of two renderers, if both are to be tried.
pub(super) fn winner(context: &Context, prepared: &Prepared<'_>) -> Result<Option<Renderer>, RenderError> {
    let start = Instant::now();
    let film = &prepared.scene.film;
    let pixels = f64::from(film.width) * f64::from(film.height);
    let tries = is_tried(prepared.settings, context.info().kind, pixels)
        && prepared.tables.bvh.is_some()
        && context.check_ray_queries().is_ok();
    if !tries {
        return Ok(None);
    }
    let made = |accel| -> Result<(Renderer, f64), RenderError> {
        let settings = RenderSettings { accel, ..prepared.settings.clone() };
        let mut renderer = Renderer::with(context, Prepared::of(prepared.scene, &settings)?)?;
        let seconds = renderer.time_a_sample()?;
        Ok((renderer, seconds))
    };
    let (bvh, by_bvh) = made(Accel::Bvh)?;
    let mut winner = bvh;
    // More leaves than it allows, say.
    match made(Accel::RayQuery) {
        Ok((queries, by_ray_queries)) => {
            log::info!("a sample takes {by_bvh:.4} s by the BVH, {by_ray_queries:.4} s by ray queries");
            if faster(by_bvh, by_ray_queries) == Accel::RayQuery {
                winner = queries;
            }
        }
        Err(error) => log::info!("no ray queries: {error}"),
    }
    winner.engine.statistics.setup_seconds = prepared.seconds + start.elapsed().as_secs_f64();
    Ok(Some(winner))
}

impl Renderer {
    /// Seconds for a sample of each pixel.
    fn time_a_sample(&mut self) -> Result<f64, RenderError> {
        let one =
            RenderSettings { samples: 1, begun_with: None, adaptive: None, time_limit: None, ..self.settings.clone() };
        let settings = std::mem::replace(&mut self.settings, one);
        let mut seconds = f64::INFINITY;
        // The first touches memory.
        for _ in 0..2 {
            self.render(|_| std::ops::ControlFlow::Continue(()))?;
            seconds = seconds.min(self.engine.statistics.render_seconds);
        }
        self.settings = settings;
        Ok(seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gpus_try_long_renderings() {
        let long = RenderSettings { samples: 1024, ..RenderSettings::default() };
        let pixels = f64::from(1 << 20);
        assert!(is_tried(&long, DeviceKind::Discrete, pixels));
        assert!(!is_tried(&long, DeviceKind::Discrete, pixels / 2.0));
        assert!(!is_tried(&long, DeviceKind::Cpu, pixels));
        for accel in [Accel::Bvh, Accel::None, Accel::RayQuery, Accel::RayQueryTriangles] {
            let forced = RenderSettings { accel, forces_trial: true, ..long.clone() };
            assert!(!is_tried(&forced, DeviceKind::Discrete, pixels), "{accel:?}");
        }
        assert!(is_tried(&RenderSettings { forces_trial: true, ..long }, DeviceKind::Cpu, 1.0));
    }

    #[test]
    fn ray_queries_have_to_be_faster() {
        assert_eq!(faster(1.0, 0.5), Accel::RayQuery);
        assert_eq!(faster(1.0, 0.99), Accel::Bvh);
        assert_eq!(faster(1.0, 2.0), Accel::Bvh);
        assert_eq!(faster(1.0, f64::NAN), Accel::Bvh);
    }
}
