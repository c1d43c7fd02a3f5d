#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
// The functions that sample and weigh, one at a time over arrays of arguments. Two words in, two words out;
// check/probe/functions.rs names them.

#include "io.glsl"
#include "../lib/math.glsl"
#include "../lib/sampler.glsl"
#include "../lib/camera.glsl"
#include "../lib/bsdf/diffuse.glsl"
#include "../lib/bsdf/mirror.glsl"
#include "../lib/bsdf/dielectric.glsl"
#include "../lib/bsdf/layered.glsl"
#include "../lib/bsdf/glass.glsl"

const uint PROBE_TWO_SUM = 0u;
const uint PROBE_TWO_PRODUCT = 1u;
const uint PROBE_COS_SIN = 2u;
const uint PROBE_LOG = 3u;
const uint PROBE_BASIS = 4u;
const uint PROBE_FILTER = 5u;
const uint PROBE_DIFFUSE = 6u;
const uint PROBE_FRESNEL = 7u;
const uint PROBE_DIELECTRIC = 8u;
const uint PROBE_SAMPLE_PAIR = 9u;
const uint PROBE_ATAN = 10u;
const uint PROBE_LOBES = 11u;
const uint PROBE_LAYERS = 12u;
const uint PROBE_LAYER_SAMPLE = 13u;
const uint PROBE_CONDUCTOR = 16u;

// A number in [0, 1] from six bits.
float sixth(uint bits, uint n) { return float((bits >> (6u * n)) & 63u) * (1.0 / 63.0); }

// Of metalness, roughness, a base colour and the cosine of wo, and by six bits each: strength and roughness of the coat, strength
// and roughness of sheen, anisotropy along the x axis.
Bsdf layered_bsdf(vec4 a, uint layers, vec3 wo) {
    Bsdf b = diffuse_bsdf(vec3(a.z));
    b.type = BSDF_METALLIC_ROUGHNESS;
    b.lobes = lobes_of(vec3(a.z), a.x, a.y, vec3(0.04), 1.0, sixth(layers, 4u), wo);
    b.tangent = vec3(1.0, 0.0, 0.0);
    if (HAS_SHEEN) b.sheen = sheen_of(vec3(sixth(layers, 2u)), sixth(layers, 3u), wo.z);
    if (HAS_COAT && sixth(layers, 0u) > 0.0) b.coat = coat_of(sixth(layers, 0u), sixth(layers, 1u), vec3(0.0, 0.0, 1.0), wo);
    if (HAS_COVER) cover(b);
    return b;
}
const uint PROBE_GLASS = 14u;
const uint PROBE_EXP = 15u;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= end_slot) return;
    uvec4 bits = probe_in[2u * i];
    vec4 a = input_floats(2u * i);
    vec4 b = input_floats(2u * i + 1u);
    vec4 x = vec4(0.0);
    vec4 y = vec4(0.0);
    if (PROBE == PROBE_TWO_SUM) two_sum(a.x, a.y, x.x, x.y);
    if (PROBE == PROBE_TWO_PRODUCT) two_product(a.x, a.y, x.x, x.y);
    if (PROBE == PROBE_COS_SIN) x.xy = cos_sin_2pi(a.x);
    if (PROBE == PROBE_LOG) x.x = log_accurate(a.x);
    if (PROBE == PROBE_ATAN) x.x = atan_accurate(a.x);
    if (PROBE == PROBE_BASIS) {
        vec3 tangent, bitangent;
        basis(a.xyz, tangent, bitangent);
        x.xyz = tangent;
        y.xyz = bitangent;
    }
    if (PROBE == PROBE_FILTER) x.xy = filter_offset(a.xy);
    if (PROBE == PROBE_DIFFUSE) x.xyz = cosine_sample(a.xyz, b.xy);
    if (PROBE == PROBE_FRESNEL) x.x = fresnel(a.x, a.y, x.y);
    if (PROBE == PROBE_DIELECTRIC) {
        Bsdf glass = bsdf_of_type(BSDF_DIELECTRIC, vec3(1.0), MUTATION == MUTATE_IOR ? 1.0 / a.w : a.w);
        BsdfSample s = dielectric_sample(glass, b.xyz, -a.xyz, b.ww);
        x = vec4(s.direction, s.crosses ? 1.0 : 0.0);
    }
    if (PROBE == PROBE_LOBES) {
        vec3 wo = vec3(sqrt(1.0 - a.w * a.w), 0.0, a.w);
        Lobes lobes = lobes_of(vec3(a.z), a.x, a.y, vec3(0.04), 1.0, 0.0, wo);
        BsdfValue v = lobes_eval(lobes, NO_COVER, wo, b.xyz);
        x = vec4(v.value, v.pdf);
    }
    if (PROBE == PROBE_LAYERS || PROBE == PROBE_LAYER_SAMPLE) {
        vec3 wo = vec3(sqrt(1.0 - a.w * a.w), 0.0, a.w);
        Bsdf layered = layered_bsdf(a, probe_in[2u * i + 1u].w, wo);
        if (PROBE == PROBE_LAYERS) {
            BsdfValue v = metallic_roughness_eval(layered, vec3(0.0, 0.0, 1.0), wo, b.xyz);
            x = vec4(v.value, v.pdf);
        }
        if (PROBE == PROBE_LAYER_SAMPLE) {
            BsdfSample s = metallic_roughness_sample(layered, vec3(0.0, 0.0, 1.0), wo, b.xy);
            x = vec4(s.direction, s.pdf);
            y.xyz = s.weight;
        }
    }
    if (PROBE == PROBE_GLASS) {
        float mu = abs(b.w);
        vec3 wo = vec3(sqrt(1.0 - mu * mu), 0.0, mu);
        Bsdf glass = bsdf_of_type(b.w < 0.0 ? BSDF_WALL : BSDF_GLASS, vec3(a.z), a.x);
        float root = (a.x - 1.0) / (a.x + 1.0);
        set_glass(glass, vec3(a.w * root * root), a.w, a.y, mu);
        BsdfValue v = glass_value(glass, wo, b.xyz);
        x = vec4(v.value, v.pdf);
    }
    if (PROBE == PROBE_EXP) x.x = exp_accurate(a.x);
    if (PROBE == PROBE_CONDUCTOR) x.x = conductor_fresnel(a.x, a.y, a.z);
    if (PROBE == PROBE_SAMPLE_PAIR) x.xy = sample_pair(pixel_key(bits.x), bits.y, bits.z, bits.w);
    output_floats(2u * i, x);
    output_floats(2u * i + 1u, y);
}
