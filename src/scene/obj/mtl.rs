//! From the text of an MTL file to surfaces.

use super::statement::{Statement, statements};
use crate::scene::description::{Rgb, Surface};
use crate::scene::error::SceneError;
use crate::scene::validate::number;

/// Reflectance where a file gives none.
pub(super) const GREY: Rgb = [0.8; 3];

/// Index of refraction of glass, where a file gives none.
const GLASS_IOR: f64 = 1.5;

/// Keywords of textures that do not start with `map_`.
const TEXTURES: [&[u8]; 5] = [b"bump", b"decal", b"disp", b"norm", b"refl"];

/// A material as an MTL file describes it. Only what a surface can be made of is kept.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MtlMaterial {
    /// `newmtl`.
    pub name: String,
    /// Of `newmtl`, counted from 1.
    pub line: u32,
    /// `Kd`: diffuse reflectance.
    pub diffuse: Option<Rgb>,
    /// `Ks`: specular reflectance.
    pub specular: Option<Rgb>,
    /// `Ke`: emitted radiance, >= 0.
    pub emission: Option<Rgb>,
    /// `Tf`: transmission filter.
    pub transmission: Option<Rgb>,
    /// `d`, or 1 - `Tr`: 1 is opaque.
    pub dissolve: Option<f64>,
    /// `Ni`: index of refraction, > 0.
    pub ior: Option<f64>,
    /// `illum`: illumination model.
    pub illumination: Option<u32>,
    /// The keyword of a texture, which is not used.
    pub texture: Option<String>,
}

/// Reads an MTL file that is in memory. Statements that are not known are ignored.
///
/// # Errors
/// [`SceneError::Statement`] with the line of a number that is none, not finite or out of its range.
pub fn parse_mtl(bytes: &[u8], file: &str) -> Result<Vec<MtlMaterial>, SceneError> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    for statement in statements(bytes) {
        if statement.keyword() == b"newmtl" {
            let name = statement.name().into_owned();
            if name.is_empty() {
                return Err(statement.error(file, "\"newmtl\" has no name".to_owned(), "a name"));
            }
            materials.push(MtlMaterial { name, line: statement.line, ..MtlMaterial::default() });
        } else if let Some(material) = materials.last_mut() {
            material.read(&statement, file)?;
        }
    }
    Ok(materials)
}

impl MtlMaterial {
    fn read(&mut self, statement: &Statement<'_>, file: &str) -> Result<(), SceneError> {
        match statement.keyword() {
            b"Kd" => self.diffuse = Some(color(statement, file)?),
            b"Ks" => self.specular = Some(color(statement, file)?),
            b"Ke" => {
                let emission = color(statement, file)?;
                if emission.iter().any(|&x| x < 0.0) {
                    return Err(statement.error(file, format!("\"Ke\" is {emission:?}"), "numbers >= 0"));
                }
                self.emission = Some(emission);
            }
            b"Tf" => self.transmission = Some(color(statement, file)?),
            b"d" if statement.words().nth(1) != Some(b"-halo") => self.dissolve = Some(scalar(statement, file)?),
            b"Tr" => self.dissolve = Some(1.0 - scalar(statement, file)?),
            b"Ni" => {
                let ior = scalar(statement, file)?;
                if ior <= 0.0 {
                    return Err(statement.error(file, format!("\"Ni\" is {}", number(ior)), "a number > 0"));
                }
                self.ior = Some(ior);
            }
            b"illum" => {
                let model = scalar(statement, file)?;
                if !(0.0..=10.0).contains(&model) || model.fract() != 0.0 {
                    let found = format!("\"illum\" is {}", number(model));
                    return Err(statement.error(file, found, "an integer from 0 to 10"));
                }
                self.illumination = Some(model as u32);
            }
            keyword if keyword.starts_with(b"map_") || TEXTURES.contains(&keyword) => {
                self.texture = Some(statement.quoted_keyword())
            }
            _ => {}
        }
        Ok(())
    }

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
        if let Some(radiance) = self.emission.filter(|ke| ke.iter().any(|&x| x > 0.0)) {
            return Surface::Emitter { radiance };
        }
        let reflects = matches!(self.illumination, Some(3 | 5 | 8));
        let is_perfect_mirror = self.specular == Some([1.0; 3]) && self.diffuse == Some([0.0; 3]);
        if reflects || is_perfect_mirror {
            let given = self.specular.filter(|ks| ks.iter().any(|&x| x > 0.0));
            return Surface::Mirror { reflectance: clamp("Ks", given.unwrap_or([1.0; 3]), warn) };
        }
        let is_transparent =
            self.dissolve.is_some_and(|d| d < 1.0) || self.transmission.is_some_and(|tf| tf.iter().any(|&x| x < 1.0));
        let refracts = matches!(self.illumination, Some(4 | 6 | 7 | 9))
            || is_transparent && self.ior.is_some_and(|ior| ior != 1.0);
        if refracts {
            return Surface::Dielectric { ior: self.ior.unwrap_or(GLASS_IOR) };
        }
        if is_transparent {
            warn("transparency without refraction (Ni) is not supported and is ignored");
        }
        Surface::Diffuse { reflectance: clamp("Kd", self.diffuse.unwrap_or(GREY), warn) }
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

/// Three numbers, or one for all three.
fn color(statement: &Statement<'_>, file: &str) -> Result<Rgb, SceneError> {
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
