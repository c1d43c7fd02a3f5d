//! Deliberate errors: each must make the test suite fail, or the suite is toothless.

/// One thing broken in the shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Mutation {
    /// Reflectances are 1% too high.
    Albedo = 1,
    /// Direct light without its cosine.
    Cosine = 2,
    /// The index of refraction is inverted.
    SwappedIor = 3,
    /// Hits closer than 10⁻³ are ignored, and nothing else guards against self-intersection.
    FixedTmin = 4,
    /// The sampler has only a few distinct values.
    TruncatedSampler = 5,
}

impl Mutation {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Albedo, Self::Cosine, Self::SwappedIor, Self::FixedTmin, Self::TruncatedSampler];
}
