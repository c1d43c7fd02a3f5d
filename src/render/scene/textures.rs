//! Textures and the table of albedos as the shaders see them (shaders/lib/texture.glsl, shaders/lib/bsdf/albedo.glsl).

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::accel::Texel;
use crate::ggx_albedo;
use crate::glass_albedo;
use crate::scene::{Material, Scene, Texels, Texture, TextureImage, TextureSlot};

use crate::render::kernel::layout::texture::*;
use crate::render::scene::materials::SLOTS;

/// Images are made of squares of so many pixels a side.
const BLOCK: usize = 2;

/// The texels, and the numbers of textures.
pub(crate) struct TextureTable {
    pub texels: Vec<Texel>,
    /// First texel of the albedos of glass; 0 where nothing needs them.
    pub glass: u32,
    /// In the order of materials, then of their slots.
    numbers: Vec<[Option<u32>; SLOTS.len()]>,
}

impl TextureTable {
    /// Of the materials of a scene; a texel that nothing looks at if none has details.
    pub fn of(scene: &Scene) -> Self {
        if !scene.materials.iter().any(|material| material.has_details()) {
            return Self { texels: vec![[0; 4]], glass: 0, numbers: Vec::new() };
        }
        let mut textures = Vec::new();
        let mut number = |texture: &Texture| {
            // Uses that are the same share a record.
            let known = textures.iter().position(|known| known == texture);
            known.unwrap_or_else(|| {
                textures.push(*texture);
                textures.len() - 1
            }) as u32
        };
        let of_material = |m: &Material| SLOTS.map(|slot| m.textures.get(&slot).map(&mut number));
        let numbers = scene.materials.iter().map(of_material).collect();
        let mut texels = ALBEDO_TEXELS.clone();
        let records = texels.len();
        texels.resize(records + 3 * textures.len(), [0; 4]);
        let mut first_of_image = vec![None; scene.images.len()];
        for (i, texture) in textures.iter().enumerate() {
            let image = &scene.images[texture.image as usize];
            let first = *first_of_image[texture.image as usize].get_or_insert_with(|| {
                let first = texels.len();
                texels.par_extend(image_texels(image));
                first
            });
            texels[records + 3 * i..][..3].copy_from_slice(&texture_texels(texture, image, first as u32));
        }
        let mut glass = 0;
        if scene.materials.iter().any(|material| material.surface.is_transmissive()) {
            glass = texels.len() as u32;
            texels.extend(&*GLASS_TEXELS);
        }
        Self { texels, glass, numbers }
    }

    /// The number of a material's texture.
    pub fn number(&self, material: usize, slot: TextureSlot) -> Option<u32> {
        let place = SLOTS.iter().position(|&known| known == slot)?;
        self.numbers.get(material)?[place]
    }
}

fn texture_texels(texture: &Texture, image: &TextureImage, first: u32) -> [Texel; 3] {
    let [wrap_u, wrap_v] = texture.wrap.map(|wrap| wrap as u32);
    let flags = [
        (texture.srgb, SRGB),
        (texture.nearest, NEAREST),
        (texture.uv_set == 1, SECOND_UV),
        (matches!(image.texels, Texels::Rgba16(_)), CODES_16),
        (matches!(image.texels, Texels::Rgba32F(_)), FLOATS),
    ];
    let flags = flags.iter().filter(|(is_set, _)| *is_set).fold(0, |all, (_, flag)| all | flag);
    let head = [first, image.width | image.height << 16, wrap_u | wrap_v << WRAP_V_SHIFT | flags, 0];
    let row = |[a, b, c]: [f64; 3]| [a as f32, b as f32, c as f32, 0.0].map(f32::to_bits);
    [head, row(texture.transform[0]), row(texture.transform[1])]
}

/// The blocks of an image.
fn image_texels(image: &TextureImage) -> Vec<Texel> {
    match &image.texels {
        Texels::Rgba8(pixels) => in_blocks(image, pixels, |block| vec![block.map(u32::from_le_bytes)]),
        Texels::Rgba16(pixels) => in_blocks(image, pixels, |[a, b, c, d]| {
            let words = |[r, g, b, a]: [u16; 4]| [u32::from(r) | u32::from(g) << 16, u32::from(b) | u32::from(a) << 16];
            let row = |left, right| [words(left), words(right)].concat().try_into().unwrap_or_default();
            vec![row(a, b), row(c, d)]
        }),
        Texels::Rgba32F(pixels) => {
            in_blocks(image, pixels, |block| block.map(|pixel| pixel.map(f32::to_bits)).to_vec())
        }
    }
}

/// The blocks, row by row, each by its upper left, upper right, lower left and lower right pixel.
fn in_blocks<P: Copy + Sync>(
    image: &TextureImage,
    pixels: &[P],
    texels: impl Fn([P; BLOCK * BLOCK]) -> Vec<Texel> + Sync,
) -> Vec<Texel> {
    let (width, height) = (image.width as usize, image.height as usize);
    let row = |y: usize| {
        let pixel = |x: usize, y: usize| pixels[y.min(height - 1) * width + x.min(width - 1)];
        let block = |x: usize| texels([pixel(x, y), pixel(x + 1, y), pixel(x, y + 1), pixel(x + 1, y + 1)]);
        (0..width).step_by(BLOCK).flat_map(block).collect::<Vec<_>>()
    };
    (0..height.div_ceil(BLOCK)).into_par_iter().map(|y| row(BLOCK * y)).flatten_iter().collect()
}

/// The slices of the table of glass, a texel for a cell, and means.
static GLASS_TEXELS: LazyLock<Vec<Texel>> = LazyLock::new(|| {
    use crate::glass_albedo::{COSINES, ROUGHNESSES, SLICES};
    let table = glass_albedo::table();
    let value = |k: usize, j: usize, i: usize| table.value(k, j.min(ROUGHNESSES - 1), i.min(COSINES - 1)).to_bits();
    let cell = |k, j, i| [value(k, j, i), value(k, j, i + 1), value(k, j + 1, i), value(k, j + 1, i + 1)];
    let cells = |k| (0..ROUGHNESSES).flat_map(move |j| (0..COSINES).map(move |i| cell(k, j, i)));
    let last = GLASS_MEANS - 1;
    let means: Vec<Vec<u32>> = (0..SLICES)
        .into_par_iter()
        .map(|k| (0..=last).map(|j| (table.mean_of_slice(k, j as f64 / last as f64) as f32).to_bits()).collect())
        .collect();
    let mean = |k: usize, j: usize| means[k.min(SLICES - 1)][j.min(last)];
    let of_slice = |k| (0..=last).map(move |j| (k, j));
    let means =
        (0..SLICES).flat_map(of_slice).map(|(k, j)| [mean(k, j), mean(k, j + 1), mean(k + 1, j), mean(k + 1, j + 1)]);
    (0..SLICES).flat_map(cells).chain(means).collect()
});

/// Both parts of the table, a texel for a cell, and means.
static ALBEDO_TEXELS: LazyLock<Vec<Texel>> = LazyLock::new(|| {
    let cells = |table: &[f32]| {
        let value =
            |i: usize, j: usize| table[j.min(ALBEDO_STEPS - 1) * ALBEDO_STEPS + i.min(ALBEDO_STEPS - 1)].to_bits();
        let cell = |i, j| [value(i, j), value(i + 1, j), value(i, j + 1), value(i + 1, j + 1)];
        (0..ALBEDO_STEPS)
            .flat_map(|j| (0..ALBEDO_STEPS).map(move |i| (i, j)))
            .map(|(i, j)| cell(i, j))
            .collect::<Vec<_>>()
    };
    let table = ggx_albedo::table();
    let mut texels = cells(&table.sum);
    texels.extend(cells(&table.grazing));
    let last = ALBEDO_MEANS - 1;
    let mean = |i: usize| table.mean(i.min(last) as f64 / last as f64).map(|x| (x as f32).to_bits());
    texels.extend((0..=last).map(|i| {
        let ([a, b], [c, d]) = (mean(i), mean(i + 1));
        [a, b, c, d]
    }));
    texels
});
