//! glTF 2.0: a file becomes a scene (docs/gltf.md).

mod accessor;
mod animation;
mod camera;
mod document;
mod geometry;
mod instances;
mod lights;
mod material;
mod meshopt;
mod nodes;
mod problem;
mod uri;

use std::collections::{BTreeSet, HashMap};

use glam::DMat4;
use gltf::json::accessor::Type;
use rayon::prelude::*;

use crate::host::available_memory;
use crate::scene::description::*;
use crate::scene::error::SceneError;
use crate::scene::image_file::{KINDS, decode};
use crate::scene::load_options::LoadOptions;
use crate::scene::model::Model;
use crate::scene::read::Files;
use crate::scene::texel_channels::{Channel, Part, combine};
use crate::scene::texture::{Texels, TextureImage};

pub(super) use crate::scene::gltf::document::is_glb;
use crate::scene::gltf::document::{Document, number};
use crate::scene::gltf::material::Glossiness;
use crate::scene::gltf::nodes::Placed;

/// Reads a glTF file. `name` stands for it in messages, `files` is where what it names is looked for.
pub(in crate::scene) fn load(
    bytes: &[u8],
    name: &str,
    files: Files<'_>,
    options: &LoadOptions,
    warnings: &mut Vec<String>,
) -> Result<Model, SceneError> {
    let document = Document::parse(bytes, name, files, warnings)?;
    let pose = document.pose(options.time)?;
    let placed = document.placed_nodes(&pose)?;
    let mut builder = Builder {
        document: &document,
        options,
        materials: Vec::new(),
        numbers: HashMap::new(),
        glossiness: Vec::new(),
        left_out: 0,
        meshes: Vec::new(),
        bytes: 0,
    };
    for place in &placed {
        builder.add_node(place, &placed, &pose)?;
    }
    let Builder { mut materials, mut meshes, glossiness, left_out, .. } = builder;
    if left_out > 0 {
        warnings.push(format!("{name}: {left_out} primitives of points or lines are left out"));
    }
    let dropped: usize = meshes.iter().map(|mesh| mesh.degenerate_dropped).sum();
    if dropped > 0 {
        warnings.push(format!("{name}: {dropped} triangles without an area are left out"));
    }
    let images = document.images(&mut materials, &glossiness)?;
    make_names_unique(&mut materials);
    meshes.retain(|mesh| !mesh.triangles.is_empty());
    let (lights, cameras) = (document.lights(&placed)?, document.cameras(&placed)?);
    Ok(Model { materials, images, meshes, lights, cameras })
}

/// The meshes and materials of a scene while its nodes are gone through.
struct Builder<'a> {
    document: &'a Document<'a>,
    options: &'a LoadOptions,
    materials: Vec<Material>,
    /// Numbers of materials by those of the file; `None` is the default material.
    numbers: HashMap<Option<usize>, u32>,
    /// Images that are made of others.
    glossiness: Vec<Glossiness>,
    /// Primitives without triangles.
    left_out: usize,
    meshes: Vec<Mesh>,
    /// Bytes of all copies of meshes so far.
    bytes: u64,
}

impl Builder<'_> {
    fn add_node(&mut self, place: &Placed, all: &[Placed], pose: &animation::Pose) -> Result<(), SceneError> {
        let document = self.document;
        let node = &document.root.nodes[place.node];
        let Some(mesh_index) = node.mesh.map(number) else { return Ok(()) };
        let at = format!("node {}", place.node);
        let mesh = document.get(&document.root.meshes, mesh_index, "mesh", &at)?;
        let joints = match node.skin {
            Some(skin) => document.joints(number(skin), all, &at)?,
            None => Vec::new(),
        };
        let instances = document.instances(place.node)?;
        let weights = pose.of_node(place.node).weights;
        let stored = node.weights.as_ref().or(mesh.weights.as_ref());
        let weights: Vec<f64> =
            weights.unwrap_or_else(|| stored.into_iter().flatten().map(|&weight| f64::from(weight)).collect());
        for (nth, primitive) in mesh.primitives.iter().enumerate() {
            let at = match &mesh.name {
                Some(name) => format!("mesh {mesh_index} ({name:?}), primitive {nth}"),
                None => format!("mesh {mesh_index}, primitive {nth}"),
            };
            let material = self.material(document.material_of(primitive, self.options, &at)?)?;
            let tangent_uv = self.materials[material as usize].tangent_uv();
            match document.geometry(primitive, &weights, tangent_uv, &at)? {
                None => self.left_out += 1,
                Some(geometry) => {
                    self.reserve(geometry.placed_bytes().saturating_mul(instances.len() as u64), &at)?;
                    for instance in &instances {
                        self.meshes.extend(geometry.placed(place.to_world * *instance, &joints, material));
                    }
                }
            }
        }
        Ok(())
    }

    /// Counts memory for copies in the world. A few bytes of a file can ask for any number of copies.
    fn reserve(&mut self, bytes: u64, at: &str) -> Result<(), SceneError> {
        self.bytes = self.bytes.saturating_add(bytes);
        match available_memory() {
            // What was counted before is taken already, at most.
            Some(available) if bytes > available => {
                let found = format!("{} MB of copies ({} MB with all before)", bytes >> 20, self.bytes >> 20);
                Err(self.document.error(
                    at,
                    found,
                    format!("at most the {} MB of memory that are left", available >> 20),
                ))
            }
            _ => Ok(()),
        }
    }

    fn material(&mut self, index: Option<usize>) -> Result<u32, SceneError> {
        if let Some(&known) = self.numbers.get(&index) {
            return Ok(known);
        }
        let material = match index {
            Some(index) => self.document.material(index, &mut self.glossiness)?,
            None => Material {
                culls_back: true,
                ..Material::new(
                    "default",
                    Surface {
                        bsdf: Bsdf::MetallicRoughness(MetallicRoughness::default()),
                        ..Surface::diffuse([0.0; 3])
                    },
                )
            },
        };
        let number = self.materials.len() as u32;
        self.materials.push(material);
        self.numbers.insert(index, number);
        Ok(number)
    }
}

impl Document<'_> {
    /// The joints of a skin: from the space of its mesh to the world.
    fn joints(&self, skin: usize, placed: &[Placed], at: &str) -> Result<Vec<DMat4>, SceneError> {
        let of_skin = self.get(&self.root.skins, skin, "skin", at)?;
        let at = format!("skin {skin}");
        let inverse = match of_skin.inverse_bind_matrices {
            Some(index) => self.vectors::<16>(number(index), &at, &[Type::Mat4], 0.0)?,
            None => Vec::new(),
        };
        let world: HashMap<usize, DMat4> = placed.iter().map(|place| (place.node, place.to_world)).collect();
        let joint = |(nth, joint): (usize, &gltf::json::Index<gltf::json::Node>)| {
            let to_world = world.get(&number(*joint)).copied().unwrap_or(DMat4::IDENTITY);
            to_world * inverse.get(nth).map_or(DMat4::IDENTITY, DMat4::from_cols_array)
        };
        Ok(of_skin.joints.iter().enumerate().map(joint).collect())
    }

    /// Decodes the images that materials use, and numbers them anew.
    fn images(&self, materials: &mut [Material], glossiness: &[Glossiness]) -> Result<Vec<TextureImage>, SceneError> {
        let used: BTreeSet<u32> =
            materials.iter().flat_map(|m| m.textures.values().map(|texture| texture.image)).collect();
        let used: Vec<u32> = used.into_iter().collect();
        let images: Vec<TextureImage> =
            used.par_iter().map(|&index| self.image_or_made(index as usize, glossiness)).collect::<Result<_, _>>()?;
        for texture in materials.iter_mut().flat_map(|material| material.textures.values_mut()) {
            texture.image = used.binary_search(&texture.image).unwrap_or(0) as u32;
            // Floats are linear.
            texture.srgb &= !matches!(images[texture.image as usize].texels, Texels::Rgba32F(_));
        }
        Ok(images)
    }

    /// An image of the file or, after them, one made of another one's glossiness.
    fn image_or_made(&self, index: usize, glossiness: &[Glossiness]) -> Result<TextureImage, SceneError> {
        let made = index.checked_sub(self.root.images.len()).and_then(|number| glossiness.get(number));
        let Some(&Glossiness { image, factor }) = made else { return self.image(index) };
        let source = self.image(image)?;
        let change = Box::new(move |gloss| 1.0 - factor * gloss);
        let green = Part { image: &source, channel: Channel::Alpha, change: Some(change) };
        Ok(combine(format!("{} (roughness)", source.name), [None, Some(green), None, None]))
    }

    fn image(&self, index: usize) -> Result<TextureImage, SceneError> {
        let image = self.get(&self.root.images, index, "image", "texture")?;
        let at = match (&image.name, &image.uri) {
            (_, Some(uri)) if !uri.starts_with("data:") => format!("image {index} ({uri:?})"),
            (Some(name), _) => format!("image {index} ({name:?})"),
            _ => format!("image {index}"),
        };
        let decoded = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => decode(&uri::read(self.files, uri, self.name, &at)?, &at),
            (None, Some(view)) => decode(self.view_content(number(view), &at)?, &at),
            (None, None) => return Err(self.error(at, "neither uri nor bufferView", "one of them")),
        };
        decoded.map_err(|found| self.error(at, found, format!("an image of type {KINDS}")))
    }

    /// The material of a primitive, or of the variant that was asked for.
    fn material_of(
        &self,
        primitive: &gltf::json::mesh::Primitive,
        options: &LoadOptions,
        at: &str,
    ) -> Result<Option<usize>, SceneError> {
        #[derive(serde::Deserialize)]
        struct Mapping {
            material: usize,
            variants: Vec<usize>,
        }
        #[derive(serde::Deserialize)]
        struct Mappings {
            mappings: Vec<Mapping>,
        }
        let default = primitive.material.map(number);
        let Some(wanted) = &options.variant else { return Ok(default) };
        let variant = self.variant(wanted)?;
        let extensions = primitive.extensions.as_ref().map(|extensions| &extensions.others);
        let mappings = self.extension::<Mappings>(extensions, "KHR_materials_variants", at)?;
        let mut mappings = mappings.into_iter().flat_map(|all| all.mappings);
        Ok(mappings.find(|mapping| mapping.variants.contains(&variant)).map(|mapping| mapping.material).or(default))
    }

    /// The number of a variant, given by name or number.
    fn variant(&self, wanted: &str) -> Result<usize, SceneError> {
        #[derive(serde::Deserialize)]
        struct Variant {
            name: String,
        }
        #[derive(serde::Deserialize)]
        struct Variants {
            variants: Vec<Variant>,
        }
        let extensions = self.root.extensions.as_ref().map(|extensions| &extensions.others);
        let variants = self.extension::<Variants>(extensions, "KHR_materials_variants", "file")?;
        let names: Vec<String> =
            variants.into_iter().flat_map(|all| all.variants).map(|variant| variant.name).collect();
        let by_number = || wanted.parse().ok().filter(|&number| number < names.len());
        names.iter().position(|name| name == wanted).or_else(by_number).ok_or_else(|| {
            let expected = if names.is_empty() {
                "none: the file has no variants".to_owned()
            } else {
                format!("one of {names:?}")
            };
            self.error("variant", format!("{wanted:?}"), expected)
        })
    }
}

/// Materials may have the same name in a file.
fn make_names_unique(materials: &mut [Material]) {
    let mut taken = BTreeSet::new();
    for material in materials {
        let name = material.name.clone();
        for suffix in 2.. {
            if taken.insert(material.name.clone()) {
                break;
            }
            material.name = format!("{name} ({suffix})");
        }
    }
}
