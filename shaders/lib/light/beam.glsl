// Light traced from lamps (Arvo, "Backward ray tracing", 1986; Veach 1997, section 8.3.2): beams leave a lamp towards bodies
// of glass and mirrors, follow the light through them, and go on from each diffuse surface in a random direction, as paths do.
// Of every diffuse surface that they meet they add what the camera sees of it. A path from the camera finds the light of
// such caustics only if a random direction leads it to the lamp, as a bright dot.
//
// The two share the light of each chain
//
//     camera – diffuse surface x – any surfaces – mirror or glass – lamp at y
//
// by the balance heuristic. Per unit of what both measure, a path samples the chain with the density
// p(x) · cosθx/π · … and a beam with p(y) p(ω) · …; what stands for the dots, distances, cosines, and directions at surfaces
// of any kind, is the same for both, so that the ratio of beams to paths is
//
//     r = (beams/samples) π p(y) p(ω) / (p(x) cosθy),
//
// ω the direction in which the light leaves y. p(x) is about 1/(|x|² A), A the area of a pixel at distance 1 (without the
// cosines of the camera ray, which both leave out: any weights will do that both reckon alike). beam_scale is all of this that
// is constant. For the same reason roulette needs no place in it.
//
// Bodies of mirror and glass are in spheres, the targets. A beam chooses a lamp together with a target, then a point y on the
// lamp, and a direction towards the target's sphere; from within the sphere, one by the cosine.
//
// light_texels from BEAM_TEXELS on: targets of a texel (centre, radius); then for each emitter (from the first on, point
// lights left out) and each target a texel: threshold, alias, probability, unused (Walker 1977; src/render/alias.rs), as many as
// the next power of two.

#ifndef BEAM_GLSL
#define BEAM_GLSL

#include "../cone.glsl"
#include "../loops.glsl"
#include "choice.glsl"
#include "../bsdf/diffuse.glsl"

layout(constant_id = 214) const uint BEAM_TARGETS = 0u;     // 0: no beams
layout(constant_id = 215) const uint BEAM_TEXELS = 0u;

const bool HAS_BEAMS = BEAM_TARGETS > 0u;
// Loop iterations at each hit: for choosing lights, and the one in which the loop over targets ends. Those of its others are
// counted where a lane goes through it.
const uint HIT_LOOPS = LIGHT_LOOPS + (HAS_BEAMS ? 1u : 0u);

// Surface hits of the longest chains that beams follow, and diffuse ones after the first of them.
const uint BEAM_HITS = 17u;
const uint BEAM_NOTES = BEAM_HITS - 1u;

// First of the lights that are emitters.
const uint FIRST_EMITTER = LIGHT_COUNT - EMITTER_COUNT;

vec4 beam_target(uint target) { return light_texel(int(BEAM_TEXELS + target)); }

// A lamp and a target.
int beam_pair(int light, uint target) {
    return int(BEAM_TEXELS + BEAM_TARGETS + (uint(light) - FIRST_EMITTER) * BEAM_TARGETS + target);
}

// A direction from y towards a target, or by the cosine from within it.
vec3 beam_direction(vec4 target, vec3 y, vec3 normal, vec2 u) {
    vec3 to = target.xyz - y;
    if (!(target.w * target.w / dot(to, to) < 1.0)) return cosine_sample(normal, u);
    return cone_sample(to, target.w, u);
}

// Density per solid angle with which beam_direction gives a direction under the cosine `cos_light`.
float beam_direction_pdf(vec4 target, vec3 y, vec3 direction, float cos_light) {
    vec3 to = target.xyz - y;
    float sin2 = target.w * target.w / dot(to, to);
    if (!(sin2 < 1.0)) return cos_light * (1.0 / PI);
    return in_cone(to, target.w, direction) ? 1.0 / (TWO_PI * cone_depth(sin2)) : 0.0;
}

// Density of beams with that direction, over all targets, times the probability of choosing the lamp; cos_light > 0.
float beam_pdf(int light, vec3 y, vec3 direction, float cos_light) {
    float sum = 0.0;
    for (uint target = 0u; target < BEAM_TARGETS; ++target) {
        float probability = light_texel(beam_pair(light, target)).z;
        sum += probability * beam_direction_pdf(beam_target(target), y, direction, cos_light);
    }
    return sum;
}

// Area of an emitter.
float emitter_area(int light) {
    Light l = light_of(light);
    return is_flat(l) ? l.size : 4.0 * PI * l.size * l.size;
}

// Beams over paths for the chain whose light leaves a lamp in `direction` and ends at x, |x|² = x2.
float beams_per_path(int light, vec3 y, vec3 direction, float cos_light, float x2) {
    return beam_scale * x2 * beam_pdf(light, y, direction, cos_light) / (emitter_area(light) * cos_light);
}

#endif
