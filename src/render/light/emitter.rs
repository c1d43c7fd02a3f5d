//! Sources of light in render space.

use std::f64::consts::PI;

use glam::DVec3;

use crate::scene::Rgb;

/// A source of light in render space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Light {
    pub shape: LightShape,
    /// Intensity Φ/4π of a point, radiance of a surface.
    pub radiance: Rgb,
    /// Of a surface: its number.
    pub primitive: u32,
    /// About the part of its radiance that a texture leaves.
    pub mean: f64,
}

/// How far away parallel light comes from, for the choice among lights: much farther than the scene is large, which is about 1.
pub(crate) const FAR: f64 = 1e4;

/// Where a light is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LightShape {
    Point(DVec3),
    /// A point that shines along an axis: cosines of its angles, and its range.
    Spot {
        position: DVec3,
        axis: DVec3,
        inner: f64,
        outer: f64,
        range: f64,
    },
    /// Parallel light along an axis.
    Directional {
        axis: DVec3,
    },
    Triangle([DVec3; 3]),
    /// A corner and its two neighbours.
    Parallelogram([DVec3; 3]),
    Sphere {
        center: DVec3,
        radius: f64,
        inward: bool,
    },
}

impl Light {
    /// One that is the same all over; which primitive it is, is said later.
    pub fn new(shape: LightShape, radiance: Rgb) -> Self {
        Self { shape, radiance, primitive: 0, mean: 1.0 }
    }

    /// Lowest and highest corner.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        match self.shape {
            LightShape::Point(p) | LightShape::Spot { position: p, .. } => (p, p),
            // As seen from the scene it is alike everywhere, as a point far away is.
            LightShape::Directional { axis } => (-FAR * axis, -FAR * axis),
            LightShape::Triangle([a, b, c]) => (a.min(b).min(c), a.max(b).max(c)),
            LightShape::Parallelogram([a, b, c]) => {
                let d = b + c - a;
                (a.min(b).min(c).min(d), a.max(b).max(c).max(d))
            }
            LightShape::Sphere { center, radius, .. } => (center - radius, center + radius),
        }
    }

    /// What a white diffuse surface facing it at distance 1 would reflect, summed over channels.
    pub fn strength(&self) -> f64 {
        let size = match self.shape {
            LightShape::Point(_) | LightShape::Spot { .. } => 1.0 / std::f64::consts::PI,
            LightShape::Directional { .. } => FAR * FAR / std::f64::consts::PI,
            LightShape::Triangle([a, b, c]) => (b - a).cross(c - a).length() / 2.0 / std::f64::consts::PI,
            LightShape::Parallelogram([a, b, c]) => (b - a).cross(c - a).length() / std::f64::consts::PI,
            LightShape::Sphere { radius, inward: false, .. } => radius * radius,
            // Seen from inside, all of it shines.
            LightShape::Sphere { radius, inward: true, .. } => 4.0 * radius * radius,
        };
        size * self.mean * self.radiance.iter().sum::<f64>()
    }

    /// Directions around which it emits a hemisphere, or everywhere.
    pub fn cone(&self) -> Cone {
        match self.shape {
            LightShape::Triangle([a, b, c]) | LightShape::Parallelogram([a, b, c]) => {
                Cone { axis: (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z), angle: 0.0 }
            }
            LightShape::Point(_)
            | LightShape::Spot { .. }
            | LightShape::Directional { .. }
            | LightShape::Sphere { .. } => Cone::ALL,
        }
    }
}

/// Directions within an angle of an axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cone {
    pub axis: DVec3,
    /// Radians, 0..=π.
    pub angle: f64,
}

impl Cone {
    /// All directions.
    pub const ALL: Self = Self { axis: DVec3::Z, angle: PI };

    /// The smallest cone around both.
    pub fn union(self, other: Self) -> Self {
        let (wide, narrow) = if self.angle >= other.angle { (self, other) } else { (other, self) };
        let between = wide.axis.angle_between(narrow.axis);
        if (between + narrow.angle).min(PI) <= wide.angle {
            return wide;
        }
        let angle = (wide.angle + between + narrow.angle) / 2.0;
        if angle >= PI {
            return Self::ALL;
        }
        let turn = angle - wide.angle;
        let Some(side) = (narrow.axis - wide.axis * wide.axis.dot(narrow.axis)).try_normalize() else {
            return Self::ALL;
        };
        Self { axis: wide.axis * turn.cos() + side * turn.sin(), angle }
    }
}
