#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
// Path tracing by path regeneration: an invocation owns a pixel, and as soon as a path ends the next sample of the
// pixel begins in its place, so that the lanes of a subgroup stay busy although paths differ in length.

#include "lib/path.glsl"
#include "lib/film.glsl"

layout(local_size_x_id = 0, local_size_y = 1, local_size_z = 1) in;

#include "lib/pixel_order.glsl"
#include "lib/trace.glsl"

void main() {
    uint slot = first_slot + group_of_work() * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    uvec2 at;
    if (slot >= end_slot || !pixel_of_slot(slot, at)) return;
    FilmPixel film_pixel = film_load(slot);
    uint first = film_pixel.count;
    uint end = min(target_samples, first + max_new_samples);
    if (first >= end) return;

    uint key = pixel_key(pixel_number(at));
    Camera camera = frame_camera();
    Path path = path_begin(camera, at, key, first);
    vec3 radiance = vec3(0.0);
    uint bad = 0u;
    uint rays = 0u;
    uint shadow_rays = 0u;
    uint loops = 0u;
    bool within_budget = true;
    while (film_pixel.count < end && within_budget) {
        float t;
        int id = closest_hit(path.origin, path.direction, path.leaving, t, loops);
        Arrival arrival;
        ShadowRay shadow;
        bool alive = path_arrive(path, id, t, key, radiance, arrival, shadow);
        rays += 1u;
        if (HAS_DIFFUSE && LIGHT_COUNT + EMITTER_COUNT > 0u) {
            shadow_rays += shadow.wanted ? 1u : 0u;
            bool hidden = true;
            bool walks = shadow.wanted && shadow_needs_tree(shadow, hidden);
            if (HAS_TREE) {
                uint steps = 0u;
                if (walks) hidden = hidden_by_tree(shadow, loops, steps);
                count_loops(steps, loops);
            }
            radiance += hidden ? vec3(0.0) : shadow.radiance;
        }
        loops += 1u + LIGHT_LOOPS;
        // Out of budget: a walk may have ended too early, so that the sample in hand does not count. What the film
        // holds is complete; the next dispatch begins with that sample again.
        within_budget = LOOP_BUDGET == 0u || loops + doubtful_loops < LOOP_BUDGET;
        if (!alive && within_budget) {
            bad += film_add(film_pixel, radiance) ? 0u : 1u;
            radiance = vec3(0.0);
        }
        path_depart(path, arrival, alive, camera, at, key, path.index + (alive ? 0u : 1u));
    }
    film_store(slot, film_pixel);
    atomicAdd(counters[COUNT_SAMPLES], film_pixel.count - first);
    atomicAdd(counters[COUNT_RAYS], rays);
    atomicAdd(counters[COUNT_SHADOW], shadow_rays);
    if (PATH_STATS) atomicAdd(counters[COUNT_STEPS], walked_steps);
    if (bad > 0u) atomicAdd(counters[COUNT_BAD], bad);
    if (film_pixel.count < end && within_budget) atomicAdd(counters[COUNT_TRUNCATED], 1u);
}
