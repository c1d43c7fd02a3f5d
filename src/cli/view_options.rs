//! Options that say from where a scene is seen, and how its image is made of samples.

use clap::{Args, ValueEnum};
use glam::DVec3;
use photolith::scene::{Camera, Loaded, NamedCamera, PixelFilter};

use super::{heading, output};

/// The camera and the pixel filter, instead of those of the scene.
#[derive(Args, Clone, Default)]
pub struct ViewOptions {
    /// Camera of the file by its name or number (0 is the first), or fit: a view of all there is, from the front, a little aside and above
    #[arg(long, value_name = "NAME|N|fit", help_heading = heading::SCENE)]
    camera: Option<String>,

    /// Where the camera is
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true, help_heading = heading::SCENE)]
    look_from: Option<DVec3>,

    /// What is in the middle of the image
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true, help_heading = heading::SCENE)]
    look_at: Option<DVec3>,

    /// What points up in the image
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true, help_heading = heading::SCENE)]
    up: Option<DVec3>,

    /// Full vertical angle of view, of a perspective camera
    #[arg(long, value_name = "DEGREES", value_parser = angle, allow_hyphen_values = true, help_heading = heading::SCENE)]
    vertical_fov: Option<f64>,

    /// Pixel filter instead of the scene's
    #[arg(long, value_name = "FILTER", help_heading = heading::IMAGE)]
    filter: Option<FilterArg>,
}

#[derive(Clone, Copy, ValueEnum)]
enum FilterArg {
    /// Uniform over the pixel
    Box,
    /// Normal distribution with a standard deviation of half a pixel
    Gaussian,
}

fn triple(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) if [x, y, z].iter().all(|c| c.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("'{text}' is no point or direction, expected three numbers X,Y,Z, such as 1,2.5,-3")),
    }
}

fn angle(text: &str) -> Result<f64, String> {
    let in_range = |angle: &f64| *angle > 0.0 && *angle < 180.0;
    let expected = || format!("'{text}' is no angle of view, expected a number between 0 and 180, both excluded");
    text.parse().ok().filter(in_range).ok_or_else(expected)
}

impl ViewOptions {
    /// Applies them to a scene, whose image has its size already, and says what was chosen.
    ///
    /// # Errors
    /// The file has no such camera.
    pub fn apply(&self, loaded: &mut Loaded) -> anyhow::Result<()> {
        let (width, height) = (loaded.scene.film.width, loaded.scene.film.height);
        if let Some(filter) = self.filter {
            loaded.scene.film.filter = match filter {
                FilterArg::Box => PixelFilter::Box,
                FilterArg::Gaussian => PixelFilter::Gaussian,
            };
        }
        let named = match self.camera.as_deref() {
            Some("fit") => None,
            Some(name) => Some(find(&loaded.cameras, name)?),
            None => loaded.cameras.first(),
        };
        loaded.scene.camera = match named {
            None => {
                if self.look_from.is_none() {
                    output::tell("camera: fit, a view of all there is, from the front, a little aside and above");
                }
                loaded.scene.fitting_camera()
            }
            Some(named) => {
                if loaded.cameras.len() > 1 {
                    output::tell(&format!("camera: {:?}, one of {}", named.name, names(&loaded.cameras)));
                }
                let (camera, widened) = named.for_image(width, height);
                if widened {
                    output::tell(
                        "camera: the image is narrower than it is meant for, and keeps what is seen at the sides",
                    );
                }
                camera
            }
        };
        let camera = &mut loaded.scene.camera;
        camera.position = self.look_from.unwrap_or(camera.position);
        camera.target = self.look_at.unwrap_or(camera.target);
        camera.up = self.up.unwrap_or(camera.up);
        if let Some(vertical) = self.vertical_fov {
            if camera.orthographic_width.is_some() {
                anyhow::bail!(
                    "--vertical-fov: the camera is orthographic and has no angle, expected a perspective one"
                );
            }
            camera.horizontal_fov = Camera::horizontal_of_vertical(vertical, f64::from(width) / f64::from(height));
        }
        Ok(())
    }
}

fn find<'a>(cameras: &'a [NamedCamera], name: &str) -> anyhow::Result<&'a NamedCamera> {
    let by_name = cameras.iter().find(|camera| camera.name == name);
    let by_number = || name.parse::<usize>().ok().and_then(|number| cameras.get(number));
    by_name.or_else(by_number).ok_or_else(|| {
        let expected = match cameras.is_empty() {
            true => "fit: the file has no cameras".to_owned(),
            false => format!("fit, or the name or number of one of {}", names(cameras)),
        };
        anyhow::anyhow!("--camera {name}: there is none of this name, expected {expected}")
    })
}

fn names(cameras: &[NamedCamera]) -> String {
    let named = |(i, camera): (usize, &NamedCamera)| format!("{i} {:?}", camera.name);
    cameras.iter().enumerate().map(named).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_angles() {
        assert_eq!(triple("1,-2, 3.5"), Ok(DVec3::new(1.0, -2.0, 3.5)));
        for bad in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,inf", "nan,0,0"] {
            assert!(triple(bad).unwrap_err().contains("X,Y,Z"), "{bad}");
        }
        assert_eq!(angle("40"), Ok(40.0));
        for bad in ["0", "180", "-1", "nan", "x"] {
            assert!(angle(bad).unwrap_err().contains("between 0 and 180"), "{bad}");
        }
    }
}
