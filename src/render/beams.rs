//! Where light is traced from and towards: lamps, and bodies of glass and mirrors (shaders/lib/light/beam.glsl).

use glam::DVec3;

use crate::scene::{Scene, Surface};

use super::alias::{Column, alias_table};
use super::lights::{Light, LightShape};
use super::space::RenderSpace;

/// Most targets; of more, one is made.
const MOST_TARGETS: usize = 8;
/// Most pairs of a lamp and a target; of more, targets are made one, and with more lamps than this there are no beams.
const MOST_PAIRS: usize = 1 << 16;

/// A sphere around a body of glass or a mirror, in render space.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Target {
    center: DVec3,
    radius: f64,
}

impl Target {
    fn contains(&self, other: &Self) -> bool {
        self.center.distance(other.center) + other.radius <= self.radius
    }

    /// Around points; `None` around none.
    fn around(points: impl Iterator<Item = DVec3> + Clone) -> Option<Self> {
        let bounds = points.clone().map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        let center = (bounds.0 + bounds.1) / 2.0;
        let radius = points.map(|p| p.distance(center)).fold(0.0, f64::max);
        Some(Self { center, radius })
    }

    /// Around other targets.
    fn around_all(targets: &[Self]) -> Option<Self> {
        let Self { center, .. } = Self::around(targets.iter().map(|t| t.center))?;
        let radius = targets.iter().map(|t| t.center.distance(center) + t.radius).fold(0.0, f64::max);
        Some(Self { center, radius })
    }
}

/// What the shaders see of it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct BeamTable {
    /// Number of targets; 0: there is nothing for beams to do.
    pub targets: u32,
    /// Targets of a texel, then entries of a texel for each emitter and each target, as many as the next power of two.
    pub texels: Vec<[f32; 4]>,
}

impl BeamTable {
    /// Of a scene, with the lights that are emitters.
    pub fn of(scene: &Scene, space: &RenderSpace, emitters: &[Light]) -> Self {
        let mut targets = targets(scene, space);
        if targets.len() * emitters.len() > MOST_PAIRS {
            targets = Target::around_all(&targets).into_iter().collect();
        }
        let pairs = targets.len() * emitters.len();
        if pairs == 0 || pairs > MOST_PAIRS {
            return Self::default();
        }
        let weights: Vec<_> = emitters.iter().flat_map(|lamp| targets.iter().map(|t| weight(lamp, t))).collect();
        let sum: f64 = weights.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return Self::default();
        }
        let shares: Vec<_> = weights.iter().map(|w| w / sum).collect();
        let place = |t: &Target| t.center.extend(t.radius).as_vec4().to_array();
        let mut texels: Vec<_> = targets.iter().map(place).collect();
        let entry = |c: Column| [c.threshold, f32::from_bits(c.alias), c.share as f32, 0.0];
        texels.extend(alias_table(&shares).into_iter().map(entry));
        Self { targets: targets.len() as u32, texels }
    }
}

/// Spheres around all that is of glass or a mirror.
fn targets(scene: &Scene, space: &RenderSpace) -> Vec<Target> {
    let is_specular = |material: u32| {
        matches!(scene.materials[material as usize].surface, Surface::Mirror { .. } | Surface::Dielectric { .. })
    };
    let spheres = scene.spheres.iter().filter(|s| is_specular(s.material));
    let mut found: Vec<_> =
        spheres.map(|s| Target { center: space.point(s.center), radius: space.length(s.radius) }).collect();
    for mesh in &scene.meshes {
        let triangles = mesh.triangles.iter().zip(&mesh.triangle_materials).filter(|(_, m)| is_specular(**m));
        found.extend(Target::around(triangles.flat_map(|(t, _)| t.map(|i| space.point(mesh.positions[i as usize])))));
    }
    // Single precision shall not leave anything out.
    found.iter_mut().for_each(|t| t.radius = t.radius * 1.001 + 1e-6);
    without_inner(found)
}

/// Those that are in no other one; or one around all, if they are too many.
fn without_inner(mut targets: Vec<Target>) -> Vec<Target> {
    targets.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    let mut kept: Vec<Target> = Vec::new();
    for target in targets {
        // Once they are too many nobody asks any more: of many spheres there are very many pairs.
        if kept.len() > MOST_TARGETS || !kept.iter().any(|k| k.contains(&target)) {
            kept.push(target);
        }
    }
    if kept.len() > MOST_TARGETS { Target::around_all(&kept).into_iter().collect() } else { kept }
}

/// About what a lamp sends towards a target.
fn weight(lamp: &Light, target: &Target) -> f64 {
    let (lo, hi) = lamp.bounds();
    let middle = (lo + hi) / 2.0;
    let distance = target.center.distance(middle);
    let around = 1.0 - (1.0 - (target.radius / distance).powi(2)).max(0.0).sqrt();
    let cosine = match lamp.shape {
        LightShape::Triangle([a, b, c]) | LightShape::Parallelogram([a, b, c]) => {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let beyond = |corner: DVec3| normal.dot(target.center - corner) + target.radius;
            // A parallelogram's fourth corner.
            let most = [a, b, c, b + c - a].map(beyond).into_iter().fold(f64::MIN, f64::max);
            if most <= 0.0 { 0.0 } else { (most / (distance + target.radius)).clamp(0.05, 1.0) }
        }
        LightShape::Sphere { .. } => 1.0,
        LightShape::Point(_) => 0.0,
    };
    lamp.strength() * around * cosine
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(height: f64) -> Light {
        let corners = [DVec3::new(-1.0, height, -1.0), DVec3::new(1.0, height, -1.0), DVec3::new(-1.0, height, 1.0)];
        Light { shape: LightShape::Parallelogram(corners), radiance: [1.0; 3] }
    }

    #[test]
    fn lamps_send_light_to_what_is_before_them() {
        let target = Target { center: DVec3::ZERO, radius: 0.5 };
        // Its normal points down.
        assert!(weight(&lamp(2.0), &target) > 4.0 * weight(&lamp(5.0), &target));
        assert_eq!(weight(&lamp(-2.0), &target), 0.0);
        assert!(weight(&lamp(-0.4), &target) > 0.0, "the target reaches below the lamp");
    }

    #[test]
    fn few_targets_are_kept_and_of_many_one_is_made() {
        let ball = |x: f64, radius: f64| Target { center: x * DVec3::X, radius };
        let inner = [ball(0.0, 1.0), ball(0.1, 0.5), ball(5.0, 2.0), ball(5.0, 2.5), ball(5.0, 2.5)];
        assert_eq!(without_inner(inner.to_vec()), [ball(5.0, 2.5), ball(0.0, 1.0)]);
        let row = |count: usize| (0..count).map(|i| ball(3.0 * i as f64, 1.0)).collect::<Vec<_>>();
        assert_eq!(without_inner(row(MOST_TARGETS)), row(MOST_TARGETS));
        assert_eq!(without_inner(row(MOST_TARGETS + 1)), [ball(12.0, 13.0)]);
        assert_eq!(without_inner(row(1_000_001)), [ball(1.5e6, 1.5e6 + 1.0)]);
    }

    #[test]
    fn spheres_around_points_hold_them() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::new(0.2, 3.0, -1.0)];
        let around = Target::around(points.into_iter()).unwrap();
        assert!(points.iter().all(|p| p.distance(around.center) <= around.radius * (1.0 + 1e-12)));
        assert_eq!(Target::around(std::iter::empty()), None);
        let others = [around, Target { center: DVec3::splat(9.0), radius: 2.0 }];
        let all = Target::around_all(&others).unwrap();
        assert!(others.iter().all(|t| t.center.distance(all.center) + t.radius <= all.radius * (1.0 + 1e-12)));
    }
}
