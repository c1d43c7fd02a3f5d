//! Where light is traced from and towards: emitters, and bodies of glass and mirrors (shaders/lib/light_tracing.glsl).

use glam::DVec3;

use crate::scene::Scene;

use crate::render::light::alias::{Column, alias_table};
use crate::render::light::emitter::{Light, LightShape};
use crate::render::scene::casters::{Target, targets, without_inner};
use crate::render::space::RenderSpace;
use crate::render::space::bounds::corners_around;

/// Most targets; of more, those that are near each other are made one. With one around all in place of 64, time × squared error is
/// 1.3 to 1.7 times as large (120 balls in a room, half of them of glass or mirrors, and heaps of balls; lavapipe).
const MOST_TARGETS: usize = 64;
/// More than this take longer,
const FEW_TARGETS: usize = 8;
/// and must leave out so much of what one around all of them would get from the emitters.
const WORTH_TELLING_APART: f64 = 0.8;
/// Most pairs of an emitter and a target; with more emitters than this there are no light paths.
const MOST_PAIRS: usize = 1 << 16;

/// What the shaders see of targets and emitters.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct CasterTable {
    /// Number of targets; 0: there is nothing for light paths to do.
    pub targets: u32,
    /// Targets of a texel, then entries of a texel for each emitter and each target, as many as the next power of two.
    pub texels: Vec<[f32; 4]>,
}

impl CasterTable {
    /// Of a scene, with the lights that are emitters.
    pub fn of(scene: &Scene, space: &RenderSpace, emitters: &[Light]) -> Self {
        if emitters.is_empty() || emitters.len() > MOST_PAIRS {
            return Self::default();
        }
        let most = MOST_TARGETS.min(MOST_PAIRS / emitters.len());
        let bodies = without_inner(targets(scene, space));
        let around_all = Target::around_all(&bodies);
        let mut targets = at_most(most, bodies);
        let weights_of = |targets: &[Target]| -> Vec<f64> {
            emitters.iter().flat_map(|emitter| targets.iter().map(|t| weight(emitter, t))).collect()
        };
        let mut weights = weights_of(&targets);
        let mut sum: f64 = weights.iter().sum();
        if let Some(one) = around_all.filter(|_| targets.len() > FEW_TARGETS) {
            let of_one = weights_of(&[one]);
            let sum_of_one = of_one.iter().sum();
            if sum > WORTH_TELLING_APART * sum_of_one {
                (targets, weights, sum) = (vec![one], of_one, sum_of_one);
            }
        }
        if !(sum > 0.0 && sum.is_finite()) {
            return Self::default();
        }
        let shares: Vec<_> = weights.iter().map(|w| w / sum).collect();
        let mut texels: Vec<_> = targets.iter().map(Target::texel).collect();
        let entry = |c: Column| [c.threshold, f32::from_bits(c.alias), c.share as f32, 0.0];
        texels.extend(alias_table(&shares).into_iter().map(entry));
        Self { targets: targets.len() as u32, texels }
    }
}

/// Those near each other made one, until there are so many, at least 1.
fn at_most(most: usize, targets: Vec<Target>) -> Vec<Target> {
    if targets.len() <= most {
        return targets;
    }
    // One around all is cut until there are enough, always the largest that is of several.
    let mut made: Vec<_> = Cluster::of(targets).into_iter().collect();
    while made.len() < most {
        let several = made.iter().enumerate().filter(|(_, cluster)| cluster.members.len() > 1);
        let largest = several.max_by(|(_, a), (_, b)| a.around.radius.total_cmp(&b.around.radius));
        let Some(index) = largest.map(|(index, _)| index) else { break };
        let cluster = made.swap_remove(index);
        made.extend(cluster.halves());
    }
    without_inner(made.into_iter().map(|cluster| cluster.around).collect())
}

/// Targets that are to be one.
struct Cluster {
    around: Target,
    members: Vec<Target>,
}

impl Cluster {
    fn of(members: Vec<Target>) -> Option<Self> {
        Some(Self { around: Target::around_all(&members)?, members })
    }

    /// Its members on either side of the middle of what their centres span along the longest axis; if these are all in one place, the
    /// first half of them and the others.
    fn halves(self) -> impl Iterator<Item = Self> {
        let [lo, hi] = corners_around(self.members.iter().map(|t| t.center)).unwrap_or_default();
        let axis = (hi - lo).max_position();
        let middle = (lo[axis] + hi[axis]) / 2.0;
        let (mut left, mut right): (Vec<_>, Vec<_>) = self.members.into_iter().partition(|t| t.center[axis] < middle);
        if left.is_empty() {
            left = right.split_off(right.len() / 2);
        }
        [left, right].into_iter().filter_map(Self::of)
    }
}

/// About what an emitter sends towards a target.
fn weight(emitter: &Light, target: &Target) -> f64 {
    let (lo, hi) = emitter.bounds();
    let middle = (lo + hi) / 2.0;
    let distance = target.center.distance(middle);
    let around = 1.0 - (1.0 - (target.radius / distance).powi(2)).max(0.0).sqrt();
    let cosine = match emitter.shape {
        LightShape::Triangle([a, b, c]) | LightShape::Parallelogram([a, b, c]) => {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let beyond = |corner: DVec3| normal.dot(target.center - corner) + target.radius;
            // A parallelogram's fourth corner.
            let most = [a, b, c, b + c - a].map(beyond).into_iter().fold(f64::MIN, f64::max);
            if most <= 0.0 { 0.0 } else { (most / (distance + target.radius)).clamp(0.05, 1.0) }
        }
        LightShape::Sphere { .. } => 1.0,
        LightShape::Point(_) | LightShape::Spot { .. } | LightShape::Directional { .. } => 0.0,
    };
    emitter.strength() * around * cosine
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::scenes::{Build, empty, mirror, v};

    fn emitter(height: f64) -> Light {
        let corners = [DVec3::new(-1.0, height, -1.0), DVec3::new(1.0, height, -1.0), DVec3::new(-1.0, height, 1.0)];
        Light::new(LightShape::Parallelogram(corners), [1.0; 3])
    }

    #[test]
    fn emitters_light_what_is_before_them() {
        let target = Target { center: DVec3::ZERO, radius: 0.5 };
        // Its normal points down.
        assert!(weight(&emitter(2.0), &target) > 4.0 * weight(&emitter(5.0), &target));
        assert_eq!(weight(&emitter(-2.0), &target), 0.0);
        assert!(weight(&emitter(-0.4), &target) > 0.0, "the target reaches below the emitter");
    }

    fn ball(x: f64, radius: f64) -> Target {
        Target { center: x * DVec3::X, radius }
    }

    #[test]
    fn of_many_targets_those_near_each_other_are_made_one() {
        let row = |count: u32| (0..count).map(|i| ball(3.0 * f64::from(i), 1.0)).collect::<Vec<_>>();
        assert_eq!(at_most(4, row(4)), row(4));
        let pairs = [ball(1.5, 2.5), ball(7.5, 2.5), ball(13.5, 2.5), ball(19.5, 2.5)];
        let mut made = at_most(4, row(8));
        made.sort_by(|a, b| a.center.x.total_cmp(&b.center.x));
        assert_eq!(made, pairs);
        assert_eq!(at_most(1, row(9)), [ball(12.0, 13.0)]);
        assert!(at_most(1, Vec::new()).is_empty());
        for most in [2, 3, 5, 64] {
            let made = at_most(most, row(1000));
            assert!(made.len() == most && row(1000).iter().all(|t| made.iter().any(|m| m.contains(t))), "{most}");
        }
        // All in one place, where one hides the others.
        assert_eq!(at_most(3, vec![ball(1.0, 1.0); 100]), [ball(1.0, 1.0)]);
    }

    #[test]
    fn targets_far_from_each_other_are_not_made_one() {
        let heap = |x: f64, count: u32| (0..count).map(move |i| ball(x + 0.5 * f64::from(i % 7), 1.0));
        let heaps: Vec<_> = heap(0.0, 101).chain(heap(50.0, 27)).chain(heap(500.0, 1)).collect();
        for most in [3, 4, 64] {
            let made = at_most(most, heaps.clone());
            assert!(made.len() <= most && heaps.iter().all(|t| made.iter().any(|m| m.contains(t))), "{most}");
            assert!(made.iter().all(|m| m.radius < 10.0), "{most}: {made:?}");
        }
    }

    #[test]
    fn targets_are_told_apart_where_that_leaves_much_out() {
        let scene_of = |places: &[DVec3]| {
            let mut scene = empty();
            places.iter().for_each(|&place| scene.sphere(place, 1.0, mirror(1.0)));
            scene
        };
        let table = |places: &[DVec3], emitters: usize| {
            let scene = scene_of(places);
            CasterTable::of(&scene, &RenderSpace::of(&scene), &vec![emitter(20.0); emitters])
        };
        let apart: Vec<_> = (0..20).map(|i| v(8.0 * f64::from(i % 5), 0.0, 8.0 * f64::from(i / 5))).collect();
        assert_eq!(table(&apart, 1).targets, 20);
        assert_eq!(table(&apart, MOST_PAIRS / 4).targets, 4, "among very many emitters");
        let heap: Vec<_> = (0..512).map(|i| v(f64::from(i % 8), f64::from(i / 8 % 8), f64::from(i / 64))).collect();
        assert_eq!(table(&heap, 1).targets, 1);
        assert_eq!(table(&heap[..8], 1).targets, 8, "few cost nothing");
        assert_eq!(table(&[], 1), CasterTable::default());
        assert_eq!(table(&apart, MOST_PAIRS + 1), CasterTable::default());
    }
}
