#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_EXT_control_flow_attributes : require
// Adds synthetic samples to the film, as many as one likes: sample k of slot s is unit_float(hash(k + 2654435761·s)).
// PROBE 1: after a first sample that is so bright that the others are below the last bit of the sum.

#include "io.glsl"
#include "../lib/sampler.glsl"
#include "../lib/film.glsl"

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= end_slot) return;
    FilmPixel p = film_load(slot);
    if (PROBE == 1u && p.count == 0u) film_add(p, vec3(1e8));
    for (uint k = 0u; k < max_new_samples; ++k) {
        float x = unit_float(hash(p.count + slot * 2654435761u));
        film_add(p, vec3(x, 1e-3 * x, 0.1));
    }
    film_store(slot, p);
    output_floats(slot, vec4(0.0));
}
