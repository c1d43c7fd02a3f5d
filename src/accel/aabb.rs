//! Axis-aligned bounding boxes in single precision.

use glam::Vec3;

/// A box; empty while `lo > hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Lowest corner.
    pub lo: Vec3,
    /// Highest corner.
    pub hi: Vec3,
}

impl Aabb {
    /// Contains nothing; the identity of [`Aabb::union`].
    pub const EMPTY: Self = Self { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    /// The smallest box around points.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::extended)
    }

    /// The smallest box around this one and a point.
    #[must_use]
    pub fn extended(self, p: Vec3) -> Self {
        Self { lo: self.lo.min(p), hi: self.hi.max(p) }
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Half the surface area; 0 for an empty box.
    pub fn half_area(self) -> f32 {
        let d = (self.hi - self.lo).max(Vec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Whether it meets a ray from the origin, given the inverse of its direction. (Not for rays whose hits decide: nothing is
    /// done about rounding, nor about rays within a side.)
    pub fn meets_ray_from_origin(self, inverse: Vec3) -> bool {
        let (a, b) = (self.lo * inverse, self.hi * inverse);
        a.max(b).min_element() >= a.min(b).max_element().max(0.0)
    }

    /// Middle of the box.
    pub fn centroid(self) -> Vec3 {
        0.5 * (self.lo + self.hi)
    }

    /// Whether `other` lies within this box.
    pub fn contains(self, other: Self) -> bool {
        self.lo.cmple(other.lo).all() && self.hi.cmpge(other.hi).all()
    }

    /// Whether the two have a point in common.
    pub fn meets(self, other: Self) -> bool {
        self.lo.cmple(other.hi).all() && other.lo.cmple(self.hi).all()
    }
}
