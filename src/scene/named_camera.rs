//! Cameras that a file has, by name, and what they become in an image of other proportions.

use crate::scene::description::Camera;

/// A camera of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCamera {
    /// Empty where the file gives none.
    pub name: String,
    /// In an image of any proportions, unless `vertical` says more.
    pub camera: Camera,
    /// How high its view is, where the file says that and not how wide.
    pub vertical: Option<Vertical>,
}

/// The height of a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertical {
    /// Full angle in degrees, or of an orthographic camera the height in scene units.
    pub extent: f64,
    /// Width over height of the image that the camera is meant for.
    pub aspect: Option<f64>,
}

impl NamedCamera {
    /// The camera for an image of these sides, and whether it is cut at the top and bottom by less than the file says: an image that is
    /// narrower than it is meant for keeps what is seen at the sides.
    pub fn for_image(&self, width: u32, height: u32) -> (Camera, bool) {
        let mut camera = self.camera.clone();
        let Some(Vertical { extent, aspect: meant }) = self.vertical else { return (camera, false) };
        let aspect = f64::from(width) / f64::from(height);
        let widened = meant.is_some_and(|meant| aspect < meant);
        let aspect = meant.map_or(aspect, |meant| aspect.max(meant));
        match &mut camera.orthographic_width {
            Some(width) => *width = extent * aspect,
            None => camera.horizontal_fov = Camera::horizontal_of_vertical(extent, aspect),
        }
        (camera, widened)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_height_counts_and_narrow_images_keep_the_width() {
        let of = |orthographic_width, extent, aspect| NamedCamera {
            name: String::new(),
            camera: Camera { orthographic_width, ..Camera::default() },
            vertical: Some(Vertical { extent, aspect }),
        };
        let fov = |camera: &NamedCamera, w, h| {
            let (camera, widened) = camera.for_image(w, h);
            (camera.horizontal_fov.round(), widened)
        };
        assert_eq!(fov(&of(None, 90.0, None), 100, 100), (90.0, false));
        assert_eq!(fov(&of(None, 90.0, Some(2.0)), 400, 100), (152.0, false));
        assert_eq!(fov(&of(None, 90.0, Some(2.0)), 100, 100), (127.0, true));
        let width = |w, h| of(Some(1.0), 4.0, Some(2.0)).for_image(w, h).0.orthographic_width;
        assert_eq!((width(300, 100), width(100, 100)), (Some(12.0), Some(8.0)));
        let plain = NamedCamera { vertical: None, ..of(None, 1.0, None) };
        assert_eq!(plain.for_image(7, 1), (plain.camera.clone(), false));
    }
}
