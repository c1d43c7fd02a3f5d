//! Boxes in double precision, by their lowest and highest corner.

use glam::DVec3;

/// The lowest and the highest corner.
pub(crate) type Corners = [DVec3; 2];

/// Of the smallest box around two others.
pub(crate) fn joined(a: Corners, b: Corners) -> Corners {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Of the smallest box around points; `None` around none.
pub(crate) fn corners_around(points: impl Iterator<Item = DVec3>) -> Option<Corners> {
    points.map(|p| [p, p]).reduce(joined)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_the_lowest_and_the_highest() {
        let points = [DVec3::new(1.0, -2.0, 3.0), DVec3::new(-1.0, 5.0, 3.0), DVec3::new(0.0, 0.0, 4.0)];
        assert_eq!(corners_around(points.into_iter()), Some([DVec3::new(-1.0, -2.0, 3.0), DVec3::new(1.0, 5.0, 4.0)]));
        assert_eq!(corners_around(std::iter::empty()), None);
    }
}
