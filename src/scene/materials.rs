//! The scene's lists of materials and images while they are being collected from scene files, models and MTL files.

use std::collections::{BTreeSet, HashMap};

use crate::scene::description::Material;
use crate::scene::texture::TextureImage;

#[derive(Default)]
pub(super) struct MaterialList {
    materials: Vec<Material>,
    index_of_name: HashMap<String, u32>,
    images: Vec<TextureImage>,
    index_of_image: HashMap<String, u32>,
}

impl MaterialList {
    /// Appends a material of the scene file, where names have to be unique: `None` if this one is not.
    pub fn define(&mut self, material: Material) -> Option<u32> {
        if self.index_of_name.contains_key(&material.name) {
            return None;
        }
        Some(self.push(material))
    }

    fn push(&mut self, material: Material) -> u32 {
        // Does not wrap: 2³² materials do not fit in memory.
        let index = self.materials.len() as u32;
        self.index_of_name.insert(material.name.clone(), index);
        self.materials.push(material);
        index
    }

    /// The index of a material from elsewhere, which is shared if it is there already, and given another name if its
    /// own is taken by a different one.
    pub fn add(&mut self, mut material: Material) -> u32 {
        let name = material.name.clone();
        for suffix in 2.. {
            match self.find(&material.name) {
                Some(index) if self.materials[index as usize] == material => return index,
                Some(_) => material.name = format!("{name} ({suffix})"),
                None => break,
            }
        }
        self.push(material)
    }

    pub fn find(&self, name: &str) -> Option<u32> {
        self.index_of_name.get(name).copied()
    }

    pub fn get(&self, index: u32) -> &Material {
        &self.materials[index as usize]
    }

    /// The names, quoted, for a message; long lists are cut.
    pub fn names(&self) -> String {
        const SHOWN: usize = 8;
        let mut names: Vec<_> = self.materials.iter().take(SHOWN).map(|m| format!("{:?}", m.name)).collect();
        if self.materials.len() > SHOWN {
            names.push("…".to_owned());
        }
        names.join(", ")
    }

    /// The index of an image, which is shared with those of the same name: they come from one file in one way.
    pub fn add_image(&mut self, image: TextureImage) -> u32 {
        let next = self.images.len() as u32;
        let index = *self.index_of_image.entry(image.name.clone()).or_insert(next);
        if index == next {
            self.images.push(image);
        }
        index
    }

    /// The index of an image that is made of others, unless it was already.
    pub fn make_image(
        &mut self,
        what: &str,
        sources: &[u32],
        make: impl FnOnce(String, &[&TextureImage]) -> TextureImage,
    ) -> u32 {
        let sources: Vec<_> = sources.iter().map(|&source| self.image(source)).collect();
        let names: Vec<_> = sources.iter().map(|image| image.name.as_str()).collect();
        let name = format!("{} ({what})", names.join(", "));
        match self.index_of_image.get(&name) {
            Some(&known) => known,
            None => {
                let image = make(name, &sources);
                self.add_image(image)
            }
        }
    }

    pub fn image(&self, index: u32) -> &TextureImage {
        &self.images[index as usize]
    }

    /// The materials, and the images that they use.
    pub fn into_parts(mut self) -> (Vec<Material>, Vec<TextureImage>) {
        let textures = || self.materials.iter().flat_map(|material| material.textures.values());
        let used: BTreeSet<u32> = textures().map(|texture| texture.image).collect();
        let new_index: HashMap<u32, u32> = used.iter().copied().zip(0..).collect();
        for texture in self.materials.iter_mut().flat_map(|material| material.textures.values_mut()) {
            texture.image = new_index[&texture.image];
        }
        let images = (0..).zip(self.images).filter(|(index, _)| used.contains(index)).map(|(_, image)| image);
        (self.materials, images.collect())
    }
}
