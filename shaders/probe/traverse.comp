#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Rays and nothing else, to measure how many a second can be traced: the traversal of the path tracer. A workgroup is one
// subgroup, which owns a run of rays; when enough lanes are done they fetch the next ones. path_queue.comp does without
// that counting: there each lane has rays of its own to go on with.
// Records: check/probe/traversal.rs. A ray query has no steps to deal out: there each lane has rays of its own.

#include "io.glsl"
#include "../lib/path.glsl"
#include "../lib/intersect/bvh/bvh.glsl"
#include "../lib/scene.glsl"
#include "../lib/votes.glsl"

layout(constant_id = 241) const uint RUN = 512u;    // rays of a workgroup

// Not a constant: the path tracer's loop has rays of both kinds.
bool any_hit = max_new_samples != 0u;

Ray ray_of_input(uint i, out float t) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    t = o.w;
    return Ray(o.xyz, d.xyz, floatBitsToInt(d.w));
}

#ifdef RAY_QUERY
void trace_by_queries(uint first, uint total) {
    uint loops = 0u;
    for (uint i = first + gl_LocalInvocationIndex; i < first + total; i += gl_WorkGroupSize.x) {
        float t;
        Ray ray = ray_of_input(i, t);
        int id = -1;
        closest_constant(ray, t, id);
        Nearest nearest = Nearest(t, -1);
        uint steps = 0u;
        uint entry = any_hit && id >= 0 ? 0u : root_hit_mask(ray.origin, ray.direction, t);
        if (entry != 0u) {
            if (QUERIES_TRIANGLES) query_triangles(ray, t, any_hit, loops, nearest.t, nearest.id, steps);
            else query_leaves(ray, t, any_hit, loops, nearest.t, nearest.id, steps);
        }
        loops += steps + 1u;
        bool within = LOOP_BUDGET == 0u || loops < LOOP_BUDGET;
        int found = nearest.id >= 0 ? bvh_primitive(nearest.id) : id;
        probe_out[i] = uvec4(floatBitsToUint(nearest.t), uint(found), within ? 0u : 1u, steps);
    }
}
#endif

void main() {
    load_scene();
    uint first = gl_WorkGroupID.x * RUN;
    uint total = min(RUN, end_slot - first);
    // A workgroup that a driver cuts up must not go on: the host is told by a 2.
    if (gl_NumSubgroups != 1u || gl_SubgroupSize != gl_WorkGroupSize.x) {
        for (uint i = gl_LocalInvocationIndex; i < total; i += gl_WorkGroupSize.x) probe_out[first + i] = uvec4(0u, 0u, 2u, 0u);
        return;
    }
#ifdef RAY_QUERY
    if (USES_RAY_QUERY) {
        trace_by_queries(first, total);
        return;
    }
#endif
    uint next = gl_SubgroupSize;
    uint mine = gl_SubgroupInvocationID;
    uint loops = 0u;
    uint steps = 0u;
    bool busy = false;
    bool fetch = true;
    int self_id = -1;
    int id = -1;
    BvhRay ray = bvh_ray(vec3(0.0), vec3(0.0, 0.0, 1.0), false);
    Traversal traversal = traversal_idle();
    while (LOOP_BUDGET == 0u || loops + fallback_loops < LOOP_BUDGET) {
        if (fetch && mine < total) {
            float t;
            Ray of_input = ray_of_input(first + mine, t);
            self_id = of_input.self_id;
            id = -1;
            closest_constant(of_input, t, id);
            ray = bvh_ray(of_input.origin, of_input.direction, any_hit);
            uint entry = any_hit && id >= 0 ? 0u : root_hit_mask(of_input.origin, of_input.direction, t);
            traversal = traversal_begin(ray, t, entry);
            busy = true;
        }
        if (!any_lane(busy)) break;
        uint enough = next < total ? ENOUGH_LANES : 1u;
        do {
            traversal_advance(traversal, ray, self_id, any_hit, steps);
            traversal_advance(traversal, ray, self_id, any_hit, steps);
            loops += 1u;
        } while (lanes(traversal.running) >= enough && (LOOP_BUDGET == 0u || loops + fallback_loops < LOOP_BUDGET));
        fetch = busy && !traversal.running;
        if (fetch) {
            int found = traversal.id >= 0 ? bvh_primitive(traversal.id) : id;
            probe_out[first + mine] = uvec4(floatBitsToUint(traversal.t), uint(found), 0u, steps);
            steps = 0u;
        }
        busy = busy && !fetch;
        uvec4 done = subgroupBallot(fetch);
        mine = fetch ? next + subgroupBallotExclusiveBitCount(done) : mine;
        next += subgroupBallotBitCount(done);
        loops += 1u;
    }
    // Out of budget: the host is told.
    if (busy) probe_out[first + mine] = uvec4(0u, 0u, 1u, 0u);
}
