//! Animations, evaluated at one time.

use std::collections::HashMap;

use glam::{DQuat, DVec3};
use gltf::json::accessor::Type;
use gltf::json::animation::{Interpolation, Property};
use gltf::json::validation::Checked;

use crate::scene::error::SceneError;
use crate::scene::gltf::document::{Document, number};

/// What an animation sets of a node.
#[derive(Debug, Clone, Default)]
pub(super) struct NodePose {
    pub translation: Option<DVec3>,
    pub rotation: Option<DQuat>,
    pub scale: Option<DVec3>,
    pub weights: Option<Vec<f64>>,
}

impl NodePose {
    pub fn is_moved(&self) -> bool {
        self.translation.is_some() || self.rotation.is_some() || self.scale.is_some()
    }
}

/// What animations set, by node.
#[derive(Debug, Default)]
pub(super) struct Pose(HashMap<usize, NodePose>);

impl Pose {
    pub fn of_node(&self, node: usize) -> NodePose {
        self.0.get(&node).cloned().unwrap_or_default()
    }
}

impl Document<'_> {
    /// All animations at a time in seconds; none without one.
    pub fn pose(&self, time: Option<f64>) -> Result<Pose, SceneError> {
        let mut pose = Pose::default();
        let Some(time) = time else { return Ok(pose) };
        for (index, animation) in self.root.animations.iter().enumerate() {
            for (nth, channel) in animation.channels.iter().enumerate() {
                let at = format!("animation {index}, channel {nth}");
                let sampler = self.get(&animation.samplers, number(channel.sampler), "sampler", &at)?;
                let Checked::Valid(property) = channel.target.path else { continue };
                let width = match property {
                    Property::Translation | Property::Scale => 3,
                    Property::Rotation => 4,
                    Property::MorphTargetWeights => 1,
                };
                let times: Vec<f64> = self
                    .vectors::<1>(number(sampler.input), &at, &[Type::Scalar], 0.0)?
                    .into_iter()
                    .flatten()
                    .collect();
                let types = [Type::Scalar, Type::Vec3, Type::Vec4];
                let values = self.vectors::<4>(number(sampler.output), &at, &types, 0.0)?;
                let values: Vec<f64> = values.iter().flat_map(|value| value[..width].to_vec()).collect();
                let Checked::Valid(interpolation) = sampler.interpolation else {
                    return Err(self.error(at, "an unknown interpolation", "LINEAR, STEP or CUBICSPLINE"));
                };
                let is_rotation = property == Property::Rotation;
                let value = sampled(&times, &values, interpolation, is_rotation, time);
                let fits = |value: &Vec<f64>| width == 1 || value.len() == width;
                let Some(value) = value.filter(fits) else {
                    let found = format!("{} times and {} numbers", times.len(), values.len());
                    return Err(self.error(at, found, "at least one time, and as many values"));
                };
                let node = pose.0.entry(number(channel.target.node)).or_default();
                let vector = || DVec3::from_slice(&value);
                match property {
                    Property::Translation => node.translation = Some(vector()),
                    Property::Scale => node.scale = Some(vector()),
                    Property::Rotation => node.rotation = Some(DQuat::from_slice(&value)),
                    Property::MorphTargetWeights => node.weights = Some(value),
                }
            }
        }
        Ok(pose)
    }
}

/// The value at a time: that of the first key before, that of the last one after.
fn sampled(
    times: &[f64],
    values: &[f64],
    interpolation: Interpolation,
    is_rotation: bool,
    time: f64,
) -> Option<Vec<f64>> {
    let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let width = values.len().checked_div(times.len() * parts)?;
    if width == 0 || width * times.len() * parts != values.len() || (is_rotation && width != 4) {
        return None;
    }
    let part = |key: usize, part: usize| &values[(key * parts + part) * width..][..width];
    let value = |key: usize| part(key, parts / 2);
    let after = times.partition_point(|&t| t <= time);
    if after == 0 || after == times.len() {
        return Some(value(after.saturating_sub(1)).to_vec());
    }
    let (first, second) = (after - 1, after);
    let length = times[second] - times[first];
    let t = if length > 0.0 { (time - times[first]) / length } else { 0.0 };
    let mix = |weights: [f64; 2]| {
        let both = value(first).iter().zip(value(second));
        both.map(|(a, b)| weights[0] * a + weights[1] * b).collect::<Vec<_>>()
    };
    Some(match interpolation {
        Interpolation::Step => value(first).to_vec(),
        Interpolation::Linear if is_rotation => {
            let [a, b] = [first, second].map(|key| DQuat::from_slice(value(key)).normalize());
            a.slerp(b, t).to_array().to_vec()
        }
        Interpolation::Linear => mix([1.0 - t, t]),
        Interpolation::CubicSpline => {
            let (t2, t3) = (t * t, t * t * t);
            let values = mix([2.0 * t3 - 3.0 * t2 + 1.0, 3.0 * t2 - 2.0 * t3]);
            let tangents = part(first, 2).iter().zip(part(second, 0));
            let tangents = tangents.map(|(out, into)| length * ((t3 - 2.0 * t2 + t) * out + (t3 - t2) * into));
            values.iter().zip(tangents).map(|(value, tangent)| value + tangent).collect()
        }
    })
}
