//! Implicit surfaces: functions of space that are negative inside, positive outside and grow about as fast as distance.
//!
//! Only `+ − × ÷ √` are used, which IEEE 754 rounds correctly, so that every machine computes the same bits.
//! The ellipsoid bound and the polynomial blend are those of Inigo Quilez, "Distance functions" and "Smooth minimum"
//! (iquilezles.org/articles).

use glam::DVec3;

/// A sphere; exact distance.
pub fn sphere(p: DVec3, center: DVec3, radius: f64) -> f64 {
    (p - center).length() - radius
}

/// An axis-aligned ellipsoid with semi-axes `radii`: zero on the surface, distance to first order near it.
pub fn ellipsoid(p: DVec3, center: DVec3, radii: DVec3) -> f64 {
    let q = (p - center) / radii;
    let level = q.length();
    let slope = (q / radii).length();
    if slope < 1e-9 {
        return -radii.min_element();
    }
    level * (level - 1.0) / slope
}

/// The convex hull of a sphere of radius `ra` at `a` and one of radius `rb` at `b`; exact distance.
/// Neither sphere may contain the other.
pub fn round_cone(p: DVec3, a: DVec3, ra: f64, b: DVec3, rb: f64) -> f64 {
    let axis = b - a;
    let length = axis.length();
    let along = (p - a).dot(axis) / length;
    let across = ((p - a).length_squared() - along * along).max(0.0).sqrt();
    // Sine and cosine of the cone's half angle; its tangent circles lie off the centres towards the thin end.
    let sin = (ra - rb) / length;
    let cos = (1.0 - sin * sin).sqrt();
    let foot = along * cos - across * sin;
    if foot < 0.0 {
        (p - a).length() - ra
    } else if foot > length * cos {
        (p - b).length() - rb
    } else {
        across * cos + along * sin - ra
    }
}

/// A chain of round cones through `(centre, radius)` knots, as for a limb or a tail.
pub fn chain(p: DVec3, knots: &[(DVec3, f64)]) -> f64 {
    knots.windows(2).map(|k| round_cone(p, k[0].0, k[0].1, k[1].0, k[1].1)).fold(f64::INFINITY, f64::min)
}

/// Union of `a` and `b` with a fillet that starts where the two differ by less than `k`.
pub fn blend(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - 0.25 * h * h * k
}

/// `a` without `b`, the rim rounded over `k`.
pub fn carve(a: f64, b: f64, k: f64) -> f64 {
    -blend(-a, b, k)
}

/// The part common to `a` and `b`, the edge rounded over `k`.
pub fn common(a: f64, b: f64, k: f64) -> f64 {
    -blend(-a, -b, k)
}

/// Gradient of `field` at `p` by central differences.
pub fn gradient(field: &impl Fn(DVec3) -> f64, p: DVec3) -> DVec3 {
    const STEP: f64 = 1e-4;
    let along = |axis: DVec3| (field(p + axis * STEP) - field(p - axis * STEP)) / (2.0 * STEP);
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}
