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
// Path tracing by path regeneration: an invocation owns a pixel, and as soon as a path ends the next sample of the
// pixel begins in its place, so that the lanes of a subgroup stay busy although paths differ in length.
//
// With REUSE, paths of groups of eight pixels serve each other (reuse_lanes.glsl): a path that has ended waits for the
// others of its group before the sample is added up. Meanwhile its lane goes on with the next one, but only with that.

#include "lib/path.glsl"
#include "lib/film.glsl"

layout(local_size_x_id = 61, local_size_y = 1, local_size_z = 1) in;

#include "lib/pixel_order.glsl"
#include "lib/work.glsl"
#include "lib/split.glsl"
#include "lib/counting.glsl"
#include "lib/scene.glsl"
#include "lib/reuse_lanes.glsl"

// Whether to go on before paths are shared: some lane has none that has ended, or none are shared.
bool group_lacks_path(bool going, bool reusing, bool has_ended) {
    if (SUBGROUP_LANES == MEMBERS) return any_lane(going && !has_ended);
    return !reusing || any_lane(going && !has_ended);
}

void main() [[maximally_reconverges]] {
    load_scene();
    uint number = 0u;
    if (!REUSE && !PERSISTENT_THREADS) number = split_number();
    // Groups of pixels are in a subgroup, which may draw its work.
    else if (!number_of_invocation(number)) return;
    uint slot = slot_of_invocation(number);
    uvec2 at = uvec2(0u);
    bool real = slot < end_slot && pixel_of_slot(slot, at);
    // Groups stay together.
    if (!REUSE && SPLIT == 1u && !real) return;
    FilmPixel film_pixel = film_empty();
    uint film_place = film_slot(slot);
    if (real) film_pixel = film_load(film_place);
    Gradients gradients = Gradients(vec4(0.0), vec4(0.0), vec4(0.0));
    if (real && reuses()) gradients = gradients_load(film_place);
    uint first = film_pixel.count;
    uint samples = real ? samples_lacking(film_pixel.multipliers, first, max_new_samples) : 0u;
    uvec2 share = REUSE ? uvec2(0u, samples) : split_share(samples);
    uint left = share.y;                    // samples that have not ended
    bool going = left > 0u;                 // with a path
    if (REUSE ? !any_lane(going) : SPLIT == 1u && !going) return;
    // The host asks for whole subgroups, of whole groups; a device that cuts them up must not go on.
    if ((REUSE || PERSISTENT_THREADS) && (gl_SubgroupSize != SUBGROUP_LANES || gl_NumSubgroups * SUBGROUP_LANES != gl_WorkGroupSize.x)) {
        if (subgroupElect()) count_up(COUNT_SUBGROUP_MISMATCHES, 1u);
        return;
    }

    uint p = slot % TILE;
    bool reusing = reuses();
    uint key = pixel_key(pixel_number(at));
    uint shared_key = REUSE ? group_key(pixel_of_tile(tile_corner(slot / TILE), first_of_group(p))) : key;
    Camera camera = frame_camera();
    Path path = path_begin(camera, at, key, index_of_member(index_after(film_pixel.multipliers, first) + share.x, member_of_group(p)));
    vec3 radiance = vec3(0.0);
    Counts counts = Counts(0u, 0u, 0u, 0u, 0u, 0u, 0u);
    uint loops = 0u;
    bool within_budget = true;
    PathVertices vertices = vertices_none();       // of the path
    FirstVertex first_vertex = first_vertex_none();
    EndedPath ended = ended_none();
    bool waits = false;                     // with a path that has ended too
    if (REUSE || SPLIT == 1u || going) do {
        do {
            Hit hit = intersect(ray_of(path), loops);
            Vertex vertex;
            ShadowRay shadow;
            bool second = has_flag(path, PATH_FROM_FIRST);
            vec3 direct = radiance;
            radiance = second ? vec3(0.0) : radiance;
            bool alive = path_arrive(path, hit, shared_key, reusing ? LIGHT_SAMPLES : 1u, radiance, vertex, shadow);
            if (REUSE) {
                alive = alive && going;
                shadow.enabled = shadow.enabled && going;
                if ((SMOOTH_NORMALS || HAS_PARTS) && vertex.first) first_vertex = first_vertex_of(vertex);
                if (second) vertices = vertices_at(path, vertex, hit.t, direct, first_vertex);
            }
            counts.rays += going ? 1u : 0u;
            if (SAMPLES_LIGHTS) {
                counts.shadow_rays += shadow.enabled ? 1u : 0u;
                bool occluded = light_occluded(ray_of(shadow), shadow.distance, shadow.enabled, loops);
                radiance += shadow.enabled && !occluded ? shadow.radiance : vec3(0.0);
            }
            loops += 1u + HIT_LOOPS;
            // Out of budget: a traversal may have ended too early, so that the sample in hand does not count. What the film
            // holds is complete; the next dispatch begins with that sample again.
            within_budget = LOOP_BUDGET == 0u || loops + fallback_loops < LOOP_BUDGET;
            bool over = going && !alive && within_budget;
            left -= over ? 1u : 0u;
            waits = over && ended.there;
            if (over && !waits) {
                if (reusing) {
                    ended = path_ends(vertices, radiance);
                } else if (!REUSE && SPLIT > 1u) {
                    split_record(share.x, radiance);
                    share.x += 1u;
                } else {
                    counts.bad += film_add(film_pixel, radiance) ? 0u : 1u;
                }
                radiance = vec3(0.0);
            }
            path_depart(path, vertex, alive, camera, at, alive ? shared_key : key, path.index + (alive ? 0u : 1u));
            if (REUSE && !reusing) path.flags &= ~PATH_FROM_FIRST;
            going = within_budget && left > 0u && !waits;
        } while (going && (!REUSE || group_lacks_path(going, reusing, ended.there)));
        if (REUSE && any_lane(ended.there)) {
            within_budget = share_sample(ended, film_pixel, gradients, shared_key, counts.shadow_rays, loops, counts.bad);
            ended = ended_none();
            if (waits) {
                ended = path_ends(vertices, radiance);
                radiance = vec3(0.0);
                waits = false;
            }
            going = within_budget && left > 0u;
        }
    } while (REUSE && within_budget && any_lane(going || ended.there));
    bool adds = real && (REUSE || split_part() == 0u);
    if (!REUSE && SPLIT > 1u) counts.bad = split_add(film_pixel, samples);
    if (adds) film_store(film_place, film_pixel);
    if (real && is_scattered()) film_store_cost(film_place, cost_of(counts.shadow_rays, occlusion_steps));
    if (real && reuses()) gradients_store(film_place, gradients);
    counts.samples = adds ? film_pixel.count - first : 0u;
    counts.reused = reusing ? counts.samples : 0u;
    if (PATH_STATS) counts.steps = traversal_steps;
    counts.truncated = (REUSE ? film_pixel.count < first + samples : left > 0u) && within_budget ? 1u : 0u;
    add_counts(counts);
}
