//! Images on surfaces, and how they are looked up.

/// The pixels of an image, rows from the top. Colours are not premultiplied.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureImage {
    /// For messages: its file, or where in a file it is.
    pub name: String,
    /// Pixels, at least 1.
    pub width: u32,
    /// Pixels, at least 1.
    pub height: u32,
    /// `width · height` pixels.
    pub texels: Texels,
}

/// Pixels as the file has them.
#[derive(Debug, Clone, PartialEq)]
pub enum Texels {
    /// Codes of 8 bits: value = code / 255.
    Rgba8(Vec<[u8; 4]>),
    /// Codes of 16 bits: value = code / 65535.
    Rgba16(Vec<[u16; 4]>),
    /// Values; finite and at least 0.
    Rgba32F(Vec<[f32; 4]>),
}

impl Texels {
    /// Red, green, blue and alpha of a pixel; colours are not decoded.
    pub(crate) fn value(&self, pixel: usize) -> [f64; 4] {
        match self {
            Self::Rgba8(pixels) => pixels[pixel].map(|code| f64::from(code) / 255.0),
            Self::Rgba16(pixels) => pixels[pixel].map(|code| f64::from(code) / 65535.0),
            Self::Rgba32F(pixels) => pixels[pixel].map(f64::from),
        }
    }

    /// The pixels, one after the other.
    pub(crate) fn as_bytes(&self) -> &[u8] {
        match self {
            Self::Rgba8(texels) => texels.as_flattened(),
            Self::Rgba16(texels) => bytemuck::cast_slice(texels),
            Self::Rgba32F(texels) => bytemuck::cast_slice(texels),
        }
    }
}

/// What lies beyond the edges of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// Its mirror image, and so on in turns.
    Mirror,
    /// The pixels of its edge.
    Clamp,
}

/// Use of an image: how coordinates of a mesh become a value.
///
/// Pixel (i, j) of an image of n × m has its centre at u = (i + ½)/n, v = (j + ½)/m; v runs down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    /// Index into [`Scene::images`](crate::Scene::images).
    pub image: u32,
    /// Colours are codes of IEC 61966-2-1, decoded before they are filtered (alpha never is).
    pub srgb: bool,
    /// Along u and v.
    pub wrap: [Wrap; 2],
    /// The nearest pixel alone; else bilinear between four.
    pub nearest: bool,
    /// Which coordinates of the mesh: 0 or 1.
    pub uv_set: u32,
    /// Two rows of an affine map from the mesh's coordinates to those of the image.
    pub transform: [[f64; 3]; 2],
}

impl Texture {
    /// The map that changes nothing.
    pub const IDENTITY: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    /// Repeated, bilinear, by the first coordinates of the mesh.
    pub const fn new(image: u32, srgb: bool) -> Self {
        Self { image, srgb, wrap: [Wrap::Repeat; 2], nearest: false, uv_set: 0, transform: Self::IDENTITY }
    }
}

/// What a texture of a material is for. Its value multiplies the material's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TextureSlot {
    /// Red, green, blue: base colour or reflectance. Alpha: coverage.
    BaseColor,
    /// Green: roughness. Blue: metalness.
    MetallicRoughness,
    /// A normal in the frame of tangent, bitangent and normal: (2·rgb − 1)·(scale, scale, 1), normalised.
    Normal,
    /// Red, green, blue: emission.
    Emission,
    /// Red: transmission.
    Transmission,
    /// Alpha: strength of specular reflection.
    Specular,
    /// Red, green, blue: colour of specular reflection.
    SpecularColor,
    /// Red: strength of the coat.
    Coat,
    /// Green: roughness of the coat.
    CoatRoughness,
    /// The coat's own normal, as [`TextureSlot::Normal`].
    CoatNormal,
    /// Red, green, blue: colour of the sheen.
    SheenColor,
    /// Alpha: roughness of the sheen.
    SheenRoughness,
    /// Red, green: direction, 2·rg − 1. Blue: strength of the anisotropy.
    Anisotropy,
}
