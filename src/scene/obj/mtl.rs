//! From the text of an MTL file to surfaces.

use super::statement::{Statement, quoted, read_failed, statements};
use crate::scene::description::{Rgb, Surface};
use crate::scene::error::SceneError;
use crate::scene::validate::{EXPECTED_IOR, IOR_RANGE, number};

/// Reflectance where a file gives none.
pub(super) const GREY: Rgb = [0.8; 3];

/// Index of refraction of glass, where a file gives none.
const GLASS_IOR: f64 = 1.5;

/// Keywords of textures that do not start with `map_`.
const TEXTURES: [&[u8]; 5] = [b"bump", b"decal", b"disp", b"norm", b"refl"];

/// A material as an MTL file describes it.
#[derive(Debug, Clone)]
pub struct MtlMaterial {
    /// `newmtl`.
    pub name: String,
    /// Of `newmtl`, counted from 1.
    pub line: u32,
    /// The keyword of a texture, which is not used.
    pub texture: Option<String>,
    /// What a surface can be made of; `Tr` is turned into `d`, and `Tf` is unknown to `tobj`.
    parameters: tobj::Material,
}

/// Reads an MTL file that is in memory. Statements that are not known are ignored.
///
/// # Errors
/// [`SceneError::Statement`] with the line of a number that is none, not finite or out of its range.
pub fn parse_mtl(bytes: &[u8], file: &str) -> Result<Vec<MtlMaterial>, SceneError> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut checked = String::new();
    for statement in statements(bytes) {
        if statement.keyword() == b"newmtl" {
            let name = statement.name();
            if name.is_empty() {
                return Err(statement.error(file, "\"newmtl\" has no name".to_owned(), "a name"));
            }
            checked.push_str(&format!("newmtl {name}\n"));
            materials.push(MtlMaterial { name, line: statement.line, texture: None, parameters: Default::default() });
        } else if let Some(material) = materials.last_mut() {
            match statement.keyword() {
                keyword if keyword.starts_with(b"map_") || TEXTURES.contains(&keyword) => {
                    material.texture = Some(statement.quoted_keyword());
                }
                _ => checked.push_str(&check(&statement, file)?),
            }
        }
    }
    let (parameters, _) = tobj::load_mtl_buf(&mut checked.as_bytes()).map_err(|error| read_failed(file, error))?;
    for (material, parameters) in materials.iter_mut().zip(parameters) {
        material.parameters = parameters;
    }
    Ok(materials)
}

/// Checks a statement and returns it as a line for `tobj`, which would panic at colours of one number; empty if it is
/// not needed.
fn check(statement: &Statement<'_>, file: &str) -> Result<String, SceneError> {
    Ok(match statement.keyword() {
        keyword @ (b"Kd" | b"Ks" | b"Ke" | b"Tf") => {
            let rgb @ [r, g, b] = color(statement, file)?;
            if keyword == b"Ke" && rgb.iter().any(|&x| x < 0.0) {
                return Err(statement.error(file, format!("\"Ke\" is {rgb:?}"), "numbers >= 0"));
            }
            format!("{} {r} {g} {b}\n", String::from_utf8_lossy(keyword))
        }
        // Where the surface faces the eye; it is the only value that there is.
        b"d" if statement.words().nth(1) == Some(b"-halo") => {
            format!("d {}\n", statement.numbers_from::<1>(2, file, 1)?.0[0])
        }
        b"d" => format!("d {}\n", scalar(statement, file)?),
        b"Tr" => format!("d {}\n", 1.0 - scalar(statement, file)?),
        b"Ni" => {
            let ior = scalar(statement, file)?;
            if !IOR_RANGE.contains(&ior) {
                return Err(statement.error(file, format!("\"Ni\" is {}", number(ior)), EXPECTED_IOR));
            }
            format!("Ni {ior}\n")
        }
        b"illum" => {
            let model = scalar(statement, file)?;
            if !(0.0..=10.0).contains(&model) || model.fract() != 0.0 {
                let found = format!("\"illum\" is {}", number(model));
                return Err(statement.error(file, found, "an integer from 0 to 10"));
            }
            format!("illum {}\n", model as u8)
        }
        _ => String::new(),
    })
}

impl MtlMaterial {
    /// What the material becomes. `warn` is told of everything that is lost.
    ///
    /// MTL describes shading models of 1995 and is used loosely; the rules are, in this order: `Ke` above 0 is an
    /// emitter; `illum` 3, 5 or 8 (reflection), or `Ks` 1 with `Kd` 0, is a mirror of reflectance `Ks`; `illum` 4, 6, 7
    /// or 9 (glass), or transparency (`d` or `Tf` below 1) with an `Ni` other than 1, is a dielectric; all else is
    /// diffuse.
    pub fn surface(&self, mut warn: impl FnMut(&str)) -> Surface {
        if let Some(keyword) = &self.texture {
            warn(&format!("the texture {keyword} is not supported and is ignored"));
        }
        let tobj::Material { diffuse, specular, emissive, dissolve, optical_density: ior, illumination_model, .. } =
            self.parameters;
        let emission = emissive.filter(|ke| ke.iter().any(|&x| x > 0.0));
        if let (Some(radiance), None) = (emission, diffuse) {
            return Surface::emitter(radiance);
        }
        let reflects = matches!(illumination_model, Some(3 | 5 | 8));
        let is_perfect_mirror = specular == Some([1.0; 3]) && diffuse == Some([0.0; 3]);
        if reflects || is_perfect_mirror {
            let given = specular.filter(|ks| ks.iter().any(|&x| x > 0.0));
            return Surface::mirror(clamp("Ks", given.unwrap_or([1.0; 3]), warn));
        }
        let filter = self.parameters.unknown_param.get("Tf").map_or("", String::as_str);
        let filters = filter.split_whitespace().any(|x| x.parse().is_ok_and(|x: f64| x < 1.0));
        let is_transparent = filters || dissolve.is_some_and(|d| d < 1.0);
        let refracts =
            matches!(illumination_model, Some(4 | 6 | 7 | 9)) || is_transparent && ior.is_some_and(|ior| ior != 1.0);
        if refracts {
            return Surface::dielectric(ior.unwrap_or(GLASS_IOR));
        }
        if is_transparent {
            warn("transparency without refraction (Ni) is not supported and is ignored");
        }
        Surface::diffuse(clamp("Kd", diffuse.unwrap_or(GREY), warn))
    }
}

/// A reflectance, made to lie in 0..=1.
fn clamp(keyword: &str, given: Rgb, mut warn: impl FnMut(&str)) -> Rgb {
    let reflectance = given.map(|x| x.clamp(0.0, 1.0));
    if reflectance != given {
        warn(&format!("{keyword} {given:?} is clamped to 0..=1"));
    }
    reflectance
}

/// Three numbers, or one for all three. Curves over the wavelength and CIE XYZ, which the format has as well, would have
/// to be turned into RGB to say what the material becomes.
fn color(statement: &Statement<'_>, file: &str) -> Result<Rgb, SceneError> {
    if let Some(kind @ (b"spectral" | b"xyz")) = statement.words().nth(1) {
        let found = format!("{} is given as {}", statement.quoted_keyword(), quoted(kind));
        return Err(statement.error(file, found, "RGB: spectral and CIE XYZ colours are not supported"));
    }
    match statement.numbers::<3>(file, 1)? {
        ([grey, ..], 1) => Ok([grey; 3]),
        (rgb, 3) => Ok(rgb),
        _ => Err(statement.error(file, format!("{} has 2 numbers", statement.quoted_keyword()), "1 or 3")),
    }
}

fn scalar(statement: &Statement<'_>, file: &str) -> Result<f64, SceneError> {
    let ([value], _) = statement.numbers::<1>(file, 1)?;
    Ok(value)
}
