// Rays aimed at glass and mirrors. Where paths serve several pixels (reuse.glsl), light that a first diffuse hit x gets straight
// from glass or a mirror stays with its pixel, and is most of the noise that is left: few random directions meet such a body. So
// after its path each sample has another one, whose first ray goes from x towards the spheres around these bodies, the targets.
//
// Directions from x are in two parts. Glass and mirrors that are met within the cones of targets are for the aimed path alone, and the
// other one ends there; what is diffuse, and all beyond the cones, is for that.
//
// It is done where images are made from gradients (gradient.glsl). All members of a group take the same random numbers for their aimed
// paths: what their pixels get by them errs alike, and differences between neighbours are known well.

#ifndef AIM_GLSL
#define AIM_GLSL

#include "cone.glsl"
#include "unroll.glsl"
#include "layout.glsl"
#include "math.glsl"

// Where a ray is aimed from: a path's first diffuse hit.
struct AimFrom {
    vec3 x;
    int leaving;        // id of the primitive the ray starts on
    vec3 normal;        // shading normal
    vec3 up;            // with SMOOTH_NORMALS: geometric normal
    vec3 beta;          // throughput
    uint hits;          // number of the hit
};

AimFrom aim_nowhere() { return AimFrom(vec3(0.0), -1, vec3(0.0), vec3(0.0), vec3(0.0), 0u); }

// How often a target is chosen, not normalized; 0: it is below the horizon, or x within it. `depth` is that of its cone.
float aim_weight(vec4 target, vec3 x, vec3 normal, out float depth) {
    vec3 to = target.xyz - x;
    float d2 = dot(to, to);
    float sin2 = target.w * target.w / d2;
    float above = dot(normal, to) + target.w;
    depth = cone_depth(lower(sin2, 1.0));
    return sin2 < 1.0 && above > 0.0 ? depth * above * inversesqrt(d2) : 0.0;
}

// Whether rays are aimed in a direction from x.
bool is_aimed_at(vec3 x, vec3 normal, vec3 direction) {
    bool aimed = false;
    float depth;
#define LOOK_AT_TARGET(n)                                                                     \
    aimed = aimed || (in_cone(aim_targets[n].xyz - x, aim_targets[n].w, direction) &&         \
                      aim_weight(aim_targets[n], x, normal, depth) > 0.0);
    FOR_0_TO_7(AIM_TARGETS, LOOK_AT_TARGET)
#undef LOOK_AT_TARGET
    return aimed;
}

// An aimed direction, and what light from there counts: the cosine over π and over the density, which is that of all targets in
// whose cone it is. 0: there is nothing to aim at from here.
vec3 aim_sample(AimFrom from, vec2 u, out float weight) {
    vec4 target = aim_targets[0];
    float all = 0.0;
    float densities[8];     // of each target, times how often it is chosen
    float depth, part, chance;
    bool taken;
    // One of them in proportion to its weight, by one number: whether the next one takes the place of that before (Chao 1982).
#define CHOOSE_TARGET(n)                                                                      \
    part = aim_weight(aim_targets[n], from.x, from.normal, depth);                            \
    all += part;                                                                              \
    densities[n] = part > 0.0 ? part / (TWO_PI * depth) : 0.0;                                \
    if (AIM_TARGETS > 1u) {                                                                   \
        chance = part > 0.0 ? part / all : 0.0;                                               \
        taken = u.x < chance;                                                                 \
        target = taken ? aim_targets[n] : target;                                             \
        u.x = taken ? u.x / chance : (u.x - chance) / upper(1.0 - chance, 1e-6);              \
    }
    FOR_0_TO_7(AIM_TARGETS, CHOOSE_TARGET)
#undef CHOOSE_TARGET
    vec3 direction = cone_sample(target.xyz - from.x, target.w, u);
    float within = 0.0;
#define ADD_DENSITY(n) \
    within += in_cone(aim_targets[n].xyz - from.x, aim_targets[n].w, direction) ? densities[n] : 0.0;
    FOR_0_TO_7(AIM_TARGETS, ADD_DENSITY)
#undef ADD_DENSITY
    weight = within > 0.0 ? upper(dot(from.normal, direction), 0.0) * all / (PI * within) : 0.0;
    if (SMOOTH_NORMALS && dot(from.up, direction) <= 0.0) weight = 0.0;
    return direction;
}

#endif
