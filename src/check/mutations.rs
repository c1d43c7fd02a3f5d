//! Which cases notice which deliberate error.

use crate::render::Mutation;

/// Cases of which each must fail under the mutation.
pub fn held_by(mutation: Mutation) -> &'static [&'static str] {
    match mutation {
        Mutation::Albedo => &["energy/sphere-centre", "energy/sphere-1000-bounces", "energy/convex-body"],
        Mutation::Cosine => &["light/closed-form"],
        Mutation::SwappedIor => &["glass/slab-shift", "glass/total-reflection"],
        Mutation::FixedTmin => &["triangles/close-corner"],
        Mutation::TruncatedSampler => &["sampling/stratified"],
        Mutation::ContractedEdges => &["triangles/edges"],
        Mutation::NoOffset => &["triangles/spawn-flat"],
        Mutation::NoSkip => &["spheres/self-hit"],
        Mutation::NoBoxMargin => &["bvh/brute-force"],
        Mutation::TextbookSphere => &["spheres/walls", "spheres/far-small"],
        Mutation::PlainSum => &["film/long-sum"],
        Mutation::UnguardedRays => &["bvh/non-finite-steps"],
        Mutation::NonFiniteSamples => &["scale/overflow"],
        Mutation::ThinBoxes => &["bvh/brute-force"],
        Mutation::TwoFloatSum => &["film/after-firefly"],
        Mutation::BuiltInSinCos => &["sampling/cos-sin"],
        Mutation::BuiltInLog => &["sampling/log"],
        Mutation::PlainFresnel => &["glass/fresnel"],
        Mutation::HitAlongRay => &["triangles/hit-points"],
        Mutation::NoProjection => &["triangles/polygon-points"],
        Mutation::InfiniteInverse => &["bvh/axis-aligned"],
        Mutation::BlindReuse => &["reuse/paths", "reuse/lanes"],
        Mutation::NoDoubt => &["triangles/quick-polygons"],
        Mutation::NoMargins => &["bvh/axis-aligned", "bvh/brute-force"],
        Mutation::InvertedGradients => &["gradients/paths", "gradients/lanes"],
        Mutation::DoubleLightTracing => &["oracle/caustics", "oracle/caustics-within"],
        Mutation::UncorrectedAdjoint => &["light-tracing/tilted-normals"],
        Mutation::NoLimb => &["emitters/limb"],
        Mutation::UnbentNormals => &["energy/low-poly"],
        Mutation::NoEvenShare => &["lights/hidden"],
        Mutation::CentredLens => &["camera/circle-of-confusion"],
        Mutation::NarrowView => &["camera/orthographic-silhouette"],
        Mutation::FlushEmitters => &["emitters/flush"],
        Mutation::SingleScattering => &["materials/furnace", "glass/rough-furnace"],
        Mutation::UncoupledBase => &["materials/furnace", "materials/reciprocity"],
        Mutation::UnboundedNormals => &["materials/furnace"],
        Mutation::UndecodedColors => &["materials/textures"],
        Mutation::SwappedBitangent => &["materials/textures"],
        Mutation::ThresholdAlpha => &["materials/coverage"],
        Mutation::LinearSpot | Mutation::NoRange => &["materials/spots"],
        Mutation::TurnedEnvironment | Mutation::FlatEnvironment => &["environment/oracle", "environment/hot-texel"],
        Mutation::QueriedThinBoxes
        | Mutation::QueriedEpsilonBoxes
        | Mutation::QueriedLostLeaf
        | Mutation::QueriedDistance
        | Mutation::QueriedTies => &["query/closest"],
        Mutation::QueriedMask => &["query/closest", "query/image"],
        Mutation::QueriedSelf => &["query/triangles-left"],
        Mutation::FullNormalIncidence => &["materials/specular-textures"],
        Mutation::ClearWayOut => &["materials/layer-formula", "materials/layer-reciprocity", "materials/layer-furnace"],
        Mutation::CoatOfBase => &["materials/layer-frames"],
        Mutation::ClearSheen => &["materials/layer-formula", "materials/layer-reciprocity"],
        Mutation::UnsquaredRefraction => &["glass/rough-furnace"],
        Mutation::SingleWall => &["glass/wall"],
        Mutation::ClearShadows => &["glass/amber"],
        Mutation::TurnedAnisotropy => &["materials/layer-frames"],
        Mutation::PolarisedConductor => &["materials/conductor-fresnel"],
        Mutation::UnweightedParts => &["reuse/parts-lanes"],
        Mutation::OwnSampleMap => &["emitters/edges-of-glass"],
    }
}
