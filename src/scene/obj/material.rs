//! A material of MTL with its textures, as one of the scene.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::scene::description::{Bsdf, Coverage, Material, Surface};
use crate::scene::image_file::{KINDS, decode};
use crate::scene::materials::MaterialList;
use crate::scene::obj::map::{Map, MapKind};
use crate::scene::obj::mtl::MtlMaterial;
use crate::scene::obj::names::find_file;
use crate::scene::obj::statement::quoted;
use crate::scene::obj::surface::{OPAQUE, SMOOTH_EXPONENT, is_black, roughness_of_exponent};
use crate::scene::read::{Files, read_file};
use crate::scene::texel_channels::{
    Channel, Part, combine, has_alpha, is_mask, looks_like_normals, normals_of_heights,
};
use crate::scene::texture::{Texels, Texture, TextureSlot};

/// The images that MTL files name, each decoded once.
pub(super) struct MapImages<'a> {
    /// Of the OBJ file, where images of any MTL file may lie.
    files: Files<'a>,
    /// By path: an index into the list of images, or what is wrong.
    read: HashMap<PathBuf, Result<u32, String>>,
}

impl<'a> MapImages<'a> {
    pub fn new(files: Files<'a>) -> Self {
        Self { files, read: HashMap::new() }
    }

    /// The file of an image, looked for beside its MTL file, then beside the OBJ file.
    fn find(&self, name: &str, mtl: &Path) -> Option<PathBuf> {
        let of_mtl = self.files.of(mtl);
        [of_mtl, self.files].into_iter().find_map(|files| find_file(files, name))
    }

    /// Decodes the images of some materials, at the same time.
    pub fn read_all<'b>(&mut self, used: impl Iterator<Item = (&'b MtlMaterial, &'b Path)>, list: &mut MaterialList) {
        let names = used.flat_map(|(material, mtl)| material.maps.values().map(move |map| (map.name.as_str(), mtl)));
        let mut paths: Vec<PathBuf> = names.filter_map(|(name, mtl)| self.find(name, mtl)).collect();
        paths.sort();
        paths.dedup();
        let read = |path: &PathBuf| {
            let bytes = read_file(path).map_err(|error| error.to_string())?;
            let name = path.display().to_string();
            decode(&bytes, &name).map_err(|found| format!("{name}: {found}, expected {KINDS}"))
        };
        let images: Vec<_> = paths.par_iter().map(read).collect();
        for (path, image) in paths.into_iter().zip(images) {
            self.read.insert(path, image.map(|image| list.add_image(image)));
        }
    }

    /// One that was decoded.
    fn image(&self, name: &str, mtl: &Path) -> Result<u32, String> {
        let is_missing = || "there is no such file".to_owned();
        self.find(name, mtl).and_then(|path| self.read.get(&path).cloned()).unwrap_or_else(|| Err(is_missing()))
    }
}

/// A texture whose image is there.
struct Loaded<'a> {
    map: &'a Map,
    image: u32,
}

/// The textures of a material, and what they become.
struct Maps<'a> {
    list: &'a mut MaterialList,
    loaded: BTreeMap<MapKind, Loaded<'a>>,
    textures: BTreeMap<TextureSlot, Texture>,
}

impl MtlMaterial {
    /// What the material becomes. `warn` is told of everything that is lost or replaced.
    ///
    /// It emits `Ke`, and [reflects](Self::reflecting) as a mirror, glass, or diffusely; an emitter that would be diffuse, with `Kd` 0 or
    /// missing, reflects nothing.
    pub fn material(
        &self,
        images: &MapImages<'_>,
        mtl: &Path,
        list: &mut MaterialList,
        warn: &mut dyn FnMut(&str),
    ) -> Material {
        self.problems.iter().for_each(|problem| warn(problem));
        let of_diffuse = self.maps.get(&MapKind::Diffuse).map(|map| map.name.as_str());
        for (keyword, name) in &self.others {
            // The colour in ambient light, which there is none of, is nearly always that of all light.
            let is_ambient = keyword.eq_ignore_ascii_case("\"map_Ka\"");
            if !(is_ambient && (of_diffuse == Some(name) || self.ambient.is_some_and(is_black))) {
                warn(&format!("the texture {keyword} {} is not supported and is ignored", quoted(name.as_bytes())));
            }
        }
        let mut loaded = BTreeMap::new();
        for (&kind, map) in &self.maps {
            match images.image(&map.name, mtl) {
                Ok(image) => drop(loaded.insert(kind, Loaded { map, image })),
                Err(reason) => {
                    let name = quoted(map.name.as_bytes());
                    warn(&format!("the texture {} {name} is left out: {reason}", map.keyword));
                }
            }
        }
        let mut maps = Maps { list, loaded, textures: BTreeMap::new() };
        let opacity = self.opacity(warn);
        let emission = self.emission(&maps, warn);
        let emits = emission != [0.0; 3];
        let mut told = Vec::new();
        let has = |kind| maps.loaded.contains_key(&kind);
        let mut bsdf = self.reflecting(&has, opacity, &mut |text| told.push(text.to_owned()));
        let is_matt = match bsdf {
            Bsdf::Diffuse { .. } => true,
            Bsdf::MetallicRoughness(m) => m.metallic == 0.0 && m.transmission == 0.0,
            _ => false,
        };
        if emits && is_matt && self.is_dark() {
            bsdf = Bsdf::Black;
        } else {
            told.iter().for_each(|text| warn(text));
        }
        // The colours of what reflects like metal are those of its reflection.
        let colors = match bsdf {
            Bsdf::Mirror { .. } => MapKind::Specular,
            Bsdf::MetallicRoughness(m) if m.metallic == 1.0 && !self.is_physical(&has) && !has(MapKind::Diffuse) => {
                MapKind::Specular
            }
            _ => MapKind::Diffuse,
        };
        let mut material = Material::new(&*self.name, Surface { bsdf, emission, two_sided: false });
        let is_clear = match bsdf {
            Bsdf::Dielectric { .. } => true,
            Bsdf::MetallicRoughness(m) => m.transmission > 0.0,
            _ => false,
        };
        if !is_clear {
            maps.add_coverage(&mut material, colors, opacity, warn);
        }
        if !matches!(bsdf, Bsdf::Dielectric { .. }) {
            if emits {
                maps.add_color(MapKind::Emission, TextureSlot::Emission);
            }
            maps.add_relief(&mut material, warn);
        }
        match bsdf {
            Bsdf::Mirror { .. } | Bsdf::Diffuse { .. } => maps.add_color(colors, TextureSlot::BaseColor),
            Bsdf::MetallicRoughness(_) => {
                maps.add_color(colors, TextureSlot::BaseColor);
                maps.add_color(MapKind::Specular, TextureSlot::SpecularColor);
                maps.add_roughness(self.exponent, warn);
                maps.add_numbers(MapKind::Coat, TextureSlot::Coat);
                maps.add_numbers(MapKind::CoatRoughness, TextureSlot::CoatRoughness);
                maps.add_numbers(MapKind::Sheen, TextureSlot::SheenColor);
            }
            _ => {}
        }
        for Loaded { map, .. } in maps.loaded.values() {
            let name = quoted(map.name.as_bytes());
            warn(&format!("the texture {} {name} changes nothing of such a surface and is ignored", map.keyword));
        }
        material.textures = maps.textures;
        material
    }

    /// Radiance that it emits, before a texture.
    fn emission(&self, maps: &Maps<'_>, warn: &mut dyn FnMut(&str)) -> [f64; 3] {
        if let Some(given) = self.emissive.filter(|ke| ke.iter().any(|&x| x < 0.0)) {
            warn(&format!("Ke {given:?} has numbers below 0, which count as 0"));
        }
        let given = self.emissive.map(|ke| ke.map(|x| x.max(0.0)));
        match given {
            Some([0.0, 0.0, 0.0]) if maps.loaded.contains_key(&MapKind::Emission) => {
                warn("Ke is 0 beside the texture map_Ke, which is used alone");
                [1.0; 3]
            }
            None if maps.loaded.contains_key(&MapKind::Emission) => [1.0; 3],
            given => given.unwrap_or_default(),
        }
    }
}

impl Maps<'_> {
    /// A texture of colours, with the alpha that it has; not if the slot is taken.
    fn add_color(&mut self, kind: MapKind, slot: TextureSlot) {
        if self.textures.contains_key(&slot) {
            return;
        }
        let Some(Loaded { map, image }) = self.loaded.remove(&kind) else { return };
        let image = if map.is_plain() { image } else { self.color_with(map, image, None) };
        self.insert(slot, map, image);
    }

    /// Codes of 8 or 16 bits are those of sRGB, floats are linear.
    fn insert(&mut self, slot: TextureSlot, map: &Map, image: u32) {
        let is_srgb = !matches!(self.list.image(image).texels, Texels::Rgba32F(_));
        self.textures.insert(slot, map.texture(image, is_srgb));
    }

    /// An image of colours with alpha from elsewhere, or without.
    fn color_with(&mut self, map: &Map, image: u32, alpha: Option<(&Map, u32, Channel)>) -> u32 {
        let of_alpha = alpha.map_or("opaque".to_owned(), |(map, _, channel)| map.levels(channel));
        let what = format!("colours {}, alpha {of_alpha}", map.levels(Channel::Luminance));
        let sources: Vec<u32> = [image].into_iter().chain(alpha.map(|(_, image, _)| image)).collect();
        self.list.make_image(&what, &sources, |name, images| {
            let part = |channel| Some(map.part(images[0], channel));
            let alpha = alpha.map(|(map, _, channel)| map.part(images[1], channel));
            combine(name, [part(Channel::Red), part(Channel::Green), part(Channel::Blue), alpha])
        })
    }

    /// A texture of numbers, the same in each channel.
    fn add_numbers(&mut self, kind: MapKind, slot: TextureSlot) {
        let Some(Loaded { map, image }) = self.loaded.remove(&kind) else { return };
        let channel = map.numbers();
        let image = self.list.make_image(&map.levels(channel), &[image], |name, images| {
            combine(name, [(); 4].map(|()| Some(map.part(images[0], channel))))
        });
        self.textures.insert(slot, map.texture(image, false));
    }

    /// Roughness and metalness in one image.
    fn add_roughness(&mut self, exponent: Option<f64>, warn: &mut dyn FnMut(&str)) {
        let exponents =
            self.loaded.remove(&MapKind::Exponent).filter(|_| !self.loaded.contains_key(&MapKind::Roughness));
        let largest = exponents.as_ref().map(|_| exponent.filter(|&ns| ns > 0.0).unwrap_or(SMOOTH_EXPONENT));
        let roughness = self.loaded.remove(&MapKind::Roughness).or(exponents);
        let metallic = self.loaded.remove(&MapKind::Metallic);
        let Some(first) = roughness.as_ref().or(metallic.as_ref()).map(|loaded| loaded.map) else { return };
        if let (Some(a), Some(b)) = (&roughness, &metallic) {
            tell_of_placement(a.map, b.map, warn);
        }
        let levels = |loaded: &Option<Loaded<'_>>| {
            loaded.as_ref().map_or("1".to_owned(), |Loaded { map, .. }| map.levels(map.numbers()))
        };
        let exponents = largest.map_or(String::new(), |largest| format!(" of exponents to {largest}"));
        let what = format!("roughness {}{exponents}, metalness {}", levels(&roughness), levels(&metallic));
        let sources: Vec<u32> = roughness.iter().chain(&metallic).map(|loaded| loaded.image).collect();
        let image = self.list.make_image(&what, &sources, |name, images| {
            let green = roughness.as_ref().map(|Loaded { map, .. }| {
                let part = map.part(images[0], map.numbers());
                match (largest, part.change) {
                    (None, change) => Part { change, ..Part::plain(part.image, part.channel) },
                    (Some(largest), change) => {
                        let exponent = move |x| largest * change.as_ref().map_or(x, |change| change(x));
                        let change = Box::new(move |x| roughness_of_exponent(exponent(x)));
                        Part { change: Some(change), ..Part::plain(part.image, part.channel) }
                    }
                }
            });
            let blue = metallic.as_ref().map(|Loaded { map, .. }| map.part(images[images.len() - 1], map.numbers()));
            combine(name, [None, green, blue, None])
        });
        self.textures.insert(TextureSlot::MetallicRoughness, first.texture(image, false));
    }

    /// A map of normals, or one made of heights.
    fn add_relief(&mut self, material: &mut Material, warn: &mut dyn FnMut(&str)) {
        let heights = self.loaded.remove(&MapKind::Bump);
        let Some((map, image)) = (match (self.loaded.remove(&MapKind::Normal), heights) {
            (Some(Loaded { map, image }), _) => Some((map, image)),
            (None, Some(Loaded { map, image })) => {
                if map.channel.is_none() && looks_like_normals(self.list.image(image)) {
                    let name = quoted(map.name.as_bytes());
                    warn(&format!(
                        "the texture {} {name} has normals, and no heights: it is used as such",
                        map.keyword
                    ));
                    Some((map, image))
                } else {
                    let channel = map.numbers();
                    let what = format!("normals of {}", map.levels(channel));
                    let normals = self.list.make_image(&what, &[image], |name, images| {
                        normals_of_heights(name, &map.part(images[0], channel))
                    });
                    Some((map, normals))
                }
            }
            (None, None) => None,
        }) else {
            return;
        };
        material.normal_scale = map.bump;
        self.textures.insert(TextureSlot::Normal, map.texture(image, false));
    }

    /// Coverage by `d` and `map_d`, whose values become the alpha of the texture of colours.
    fn add_coverage(&mut self, material: &mut Material, colors: MapKind, opacity: f64, warn: &mut dyn FnMut(&str)) {
        let color = self.loaded.get(&colors).map(|loaded| (loaded.map, loaded.image));
        let Some(Loaded { map, image }) = self.loaded.remove(&MapKind::Opacity) else {
            let transparent = color.filter(|(_, image)| has_alpha(self.list.image(*image)));
            if let Some((map, _)) = transparent {
                let name = quoted(map.name.as_bytes());
                warn(&format!("the alpha of {} {name} is not used: map_d would say that it is to be", map.keyword));
            }
            if opacity < OPAQUE {
                (material.alpha, material.coverage) = (opacity, Coverage::Blend);
                if let Some((map, image)) = transparent {
                    let opaque = self.color_with(map, image, None);
                    self.insert(TextureSlot::BaseColor, map, opaque);
                    self.loaded.remove(&colors);
                }
            }
            return;
        };
        let channel = match map.channel {
            Some(channel) => channel,
            None if has_alpha(self.list.image(image)) => Channel::Alpha,
            None => Channel::Luminance,
        };
        material.alpha = opacity;
        if opacity == 0.0 {
            warn("d is 0 beside the texture map_d, which is used alone");
            material.alpha = 1.0;
        }
        let is_mask = map.is_plain() && material.alpha >= OPAQUE && is_mask(self.list.image(image), channel);
        material.coverage = if is_mask { Coverage::Mask(0.5) } else { Coverage::Blend };
        let Some((of_color, other)) = color else {
            let alpha = self.list.make_image(&format!("alpha {}", map.levels(channel)), &[image], |name, images| {
                combine(name, [None, None, None, Some(map.part(images[0], channel))])
            });
            self.textures.insert(TextureSlot::BaseColor, map.texture(alpha, false));
            return;
        };
        tell_of_placement(of_color, map, warn);
        let is_in_place = other == image && channel == Channel::Alpha && map.is_plain() && of_color.is_plain();
        let both = if is_in_place { image } else { self.color_with(of_color, other, Some((map, image, channel))) };
        self.insert(TextureSlot::BaseColor, of_color, both);
        self.loaded.remove(&colors);
    }
}

/// Where two textures become one, the first says how it is looked up.
fn tell_of_placement(first: &Map, other: &Map, warn: &mut dyn FnMut(&str)) {
    if !first.is_placed_as(other) {
        warn(&format!("the options -s, -o and -clamp of {} count for {} too", first.keyword, other.keyword));
    }
}
