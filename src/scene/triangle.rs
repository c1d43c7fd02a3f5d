//! The test that tells a triangle from a line or a point.

use glam::DVec3;

/// Whether the triangle has an area: one that its coordinates, given to double precision, can tell from zero, and
/// that does not underflow in single precision.
///
/// Each coordinate carries a relative rounding error of at most ε/2 per operation that made it (decimal conversion,
/// scale, rotate, translate: well below eight), hence an edge an absolute one of about 8ε·max|p|, and the cross
/// product of two edges one of about that times the longer edge.
pub(super) fn has_area(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let doubled_area = ab.cross(ac).length();
    let largest_coordinate = a.abs().max(b.abs()).max(c.abs()).max_element();
    let longest_edge = ab.length().max(ac.length()).max(bc.length());
    let error = 8.0 * f64::EPSILON * largest_coordinate * longest_edge;
    // Both comparisons are false for NaN.
    doubled_area > error && doubled_area >= f64::from(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    #[test]
    fn slivers_have_an_area_lines_do_not() {
        assert!(has_area(v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.5, 1e-6, 0.0)));
        assert!(has_area(v(1e5, 0.0, 0.0), v(1e5 + 1e-3, 0.0, 0.0), v(1e5, 1e-3, 0.0)));
        // Collinear in decimal, not quite so in binary.
        assert!(!has_area(v(0.1, 0.1, 0.1), v(0.2, 0.2, 0.2), v(0.3, 0.3, 0.3)));
        assert!(!has_area(v(1.0, 2.0, 3.0), v(1.0, 2.0, 3.0), v(4.0, 5.0, 6.0)));
        assert!(!has_area(v(f64::NAN, 2.0, 3.0), v(1.0, 2.0, 3.0), v(4.0, 5.0, 6.0)));
    }

    #[test]
    fn area_below_single_precision_counts_as_none() {
        let triangle = |edge: f64| has_area(v(0.0, 0.0, 0.0), v(edge, 0.0, 0.0), v(0.0, edge, 0.0));
        assert!(triangle(1.1e-19));
        assert!(!triangle(1e-19));
    }
}
