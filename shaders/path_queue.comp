#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_maximal_reconvergence : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Path tracing for scenes with a tree, on devices whose subgroup is a SIMD register of a CPU. Most rays of most scenes
// never come near the mesh, and those that do walk the tree for very different numbers of steps: traced where they
// arise, they leave most lanes idle. Here each lane has a pocket: a path whose next ray, or whose shadow ray, meets the
// tree's boxes is put into it, and the lane goes on with another path. When few lanes can go on, all lanes walk the
// tree with what their pockets hold; then paths go on from the results.
//
// Pockets are arrays that are only indexed by constants: such an access is a blend or a move of registers, where one
// by a variable index, or to a buffer, is a scalar access for each lane and component. Lanes are counted
// only once in a few steps, which takes as many instructions as there are lanes, and loops end at their ends: after a break
// lavapipe executes the rest of the body once more, for no lane.
//
// Loops that only move data stay loops. lavapipe makes a coroutine of a compute shader, for which LLVM 15 reckons the
// dominators of all basic blocks once for each local variable: its time goes with the product of the two. A texel
// access has five variables and two blocks, a vec4 written to a storage buffer eighty blocks.
//
// A workgroup is one subgroup. It owns a tile of 64 pixels, or several if these get few samples, which its lanes draw in
// runs. The light of each path goes to a slot of its own, and the film is summed in the order of the samples: the image does
// not depend on how work is cut or scheduled, and no stage needs the host.
//
// With REUSE, what paths note of their first two hits is then used for the other pixels of their groups (reuse_notes.glsl).
// Segments from hit to hit are tested like shadow rays: at once if lanes share the paths of their groups; else those that meet
// the tree's boxes go through the pockets as well.

#include "lib/work.glsl"
#include "lib/pixel_order.glsl"
#include "lib/path.glsl"
#include "lib/counting.glsl"
#include "lib/film.glsl"

layout(local_size_x_id = 0, local_size_y = 1, local_size_z = 1) in;

#include "lib/intersect/bvh/bvh.glsl"
#include "lib/scene.glsl"
#include "lib/pocket.glsl"

const uint PATHS = 1u << SLOT_BITS;     // paths of a workgroup in one dispatch
const uint RUN = 8u;                    // samples of a pixel that a lane draws at once
const uint CHECK_PATHS = 2u;            // steps of the paths from one count of the lanes to the next
const uint CHECK_WALKS = 4u;            // fetches from one count to the next

// What the subgroup shares; the same in all lanes.
uint loops = 0u;
uint budget;                // of the loops, until the present part of the work must end
uint region;                // first of the PATHS paths that the workgroup may note
uint next_run = 0u;

uint rays = 0u;             // of this lane
uint shadow_rays = 0u;
uint steps = 0u;

bool out_of_budget() { return LOOP_BUDGET > 0u && loops + doubtful_loops >= budget; }

// The samples that a lane will begin next, all of one pixel.
struct Run {
    uint left;
    uint slot;
    uint key;
    uint index;
    uint glances;   // how each begins, see glance.glsl
};

// Runs for the lanes that have none, as long as there are any.
void draw_runs(uvec2 corner, uint tile, uint samples, inout Run run) {
    uint runs = work_pixels * ((samples + RUN - 1u) / RUN);
    if (next_run >= runs || !any_lane(run.left == 0u)) return;
    // A run may turn out to be empty: then its lane draws again.
    do {
        bool wanted = run.left == 0u;
        uvec4 ballot = subgroupBallot(wanted);
        uint number = next_run + subgroupBallotExclusiveBitCount(ballot);
        next_run += subgroupBallotBitCount(ballot);
        loops += 1u;
        if (wanted && number < runs) {
            uint p = pixel_of_path(number);
            uint first = sample_of_path(number) * RUN;
            uvec2 at = pixel_of_work(corner, p);
            uint work_slot = slot_of_tile(tile, p);
            uint slot = film_slot(work_slot);
            uint done = film_count(slot);
            uint state = film_state(slot);
            run.slot = p + first * work_pixels;
            run.key = pixel_key(pixel_number(at));
            run.index = index_of_member(index_after(state, done) + first, member_of_group(p));
            run.glances = film_glances(state);
            // A pixel that is ahead of the others just ends sooner.
            uint end = min(target_of(state), done + samples);
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

// Whether a lane has segments to make, or results of others to note.
bool can_connect(Pocket pocket, Run run) {
    return pocket_traced(pocket) != 0u || (run.left > 0u && pocket_room(pocket));
}

// Whether a lane has a path to go on with, or may begin one.
bool can_advance(Held h, Pocket pocket, Run run) {
    return h.slot != NOTHING || pocket_traced(pocket) != 0u || (run.left > 0u && pocket_room(pocket));
}

// Whether to go on with what these lanes can do: if they are most, or if no lane has a ray for the tree.
bool enough(bool can, bool waits) {
    uint count = lanes(can);
    return count >= ENOUGH_LANES || (count > 0u && !any_lane(waits));
}

// Whether a lane has a ray for the tree.
bool has_ray(Pocket pocket, PocketWalk w) { return w.place != 0u || pocket_waiting(pocket) != 0u; }

// Goes on with paths for as long as most lanes can.
void advance(Camera camera, uvec2 corner, uint tile, uint samples, inout Held h, inout Pocket pocket, inout Run run,
             PocketWalk w) {
    uint until_check = 1u;
    do {
        loops += 1u + HIT_LOOPS;

        // Shade the hits that lanes hold.
        bool held = h.slot != NOTHING;
        bool shades = held && !h.dying;
        uint p = held ? pixel_of_path(h.slot) : 0u;
        uint key = key_of_group(corner, p);
        Arrival arrival;
        ShadowRay shadow;
        bool second = REUSE && shades && h.path.second;
        vec3 radiance = second ? vec3(0.0) : h.radiance;
        vec3 direct = h.radiance;
        uint light_samples = reuses(p) ? LIGHT_SAMPLES : 1u;
        Hit hit = hit_of(shades ? h.id : -1, h.t);
        bool alive = path_arrive(h.path, hit, key, light_samples, radiance, arrival, shadow) && shades;
        h.radiance = shades ? radiance : h.radiance;
        if (REUSE) {
            if (SMOOTH_NORMALS && shades && arrival.first) {
                path_store(region + h.slot, ROW_FIRST_UP, vec4(arrival.up, 0.0));
            }
            if (second) note_second_hit(region + h.slot, h.path, arrival, h.t, direct);
            h.gives = h.gives || (second && arrival.gives);
            h.met = h.met || second;
            if (AIMS && shades && arrival.aims) h.path.glances |= AIM_FOLLOWS;
        }
        rays += shades ? 1u : 0u;
        uint entry_of_shadow = 0u;    // see tree_entry
        if (HAS_DIFFUSE && LIGHT_COUNT + EMITTER_COUNT > 0u) {
            bool wanted = shades && shadow.wanted;
            shadow_rays += wanted ? 1u : 0u;
            bool hidden;
            entry_of_shadow = shadow_entry(ray_of(shadow), shadow.distance, shadow.wanted, hidden);
            entry_of_shadow = wanted ? entry_of_shadow : 0u;
            if (wanted && !hidden && entry_of_shadow == 0u) h.radiance += shadow.radiance;
        }
        bool later = entry_of_shadow != 0u;
        bool ended = held && !alive && !later;
        bool goes_on = ended && sample_goes_on(h.path.glances);
        bool parts = REUSE && goes_on && parts_light(h.path.glances);
        if (ended && (!goes_on || parts)) {
            bool aimed = is_aimed(h.path.glances);
            if (!aimed) h.gives = h.gives && is_worth_giving(h.radiance);
            float state = h.gives ? PATH_GIVES : (h.met ? PATH_MET : PATH_ENDED);
            path_store(region + h.slot, parts ? ROW_APART : ROW_LIGHT, vec4(h.radiance, aimed ? state + PATH_AIMED : state));
        }

        // Next rays of living paths and first rays of new ones.
        bool begins = !alive && !later && !goes_on && run.left > 0u && pocket_room(pocket);
        h.slot = begins ? run.slot : (alive || later || goes_on ? h.slot : NOTHING);
        h.radiance = begins ? vec3(0.0) : h.radiance;
        h.gives = h.gives && !begins;
        h.met = h.met && !begins;
        h.dying = !alive && later;
        AimFrom from = aim_nowhere();
        if (AIMS && goes_on) from = noted_aim(region + h.slot);
        if (parts) h.radiance = vec3(0.0);
        uint state = begins ? run.glances : (goes_on ? next_state(h.path.glances) : h.path.glances & ~AIMING);
        uvec2 at = pixel_of_work(corner, goes_on ? p : pixel_of_path(run.slot));
        // From the camera to the first hit the random numbers are the pixel's own.
        if (GLANCES > 0u && REUSE) key = goes_on ? pixel_key(pixel_number(at)) : key;
        path_depart(h.path, arrival, alive, camera, at, begins ? run.key : key, begins ? run.index : h.path.index, state, from);
        run.left -= begins ? 1u : 0u;
        run.slot += begins ? work_pixels : 0u;
        run.index += begins ? 1u : 0u;
        float t = INFINITY;
        int id = -1;
        closest_constant(ray_of(h.path), t, id);
        h.t = t;
        h.id = id;
        if (REUSE) h.path.second = h.path.second && reuses(p);
        uint entry = tree_entry(h.path.origin, h.path.direction, t);
        entry = alive || begins || goes_on ? entry : 0u;
        // The same for a living path, which leaves a diffuse surface as its shadow ray does.
        h.path.origin = later ? shadow.origin : h.path.origin;
        h.path.leaving = later ? shadow.leaving : h.path.leaving;
        if (HAS_TREE) {
            pocket_put(pocket, h, shadow, entry, entry_of_shadow);
            h.slot = entry != 0u || later ? NOTHING : h.slot;
            pocket_take(pocket, h);
        }
        if (--until_check == 0u) {
            until_check = CHECK_PATHS;
            draw_runs(corner, tile, samples, run);
            if (!enough(can_advance(h, pocket, run), has_ray(pocket, w))) break;
        }
    } while (!out_of_budget());
}

// The segments from the second hits of paths to the first hits of the other members of their groups, in the order of
// the samples, one path's after another's.
const uint SEGMENTS = MEMBERS - 1u;     // of a path

// Makes segments for as long as most lanes can. A lane takes every n-th, `run.slot` being the next one.
void connect_paths(inout Pocket pocket, inout Run run, PocketWalk w) {
    uint until_check = 1u;
    do {
        loops += 1u;
        float value;
        uint traced = pocket_take_segment(pocket, value);
        if (traced != NOTHING) note_coupling(region + traced / MEMBERS, traced % MEMBERS, value);
        bool takes = run.left > 0u && pocket_room(pocket);
        uint segment = takes ? run.slot : 0u;
        uint path = segment / SEGMENTS;
        uint member = member_of(path) ^ (1u + segment % SEGMENTS);
        vec3 y = path_load(region + path, ROW_SECOND).xyz;
        vec3 normal = path_load(region + path, ROW_SECOND_NORMAL).xyz;
        ShadowRay ray = connect(region + path, y, normal, region + for_member(path, member), value);
        bool gives = takes && path_state(path_load(region + path, ROW_LIGHT).w) == PATH_GIVES;
        bool wanted = gives && ray.wanted;
        shadow_rays += wanted ? 1u : 0u;
        bool hidden;
        uint entry = segment_entry(ray_of(ray), ray.distance, ray.wanted, hidden);
        entry = wanted ? entry : 0u;
        if (MUTATION == MUTATE_REUSE) {
            hidden = false;
            entry = 0u;
        }
        if (gives && entry == 0u) note_coupling(region + path, member, wanted && !hidden ? value : 0.0);
        pocket_put_segment(pocket, ray, MEMBERS * path + member, value, entry);
        run.slot += takes ? gl_SubgroupSize : 0u;
        run.left -= takes ? 1u : 0u;
        if (--until_check == 0u) {
            until_check = CHECK_PATHS;
            if (!enough(can_connect(pocket, run), has_ray(pocket, w))) break;
        }
    } while (!out_of_budget());
}

// One step.
void walk_further(inout PocketWalk w) {
    if (REUSE) occlusion_steps += w.shadow && w.walk.walks ? 1u : 0u;
    walk_on(w.walk, w.ray, w.leaving, w.shadow, steps);
}

// Walks the tree for as long as most lanes have a ray to walk with, and then a while longer if that is all there is
// to do; `connecting`: with segments, otherwise with paths.
void walk_pockets(inout Pocket pocket, inout PocketWalk w, Run run, Held h, bool connecting) {
    uint until_check = CHECK_WALKS;
    do {
        pocket_fetch(pocket, w);
        // Three steps from one fetch to the next. They would be counted as loops, where these have a budget; and vectors of sixteen
        // lanes take .94 to 1.0 of the time without (lavapipe 25.0.7), which those of eight do not gain.
        if (LOOP_BUDGET > 0u || SUBGROUP_LANES > 8u) {
            walk_further(w);
            walk_further(w);
            walk_further(w);
        } else {
            [[dont_unroll]] for (uint i = 0u; i < 3u; ++i) walk_further(w);
        }
        loops += 1u;
        pocket_finish(pocket, w);
        if (--until_check == 0u) {
            until_check = CHECK_WALKS;
            bool can = connecting ? can_connect(pocket, run) : can_advance(h, pocket, run);
            uint count = lanes(has_ray(pocket, w));
            if (count == 0u || (count < ENOUGH_LANES && lanes(can) >= ENOUGH_LANES)) break;
        }
    } while (!out_of_budget());
}

// Makes what lanes have noted visible to the others, which on a CPU have all come as far. For all lanes to call.
void share_notes() {
    subgroupMemoryBarrierImage();
    subgroupMemoryBarrierBuffer();
    if (THREADS) subgroupBarrier();
}

// Samples that a slot still lacks.
uint wanted_samples(uint slot) {
    uvec2 at;
    bool real = slot < end_slot && pixel_of_slot(slot, at);
    uint film_place = film_slot(slot);
    return real ? samples_lacking(film_state(film_place), film_count(film_place), NOTHING) : 0u;
}

// What came of a dispatch.
struct Added {
    uint samples;
    uint reused;
    uint bad;
};

// Adds to the film what has been noted of a tile's paths, in the order of the samples, up to the first sample that did not end;
// `reusing`: with what the others of their groups have noted, if memory is where paths are shared. (Asked each time, and not of
// a variable: src/gpu/prune.rs knows of none.)
void add_noted(uint tile, uint complete, bool reusing, inout Added added) {
    for (uint p = gl_SubgroupInvocationID; p < work_pixels; p += gl_SubgroupSize) {
        uvec2 at;
        uint slot = slot_of_tile(tile, p);
        if (slot < end_slot && pixel_of_slot(slot, at)) {
            uint film_place = film_slot(slot);
            FilmPixel film_pixel = film_load(film_place);
            uint first = film_pixel.count;
            uint target = target_of(film_pixel.state);
            for (uint s = 0u; s < complete; ++s) {
                uint path = region + s * work_pixels + p;
                vec4 light;
                vec3 gathered, unshared;
                if (!SHARED_BY_LANES && reusing) {
                    light = shared_light(path, gathered, unshared);
                } else {
                    vec3 aimed;
                    light = noted_light(path, aimed);
                    light.xyz += aimed;
                    if (GLANCES > 0u && REUSE) light.xyz += path_load(path, ROW_APART).xyz;
                }
                if (light.w == PATH_OPEN || film_pixel.count >= target) break;
                float apart = !SHARED_BY_LANES && reusing ? trial_sign(film_pixel.count) * brightness(light.xyz - gathered) : 0.0;
                bool good = film_add(film_pixel, light.xyz);
                film_pixel.trial += good ? apart : 0.0;
                added.bad += good ? 0u : 1u;
                if (!SHARED_BY_LANES && reusing) {
                    path_store(path, ROW_DIRECT, good ? vec4(gathered, brightness(unshared)) : vec4(0.0));
                }
            }
            film_store(film_place, film_pixel);
            if (!SHARED_BY_LANES && reusing) {
                path_store(region + p, ROW_FIRST, uintBitsToFloat(uvec4(first, film_pixel.count, 0u, 0u)));
            }
            added.samples += film_pixel.count - first;
            added.reused += !SHARED_BY_LANES && reusing && reuses(p) ? film_pixel.count - first : 0u;
        }
    }
    if (!SHARED_BY_LANES && reusing) {
        share_notes();
        if (!THREADS) subgroupBarrier();
        for (uint p = gl_SubgroupInvocationID; p < work_pixels; p += gl_SubgroupSize) {
            uvec2 at;
            uint slot = slot_of_tile(tile, p);
            if (slot < end_slot && pixel_of_slot(slot, at)) note_gradients(region + p, film_slot(slot));
        }
    }
}

// Takes the samples of the tiles from slot `tile` on.
void trace_tiles(uint tile, Camera camera, inout Counts counts) {
    uint samples = min(max_new_samples, sample_of_path(PATHS));
    bool reusing = REUSE && reused_halves != 0u;
    uint shadow_rays_before = shadow_rays;
    uint occlusion_steps_before = occlusion_steps;
    next_run = 0u;
    // Nobody reads the notes of the last tiles any more.
    if (THREADS) subgroupBarrier();
    if (NOTES_ARE_CLEARED) {
        uint most = 0u;
        [[dont_unroll]] for (uint p = gl_SubgroupInvocationID; p < work_pixels; p += gl_SubgroupSize) {
            uint wanted = reusing ? wanted_samples(slot_of_tile(tile, p)) : samples;
            most = max(most, wanted);
            [[dont_unroll]] for (uint s = 0u; s < samples; ++s) path_clear(region + s * work_pixels + p, s < wanted, reusing);
        }
        share_notes();
        loops += (1u + samples) * work_pixels / gl_SubgroupSize;
        samples = min(samples, subgroupMax(most));
    }
    // What is left of the budget must do for reusing the paths and for the film.
    budget = reusing ? LOOP_BUDGET / 2u : LOOP_BUDGET;
    uvec2 corner = tile_corner(tile / TILE);

    Held h = held_nothing();
    Pocket pocket = pocket_empty();
    PocketWalk w = pocket_walk_idle();
    Run run = Run(0u, 0u, 0u, 0u, 0u);
    do {
        advance(camera, corner, tile, samples, h, pocket, run, w);
        if (HAS_TREE) walk_pockets(pocket, w, run, h, false);
    } while (!out_of_budget() && any_lane(has_ray(pocket, w) || can_advance(h, pocket, run)));
    if (!SHARED_BY_LANES && reusing) {
        // The paths have ended, or the budget did not suffice for them; then they are given up.
        pocket = pocket_empty();
        w = pocket_walk_idle();
        run.slot = gl_SubgroupInvocationID;
        run.left = (samples * work_pixels * SEGMENTS + gl_SubgroupSize - 1u - run.slot) / gl_SubgroupSize;
        // Some must be left for further samples of lights.
        budget = LIGHT_SAMPLES > 1u ? LOOP_BUDGET / 4u * 3u : LOOP_BUDGET;
        share_notes();
        do {
            connect_paths(pocket, run, w);
            if (HAS_TREE) walk_pockets(pocket, w, run, h, true);
        } while (!out_of_budget() && any_lane(has_ray(pocket, w) || can_connect(pocket, run)));
    }
    share_notes();
    Added added = Added(0u, 0u, 0u);
    uint complete = samples;    // samples of each pixel before the first that is not to be had
    if (!SHARED_BY_LANES && reusing) {
        // Segments that the budget did not suffice for are missing.
        uint waiting = sample_of_path(pocket_first_segment(pocket) / MEMBERS);
        uint missing = min(waiting, run.left > 0u ? sample_of_path(run.slot / SEGMENTS) : NOTHING);
        complete = min(samples, subgroupMin(missing));
        if (LIGHT_SAMPLES > 1u) complete = note_light_at_first(tile, region, complete, shadow_rays, loops);
        share_notes();
    }
    if (SHARED_BY_LANES && reusing) {
        added.samples = share_noted(tile, region, samples, shadow_rays, loops, added.bad, added.reused);
    } else {
        add_noted(tile, complete, reusing, added);
    }
    if (is_scattered()) {
        // What its paths took in all is left to the first pixels, each by the lane that has stored it. (A barrier would make what
        // lanes hold across pieces go through memory, which takes lavapipe 1.1 times the time.)
        share_notes();
        uint cost = cost_of(shadow_rays - shadow_rays_before, occlusion_steps - occlusion_steps_before);
        [[dont_unroll]] for (uint i = gl_SubgroupInvocationID; i < TILE; i += gl_SubgroupSize) {
            uint slot = slot_of_tile(tile, SHARED_BY_LANES && reusing ? pixel_in_groups(i) : i);
            if (slot < end_slot) film_note_cost(slot, i < gl_SubgroupSize ? cost : 0u);
        }
    }
    counts.samples += added.samples;
    counts.reused += added.reused;
    counts.bad += added.bad;
}

void main() [[maximally_reconverges]] {
    load_scene();
    // The host asks for workgroups of one subgroup; a device that cuts them up must not go on.
    if (gl_NumSubgroups != 1u || (SHARED_BY_LANES && gl_SubgroupSize != SUBGROUP_LANES)) {
        if (subgroupElect()) count_up(COUNT_MISFITS, 1u);
        return;
    }
    if (max_new_samples == 0u) return;
    Camera camera = frame_camera();
    Counts counts = Counts(0u, 0u, 0u, 0u, 0u, 0u, 0u);
    uint r = acquire_region();
    region = r * PATHS;
    bool works;
    do {
        uint piece = next_number();
        works = piece < pieces;
        if (works) trace_tiles(first_slot + place_of_piece(piece) * tile_step * work_pixels, camera, counts);
    } while (DRAWS_WORK && works);
    release_region(r);
    if (PATH_STATS) steps += walked_steps;
    counts.rays = rays;
    counts.shadow_rays = shadow_rays;
    counts.steps = steps;
    add_counts(counts);
}
