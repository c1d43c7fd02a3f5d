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
mod tangents;
mod uri;

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use glam::DMat4;
use gltf::json::accessor::Type;
use rayon::prelude::*;

use crate::host::available_memory;
use crate::scene::description::*;
use crate::scene::environment::Environment;
use crate::scene::error::SceneError;
use crate::scene::image_file::decode;
use crate::scene::limits::MAX_IMAGE_SIDE;
use crate::scene::load_options::LoadOptions;
use crate::scene::named_camera::NamedCamera;
use crate::scene::texture::{TextureImage, TextureSlot};

pub(super) use crate::scene::gltf::document::is_glb;
use crate::scene::gltf::document::{Document, number};
use crate::scene::gltf::geometry::Wanted;
use crate::scene::gltf::nodes::Placed;
use crate::scene::gltf::uri::Files;

/// Longest chain of surface hits of a model's paths: light passes several layers of glass.
const MAX_DEPTH: u32 = 16;

/// Rows of an image, unless asked for otherwise.
const ROWS: u32 = 512;

/// Makes a scene of a glTF file, and lists its cameras: the first of them is the scene's. `name` stands for it in messages, `base_dir` is where what it names is looked for.
pub(in crate::scene) fn load(
    bytes: &[u8],
    name: &str,
    base_dir: Option<&Path>,
    options: &LoadOptions,
    warnings: &mut Vec<String>,
) -> Result<(Scene, Vec<NamedCamera>), SceneError> {
    let files = Files { base_dir, confined: options.confine };
    let document = Document::parse(bytes, name, files, warnings)?;
    let pose = document.pose(options.time)?;
    let placed = document.placed_nodes(&pose)?;
    let mut builder = Builder {
        document: &document,
        options,
        materials: Vec::new(),
        numbers: HashMap::new(),
        left_out: 0,
        meshes: Vec::new(),
        bytes: 0,
    };
    for place in &placed {
        builder.add_node(place, &placed, &pose)?;
    }
    let Builder { mut materials, mut meshes, left_out, .. } = builder;
    if left_out > 0 {
        warnings.push(format!("{name}: {left_out} primitives of points or lines are left out"));
    }
    let dropped: usize = meshes.iter().map(|mesh| mesh.degenerate_dropped).sum();
    if dropped > 0 {
        warnings.push(format!("{name}: {dropped} triangles without an area are left out"));
    }
    let images = document.images(&mut materials, options, warnings)?;
    make_names_unique(&mut materials);
    warnings.extend(left_out_of(&materials).map(|(material, what)| format!("{name}: {material}: {what} left out")));
    meshes.retain(|mesh| !mesh.triangles.is_empty());
    let lights = document.lights(&placed)?;
    let cameras = document.cameras(&placed)?;
    let aspect = cameras.first().and_then(|camera| camera.vertical?.aspect).unwrap_or(1.0);
    let width = (f64::from(ROWS) * aspect).round().clamp(1.0, f64::from(MAX_IMAGE_SIDE)) as u32;
    let emits = meshes.iter().any(|mesh| {
        mesh.triangle_materials.iter().any(|&m| {
            let material = &materials[m as usize];
            // Textures of emission are decoration more often than sources of light.
            material.surface.emits() && !material.unlit && !material.textures.contains_key(&TextureSlot::Emission)
        })
    });
    let is_lit = emits || !lights.is_empty();
    if !is_lit {
        warnings.push(format!("{name}: no lights: a studio lights it"));
    }
    let mut scene = Scene {
        source: name.to_owned(),
        film: Film { width, height: ROWS, ..Film::default() },
        integrator: Integrator { max_depth: MAX_DEPTH, ..Integrator::default() },
        materials,
        images,
        environment: (!is_lit).then(Environment::studio),
        meshes,
        lights,
        ..Scene::default()
    };
    scene.camera = match cameras.first() {
        Some(camera) => camera.for_image(width, ROWS).0,
        None => scene.fitting_camera(),
    };
    Ok((scene, cameras))
}

/// The meshes and materials of a scene while its nodes are gone through.
struct Builder<'a> {
    document: &'a Document<'a>,
    options: &'a LoadOptions,
    materials: Vec<Material>,
    /// Numbers of materials by those of the file; `None` is the default material.
    numbers: HashMap<Option<usize>, u32>,
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
            let of_material = &self.materials[material as usize];
            let normal =
                of_material.textures.get(&TextureSlot::Normal).or(of_material.textures.get(&TextureSlot::CoatNormal));
            let anisotropy = of_material.textures.get(&TextureSlot::Anisotropy);
            let is_anisotropic = matches!(of_material.surface.bsdf, Bsdf::MetallicRoughness(m) if m.anisotropy > 0.0);
            let wanted = Wanted {
                tangents: normal.is_some() || is_anisotropic,
                tangent_uv: normal.or(anisotropy).map_or(0, |texture| texture.uv_set as usize),
            };
            match document.geometry(primitive, &weights, wanted, &at)? {
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
            Some(index) => self.document.material(index)?,
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
    fn images(
        &self,
        materials: &mut [Material],
        options: &LoadOptions,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<TextureImage>, SceneError> {
        let used: BTreeSet<u32> =
            materials.iter().flat_map(|m| m.textures.values().map(|texture| texture.image)).collect();
        let used: Vec<u32> = used.into_iter().collect();
        let images: Vec<_> = used.par_iter().map(|&index| self.image(index as usize)).collect::<Result<_, _>>()?;
        for texture in materials.iter_mut().flat_map(|material| material.textures.values_mut()) {
            texture.image = used.binary_search(&texture.image).unwrap_or(0) as u32;
        }
        crate::scene::texture_limit::limit(self.name, images, materials, options.texture_limit, warnings)
    }

    fn image(&self, index: usize) -> Result<TextureImage, SceneError> {
        let image = self.get(&self.root.images, index, "image", "texture")?;
        let at = match (&image.name, &image.uri) {
            (_, Some(uri)) if !uri.starts_with("data:") => format!("image {index} ({uri:?})"),
            (Some(name), _) => format!("image {index} ({name:?})"),
            _ => format!("image {index}"),
        };
        let decoded = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => decode(&self.files.read(uri, self.name, &at)?, &at),
            (None, Some(view)) => decode(self.view_content(number(view), &at)?, &at),
            (None, None) => return Err(self.error(at, "neither uri nor bufferView", "one of them")),
        };
        decoded.map_err(|found| self.error(at, found, "an image of type PNG, JPEG, WebP, TGA, BMP or HDR"))
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

/// What of materials is not rendered: names, and what it is.
fn left_out_of(materials: &[Material]) -> impl Iterator<Item = (String, String)> {
    materials.iter().filter_map(|material| {
        let Bsdf::MetallicRoughness(m) = material.surface.bsdf else { return None };
        let has = |slot| material.textures.contains_key(&slot);
        let parts = [
            ("clear coat", m.coat > 0.0),
            ("sheen", m.sheen_color != [0.0; 3]),
            ("anisotropy", m.anisotropy > 0.0),
            ("textures of specular reflection", has(TextureSlot::Specular) || has(TextureSlot::SpecularColor)),
        ];
        let parts: Vec<_> = parts.iter().filter(|(_, is_there)| *is_there).map(|(what, _)| *what).collect();
        let are = if parts.len() == 1 { "is" } else { "are" };
        (!parts.is_empty()).then(|| (format!("material {:?}", material.name), format!("{} {are}", parts.join(", "))))
    })
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
