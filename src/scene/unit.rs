//! Directions of vectors of any length.

use glam::DVec3;

/// Unit vector, also of vectors whose squared length over- or underflows; `None` for one that has no direction.
pub fn unit(v: DVec3) -> Option<DVec3> {
    let scale = v.abs().max_element();
    if scale > 0.0 { (v / scale).try_normalize() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_length_has_a_direction_but_none_and_infinity() {
        for length in [1e-300, 1.0, 1e300] {
            let found = unit(DVec3::new(3.0, 0.0, -4.0) * length).unwrap();
            assert!(found.abs_diff_eq(DVec3::new(0.6, 0.0, -0.8), 1e-15), "{length}: {found}");
        }
        for v in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
            assert_eq!(unit(v), None, "{v}");
        }
    }
}
