#version 460
#extension GL_GOOGLE_include_directive : require
// The functions that sample and weigh, one at a time over arrays of arguments. Two words in, two words out;
// check/probe/functions.rs names them.

#include "io.glsl"
#include "../lib/math.glsl"
#include "../lib/sampler.glsl"
#include "../lib/camera.glsl"
#include "../lib/bsdf/diffuse.glsl"
#include "../lib/bsdf/mirror.glsl"
#include "../lib/bsdf/dielectric.glsl"
#include "../lib/bsdf/glass.glsl"
#include "../lib/bsdf/metallic_roughness.glsl"

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
const uint PROBE_GLASS = 12u;
const uint PROBE_EXP = 13u;

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
        Bsdf glass = Bsdf(BSDF_DIELECTRIC, vec3(1.0), MUTATION == MUTATE_IOR ? 1.0 / a.w : a.w, NO_LOBES, NO_GLASS);
        BsdfSample s = dielectric_sample(glass, b.xyz, -a.xyz, b.ww);
        x = vec4(s.direction, s.crosses ? 1.0 : 0.0);
    }
    if (PROBE == PROBE_LOBES) {
        vec3 wo = vec3(sqrt(1.0 - a.w * a.w), 0.0, a.w);
        Lobes lobes = lobes_of(vec3(a.z), a.x, a.y, vec3(0.04), 1.0, wo.z);
        vec3 value;
        float pdf;
        lobes_eval(lobes, wo, b.xyz, value, pdf);
        x = vec4(value, pdf);
    }
    if (PROBE == PROBE_GLASS) {
        float mu = abs(b.w);
        vec3 wo = vec3(sqrt(1.0 - mu * mu), 0.0, mu);
        Bsdf glass = Bsdf(b.w < 0.0 ? BSDF_WALL : BSDF_GLASS, vec3(a.z), a.x, NO_LOBES, NO_GLASS);
        float root = (a.x - 1.0) / (a.x + 1.0);
        set_glass(glass, vec3(a.w * root * root), a.w, a.y, mu);
        vec3 value;
        float pdf;
        glass_both(glass, wo, b.xyz, value, pdf);
        x = vec4(value, pdf);
    }
    if (PROBE == PROBE_EXP) x.x = exp_accurate(a.x);
    if (PROBE == PROBE_SAMPLE_PAIR) x.xy = sample_pair(pixel_key(bits.x), bits.y, bits.z, bits.w);
    output_floats(2u * i, x);
    output_floats(2u * i + 1u, y);
}
