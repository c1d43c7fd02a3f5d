//! What a material is at a point of a triangle: textures, vertex colours, alpha.

use glam::{DVec2, DVec3, DVec4};

use crate::scene::{Bsdf, Coverage, Material, Mesh, Scene, Surface, Texels, Texture, TextureImage, TextureSlot, Wrap};

/// A point of a triangle.
#[derive(Debug, Clone, Copy)]
pub struct Place<'a> {
    /// The triangle's mesh.
    pub mesh: &'a Mesh,
    /// Its vertices.
    pub vertices: [u32; 3],
    /// Barycentric weights of these.
    pub weights: [f64; 3],
}

impl Place<'_> {
    /// Zeros where the mesh has no values.
    fn blend<T: Copy, const N: usize>(&self, values: &[T], part: impl Fn(T) -> [f32; N]) -> [f64; N] {
        let mut sum = [0.0; N];
        for (vertex, weight) in self.vertices.iter().zip(self.weights) {
            let value = values.get(*vertex as usize).map_or([0.0; N], |&value| part(value));
            sum = std::array::from_fn(|i| sum[i] + weight * f64::from(value[i]));
        }
        sum
    }

    fn color(&self) -> DVec4 {
        if self.mesh.colors.is_empty() { DVec4::ONE } else { self.blend(&self.mesh.colors, |color| color).into() }
    }

    fn look_up(&self, scene: &Scene, material: &Material, slot: TextureSlot) -> Option<DVec4> {
        let texture = material.textures.get(&slot)?;
        let uv = self.blend(&self.mesh.uvs[texture.uv_set as usize], |uv| uv);
        Some(texture_value(texture, &scene.images[texture.image as usize], uv.into()))
    }

    /// What the material does there.
    pub fn surface(&self, scene: &Scene, material: &Material) -> Surface {
        let mut surface = material.surface;
        let base = self.color().truncate()
            * self.look_up(scene, material, TextureSlot::BaseColor).map_or(DVec3::ONE, DVec4::truncate);
        let times = |color: [f64; 3]| (DVec3::from(color) * base).min(DVec3::ONE).to_array();
        match &mut surface.bsdf {
            Bsdf::Diffuse { reflectance } | Bsdf::Mirror { reflectance } => *reflectance = times(*reflectance),
            Bsdf::MetallicRoughness(m) => {
                m.base_color = times(m.base_color);
                if let Some(value) = self.look_up(scene, material, TextureSlot::MetallicRoughness) {
                    m.roughness *= value.y;
                    m.metallic *= value.z;
                }
                if let Some(value) = self.look_up(scene, material, TextureSlot::Transmission) {
                    m.transmission *= value.x;
                }
            }
            Bsdf::Dielectric { .. } | Bsdf::Black => {}
        }
        if let Some(value) = self.look_up(scene, material, TextureSlot::Emission) {
            surface.emission = (DVec3::from(surface.emission) * value.truncate()).to_array();
        }
        if material.unlit {
            surface.emission = (DVec3::from(surface.emission) * self.color().truncate()).to_array();
        }
        surface
    }

    /// The shading normal, given the interpolated one.
    pub fn normal(&self, scene: &Scene, material: &Material, interpolated: DVec3) -> DVec3 {
        let Some(value) = self.look_up(scene, material, TextureSlot::Normal) else { return interpolated };
        let frame = |i: usize| DVec3::from(self.blend(&self.mesh.tangents, |two| two[i])).normalize_or_zero();
        let relief = (2.0 * value.truncate() - 1.0) * DVec3::new(material.normal_scale, material.normal_scale, 1.0);
        (frame(0) * relief.x + frame(1) * relief.y + interpolated * relief.z).normalize_or(interpolated)
    }

    /// The part of rays that meet the material there; `front`: from its front.
    pub fn coverage(&self, scene: &Scene, material: &Material, front: bool) -> f64 {
        if material.culls_back && !front {
            return 0.0;
        }
        let of_texture = self.look_up(scene, material, TextureSlot::BaseColor).map_or(1.0, |value| value.w);
        let alpha = (material.alpha * self.color().w * of_texture).clamp(0.0, 1.0);
        match material.coverage {
            Coverage::Opaque => 1.0,
            Coverage::Mask(least) => f64::from(u8::from(alpha >= least)),
            Coverage::Blend => alpha,
        }
    }
}

/// A texture at the coordinates of its mesh.
pub fn texture_value(texture: &Texture, image: &TextureImage, uv: DVec2) -> DVec4 {
    let size = [image.width, image.height];
    let mapped = texture.transform.map(|[a, b, c]| a * uv.x + b * uv.y + c);
    let shift = if texture.nearest { 0.0 } else { 0.5 };
    let [x, y] = [0, 1].map(|axis| mapped[axis] * f64::from(size[axis]) - shift);
    let pixel = |i: f64, j: f64| {
        let [i, j] = [(0, i), (1, j)].map(|(axis, k)| wrapped(k as i64, i64::from(size[axis]), texture.wrap[axis]));
        pixel(texture, image, j as usize * image.width as usize + i as usize)
    };
    let (i, j) = (x.floor(), y.floor());
    if texture.nearest {
        return pixel(i, j);
    }
    let row = |j: f64| pixel(i, j).lerp(pixel(i + 1.0, j), x - i);
    row(j).lerp(row(j + 1.0), y - j)
}

fn wrapped(i: i64, size: i64, wrap: Wrap) -> i64 {
    match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Clamp => i.clamp(0, size - 1),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * size);
            i.min(2 * size - 1 - i)
        }
    }
}

fn pixel(texture: &Texture, image: &TextureImage, index: usize) -> DVec4 {
    let value: DVec4 = match &image.texels {
        Texels::Rgba8(pixels) => pixels[index].map(|code| f64::from(code) / 255.0),
        Texels::Rgba16(pixels) => pixels[index].map(|code| f64::from(code) / 65535.0),
        Texels::Rgba32F(pixels) => pixels[index].map(f64::from),
    }
    .into();
    let decoded = |code: f64| if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) };
    if texture.srgb { DVec4::new(decoded(value.x), decoded(value.y), decoded(value.z), value.w) } else { value }
}
