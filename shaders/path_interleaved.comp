#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_maximal_reconvergence : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Path tracing for scenes with a BVH, on devices whose lanes are threads. Rays traverse the BVH for very different numbers of
// steps, and most never enter it. If all lanes of a subgroup wait for the slowest, twice for each hit, most of them are idle. Here
// shading and traversing take turns: lanes whose rays are done wait until some more are, shade what they have met, and
// have their next rays, while the traversals of the others are where they were.
//
// An invocation takes samples of a pixel one after another. A path goes on before it is known whether the light that
// its last hit was to get arrives: the shadow ray is traversed just before the ray that continues the path. Light is added up in the
// same order as in path_trace.comp, to the same bits.

#include "lib/path.glsl"
#include "lib/film.glsl"

layout(local_size_x_id = 61, local_size_y = 1, local_size_z = 1) in;

#include "lib/pixel_order.glsl"
#include "lib/work.glsl"
#include "lib/split.glsl"
#include "lib/counting.glsl"
#include "lib/intersect/bvh/bvh.glsl"
#include "lib/scene.glsl"
#include "lib/votes.glsl"

// What a lane's traversal is for.
const uint NOTHING = 0u;
const uint SHADOW = 1u;     // and then, if the path's ray meets the BVH's boxes too, for that
const uint PATH = 2u;

// The film's pixel of each lane between the ends of its samples: in registers it would be in the way all the time.
shared uvec4 kept[3u * gl_WorkGroupSize.x];

void film_keep(FilmPixel p) {
    uint row = gl_LocalInvocationID.x;
    kept[row] = uvec4(floatBitsToUint(p.sum), p.count);
    kept[row + gl_WorkGroupSize.x] = floatBitsToUint(vec4(p.compensation, p.pilot));
    kept[row + 2u * gl_WorkGroupSize.x] = uvec4(floatBitsToUint(p.residue), p.multipliers);
}

FilmPixel film_kept() {
    uint row = gl_LocalInvocationID.x;
    uvec4 a = kept[row];
    vec4 b = uintBitsToFloat(kept[row + gl_WorkGroupSize.x]);
    uvec4 c = kept[row + 2u * gl_WorkGroupSize.x];
    return FilmPixel(uintBitsToFloat(a.xyz), b.xyz, uintBitsToFloat(c.xyz), a.w, b.w, c.w);
}

void main() [[maximally_reconverges]] {
    load_scene();
    uint slot = slot_of_invocation(split_number());
    uvec2 at = uvec2(0u);
    bool real = slot < end_slot && pixel_of_slot(slot, at);
    if (SPLIT == 1u && !real) return;
    FilmPixel film_pixel = film_empty();
    if (real) film_pixel = film_load(slot);
    uint first = film_pixel.count;
    uint samples = real ? samples_lacking(film_pixel.multipliers, first, max_new_samples) : 0u;
    uvec2 share = split_share(samples);
    uint left = share.y;            // samples that have not begun
    if (SPLIT == 1u && left == 0u) return;
    film_keep(film_pixel);

    uint key = pixel_key(pixel_number(at));
    Camera camera = frame_camera();
    Path path = path_begin(camera, at, key, first + share.x);
    bool there = left > 0u;         // the path
    left -= there ? 1u : 0u;
    vec3 radiance = vec3(0.0);
    Counts counts = Counts(0u, 0u, 0u, 0u, 0u, 0u, 0u);
    uint loops = 0u;
    bool within_budget = true;

    float t = INFINITY;             // how far the path's ray reaches
    int id = -1;                    // and what it meets there
    closest_constant(ray_of(path), t, id);
    uint path_root_mask = there ? root_hit_mask(path.origin, path.direction, t) : 0u;
    bool over = false;              // the sample before it, but for the shadow ray of its last hit
    vec3 awaited = vec3(0.0);       // light of that ray
    uint traversal_of = path_root_mask != 0u ? PATH : NOTHING;
    vec3 origin = path.origin;      // of the ray that traverses the BVH
    vec3 direction = path.direction;
    int self_id = path.self_id;
    Traversal traversal = traversal_begin(bvh_ray(origin, direction, false), t, path_root_mask);
    do {
        bool busy;
        BvhRay ray = bvh_ray(origin, direction, traversal_of == SHADOW);
        do {
            traversal_advance(traversal, ray, self_id, traversal_of == SHADOW, traversal_steps);
            if (!traversal.running && traversal_of == SHADOW) {
                if (traversal.id < 0) radiance += awaited;
                traversal_of = path_root_mask != 0u ? PATH : NOTHING;
                if (path_root_mask != 0u) {
                    origin = path.origin;
                    direction = path.direction;
                    self_id = path.self_id;
                    ray = bvh_ray(origin, direction, false);
                    traversal = traversal_begin(ray, t, path_root_mask);
                }
            }
            busy = traversal.running;
            loops += 1u;
            within_budget = LOOP_BUDGET == 0u || loops + fallback_loops < LOOP_BUDGET;
        } while (within_budget && any_lane(busy) && lanes(!busy && (there || over)) < ENOUGH_LANES);

        // Out of budget: what is in hand does not count. What the film holds is complete; the next dispatch begins with this sample
        // again.
        if (!busy && within_budget) {
            if (over) {
                if (SPLIT > 1u) {
                    split_record(share.x, radiance);
                    share.x += 1u;
                } else {
                    FilmPixel kept_pixel = film_kept();
                    counts.bad += film_add(kept_pixel, radiance) ? 0u : 1u;
                    film_keep(kept_pixel);
                }
                radiance = vec3(0.0);
                over = false;
            }
            if (there) {
                if (traversal_of == PATH && traversal.id >= 0) {
                    t = traversal.t;
                    id = traversal.id;
                }
                Vertex vertex;
                ShadowRay shadow;
                bool alive = path_arrive(path, hit_of(id, t), key, 1u, radiance, vertex, shadow);
                counts.rays += 1u;
                uint entry = 0u;        // of the shadow ray
                if (SAMPLES_LIGHTS) {
                    counts.shadow_rays += shadow.enabled ? 1u : 0u;
                    bool occluded;
                    entry = shadow_root_mask(ray_of(shadow), shadow.distance, shadow.enabled, occluded);
                    entry = shadow.enabled ? entry : 0u;
                    if (shadow.enabled && !occluded && entry == 0u) radiance += shadow.radiance;
                }
                over = !alive;
                there = !over || left > 0u;
                left -= over && there ? 1u : 0u;
                path_depart(path, vertex, alive, camera, at, key, path.index + (over ? 1u : 0u));
                t = INFINITY;
                id = -1;
                closest_constant(ray_of(path), t, id);
                path_root_mask = there ? root_hit_mask(path.origin, path.direction, t) : 0u;
                bool of_shadow = entry != 0u;
                traversal_of = of_shadow ? SHADOW : (path_root_mask != 0u ? PATH : NOTHING);
                awaited = shadow.radiance;
                if (traversal_of != NOTHING) {
                    origin = of_shadow ? shadow.origin : path.origin;
                    direction = of_shadow ? shadow.direction : path.direction;
                    self_id = of_shadow ? shadow.self_id : path.self_id;
                    BvhRay next = bvh_ray(origin, direction, of_shadow);
                    traversal = traversal_begin(next, of_shadow ? shadow.distance : t, of_shadow ? entry : path_root_mask);
                }
            }
        }
        // The same in all lanes.
        loops += 1u + HIT_LOOPS;
        if (LOOP_BUDGET > 0u) fallback_loops = subgroupMax(fallback_loops);
    } while (within_budget && any_lane(there || over));
    counts.truncated = (there || over) && within_budget ? 1u : 0u;
    film_pixel = film_kept();
    if (SPLIT > 1u) counts.bad = split_add(film_pixel, samples);
    if (real && split_part() == 0u) {
        film_store(slot, film_pixel);
        counts.samples = film_pixel.count - first;
    }
    if (PATH_STATS) counts.steps = traversal_steps;
    add_counts(counts);
}
