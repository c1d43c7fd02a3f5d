//! Placing a mesh in the scene.

use glam::{DMat3, DVec3};

/// Takes a mesh from its file's space to scene space: scale, then rotate, then translate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Uniform, > 0.
    pub scale: f64,
    /// Degrees about the x, then the y, then the z axis of the scene, each counter-clockwise seen from the axis' tip.
    pub rotate: DVec3,
    /// Scene units.
    pub translate: DVec3,
}

impl Default for Placement {
    fn default() -> Self {
        Self { scale: 1.0, rotate: DVec3::ZERO, translate: DVec3::ZERO }
    }
}

impl Placement {
    /// The rotation alone, which is what directions need.
    pub fn rotation(&self) -> DMat3 {
        let [(sx, cx), (sy, cy), (sz, cz)] = self.rotate.to_array().map(sin_cos_degrees);
        let about_x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
        let about_y = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
        let about_z = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
        about_z * about_y * about_x
    }

    /// Scene-space points from points of the mesh's file. Exact for the default placement.
    pub fn scene_from_mesh(&self) -> impl Fn(DVec3) -> DVec3 {
        let (scale, rotation, translate) = (self.scale, self.rotation(), self.translate);
        let rotates = self.rotate != DVec3::ZERO;
        move |point| {
            let scaled = point * scale;
            (if rotates { rotation * scaled } else { scaled }) + translate
        }
    }
}

/// What transforms normals: the inverse transpose times the determinant.
pub(super) fn cofactors(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

/// Sine and cosine; exact for multiples of 90°, so that a mesh turned onto another axis keeps its coordinates.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turn = degrees.rem_euclid(360.0);
    match turn {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => turn.to_radians().sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_turns_are_exact_and_go_x_then_y_then_z() {
        let turned = |rotate, point| Placement { rotate, ..Placement::default() }.scene_from_mesh()(point);
        assert_eq!(turned(DVec3::new(90.0, 0.0, 0.0), DVec3::Y), DVec3::Z);
        assert_eq!(turned(DVec3::new(0.0, 90.0, 0.0), DVec3::Z), DVec3::X);
        assert_eq!(turned(DVec3::new(0.0, 0.0, -270.0), DVec3::X), DVec3::Y);
        // About x: y -> z; about y: z -> x; about z: x -> y.
        assert_eq!(turned(DVec3::splat(90.0), DVec3::Y), DVec3::Y);
        // About x: x stays; about y: x -> -z; about z: -z stays.
        assert_eq!(turned(DVec3::splat(90.0), DVec3::X), -DVec3::Z);
    }

    #[test]
    fn scale_comes_first_translate_last() {
        let placement =
            Placement { scale: 2.0, rotate: DVec3::new(0.0, 0.0, 90.0), translate: DVec3::new(10.0, 0.0, 0.0) };
        assert_eq!(placement.scene_from_mesh()(DVec3::new(1.0, 0.0, 0.5)), DVec3::new(10.0, 2.0, 1.0));
        let r = Placement { rotate: DVec3::new(12.0, -34.0, 56.0), ..placement }.rotation();
        assert!((r.determinant() - 1.0).abs() < 1e-15);
        assert!((r * r.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-15));
    }
}
