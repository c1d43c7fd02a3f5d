//! A number that tells scenes apart by what their images show.

use std::hash::Hasher;

use crate::hash::{Fnv, digest};
use crate::scene::{Bsdf, Coverage, Light, Material, PixelFilter, Reflection, Scene, Surface, TextureImage};

/// Hash of everything that the expectation of a scene's image depends on. Names, files, the number of samples,
/// roulette and the transfer curve are left out.
pub fn fingerprint(scene: &Scene) -> u64 {
    let mut h = Fnv::default();
    let c = &scene.camera;
    h.points(&[c.position, c.target, c.up]);
    h.numbers(&[c.horizontal_fov]);
    // Pinholes keep their numbers.
    if let Some(width) = c.orthographic_width {
        h.write(b"orthographic");
        h.numbers(&[width]);
    }
    if let Some(lens) = c.lens {
        h.write(b"lens");
        h.numbers(&[lens.radius, lens.focus]);
    }
    h.write(&scene.film.width.to_le_bytes());
    h.write(&scene.film.height.to_le_bytes());
    h.write(&[u8::from(scene.film.filter == PixelFilter::Gaussian), u8::from(scene.integrator.indirect)]);
    h.write(&scene.integrator.max_depth.to_le_bytes());
    h.numbers(&scene.background);
    if let Some(map) = &scene.environment {
        h.write(&map.width.to_le_bytes());
        h.write(&digest(bytemuck::cast_slice(&map.texels[..])).to_le_bytes());
        h.numbers(&[map.rotation, map.scale, if map.visible { 1.0 } else { 0.0 }]);
    }
    h.count(scene.materials.len());
    for material in &scene.materials {
        add_surface(&mut h, &material.surface);
        if *material != Material::new(material.name.clone(), material.surface) {
            add_details(&mut h, material);
        }
    }
    scene.images.iter().for_each(|image| add_image(&mut h, image));
    h.count(scene.spheres.len());
    for s in &scene.spheres {
        h.points(&[s.center]);
        h.numbers(&[s.radius]);
        h.write(&s.material.to_le_bytes());
        h.write(&[u8::from(s.inward)]);
    }
    h.count(scene.meshes.len());
    for mesh in &scene.meshes {
        h.points(&mesh.positions);
        h.points(&mesh.vertex_normals);
        for (triangle, material) in mesh.triangles.iter().zip(&mesh.triangle_materials) {
            triangle.iter().chain([material]).for_each(|i| h.write(&i.to_le_bytes()));
        }
        h.count(mesh.triangles.len());
        let attributes: [&[f32]; 4] = [
            mesh.uvs[0].as_flattened(),
            mesh.uvs[1].as_flattened(),
            mesh.tangents.as_flattened().as_flattened(),
            mesh.colors.as_flattened(),
        ];
        // Meshes without them keep their numbers.
        for (kind, numbers) in (1..).zip(attributes).filter(|(_, numbers)| !numbers.is_empty()) {
            h.write(&[kind]);
            h.write(bytemuck::cast_slice(numbers));
        }
    }
    h.count(scene.lights.len());
    for light in &scene.lights {
        match light {
            Light::Point { position, .. } => h.points(&[*position]),
            Light::Spot { position, direction, inner, outer, range, .. } => {
                h.points(&[*position, *direction]);
                h.numbers(&[*inner, *outer, *range]);
            }
            Light::Directional { direction, .. } => h.points(&[*direction; 3]),
        }
        h.numbers(&light.color());
    }
    h.finish()
}

fn add_surface(h: &mut Fnv, surface: &Surface) {
    let Surface { bsdf, emission, two_sided } = *surface;
    let mut add = |kind, values: &[f64]| {
        h.write(&[kind]);
        h.numbers(values);
    };
    match bsdf {
        Bsdf::Diffuse { reflectance } => add(0, &reflectance),
        Bsdf::Mirror { reflectance } => add(1, &reflectance),
        Bsdf::Dielectric { ior } => add(2, &[ior; 3]),
        Bsdf::Black => add(3, &[0.0; 3]),
        Bsdf::Conductor(c) => {
            match c.reflection {
                Reflection::Constant(reflectance) => add(5, &reflectance),
                Reflection::Index { eta, k } => add(6, &[eta, k].concat()),
            }
            h.numbers(&[c.roughness]);
        }
        Bsdf::MetallicRoughness(m) => {
            add(4, &m.base_color);
            let transmission = if m.has_volume { -1.0 - m.transmission } else { m.transmission };
            h.numbers(&[m.metallic, m.roughness, m.ior, m.specular, transmission, m.attenuation_distance, m.coat]);
            h.numbers(&[m.coat_roughness, m.sheen_roughness, m.anisotropy, m.anisotropy_rotation]);
            [m.specular_color, m.attenuation_color, m.sheen_color].iter().for_each(|color| h.numbers(color));
        }
    }
    h.numbers(&emission);
    // Scenes without such a material keep their numbers.
    if two_sided {
        h.write(&[1]);
    }
}

fn add_details(h: &mut Fnv, material: &Material) {
    h.numbers(&[material.normal_scale, material.coat_normal_scale, material.alpha]);
    match material.coverage {
        Coverage::Opaque => h.write(&[0]),
        Coverage::Blend => h.write(&[1]),
        Coverage::Mask(cutoff) => h.numbers(&[cutoff]),
    }
    h.write(&[u8::from(material.culls_back), u8::from(material.unlit)]);
    for (&slot, texture) in &material.textures {
        h.write(&[slot as u8, u8::from(texture.srgb), u8::from(texture.nearest), texture.uv_set as u8]);
        h.write(&texture.image.to_le_bytes());
        h.write(&texture.wrap.map(|wrap| wrap as u8));
        h.numbers(texture.transform.as_flattened());
    }
}

fn add_image(h: &mut Fnv, image: &TextureImage) {
    h.write(&image.width.to_le_bytes());
    h.write(&image.height.to_le_bytes());
    h.write(&digest(image.texels.as_bytes()).to_le_bytes());
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::fingerprint;
    use crate::scene::*;

    fn scene() -> Scene {
        Scene {
            source: "test".into(),
            camera: Camera {
                position: DVec3::Z,
                target: DVec3::ZERO,
                up: DVec3::Y,
                horizontal_fov: 60.0,
                ..Camera::default()
            },
            film: Film { width: 8, height: 8, filter: PixelFilter::Box, transfer: Transfer::Srgb, ..Film::default() },
            integrator: Integrator { max_depth: 8, samples: 1, russian_roulette: None, indirect: true },
            materials: vec![Material::new("grey", Surface::diffuse([0.5; 3]))],
            meshes: vec![Mesh {
                name: "mesh".into(),
                positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
                vertex_normals: vec![],
                triangles: vec![[0, 1, 2]],
                triangle_materials: vec![0],
                normals: Normals::Flat,
                ..Mesh::default()
            }],
            lights: vec![Light::Point { position: DVec3::Z, power: [1.0; 3] }],
            ..Scene::default()
        }
    }

    #[test]
    fn what_an_image_shows_counts_and_nothing_else() {
        let scene = scene();
        let same = |change: fn(&mut Scene)| {
            let mut other = scene.clone();
            change(&mut other);
            fingerprint(&other) == fingerprint(&scene)
        };
        assert!(same(|s| s.source.push('x')));
        assert!(same(|s| s.integrator.samples += 1));
        assert!(same(|s| s.integrator.russian_roulette = Some(3)));
        assert!(!same(|s| s.integrator.max_depth += 1));
        assert!(!same(|s| s.meshes[0].positions[2].y += 1e-9));
        assert!(!same(|s| s.meshes[0].triangles[0].swap(0, 1)));
        assert!(!same(|s| s.film.width += 1));
        assert!(!same(|s| s.materials[0].surface = Surface::dielectric(1.5)));
        assert!(!same(|s| s.materials[0].surface.two_sided = true));
        assert!(!same(|s| s.materials[0].culls_back = true));
        assert!(!same(|s| s.meshes[0].uvs[1] = vec![[0.0; 2]; 3]));
        assert!(!same(|s| s.lights.clear()));
    }
}
