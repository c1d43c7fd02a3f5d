//! What rays are aimed at, where paths serve several pixels: bodies of glass and mirrors (shaders/lib/aim.glsl).

use glam::DVec3;

use crate::scene::Scene;

use super::layout::constant::MAX_AIM_TARGETS;
use super::space::RenderSpace;
use super::targets::{self, Target};

/// The square of the sine of half the angle under which the camera may see a target at most. Larger ones are walls: rays meet them by
/// chance, and what they are aimed at besides makes little of the noise. (A room with two mirror walls: 1.2 times the time × squared
/// error, with the walls among the targets or without.)
const LARGEST_SEEN: f64 = 0.5;
/// The part that the targets there is room for must be of all, by the squares of radii.
const LEAST_COVERED: f64 = 0.5;

/// The spheres around the largest bodies, in render space: centre, radius. None if one is too large, or they are too little of all.
pub(super) fn targets(scene: &Scene, space: &RenderSpace) -> Vec<[f32; 4]> {
    chosen(targets::targets(scene, space)).iter().map(Target::texel).collect()
}

/// The largest, without what is in them.
fn chosen(mut targets: Vec<Target>) -> Vec<Target> {
    targets.sort_unstable_by(|a, b| b.radius.total_cmp(&a.radius));
    // The camera is the origin.
    let is_wall = |t: &Target| t.radius.powi(2) > LARGEST_SEEN * t.center.distance_squared(DVec3::ZERO);
    if targets.iter().any(is_wall) {
        return Vec::new();
    }
    let mut chosen: Vec<Target> = Vec::new();
    let (mut covered, mut all) = (0.0, 0.0);
    for target in targets {
        let square = target.radius.powi(2);
        if chosen.iter().any(|c| c.contains(&target)) {
            continue;
        }
        all += square;
        if chosen.len() < MAX_AIM_TARGETS {
            covered += square;
            chosen.push(target);
        }
    }
    if covered < LEAST_COVERED * all { Vec::new() } else { chosen }
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
        let hollow: Vec<_> = row(8).into_iter().flat_map(|t| [Target { radius: 0.95, ..t }, t]).collect();
        assert_eq!(chosen(hollow), row(8));
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
