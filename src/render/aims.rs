//! What rays are aimed at, where paths serve several pixels: bodies of glass and mirrors (shaders/lib/aim.glsl).

use glam::DVec3;

use crate::scene::Scene;

use super::layout::constant::MAX_AIM_TARGETS;
use super::space::RenderSpace;
use super::targets::{self, Target, without_inner};

/// The square of the sine of half the angle under which the camera may see a target at most. Larger ones are walls: rays meet them by
/// chance, and what they are aimed at besides makes little of the noise. (A room with two mirror walls: 1.2 times the time × squared
/// error, with the walls among the targets or without.)
const LARGEST_SEEN: f64 = 0.5;
/// The part of what targets cover, as seen from everywhere, that must be that of the ones there is room for.
const LEAST_COVERED: f64 = 0.5;

/// The spheres around the largest bodies, in render space: centre, radius. None if one is too large, or they are too little of all.
pub(super) fn targets(scene: &Scene, space: &RenderSpace) -> Vec<[f32; 4]> {
    chosen(without_inner(targets::targets(scene, space)))
        .iter()
        .map(|t| t.center.extend(t.radius).as_vec4().to_array())
        .collect()
}

/// Of targets, the largest first.
fn chosen(mut targets: Vec<Target>) -> Vec<Target> {
    let area = |targets: &[Target]| targets.iter().map(|t| t.radius.powi(2)).sum::<f64>();
    // The camera is the origin.
    let is_wall = |t: &Target| t.radius.powi(2) > LARGEST_SEEN * t.center.distance_squared(DVec3::ZERO);
    let all = area(&targets);
    targets.truncate(MAX_AIM_TARGETS);
    if area(&targets) < LEAST_COVERED * all || targets.iter().any(is_wall) { Vec::new() } else { targets }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(x: f64, radius: f64) -> Target {
        Target { center: DVec3::new(x, 0.0, 10.0), radius }
    }

    #[test]
    fn the_largest_are_chosen_if_they_are_most() {
        assert!(chosen(Vec::new()).is_empty());
        let few = vec![ball(0.0, 2.0), ball(5.0, 1.0)];
        assert_eq!(chosen(few.clone()), few);
        let row = |count: usize| (0..count).map(|i| ball(3.0 * i as f64, 1.0)).collect::<Vec<_>>();
        assert_eq!(chosen(row(16)).len(), MAX_AIM_TARGETS);
        assert!(chosen(row(17)).is_empty(), "most of them would be left out");
        let mut with_small = row(8);
        with_small.extend((0..100).map(|i| ball(-3.0 * f64::from(i), 0.1)));
        assert_eq!(chosen(with_small), row(8));
    }

    #[test]
    fn nothing_is_aimed_at_beside_walls() {
        assert_eq!(chosen(vec![ball(0.0, 7.0)]).len(), 1);
        assert!(chosen(vec![ball(0.0, 7.1), ball(0.0, 1.0)]).is_empty());
        assert!(chosen(vec![ball(0.0, 20.0)]).is_empty(), "around the camera");
    }
}
