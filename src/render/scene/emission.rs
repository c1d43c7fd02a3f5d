//! How bright emitting triangles are whose emission has a texture: light sampling goes to them by that, and not to those that are dark.

use std::collections::HashMap;

use crate::scene::{Material, Mesh, Scene, Texture, TextureImage, TextureSlot, srgb};

/// Sums of an image's brightness over all pixels above and to the left.
struct Sums {
    width: usize,
    height: usize,
    sums: Vec<f64>,
}

impl Sums {
    fn of(image: &TextureImage, is_srgb: bool) -> Self {
        let (width, height) = (image.width as usize, image.height as usize);
        let decoded = |x: f64| if is_srgb { srgb::decode(x) } else { x };
        let brightness = |i: usize| image.texels.value(i)[..3].iter().map(|&x| decoded(x)).sum::<f64>() / 3.0;
        let mut sums = vec![0.0; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0.0;
            for x in 0..width {
                row += brightness(y * width + x);
                sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
            }
        }
        Self { width, height, sums }
    }

    /// Mean over pixels `x0..x1` × `y0..y1`.
    fn mean(&self, [x0, x1]: [usize; 2], [y0, y1]: [usize; 2]) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        let sum = at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
        // Of dark pixels nothing but rounding is left.
        let part = sum / ((x1 - x0) * (y1 - y0)) as f64;
        if part > 1e-9 { part } else { 0.0 }
    }
}

/// The means of textures of emission.
pub(crate) struct EmissionMeans(HashMap<(u32, bool), Sums>);

impl EmissionMeans {
    /// Of all emitting materials of a scene.
    pub fn of(scene: &Scene) -> Self {
        let emitting = scene.materials.iter().filter(|material| material.surface.emits() && !material.unlit);
        let textures = emitting.filter_map(|material| material.textures.get(&TextureSlot::Emission));
        let mut sums = HashMap::new();
        for texture in textures {
            let image = &scene.images[texture.image as usize];
            sums.entry((texture.image, texture.srgb)).or_insert_with(|| Sums::of(image, texture.srgb));
        }
        Self(sums)
    }

    /// About the mean of what a triangle's texture leaves of its emission: over the rectangle of pixels around it. 0 only if no pixel
    /// of these shines.
    pub fn of_triangle(&self, mesh: &Mesh, triangle: usize, material: &Material) -> f64 {
        let Some(texture) = material.textures.get(&TextureSlot::Emission) else { return 1.0 };
        let Some(sums) = self.0.get(&(texture.image, texture.srgb)) else { return 1.0 };
        let corners = mesh.triangles[triangle].map(|vertex| {
            let uv = mesh.uvs[texture.uv_set as usize].get(vertex as usize).copied().unwrap_or_default();
            place(texture, uv)
        });
        let range = |axis: usize, size: usize| {
            let (lo, hi) = corners
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| (lo.min(p[axis]), hi.max(p[axis])));
            // What is wrapped may show any pixel.
            if lo < 0.0 || hi > 1.0 {
                return [0, size];
            }
            // Filtering reaches to the next pixel.
            let first = (lo * size as f64 - 1.0).floor().max(0.0) as usize;
            let last = (hi * size as f64 + 1.0).ceil() as usize;
            // At the edge it reaches around.
            if first == 0 || last >= size { [0, size] } else { [first, last.max(first + 1)] }
        };
        sums.mean(range(0, sums.width), range(1, sums.height))
    }
}

fn place(texture: &Texture, [u, v]: [f32; 2]) -> [f64; 2] {
    texture.transform.map(|[a, b, c]| a * f64::from(u) + b * f64::from(v) + c)
}
