//! The scene's list of materials while it is being collected from a scene file and from MTL files.

use std::collections::HashMap;

use crate::scene::description::{Material, Surface};

#[derive(Default)]
pub(super) struct MaterialList {
    materials: Vec<Material>,
    index_of_name: HashMap<String, u32>,
}

impl MaterialList {
    /// Appends a material of the scene file, where names have to be unique: `None` if this one is not.
    pub fn define(&mut self, name: String, surface: Surface) -> Option<u32> {
        if self.index_of_name.contains_key(&name) {
            return None;
        }
        Some(self.push(name, surface))
    }

    fn push(&mut self, name: String, surface: Surface) -> u32 {
        // Does not wrap: 2³² materials do not fit in memory.
        let index = self.materials.len() as u32;
        self.index_of_name.insert(name.clone(), index);
        self.materials.push(Material::new(name, surface));
        index
    }

    /// The index of a material from elsewhere, which is shared if it is there already, and given another name if its
    /// own is taken by a different surface.
    pub fn add(&mut self, name: &str, surface: &Surface) -> u32 {
        let mut free_name = name.to_owned();
        for suffix in 2.. {
            match self.find(&free_name) {
                Some(index) if self.materials[index as usize].surface == *surface => return index,
                Some(_) => free_name = format!("{name} ({suffix})"),
                None => break,
            }
        }
        self.push(free_name, *surface)
    }

    pub fn find(&self, name: &str) -> Option<u32> {
        self.index_of_name.get(name).copied()
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

    pub fn into_vec(self) -> Vec<Material> {
        self.materials
    }
}
