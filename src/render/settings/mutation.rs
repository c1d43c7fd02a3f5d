//! Deliberate errors: each must make the test suite fail, or the suite is toothless.

/// One thing broken in the shaders (MUTATE_… in shaders/lib/layout.glsl).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Mutation {
    /// Reflectances are 1% too high.
    Albedo = 1,
    /// Direct light without its cosine.
    Cosine = 2,
    /// The index of refraction is inverted.
    SwappedIor = 3,
    /// Hits closer than 10⁻³ are ignored, and the primitive that a ray leaves is not skipped.
    FixedTmin = 4,
    /// The sampler has only a few distinct values.
    TruncatedSampler = 5,
    /// Edge functions of the watertight test as a compiler contracts them to fused multiply–adds.
    ContractedEdges = 6,
    /// Rays start on the computed hit point, not offset by its error bound.
    NoOffset = 7,
    /// The sphere or triangle that a ray leaves is tested like any other.
    NoSkip = 8,
    /// Boxes are not widened by what is relative to the ray's origin.
    NoBoxMargin = 9,
    /// Spheres by the textbook quadratic.
    TextbookSphere = 10,
    /// The film is a plain sum in single precision.
    PlainSum = 11,
    /// Rays that are not finite enter the BVH.
    UnguardedRays = 12,
    /// NaN and infinite samples are added to the film.
    NonFiniteSamples = 13,
    /// Boxes are not widened by what is relative to their own place (on the host).
    ThinBoxes = 14,
    /// The film's sums are two floats.
    TwoFloatSum = 15,
    /// Sine and cosine as inaccurate as Vulkan allows the built-in ones to be.
    BuiltInSinCos = 16,
    /// The logarithm as inaccurate as Vulkan allows the built-in one to be.
    BuiltInLog = 17,
    /// Fresnel's equations in plain single precision, without their limits.
    PlainFresnel = 18,
    /// Hit points on triangles of the BVH as o + t·d instead of from barycentrics.
    HitAlongRay = 19,
    /// Hit points on polygons not brought back onto the plane.
    NoProjection = 20,
    /// Reciprocals of directions with their infinities.
    InfiniteInverse = 21,
    /// Light that is reused for other pixels passes through everything.
    BlindReuse = 22,
    /// The simpler test of polygons is believed where rounding may decide.
    NoDoubt = 23,
    /// Boxes are not widened at all.
    NoMargins = 24,
    /// The image's own first samples decide how many a pixel gets (on the host).
    OwnSampleMap = 25,
    /// Differences from the pixels below have the wrong sign.
    InvertedGradients = 26,
    /// Light paths count all light of their chains, although paths find a part of it.
    DoubleLightTracing = 27,
    /// Shadow rays to spherical emitters end before the emitter by a bound on its distance where it is met head-on.
    NoLimb = 28,
    /// Shading normals of mirrors and glass are not bent.
    UnbentNormals = 29,
    /// Lights are chosen by what they may contribute alone.
    NoEvenShare = 30,
    /// Emitters stay in the plane of what they are fixed to (on the host).
    FlushEmitters = 31,
    /// Light that microfacets scatter more than once is left out.
    SingleScattering = 32,
    /// The diffuse base is lit as if the dielectric above it reflected nothing of what leaves.
    UncoupledBase = 33,
    /// The density of reflections is that of visible normals without their bound.
    UnboundedNormals = 34,
    /// Colours of textures are taken for linear.
    UndecodedColors = 35,
    /// Normals from textures have their green turned over.
    SwappedBitangent = 36,
    /// Alpha is compared with one half where it is a part of the rays.
    ThresholdAlpha = 37,
    /// Spots fall off linearly.
    LinearSpot = 40,
    /// Lights have no range.
    NoRange = 41,
    /// Environment maps are turned the other way round where rays meet them.
    TurnedEnvironment = 42,
    /// The density of environment sampling leaves out that cells near the poles are smaller.
    FlatEnvironment = 43,
    /// Rays leave the lens more often near its middle.
    CentredLens = 38,
    /// Parallel rays are as close as if the image were 2 % narrower.
    NarrowView = 39,
    /// Ray queries get boxes that are not widened (on the host).
    QueriedThinBoxes = 44,
    /// Ray queries get boxes that are widened by 10⁻⁷ wherever they are (on the host).
    QueriedEpsilonBoxes = 45,
    /// The box of the last leaf is not handed to ray queries (on the host).
    QueriedLostLeaf = 46,
    /// The distance of a hit is the one that a ray query has committed.
    QueriedDistance = 47,
    /// Of equal distances the one that a ray query proposes first wins.
    QueriedTies = 48,
    /// Ray queries with a mask that no instance has.
    QueriedMask = 49,
    /// Textures of specular strength weaken reflection where light grazes alone.
    FullNormalIncidence = 60,
    /// Coats take nothing from what the base sends out.
    ClearWayOut = 61,
    /// Normals of coats are those of the base.
    CoatOfBase = 62,
    /// Sheen takes nothing from what is below it towards the light.
    ClearSheen = 63,
    /// The density of refracted directions lacks η².
    UnsquaredRefraction = 50,
    /// Of a thin wall only one side reflects.
    SingleWall = 51,
    /// What bodies absorb is left out of shadow rays.
    ClearShadows = 52,
    /// Anisotropy is turned the other way.
    TurnedAnisotropy = 64,
    /// Conductors reflect light of either polarisation alike.
    PolarisedConductor = 65,
}

impl Mutation {
    /// All of them.
    pub const ALL: [Self; 58] = [
        Self::Albedo,
        Self::Cosine,
        Self::SwappedIor,
        Self::FixedTmin,
        Self::TruncatedSampler,
        Self::ContractedEdges,
        Self::NoOffset,
        Self::NoSkip,
        Self::NoBoxMargin,
        Self::TextbookSphere,
        Self::PlainSum,
        Self::UnguardedRays,
        Self::NonFiniteSamples,
        Self::ThinBoxes,
        Self::TwoFloatSum,
        Self::BuiltInSinCos,
        Self::BuiltInLog,
        Self::PlainFresnel,
        Self::HitAlongRay,
        Self::NoProjection,
        Self::InfiniteInverse,
        Self::BlindReuse,
        Self::NoDoubt,
        Self::NoMargins,
        Self::OwnSampleMap,
        Self::InvertedGradients,
        Self::DoubleLightTracing,
        Self::NoLimb,
        Self::UnbentNormals,
        Self::NoEvenShare,
        Self::FlushEmitters,
        Self::SingleScattering,
        Self::UncoupledBase,
        Self::UnboundedNormals,
        Self::UndecodedColors,
        Self::SwappedBitangent,
        Self::ThresholdAlpha,
        Self::LinearSpot,
        Self::NoRange,
        Self::TurnedEnvironment,
        Self::FlatEnvironment,
        Self::CentredLens,
        Self::NarrowView,
        Self::QueriedThinBoxes,
        Self::QueriedEpsilonBoxes,
        Self::QueriedLostLeaf,
        Self::QueriedDistance,
        Self::QueriedTies,
        Self::QueriedMask,
        Self::FullNormalIncidence,
        Self::ClearWayOut,
        Self::CoatOfBase,
        Self::ClearSheen,
        Self::UnsquaredRefraction,
        Self::SingleWall,
        Self::ClearShadows,
        Self::TurnedAnisotropy,
        Self::PolarisedConductor,
    ];

    /// What is broken, in words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Albedo => "reflectances × 1.01",
            Self::Cosine => "direct light without its cosine",
            Self::SwappedIor => "index of refraction inverted",
            Self::FixedTmin => "fixed tmin of 1e-3 instead of primitive skip",
            Self::TruncatedSampler => "sampler truncated to a few values",
            Self::ContractedEdges => "edge functions contracted to FMA",
            Self::NoOffset => "no error-bounded offset of ray origins",
            Self::NoSkip => "primitive that a ray leaves not skipped",
            Self::NoBoxMargin => "boxes not widened by errors relative to the origin of the ray",
            Self::TextbookSphere => "textbook quadratic for spheres",
            Self::PlainSum => "film summed in plain single precision",
            Self::UnguardedRays => "rays that are not finite enter the BVH",
            Self::NonFiniteSamples => "NaN and infinite samples added to the film",
            Self::ThinBoxes => "boxes not widened by errors relative to their own place",
            Self::TwoFloatSum => "film summed in two floats instead of three",
            Self::BuiltInSinCos => "sine and cosine as inaccurate as Vulkan allows",
            Self::BuiltInLog => "logarithm as inaccurate as Vulkan allows",
            Self::PlainFresnel => "Fresnel's equations in plain single precision, without their limits",
            Self::HitAlongRay => "hit points on triangles as o + t·d instead of from barycentrics",
            Self::NoProjection => "hit points on polygons not brought back onto the plane",
            Self::InfiniteInverse => "reciprocals of directions not kept finite",
            Self::BlindReuse => "light reused without regard to visibility",
            Self::NoDoubt => "polygons not tested exactly where rounding may decide",
            Self::NoMargins => "boxes not widened at all",
            Self::OwnSampleMap => "numbers of samples decided by the image's own first ones",
            Self::InvertedGradients => "differences from the pixels below with the wrong sign",
            Self::DoubleLightTracing => "all light of caustics counted for light paths, a part of it for paths too",
            Self::NoLimb => "spherical emitters shadow themselves towards the limb",
            Self::UnbentNormals => "shading normals of mirrors and glass not bent",
            Self::NoEvenShare => "lights chosen by what they may contribute alone",
            Self::FlushEmitters => "emitters not moved off the plane of what they are fixed to",
            Self::SingleScattering => "microfacets scatter light once only",
            Self::UncoupledBase => "diffuse base not darkened by the dielectric above it towards the light",
            Self::UnboundedNormals => "density of reflections without the bound on visible normals",
            Self::UndecodedColors => "colours of textures taken for linear",
            Self::SwappedBitangent => "normals of textures with their green turned over",
            Self::ThresholdAlpha => "alpha compared with one half instead of at random",
            Self::LinearSpot => "spots fall off linearly",
            Self::NoRange => "lights have no range",
            Self::TurnedEnvironment => "environment maps turned the other way round where rays meet them",
            Self::FlatEnvironment => "density of environment sampling as if all cells were alike",
            Self::CentredLens => "rays leave the lens more often near its middle",
            Self::NarrowView => "an orthographic view that is 2 % narrower",
            Self::QueriedThinBoxes => "boxes of ray queries not widened",
            Self::QueriedEpsilonBoxes => "boxes of ray queries widened by a fixed 1e-7",
            Self::QueriedLostLeaf => "a leaf that ray queries do not have",
            Self::QueriedDistance => "distances as a ray query has committed them",
            Self::QueriedTies => "of equal distances, what a ray query proposes first",
            Self::QueriedMask => "ray queries with a mask that no instance has",
            Self::FullNormalIncidence => "reflection of dielectrics weakened by textures where light grazes alone",
            Self::ClearWayOut => "coats take nothing from what the base sends out",
            Self::CoatOfBase => "coats with the normals of the base",
            Self::TurnedAnisotropy => "anisotropy turned the other way",
            Self::PolarisedConductor => "conductors reflect light of either polarisation alike",
            Self::ClearSheen => "sheen takes nothing from what is below it towards the light",
            Self::UnsquaredRefraction => "density of refracted directions without the square of the index",
            Self::SingleWall => "thin walls reflect on one side only",
            Self::ClearShadows => "light that bodies absorb left out of shadow rays",
        }
    }
}
