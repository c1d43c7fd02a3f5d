//! Spheres around bodies of glass and mirrors, to which light is traced (shaders/lib/light_tracing.glsl).

use glam::DVec3;

use crate::scene::Scene;

use crate::render::space::RenderSpace;
use crate::render::space::bounds::corners_around;

/// So many of the largest targets may have others in them.
const MOST_LOOKED_INTO: usize = 64;

/// A sphere around bodies of glass and mirrors, in render space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target {
    pub center: DVec3,
    pub radius: f64,
}

impl Target {
    pub fn contains(&self, other: &Self) -> bool {
        self.center.distance(other.center) + other.radius <= self.radius
    }

    /// For the shaders: centre, radius.
    pub fn texel(&self) -> [f32; 4] {
        self.center.extend(self.radius).as_vec4().to_array()
    }

    /// Around points; `None` around none.
    fn around(points: impl Iterator<Item = DVec3> + Clone) -> Option<Self> {
        let [lo, hi] = corners_around(points.clone())?;
        let center = (lo + hi) / 2.0;
        let radius = points.map(|p| p.distance(center)).fold(0.0, f64::max);
        Some(Self { center, radius })
    }

    /// Around other targets.
    pub fn around_all(targets: &[Self]) -> Option<Self> {
        let Self { center, .. } = Self::around(targets.iter().map(|t| t.center))?;
        let radius = targets.iter().map(|t| t.center.distance(center) + t.radius).fold(0.0, f64::max);
        Some(Self { center, radius })
    }
}

/// Spheres around all that is of glass or a mirror.
pub(crate) fn targets(scene: &Scene, space: &RenderSpace) -> Vec<Target> {
    let is_specular = |material: u32| scene.surface(material).is_mirror() || scene.surface(material).is_dielectric();
    let spheres = scene.spheres.iter().filter(|s| is_specular(s.material));
    let mut found: Vec<_> =
        spheres.map(|s| Target { center: space.point(s.center), radius: space.length(s.radius) }).collect();
    for mesh in &scene.meshes {
        let triangles = mesh.triangles.iter().zip(&mesh.triangle_materials).filter(|(_, m)| is_specular(**m));
        found.extend(Target::around(triangles.flat_map(|(t, _)| t.map(|i| space.point(mesh.positions[i as usize])))));
    }
    // Single precision shall not leave anything out.
    found.iter_mut().for_each(|t| t.radius = t.radius * 1.001 + 1e-6);
    found
}

/// Those that are in none of the largest.
pub(crate) fn without_inner(mut targets: Vec<Target>) -> Vec<Target> {
    targets.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    let mut kept: Vec<Target> = Vec::new();
    for target in targets {
        // Of many spheres there are very many pairs.
        if !kept.iter().take(MOST_LOOKED_INTO).any(|k| k.contains(&target)) {
            kept.push(target);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(x: f64, radius: f64) -> Target {
        Target { center: x * DVec3::X, radius }
    }

    #[test]
    fn inner_targets_are_left_out() {
        let inner = [ball(0.0, 1.0), ball(0.1, 0.5), ball(5.0, 2.0), ball(5.0, 2.5), ball(5.0, 2.5)];
        assert_eq!(without_inner(inner.to_vec()), [ball(5.0, 2.5), ball(0.0, 1.0)]);
        // Those of the largest, however many there are.
        let mut many: Vec<_> = (0..1_000_000).map(|i| ball(3.0 * f64::from(i), 1.0)).collect();
        many.push(ball(0.5, 0.25));
        assert_eq!(without_inner(many).len(), 1_000_000);
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
