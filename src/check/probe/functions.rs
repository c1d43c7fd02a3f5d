//! Functions that need no scene: sampling, Fresnel, sums, and what the driver's arithmetic does.

use bytemuck::{Pod, Zeroable};

use crate::check::probe::Kernel;

const FUNCTIONS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/functions.spv"));
const ARITHMETIC: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/arithmetic.spv"));
const ACCUMULATE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/accumulate.spv"));

/// Functions of shaders/probe/functions.comp, with their arguments and results by word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Function {
    /// (a, b) → (sum, error)
    TwoSum = 0,
    /// (a, b) → (product, error)
    TwoProduct = 1,
    /// u → (cos 2πu, sin 2πu)
    CosSin = 2,
    /// x → ln x
    Log = 3,
    /// n → tangent; bitangent
    Basis = 4,
    /// u → offset in pixels
    Filter = 5,
    /// n; u → direction
    Diffuse = 6,
    /// (cosine, eta) → (reflectance, transmitted cosine)
    Fresnel = 7,
    /// (direction, ior); (normal, u) → (direction, crossed)
    Dielectric = 8,
    /// (pixel, index, pair, hit) as integers → u
    SamplePair = 9,
    /// x → arctan x
    Atan = 10,
    /// (metalness, roughness, base, cosine of wo); wi → f·cos θi, density; wo has azimuth 0
    Lobes = 11,
    /// (η, roughness, tint, specular); (wi, cosine of wo, negative: of a wall) → f·cos θi, density; wo has azimuth 0
    Glass = 12,
    /// x → eˣ
    Exp = 13,
}

impl Function {
    pub fn kernel(self) -> Kernel {
        Kernel::function("probe functions", FUNCTIONS, self as u32)
    }
}

impl Kernel {
    /// The operations of [`Operations`].
    pub const OPERATIONS: Self = Self::function("probe arithmetic", ARITHMETIC, 0);
    /// Loop iterations: integers in and out.
    pub const LOOP: Self = Self::function("probe loop", ARITHMETIC, 1);
    /// Synthetic samples into the film.
    pub const ACCUMULATE: Self = Self::function("probe accumulate", ACCUMULATE, 0);
    /// The same after a first sample of 10⁸.
    pub const ACCUMULATE_AFTER_FIREFLY: Self = Self::function("probe accumulate", ACCUMULATE, 1);
}

/// Two words of four floats.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct Words {
    pub x: [f32; 4],
    pub y: [f32; 4],
}

impl Words {
    /// Floats of the first word; the rest is 0.
    pub fn of(x: &[f32]) -> Self {
        let mut words = Self::zeroed();
        words.x[..x.len()].copy_from_slice(x);
        words
    }

    /// Integers as float bits.
    pub fn of_bits(x: [u32; 4]) -> Self {
        Self { x: x.map(f32::from_bits), y: [0.0; 4] }
    }
}

/// What shaders/probe/arithmetic.comp computes from (x, y, z).
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct Operations {
    pub quotient: f32,
    pub sqrt: f32,
    pub inverse_sqrt: f32,
    pub fma: f32,
    /// x·y + z, which the driver may contract.
    pub multiply_add: f32,
    /// The same, `precise`.
    pub precise_multiply_add: f32,
    pub sin: f32,
    pub cos: f32,
    pub exp: f32,
    pub log: f32,
    pub min: f32,
    pub max: f32,
    /// uint(x).
    pub to_uint: u32,
    pub product: f32,
    pub normalized: [f32; 2],
}
