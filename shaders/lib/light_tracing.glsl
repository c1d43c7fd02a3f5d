// Light traced from emitters (Arvo, "Backward ray tracing", 1986; Veach 1997, section 8.3.2): light paths leave an emitter towards bodies
// of glass and mirrors, follow the light through them, and go on from each diffuse surface in a random direction, as paths do.
// Of every diffuse surface that they meet they add what the camera sees of it. A path from the camera finds the light of
// such caustics only if a random direction leads it to the emitter, as a bright dot.
//
// The two share the light of each chain
//
//     camera – diffuse surface x – any surfaces – mirror or glass – emitter at y
//
// by the balance heuristic. Per unit of what both measure, a path samples the chain with the density
// p(x) · cosθx/π · … and a light path with p(y) p(ω) · …; what stands for the dots, distances, cosines, and directions at surfaces
// of any kind, is the same for both, so that the ratio of light paths to paths is
//
//     r = (light paths/samples) π p(y) p(ω) / (p(x) cosθy),
//
// ω the direction in which the light leaves y. p(x) is about 1/(|x|² A), A the area of a pixel at distance 1 (without the
// cosines of the camera ray, which both leave out: any weights will do that both compute alike). light_path_scale is all of this that
// is constant. For the same reason roulette needs no place in it.
//
// Bodies of mirror and glass are in spheres, the targets. A light path chooses an emitter together with a target, then a point y on the
// emitter, and a direction towards the target's sphere; from within the sphere, one by the cosine.
//
// light_texels from CASTER_TEXELS on: targets of a texel (centre, radius); then for each emitter (from the first on, point
// lights left out) and each target a texel: threshold, alias, probability, unused (Walker 1977; src/render/light/alias.rs), as many as
// the next power of two.

#ifndef LIGHT_TRACING_GLSL
#define LIGHT_TRACING_GLSL

#include "cone.glsl"
#include "loops.glsl"
#include "light/choice.glsl"
#include "bsdf/diffuse.glsl"

const bool LIGHT_TRACING = CASTER_COUNT > 0u;
// Loop iterations at each hit: for choosing lights, and the one in which the loop over targets ends. Those of its others are
// counted where a lane goes through it.
const uint HIT_LOOPS = LIGHT_LOOPS + (LIGHT_TRACING ? 1u : 0u);

// Surface hits of the longest chains that light paths follow, and diffuse ones after the first of them.
const uint LIGHT_PATH_HITS = 17u;
const uint MAX_SPLATS = LIGHT_PATH_HITS - 1u;

// First of the lights that are emitters.
const uint FIRST_EMITTER = LIGHT_COUNT - EMITTER_COUNT;

vec4 caster_bounds(uint target) { return light_texel(int(CASTER_TEXELS + target)); }

// An emitter and a target.
int caster_pair(int light, uint target) {
    return int(CASTER_TEXELS + CASTER_COUNT + (uint(light) - FIRST_EMITTER) * CASTER_COUNT + target);
}

// A direction from y towards a target, or by the cosine from within it.
vec3 caster_direction(vec4 target, vec3 y, vec3 normal, vec2 u) {
    vec3 to = target.xyz - y;
    if (!(target.w * target.w / dot(to, to) < 1.0)) return cosine_sample(normal, u);
    return cone_sample(to, target.w, u);
}

// Density per solid angle with which caster_direction gives a direction under the cosine `cos_light`.
float caster_direction_pdf(vec4 target, vec3 y, vec3 direction, float cos_light) {
    vec3 to = target.xyz - y;
    float sin2 = target.w * target.w / dot(to, to);
    if (!(sin2 < 1.0)) return cos_light * (1.0 / PI);
    return in_cone(to, target.w, direction) ? 1.0 / (TWO_PI * cone_depth(sin2)) : 0.0;
}

// Density of light paths with that direction, over all targets, times the probability of choosing the emitter; cos_light > 0.
float light_path_pdf(int light, vec3 y, vec3 direction, float cos_light) {
    float sum = 0.0;
    for (uint target = 0u; target < CASTER_COUNT; ++target) {
        float probability = light_texel(caster_pair(light, target)).z;
        sum += probability * caster_direction_pdf(caster_bounds(target), y, direction, cos_light);
    }
    return sum;
}

// Area of an emitter.
float emitter_area(int light) {
    Light l = light_of(light);
    return is_flat(l) ? l.size : 4.0 * PI * l.size * l.size;
}

// Light paths over paths for the chain whose light leaves an emitter in `direction` and ends at x, |x|² = x2.
float light_path_ratio(int light, vec3 y, vec3 direction, float cos_light, float x2) {
    return light_path_scale * x2 * light_path_pdf(light, y, direction, cos_light) / (emitter_area(light) * cos_light);
}

#endif
