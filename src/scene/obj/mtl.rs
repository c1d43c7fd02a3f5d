//! From the text of an MTL file to surfaces.
//!
//! MTL describes shading models of 1995 and is used loosely. What cannot be read, or is not supported, is told of where the material
//! is used; no statement makes a file unreadable.

use crate::scene::description::{Bsdf, Rgb, Surface};
use crate::scene::error::Location;
use crate::scene::limits::{EXPECTED_IOR, IOR_RANGE};
use crate::scene::obj::statement::{Statement, decoded, quoted, statements};
use crate::scene::problem::number;

/// Reflectance where a file gives none.
pub(super) const GREY: Rgb = [0.8; 3];

/// Index of refraction of glass, where a file gives none.
const GLASS_IOR: f64 = 1.5;

/// From which opacity on a surface is opaque: exporters round.
const OPAQUE: f64 = 0.999;

/// Keywords of textures that do not start with `map_`, in lower case.
const TEXTURES: [&str; 5] = ["bump", "decal", "disp", "norm", "refl"];

/// A material as an MTL file describes it. What a statement gives is `None` where it is missing or cannot be read.
#[derive(Debug, Clone, Default)]
pub struct MtlMaterial {
    /// `newmtl`.
    pub name: String,
    /// Of `newmtl`, counted from 1.
    pub line: u32,
    diffuse: Option<Rgb>,
    specular: Option<Rgb>,
    ambient: Option<Rgb>,
    emissive: Option<Rgb>,
    /// `Tf`.
    filter: Option<Rgb>,
    /// `d`.
    opacity: Option<f64>,
    /// `Tr`.
    transparency: Option<f64>,
    /// `Ni`, also one that no glass has.
    ior: Option<f64>,
    /// `illum`.
    model: Option<u8>,
    /// Keywords of textures, each with what follows it.
    textures: Vec<(String, String)>,
    /// Statements that cannot be read.
    problems: Vec<String>,
}

/// Reads an MTL file that is in memory: its materials, and warnings about statements that are of none. Statements that are not known
/// are ignored.
pub fn parse_mtl(bytes: &[u8], file: &str) -> (Vec<MtlMaterial>, Vec<String>) {
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
            b"illum" => {
                let model = scalar(statement, 1, problems);
                self.model = model.filter(|m| (0.0..=10.0).contains(m) && m.fract() == 0.0).map(|m| m as u8);
                if let (Some(model), None) = (model, self.model) {
                    problems.push(format!("\"illum\" is {}, expected an integer from 0 to 10", number(model)));
                }
            }
            _ => {
                let keyword = String::from_utf8_lossy(keyword).into_owned();
                if !keyword.starts_with("map_") && !TEXTURES.contains(&keyword.as_str()) {
                    return false;
                }
                self.textures.push((statement.quoted_keyword(), statement.name()));
            }
        }
        for problem in &mut self.problems[known_problems..] {
            problem.push_str(&format!(": line {} is ignored", statement.line));
        }
        true
    }

    /// Radiance that it emits, if any.
    pub fn emitted(&self) -> Option<Rgb> {
        let radiance = self.emissive?.map(|x| x.max(0.0));
        (radiance != [0.0; 3]).then_some(radiance)
    }

    /// What the material becomes. `warn` is told of everything that is lost or replaced.
    ///
    /// It emits `Ke`, and [reflects](Self::reflecting) as a mirror, glass, or diffusely; an emitter that would be diffuse, with `Kd` 0 or
    /// missing, reflects nothing.
    pub fn surface(&self, mut warn: impl FnMut(&str)) -> Surface {
        self.problems.iter().for_each(|problem| warn(problem));
        for (keyword, name) in &self.textures {
            warn(&format!("the texture {keyword} {} is not supported and is ignored", quoted(name.as_bytes())));
        }
        if let Some(given) = self.emissive.filter(|ke| ke.iter().any(|&x| x < 0.0)) {
            warn(&format!("Ke {given:?} has numbers below 0, which count as 0"));
        }
        let Some(radiance) = self.emitted() else { return self.reflecting(warn) };
        // What emits, and has no Kd, reflects nothing.
        match self.reflecting(|_| {}).bsdf {
            Bsdf::Diffuse { .. } if self.diffuse.is_none_or(is_black) => Surface::emitter(radiance),
            _ => Surface { emission: radiance, ..self.reflecting(warn) },
        }
    }

    /// What the surface does with light that arrives, whatever it emits.
    ///
    /// A mirror is of `illum` 3, 5 or 8 (reflection) with `Ks` above 0 or `Kd` 0, or has `Ks` 1 and `Kd` 0. Glass needs an index that
    /// is not 1, and `illum` 4, 6, 7 or 9 (refraction) or transparency; without an index, `illum` and transparency (or `Kd` 0). All
    /// else is diffuse.
    pub fn reflecting(&self, mut warn: impl FnMut(&str)) -> Surface {
        let is_textured = self.has_texture("map_kd");
        let reflects = matches!(self.model, Some(3 | 5 | 8));
        let diffuse_is_black = self.diffuse.is_none_or(is_black) && !is_textured;
        let specular = self.specular.filter(|ks| !is_black(*ks));
        let is_perfect_mirror = specular == Some([1.0; 3]) && self.diffuse == Some([0.0; 3]) && !is_textured;
        if is_perfect_mirror || reflects && (specular.is_some() || diffuse_is_black) {
            if let Some(kd) = self.diffuse.filter(|kd| !is_black(*kd)) {
                warn(&format!(
                    "a mirror (illum {}) has no diffuse part: Kd {kd:?} is dropped",
                    self.model.unwrap_or(0)
                ));
            }
            return Surface::mirror(clamp("Ks", specular.unwrap_or([1.0; 3]), warn));
        }
        if reflects {
            warn("a mirror (illum 3, 5 or 8) without Ks: the surface is diffuse");
        }
        let is_transparent = self.is_transparent(&mut warn);
        let refracts = self.refracts();
        let ior = self.ior.filter(|ior| IOR_RANGE.contains(ior));
        let is_glass = match ior {
            Some(1.0) => false,
            // Maya writes `illum 4` and `Tf 1 1 1` for what is opaque, and the index of a shader that has none.
            Some(_) => is_transparent || refracts && !(self.model == Some(4) && self.lets_nothing_through()),
            None => refracts && (is_transparent || diffuse_is_black && self.filter.is_none()),
        };
        if is_glass {
            if let (None, Some(given)) = (ior, self.ior) {
                warn(&format!("Ni is {}, expected {EXPECTED_IOR}: {GLASS_IOR} is used", number(given)));
            }
            if let Some(kd) = self.diffuse.filter(|kd| !is_black(*kd) && *kd != [1.0; 3]) {
                warn(&format!("glass is clear: Kd {kd:?} is dropped"));
            }
            if let Some(tf) = self.filter.filter(|tf| is_coloured(*tf)) {
                warn(&format!("glass is clear: the colour of Tf {tf:?} is dropped"));
            }
            return Surface::dielectric(ior.unwrap_or(GLASS_IOR));
        }
        if is_transparent {
            warn("transparency without refraction (Ni other than 1) is not supported and is ignored");
        } else if refracts {
            let model = self.model.unwrap_or(0);
            warn(&format!("illum {model} is glass, but neither d, Tf nor Ni says that it is: the surface is opaque"));
        }
        self.diffuse_surface(warn)
    }

    fn diffuse_surface(&self, mut warn: impl FnMut(&str)) -> Surface {
        let given = self.diffuse;
        let reflectance = match given {
            Some(kd) if !(is_black(kd) && self.has_texture("map_kd")) => kd,
            Some(_) => {
                warn(&format!("Kd is 0 beside the texture map_Kd: grey ({}) is used", GREY[0]));
                GREY
            }
            None => {
                warn(&format!("there is no Kd: grey ({}) is used", GREY[0]));
                GREY
            }
        };
        let others = [("Ks", self.specular), ("Ka", self.ambient)];
        if let Some((keyword, Some(color))) = others.into_iter().find(|(_, color)| color.is_some_and(|c| !is_black(c)))
            && is_black(reflectance)
        {
            warn(&format!("{keyword} {color:?} is not supported, and Kd is 0: the surface is black"));
        }
        Surface::diffuse(clamp("Kd", reflectance, warn))
    }

    fn has_texture(&self, keyword: &str) -> bool {
        self.textures.iter().any(|(of, _)| of.trim_matches('"').eq_ignore_ascii_case(keyword))
    }

    /// Whether `illum` says that light goes through.
    fn refracts(&self) -> bool {
        matches!(self.model, Some(4 | 6 | 7 | 9))
    }

    /// Whether `d`, `Tr` or `Tf` says so.
    fn is_transparent(&self, mut warn: impl FnMut(&str)) -> bool {
        let refracts = self.refracts();
        let mut within = |keyword: &str, value: Option<f64>| {
            value.filter(|value| {
                let is_within = (0.0..=1.0).contains(value);
                if !is_within {
                    warn(&format!("{keyword} is {}, expected a number from 0 to 1: it is ignored", number(*value)));
                }
                is_within
            })
        };
        let opacity = match (within("d", self.opacity), within("Tr", self.transparency)) {
            (Some(d), Some(tr)) => {
                let most = d.max(1.0 - tr);
                if (d - (1.0 - tr)).abs() > 1e-3 {
                    warn(&format!(
                        "d {} and Tr {} differ, expected Tr = 1 - d: the more opaque counts",
                        number(d),
                        number(tr)
                    ));
                }
                most
            }
            (Some(d), None) => d,
            (None, Some(1.0)) if !refracts => {
                warn("Tr 1 without d is taken for opaque, as many exporters mean it");
                1.0
            }
            (None, Some(tr)) => 1.0 - tr,
            (None, None) => 1.0,
        };
        let filters = self.filter.is_some_and(|tf| tf.iter().any(|&x| x < OPAQUE));
        opacity < OPAQUE || filters
    }

    /// Whether it has a colour of its own and says that it is not transparent, in the words of Maya, whose `Tf` is 1 for opaque.
    fn lets_nothing_through(&self) -> bool {
        self.filter.is_some_and(|tf| tf.iter().all(|&x| x >= OPAQUE)) && !self.diffuse.is_none_or(is_black)
    }
}

fn is_black(color: Rgb) -> bool {
    color.iter().all(|&x| x <= 0.0)
}

fn is_coloured([r, g, b]: Rgb) -> bool {
    r != g || g != b
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
