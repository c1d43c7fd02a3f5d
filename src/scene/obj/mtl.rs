//! From the text of an MTL file to its materials, statement by statement.
//!
//! MTL describes shading models of 1995 and is used loosely. What cannot be read, or is not supported, is told of where the material
//! is used; no statement makes a file unreadable.

use std::collections::BTreeMap;

use crate::scene::description::Rgb;
use crate::scene::error::Location;
use crate::scene::obj::map::{Map, MapKind};
use crate::scene::obj::statement::{Statement, decoded, quoted, statements};
use crate::scene::problem::number;

/// Keywords of textures that do not start with `map_`, in lower case.
const TEXTURES: [&str; 3] = ["decal", "disp", "refl"];

/// A material as an MTL file describes it. What a statement gives is `None` where it is missing or cannot be read.
#[derive(Debug, Clone, Default)]
pub(super) struct MtlMaterial {
    /// `newmtl`.
    pub name: String,
    /// Of `newmtl`, counted from 1.
    pub line: u32,
    pub diffuse: Option<Rgb>,
    pub specular: Option<Rgb>,
    pub ambient: Option<Rgb>,
    pub emissive: Option<Rgb>,
    /// `Tf`.
    pub filter: Option<Rgb>,
    /// `d`.
    pub opacity: Option<f64>,
    /// `Tr`.
    pub transparency: Option<f64>,
    /// `Ni`, also one that no glass has.
    pub ior: Option<f64>,
    /// `Ns`.
    pub exponent: Option<f64>,
    /// `illum`.
    pub model: Option<u8>,
    /// `Pr`, `Pm`.
    pub roughness: Option<f64>,
    pub metallic: Option<f64>,
    /// `Ps`, `Pc`, `Pcr`, `aniso`, `anisor`.
    pub sheen: Option<f64>,
    pub coat: Option<f64>,
    pub coat_roughness: Option<f64>,
    pub anisotropy: Option<f64>,
    pub anisotropy_rotation: Option<f64>,
    /// Textures.
    pub maps: BTreeMap<MapKind, Map>,
    /// Keywords of textures that are not supported, each with what follows it.
    pub others: Vec<(String, String)>,
    /// Statements that cannot be read.
    pub problems: Vec<String>,
}

/// Reads an MTL file that is in memory: its materials, and warnings about statements that are of none. Statements that are not known
/// are ignored.
pub(super) fn parse_mtl(bytes: &[u8], file: &str) -> (Vec<MtlMaterial>, Vec<String>) {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut warnings = Vec::new();
    let mut has_name = false;
    let bytes = decoded(bytes);
    for statement in statements(&bytes) {
        let keyword = statement.keyword().to_ascii_lowercase();
        if keyword == b"newmtl" {
            let name = statement.name();
            has_name = !name.is_empty();
            if has_name {
                materials.push(MtlMaterial { name, line: statement.line, ..MtlMaterial::default() });
            } else {
                let at = Location::line(file, statement.line);
                warnings.push(format!("{at}: \"newmtl\" without a name, expected one: what follows is ignored"));
            }
            continue;
        }
        let mut of_none = MtlMaterial::default();
        let material = if has_name { materials.last_mut() } else { None };
        let is_known = material.unwrap_or(&mut of_none).read(&keyword, &statement);
        if is_known && !has_name {
            let at = Location::line(file, statement.line);
            let keyword = statement.quoted_keyword();
            warnings.push(format!("{at}: {keyword} is ignored, expected \"newmtl\" with a name before it"));
        }
    }
    (materials, warnings)
}

impl MtlMaterial {
    /// Takes over a statement, whose keyword is given in lower case. Returns whether it is of a kind that matters.
    fn read(&mut self, keyword: &[u8], statement: &Statement<'_>) -> bool {
        let known_problems = self.problems.len();
        let problems = &mut self.problems;
        match keyword {
            b"kd" => self.diffuse = color(statement, problems),
            b"ks" => self.specular = color(statement, problems),
            b"ka" => self.ambient = color(statement, problems),
            b"ke" => self.emissive = color(statement, problems),
            b"tf" => self.filter = color(statement, problems),
            b"d" => {
                // With a halo it is where the surface faces the eye; it is the only value that there is.
                let is_halo = statement.words().nth(1) == Some(b"-halo");
                self.opacity = scalar(statement, if is_halo { 2 } else { 1 }, problems);
            }
            b"tr" => self.transparency = scalar(statement, 1, problems),
            b"ni" => self.ior = scalar(statement, 1, problems),
            b"ns" => self.exponent = scalar(statement, 1, problems),
            b"pr" => self.roughness = share(statement, problems),
            b"pm" => self.metallic = share(statement, problems),
            b"ps" => self.sheen = share(statement, problems),
            b"pc" => self.coat = share(statement, problems),
            b"pcr" => self.coat_roughness = share(statement, problems),
            b"aniso" => self.anisotropy = share(statement, problems),
            b"anisor" => self.anisotropy_rotation = scalar(statement, 1, problems),
            b"illum" => {
                let model = scalar(statement, 1, problems);
                self.model = model.filter(|m| (0.0..=10.0).contains(m) && m.fract() == 0.0).map(|m| m as u8);
                if let (Some(model), None) = (model, self.model) {
                    problems.push(format!("\"illum\" is {}, expected an integer from 0 to 10", number(model)));
                }
            }
            _ => match MapKind::of(keyword) {
                Some(kind) => {
                    self.maps.insert(kind, Map::read(statement, &mut self.problems));
                    return true;
                }
                None => {
                    let keyword = String::from_utf8_lossy(keyword).into_owned();
                    if !keyword.starts_with("map_") && !TEXTURES.contains(&keyword.as_str()) {
                        return false;
                    }
                    self.others.push((statement.quoted_keyword(), statement.name()));
                }
            },
        }
        for problem in &mut self.problems[known_problems..] {
            problem.push_str(&format!(": line {} is ignored", statement.line));
        }
        true
    }
}

/// Three numbers, or one for all three. Curves over the wavelength and CIE XYZ, which the format has as well, would have
/// to be turned into RGB to say what the material becomes.
fn color(statement: &Statement<'_>, problems: &mut Vec<String>) -> Option<Rgb> {
    let keyword = statement.quoted_keyword();
    if let Some(kind @ (b"spectral" | b"xyz")) = statement.words().nth(1) {
        problems.push(format!("{keyword} is given as {}, expected RGB", quoted(kind)));
        return None;
    }
    match statement.numbers_from::<3>(1, 1) {
        Ok(([grey, ..], 1)) => Some([grey; 3]),
        Ok((rgb, 3)) => Some(rgb),
        Ok(_) => {
            problems.push(format!("{keyword} has 2 numbers, expected 1 or 3"));
            None
        }
        Err((found, expected)) => {
            problems.push(format!("{found}, expected {expected}"));
            None
        }
    }
}

/// The number at a word, the keyword being word 0.
fn scalar(statement: &Statement<'_>, word: usize, problems: &mut Vec<String>) -> Option<f64> {
    match statement.numbers_from::<1>(word, 1) {
        Ok(([value], _)) => Some(value),
        Err((found, expected)) => {
            problems.push(format!("{found}, expected {expected}"));
            None
        }
    }
}

/// A number from 0 to 1, clamped.
fn share(statement: &Statement<'_>, problems: &mut Vec<String>) -> Option<f64> {
    scalar(statement, 1, problems).map(|value| value.clamp(0.0, 1.0))
}
