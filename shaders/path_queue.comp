#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_maximal_reconvergence : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Path tracing for scenes with a BVH, on devices whose subgroup is a SIMD register of a CPU. Most rays of most scenes
// never come near the mesh, and those that do traverse the BVH for very different numbers of steps: traced where they
// arise, they leave most lanes idle. Here each lane has a ray pool: a path whose next ray, or whose shadow ray, meets the
// BVH's boxes is put into it, and the lane goes on with another path. When few lanes can go on, all lanes traverse the
// BVH with what their ray pools hold; then paths go on from the results.
//
// Ray pools are arrays that are only indexed by constants: such an access is a blend or a move of registers, where one
// by a variable index, or to a buffer, is a scalar access for each lane and component. Lanes are counted
// only once in a few steps, which takes as many instructions as there are lanes, and loops end at their ends: after a break
// lavapipe executes the rest of the body once more, for no lane.
//
// Loops that only move data stay loops. lavapipe makes a coroutine of a compute shader, for which LLVM 15 computes the
// dominators of all basic blocks once for each local variable: its time goes with the product of the two. A texel
// access has five variables and two blocks, a vec4 written to a storage buffer eighty blocks.
//
// A workgroup is one subgroup. It owns a tile of 64 pixels, or several if these get few samples, which its lanes draw in
// runs. The light of each path goes to a slot of its own, and the film is summed in the order of the samples: the image does
// not depend on how work is cut or scheduled, and no stage needs the host.
//
// With REUSE, what paths record of their first two hits is then used for the other pixels of their groups (reuse_queue.glsl).
// Segments from hit to hit are tested at once, by lanes that share the paths of their groups.

#include "lib/work.glsl"
#include "lib/pixel_order.glsl"
#include "lib/path.glsl"
#include "lib/counting.glsl"
#include "lib/film.glsl"

layout(local_size_x_id = 61, local_size_y = 1, local_size_z = 1) in;

#include "lib/intersect/bvh/bvh.glsl"
#include "lib/scene.glsl"
#include "lib/ray_pool.glsl"

const uint PATHS = 1u << SLOT_BITS;     // paths of a workgroup in one dispatch
const uint RUN = 8u;                    // samples of a pixel that a lane draws at once
const uint CHECK_PATHS = 2u;            // steps of the paths from one count of the lanes to the next
const uint CHECK_TRAVERSALS = 4u;            // fetches from one count to the next

// What the subgroup shares; the same in all lanes.
uint loops = 0u;
uint budget;                // of the loops, until the present part of the work must end
uint region;                // first of the PATHS paths that the workgroup may record
uint next_run = 0u;

uint rays = 0u;             // of this lane
uint shadow_rays = 0u;
uint steps = 0u;

bool out_of_budget() { return LOOP_BUDGET > 0u && loops + fallback_loops >= budget; }

// The samples that a lane will begin next, all of one pixel.
struct Run {
    uint left;
    uint slot;
    uint key;
    uint index;
};

// Runs for the lanes that have none, as long as there are any.
void draw_runs(uvec2 corner, uint tile, uint samples, inout Run run) {
    uint runs = work_pixels * ((samples + RUN - 1u) / RUN);
    if (next_run >= runs || !any_lane(run.left == 0u)) return;
    // A run may turn out to be empty: then its lane draws again.
    do {
        bool enabled = run.left == 0u;
        uvec4 ballot = subgroupBallot(enabled);
        uint number = next_run + subgroupBallotExclusiveBitCount(ballot);
        next_run += subgroupBallotBitCount(ballot);
        loops += 1u;
        if (enabled && number < runs) {
            uint p = pixel_of_path(number);
            uint first = sample_of_path(number) * RUN;
            uvec2 at = pixel_of_work(corner, p);
            uint work_slot = slot_of_tile(tile, p);
            uint slot = film_slot(work_slot);
            uint done = film_count(slot);
            uint multipliers = film_multipliers(slot);
            run.slot = p + first * work_pixels;
            run.key = pixel_key(pixel_number(at));
            run.index = index_of_member(index_after(multipliers, done) + first, member_of_group(p));
            // A pixel that is ahead of the others just ends sooner.
            uint end = min(target_of(multipliers), done + samples);
            bool real = at.x < width && at.y < height && work_slot < end_slot;
            run.left = real && done + first < end ? min(RUN, end - done - first) : 0u;
        }
    } while (next_run < runs && any_lane(run.left == 0u));
}

// One of the regions that no other workgroup holds. On CPUs there are more of them than workgroups run at one time;
// elsewhere a workgroup may have to wait for one that runs.
uint acquire_region() {
    uint r = 0u;
    if (subgroupElect()) {
        bool found = false;
        uint word = gl_WorkGroupID.x % (REGIONS / 32u);
        while (!found) {
            int bit = findLSB(~pool[word]);
            if (bit >= 0) {
                uint mask = 1u << uint(bit);
                found = (atomicOr(pool[word], mask) & mask) == 0u;
                r = word * 32u + uint(bit);
            }
            word = (word + 1u) % (REGIONS / 32u);
        }
    }
    memoryBarrierBuffer();
    return subgroupBroadcastFirst(r);
}

void release_region(uint r) {
    memoryBarrierBuffer();
    if (subgroupElect()) atomicAnd(pool[r / 32u], ~(1u << (r % 32u)));
}

// Whether a lane has a path to go on with, or may begin one.
bool can_advance(Held h, RayPool pool, Run run) {
    return h.slot != NOTHING || pool_traced(pool) != 0u || (run.left > 0u && pool_has_room(pool));
}

// Whether to go on with what these lanes can do: if they are most, or if no lane has a ray for the BVH.
bool enough(bool can, bool waits) {
    uint count = lanes(can);
    return count >= ENOUGH_LANES || (count > 0u && !any_lane(waits));
}

// Whether a lane has a ray for the BVH.
bool has_ray(RayPool pool, PoolTraversal w) { return w.place != 0u || pool_waiting(pool) != 0u; }

// Goes on with paths for as long as most lanes can.
void advance(Camera camera, uvec2 corner, uint tile, uint samples, inout Held h, inout RayPool pool, inout Run run,
             PoolTraversal w) {
    uint until_check = 1u;
    do {
        loops += 1u + HIT_LOOPS;

        // Shade the hits that lanes hold.
        bool held = h.slot != NOTHING;
        bool shades = held && !h.dying;
        uint p = held ? pixel_of_path(h.slot) : 0u;
        uint key = key_of_group(corner, p);
        Vertex vertex;
        ShadowRay shadow;
        bool second = shades && has_flag(h.path, PATH_FROM_FIRST);
        vec3 radiance = second ? vec3(0.0) : h.radiance;
        vec3 direct = h.radiance;
        uint light_samples = reuses() ? LIGHT_SAMPLES : 1u;
        Hit hit = hit_of(shades ? h.id : -1, h.t);
        bool alive = path_arrive(h.path, hit, key, light_samples, radiance, vertex, shadow) && shades;
        h.radiance = shades ? radiance : h.radiance;
        if (REUSE) {
            if ((SMOOTH_NORMALS || HAS_PARTS) && shades && vertex.first) record_first_hit(region + h.slot, vertex);
            if (second) record_second_hit(region + h.slot, h.path, vertex, h.t, direct);
            h.shareable = h.shareable || (second && vertex.shareable);
            h.met = h.met || second;
        }
        rays += shades ? 1u : 0u;
        uint root_mask_of_shadow = 0u;    // see root_hit_mask
        if (SAMPLES_LIGHTS) {
            bool enabled = shades && shadow.enabled;
            shadow_rays += enabled ? 1u : 0u;
            bool occluded;
            root_mask_of_shadow = shadow_root_mask(ray_of(shadow), shadow.distance, shadow.enabled, occluded);
            root_mask_of_shadow = enabled ? root_mask_of_shadow : 0u;
            if (enabled && !occluded && root_mask_of_shadow == 0u) h.radiance += shadow.radiance;
        }
        bool later = root_mask_of_shadow != 0u;
        bool ended = held && !alive && !later;
        if (ended) {
            h.shareable = h.shareable && is_worth_sharing(h.radiance);
            float state = h.shareable ? PATH_GIVES : (h.met ? PATH_MET : PATH_ENDED);
            path_store(region + h.slot, ROW_LIGHT, vec4(h.radiance, state));
        }

        // Next rays of living paths and first rays of new ones.
        bool begins = !alive && !later && run.left > 0u && pool_has_room(pool);
        h.slot = begins ? run.slot : (alive || later ? h.slot : NOTHING);
        h.radiance = begins ? vec3(0.0) : h.radiance;
        h.shareable = h.shareable && !begins;
        h.met = h.met && !begins;
        h.dying = !alive && later;
        // From the camera to the first hit the random numbers are the pixel's own.
        uvec2 at = pixel_of_work(corner, pixel_of_path(run.slot));
        path_depart(h.path, vertex, alive, camera, at, begins ? run.key : key, begins ? run.index : h.path.index);
        run.left -= begins ? 1u : 0u;
        run.slot += begins ? work_pixels : 0u;
        run.index += begins ? 1u : 0u;
        float t = INFINITY;
        int id = -1;
        closest_constant(ray_of(h.path), t, id);
        h.t = t;
        h.id = id;
        if (REUSE && !reuses()) h.path.flags &= ~PATH_FROM_FIRST;
        uint entry = root_hit_mask(h.path.origin, h.path.direction, t);
        entry = alive || begins ? entry : 0u;
        // The same for a living path, which leaves a diffuse surface as its shadow ray does.
        h.path.origin = later ? shadow.origin : h.path.origin;
        h.path.self_id = later ? shadow.self_id : h.path.self_id;
        if (HAS_BVH) {
            pool_put(pool, h, shadow, entry, root_mask_of_shadow);
            h.slot = entry != 0u || later ? NOTHING : h.slot;
            pool_take(pool, h);
        }
        if (--until_check == 0u) {
            until_check = CHECK_PATHS;
            draw_runs(corner, tile, samples, run);
            if (!enough(can_advance(h, pool, run), has_ray(pool, w))) break;
        }
    } while (!out_of_budget());
}

// One step.
void advance_traversal(inout PoolTraversal w) {
    if (REUSE) occlusion_steps += w.shadow && w.traversal.running ? 1u : 0u;
    traversal_advance(w.traversal, w.ray, w.self_id, w.shadow, steps);
}

// Traverses the BVH for as long as most lanes have a ray to do it with, and then a while longer if that is all there is
// to do.
void traverse_pools(inout RayPool pool, inout PoolTraversal w, Run run, Held h) {
    uint until_check = CHECK_TRAVERSALS;
    do {
        pool_fetch(pool, w);
        // Three steps from one fetch to the next, which would be counted as loops where these have a budget.
        if (LOOP_BUDGET > 0u) {
            advance_traversal(w);
            advance_traversal(w);
            advance_traversal(w);
        } else {
            [[dont_unroll]] for (uint i = 0u; i < 3u; ++i) advance_traversal(w);
        }
        loops += 1u;
        pool_finish(pool, w);
        if (--until_check == 0u) {
            until_check = CHECK_TRAVERSALS;
            uint count = lanes(has_ray(pool, w));
            if (count == 0u || (count < ENOUGH_LANES && lanes(can_advance(h, pool, run)) >= ENOUGH_LANES)) break;
        }
    } while (!out_of_budget());
}

// Makes what lanes have recorded visible to the others, which on a CPU have all come as far. For all lanes to call.
void publish_records() {
    subgroupMemoryBarrierImage();
    subgroupMemoryBarrierBuffer();
    if (THREADS) subgroupBarrier();
}

// What came of a dispatch.
struct Added {
    uint samples;
    uint reused;
    uint bad;
};

// Adds to the film what has been recorded of a tile's paths, each for its own pixel, in the order of the samples, up to the first sample
// that did not end.
void add_recorded(uint tile, uint samples, inout Added added) {
    for (uint p = gl_SubgroupInvocationID; p < work_pixels; p += gl_SubgroupSize) {
        uvec2 at;
        uint slot = slot_of_tile(tile, p);
        if (slot < end_slot && pixel_of_slot(slot, at)) {
            uint film_place = film_slot(slot);
            FilmPixel film_pixel = film_load(film_place);
            uint first = film_pixel.count;
            uint target = target_of(film_pixel.multipliers);
            for (uint s = 0u; s < samples; ++s) {
                uint path = region + s * work_pixels + p;
                vec4 light = path_load(path, ROW_LIGHT);
                if (light.w == PATH_OPEN || film_pixel.count >= target) break;
                bool good = film_add(film_pixel, light.xyz);
                added.bad += good ? 0u : 1u;
            }
            film_store(film_place, film_pixel);
            added.samples += film_pixel.count - first;
        }
    }
}

// Takes the samples of the tiles from slot `tile` on.
void trace_tiles(uint tile, Camera camera, inout Counts counts) {
    uint samples = min(max_new_samples, sample_of_path(PATHS));
    bool reusing = reuses();
    uint shadow_rays_before = shadow_rays;
    uint occlusion_steps_before = occlusion_steps;
    next_run = 0u;
    // Nobody reads the records of the last tiles any more.
    if (THREADS) subgroupBarrier();
    if (STATES_ARE_CLEARED) {
        [[dont_unroll]] for (uint p = gl_SubgroupInvocationID; p < work_pixels; p += gl_SubgroupSize) {
            [[dont_unroll]] for (uint s = 0u; s < samples; ++s) path_clear(region + s * work_pixels + p);
        }
        publish_records();
        loops += (1u + samples) * work_pixels / gl_SubgroupSize;
    }
    // What is left of the budget must do for reusing the paths and for the film.
    budget = reusing ? LOOP_BUDGET / 2u : LOOP_BUDGET;
    uvec2 corner = tile_corner(tile / TILE);

    Held h = held_nothing();
    RayPool pool = pool_empty();
    PoolTraversal w = pool_traversal_idle();
    Run run = Run(0u, 0u, 0u, 0u);
    do {
        advance(camera, corner, tile, samples, h, pool, run, w);
        if (HAS_BVH) traverse_pools(pool, w, run, h);
    } while (!out_of_budget() && any_lane(has_ray(pool, w) || can_advance(h, pool, run)));
    publish_records();
    Added added = Added(0u, 0u, 0u);
    // (REUSE again: src/gpu/prune.rs knows of no variables.)
    if (REUSE && reusing) {
        added.samples = share_recorded(tile, region, samples, shadow_rays, loops, added.bad, added.reused);
    } else {
        add_recorded(tile, samples, added);
    }
    if (is_scattered()) {
        // What its paths took in all is left to the first pixels, each by the lane that has stored it. (A barrier would make what
        // lanes hold across pieces go through memory, which takes lavapipe 1.1 times the time.)
        publish_records();
        uint cost = cost_of(shadow_rays - shadow_rays_before, occlusion_steps - occlusion_steps_before);
        [[dont_unroll]] for (uint i = gl_SubgroupInvocationID; i < TILE; i += gl_SubgroupSize) {
            uint slot = slot_of_tile(tile, reusing ? pixel_in_groups(i) : i);
            if (slot < end_slot) film_store_cost(slot, i < gl_SubgroupSize ? cost : 0u);
        }
    }
    counts.samples += added.samples;
    counts.reused += added.reused;
    counts.bad += added.bad;
}

void main() [[maximally_reconverges]] {
    load_scene();
    // The host asks for workgroups of one subgroup; a device that cuts them up must not go on.
    if (gl_NumSubgroups != 1u || (REUSE && gl_SubgroupSize != SUBGROUP_LANES)) {
        if (subgroupElect()) count_up(COUNT_SUBGROUP_MISMATCHES, 1u);
        return;
    }
    if (max_new_samples == 0u) return;
    Camera camera = frame_camera();
    Counts counts = Counts(0u, 0u, 0u, 0u, 0u, 0u, 0u);
    uint r = acquire_region();
    region = r * PATHS;
    bool works;
    do {
        uint work_item = next_number();
        works = work_item < work_items;
        if (works) trace_tiles(first_slot + place_of_work_item(work_item) * tile_step * work_pixels, camera, counts);
    } while (PERSISTENT_THREADS && works);
    release_region(r);
    if (PATH_STATS) steps += traversal_steps;
    counts.rays = rays;
    counts.shadow_rays = shadow_rays;
    counts.steps = steps;
    add_counts(counts);
}
