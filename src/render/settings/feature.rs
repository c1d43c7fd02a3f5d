//! What can be left out of the path tracer.

/// A part of the path tracer that is left out where a scene does not need it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// Diffuse surfaces, and light that falls on them.
    Diffuse,
    /// Mirrors.
    Mirror,
    /// Glass.
    Dielectric,
    /// Surfaces that emit.
    Emitter,
    /// Light from where a ray meets nothing.
    Background,
    /// A tree.
    Tree,
    /// Spheres in the tree.
    BvhSpheres,
    /// Triangles in the tree.
    BvhTriangles,
    /// A stack for trees of any depth.
    DeepBvh,
    /// Lights of all kinds, if there is any.
    LightKinds,
    /// Interpolated normals.
    SmoothNormals,
    /// All levels of the sampler's table.
    SamplerLevels,
}

impl Feature {
    /// All of them, and their names.
    pub const ALL: [(&'static str, Self); 12] = [
        ("diffuse", Self::Diffuse),
        ("mirror", Self::Mirror),
        ("dielectric", Self::Dielectric),
        ("emitter", Self::Emitter),
        ("background", Self::Background),
        ("tree", Self::Tree),
        ("tree-spheres", Self::BvhSpheres),
        ("tree-triangles", Self::BvhTriangles),
        ("deep-tree", Self::DeepBvh),
        ("light-kinds", Self::LightKinds),
        ("smooth-normals", Self::SmoothNormals),
        ("sampler-levels", Self::SamplerLevels),
    ];
}
