#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
// Path tracing with a queue for each subgroup. Most rays of most scenes never come near the mesh, and those that do
// walk the tree for very different numbers of steps: traced where they arise, they leave most lanes idle. Here a ray
// that meets the tree's boxes is parked, and its lane goes on with another path. When the queue is full or nothing
// else is left to do, all lanes trace parked rays together, each fetching the next one when it is done; then paths
// go on from their results.
//
// A workgroup is one subgroup. It owns a tile of 64 pixels and begins their samples in order. Each path sums its light
// in slots of its own, and the film is summed in the order of the samples: the image does not depend on how work is
// cut or scheduled, and no stage needs the host.

#include "lib/path.glsl"
#include "lib/film.glsl"

layout(local_size_x_id = 0, local_size_y = 1, local_size_z = 1) in;

#include "lib/pixel_order.glsl"
#include "lib/trace.glsl"

const uint TILE = 64u;                  // pixels of a workgroup
const uint SLOT_BITS = 10u;
const uint PATHS = 1u << SLOT_BITS;     // paths of a workgroup in one dispatch
const uint TRACED = 0x80000000u;        // in an entry whose ray has its hit already
const uint RAYS = 512u;                 // parked rays
const uint SHADOWS = 512u;              // parked shadow rays
const uint RAY_SIZE = 5u;               // vec4s of an entry
const uint SHADOW_SIZE = 3u;
const uint NOTHING = 0xffffffffu;

// A region: a ring of rays, shadow rays, and for each path the light found at once (w: the round it ended in) and the
// light whose shadow rays went through the tree.
const uint REGION_SIZE = RAYS * RAY_SIZE + SHADOWS * SHADOW_SIZE + PATHS * 2u;
uint region;
uint ray_entry(uint i) { return region + (i % RAYS) * RAY_SIZE; }
uint shadow_entry(uint i) { return region + RAYS * RAY_SIZE + i * SHADOW_SIZE; }
uint path_slot(uint i) { return region + RAYS * RAY_SIZE + SHADOWS * SHADOW_SIZE + i * 2u; }

// What the subgroup shares; the same in all lanes.
uint loops = 0u;
uint ray_head = 0u;         // rays from here to ray_traced have been traced and wait to be resumed
uint ray_traced = 0u;       // rays from here to ray_tail are parked
uint ray_tail = 0u;
uint shadow_count = 0u;
uint rays = 0u;             // of this lane
uint shadow_rays = 0u;
uint steps = 0u;
uint tree_rays = 0u;

uint rank(bool wanted) { return subgroupBallotExclusiveBitCount(subgroupBallot(wanted)); }
uint lanes(bool wanted) { return subgroupBallotBitCount(subgroupBallot(wanted)); }
bool out_of_budget() { return LOOP_BUDGET > 0u && loops >= LOOP_BUDGET; }

// A path in a lane's hands.
struct Held {
    Path path;
    vec3 radiance;
    uint slot;      // NOTHING: no path
    float t;        // its ray's hit, once known
    int id;
};

void park(bool wanted, Held h, bool traced) {
    uint e = ray_entry(ray_tail + rank(wanted));
    if (wanted) {
        queue[e] = vec4(h.path.origin, h.t);
        queue[e + 1u] = vec4(h.path.direction, intBitsToFloat(h.id));
        queue[e + 2u] = vec4(h.path.throughput, intBitsToFloat(h.path.leaving));
        // A traced ray is marked, and only passes through the next trace.
        uint bits = h.slot | (h.path.hits << SLOT_BITS) | (traced ? TRACED : 0u);
        queue[e + 3u] = vec4(h.radiance, uintBitsToFloat(bits));
        if (EMITTER_COUNT > 0u) queue[e + 4u] = vec4(h.path.normal, h.path.pdf);
    }
    ray_tail += lanes(wanted);
}

void resume(bool wanted, uint i, inout Held h) {
    if (!wanted) return;
    uint e = ray_entry(i);
    vec4 v0 = queue[e];
    vec4 v1 = queue[e + 1u];
    vec4 v2 = queue[e + 2u];
    vec4 v3 = queue[e + 3u];
    vec4 v4 = EMITTER_COUNT > 0u ? queue[e + 4u] : vec4(0.0);
    uint bits = floatBitsToUint(v3.w);
    h.slot = bits & (PATHS - 1u);
    h.path = Path(v0.xyz, v1.xyz, floatBitsToInt(v2.w), v2.xyz, (bits & ~TRACED) >> SLOT_BITS, 0u, v4.xyz, v4.w);
    h.radiance = v3.xyz;
    h.t = v0.w;
    h.id = floatBitsToInt(v1.w);
}

void park_shadow(bool wanted, ShadowRay ray, uint slot) {
    uint e = shadow_entry(shadow_count + rank(wanted));
    if (wanted) {
        queue[e] = vec4(ray.origin, ray.distance);
        queue[e + 1u] = vec4(ray.direction, intBitsToFloat(ray.leaving));
        queue[e + 2u] = vec4(ray.radiance, uintBitsToFloat(slot));
    }
    shadow_count += lanes(wanted);
}

// Traces all parked rays: closest hits first, then shadow rays, of which the hidden ones turn black.
void trace_parked() {
    uint ray_count = ray_tail - ray_traced;
    uint total = ray_count + shadow_count;
    uint next = gl_SubgroupSize;
    uint mine = gl_SubgroupInvocationID;
    bool busy = false;
    bool shadow = false;
    uint entry = 0u;
    int leaving = -1;
    TreeRay ray = tree_ray(vec3(0.0), vec3(0.0, 0.0, 1.0));
    Walk walk = Walk(FINISHED, 1, 0.0, -1);
    bool fetch = true;
    while (!out_of_budget()) {
        if (fetch && mine < total) {
            shadow = mine >= ray_count;
            entry = shadow ? shadow_entry(mine - ray_count) : ray_entry(ray_traced + mine);
            vec4 v0 = queue[entry];
            vec4 v1 = queue[entry + 1u];
            vec4 v2 = queue[entry + 2u];
            ray = tree_ray(v0.xyz, v1.xyz);
            walk = walk_begin(v0.w);
            leaving = floatBitsToInt(shadow ? v1.w : v2.w);
            bool traced = !shadow && (floatBitsToUint(queue[entry + 3u].w) & TRACED) != 0u;
            if (traced) walk.current = FINISHED;
            tree_rays += traced ? 0u : 1u;
            busy = true;
        }
        if (!subgroupAny(busy)) break;
        // Once no more rays wait, the last ones are walked to their ends.
        uint enough = next < total ? REFILL_BELOW : 1u;
        do {
            if (walk.current != FINISHED) {
                walk_step(walk, ray, leaving, shadow);
                if (PATH_STATS) steps += 1u;
            }
            loops += 1u;
        } while (lanes(walk.current != FINISHED) >= enough && !out_of_budget());
        fetch = busy && walk.current == FINISHED;
        if (fetch && walk.id >= 0) {
            // A closest hit: its distance and id. A hidden shadow ray: no light.
            uint e = shadow ? entry + 2u : entry;
            queue[e] = shadow ? vec4(0.0, 0.0, 0.0, queue[e].w) : vec4(ray.origin, walk.t);
            if (!shadow) queue[entry + 1u].w = intBitsToFloat(walk.id);
        }
        busy = busy && !fetch;
        uint taken = rank(fetch);
        mine = fetch ? next + taken : mine;
        next += lanes(fetch);
        loops += 1u;
    }
}

// Adds the light of the shadow rays to their paths, one lane after the other: two rays may belong to one path, and
// the order of a path's sum must not depend on which lanes they sit in.
void collect_shadows() {
    for (uint first = 0u; first < shadow_count; first += gl_SubgroupSize) {
        uint i = first + gl_SubgroupInvocationID;
        vec4 v = i < shadow_count ? queue[shadow_entry(i) + 2u] : vec4(0.0);
        uint slot = floatBitsToUint(v.w);
        bool lit = i < shadow_count && v.x + v.y + v.z != 0.0;
        uint count = min(gl_SubgroupSize, shadow_count - first);
        for (uint lane = 0u; lane < count; ++lane) {
            if (lane == gl_SubgroupInvocationID && lit) queue[path_slot(slot) + 1u].xyz += v.xyz;
            subgroupMemoryBarrierBuffer();
            loops += 1u;
        }
        loops += 1u;
    }
}

// One of the regions that no other workgroup holds. There are more of them than workgroups can run at one time.
uint acquire_region() {
    uint r = 0u;
    if (subgroupElect()) {
        if (REGIONS == 0u) {
            r = gl_WorkGroupID.x;
        } else {
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
    }
    memoryBarrierBuffer();
    return subgroupBroadcastFirst(r);
}

void release_region(uint r) {
    memoryBarrierBuffer();
    if (REGIONS > 0u && subgroupElect()) atomicAnd(pool[r / 32u], ~(1u << (r % 32u)));
}

void main() {
    uint tile = first_slot + gl_WorkGroupID.x * TILE;
    if (tile >= end_slot || max_new_samples == 0u) return;
    // The host asks for workgroups of one subgroup; a device that cuts them up must not go on.
    if (gl_NumSubgroups != 1u) {
        if (subgroupElect()) atomicAdd(counters[COUNT_TRUNCATED], 1u);
        return;
    }
    uint r = acquire_region();
    region = r * REGION_SIZE;

    // All pixels of a tile may do as many samples as its slots hold; a pixel that is ahead of the others just ends
    // sooner.
    uint samples = min(max_new_samples, PATHS / TILE);
    uint paths = TILE * samples;
    uint next_path = 0u;
    for (uint i = gl_SubgroupInvocationID; i < paths; i += gl_SubgroupSize) {
        queue[path_slot(i)] = vec4(0.0);
        queue[path_slot(i) + 1u] = vec4(0.0);
    }
    loops += paths / gl_SubgroupSize;
    subgroupMemoryBarrierBuffer();

    // Half of a budget is for beginning paths, the rest for ending them; and what is parked must fit into it.
    uint rays_at_once = LOOP_BUDGET == 0u ? RAYS : clamp(LOOP_BUDGET / 32u, 2u * gl_SubgroupSize, RAYS);
    float round = 1.0;
    bool complete = true;
    while (true) {
        // ---- advance paths until the queues are full or nothing is left to do without them
        Held h;
        h.slot = NOTHING;
        h.t = 0.0;
        h.id = -1;
        h.radiance = vec3(0.0);
        h.path = Path(vec3(0.0), vec3(0.0, 0.0, 1.0), -1, vec3(0.0), 0u, 0u, vec3(0.0), 0.0);
        while (!out_of_budget()) {
            // Shade the hits that lanes hold.
            bool held = h.slot != NOTHING;
            uint pixel = 0u;
            uint slot_in_tile = held ? h.slot % TILE : 0u;
            bool real = pixel_of_slot(tile + slot_in_tile, pixel);
            uint key = pixel_key(pixel);
            uint done = floatBitsToUint(film[FILM_ROWS * (tile + slot_in_tile - band_first)].w);
            h.path.index = held ? done + h.slot / TILE : 0u;
            Arrival arrival;
            ShadowRay shadow;
            vec3 radiance = h.radiance;
            bool alive = path_arrive(h.path, held ? h.id : -1, h.t, key, radiance, arrival, shadow) && held;
            h.radiance = held ? radiance : vec3(0.0);
            rays += held ? 1u : 0u;
            if (HAS_DIFFUSE && LIGHT_COUNT + EMITTER_COUNT > 0u) {
                bool wanted = held && shadow.wanted;
                shadow_rays += wanted ? 1u : 0u;
                bool hidden;
                bool later = shadow_needs_tree(shadow, hidden) && wanted;
                if (wanted && !hidden && !later) h.radiance += shadow.radiance;
                park_shadow(later, shadow, h.slot);
            }
            if (held && !alive) {
                queue[path_slot(h.slot)] = vec4(h.radiance, round);
                h.slot = NOTHING;
            }

            // Lanes without a path resume a traced ray, else begin a new path.
            // Every path in hand or waiting may have to be parked once more: there must be room for all of them.
            uint left = ray_traced - ray_head;
            bool room = ray_tail - ray_head + gl_SubgroupSize <= rays_at_once;
            bool may_begin = room && (LOOP_BUDGET == 0u || loops < LOOP_BUDGET / 2u);
            uint order = rank(!alive);
            bool resumes = !alive && order < left;
            uint resume_index = ray_head + order;
            ray_head += min(left, lanes(!alive));
            bool begins = !alive && !resumes && may_begin;
            uint number = next_path + rank(begins);
            next_path = min(paths, next_path + lanes(begins));
            begins = begins && number < paths;
            if (begins) {
                bool inside = pixel_of_slot(tile + number % TILE, pixel);
                done = floatBitsToUint(film[FILM_ROWS * (tile + number % TILE - band_first)].w);
                uint index = done + number / TILE;
                begins = inside && tile + number % TILE < end_slot && index < target_samples;
                key = pixel_key(pixel);
                h.path.index = index;
                h.slot = begins ? number : NOTHING;
                h.radiance = vec3(0.0);
            }

            // Next rays of living paths and first rays of new ones.
            path_depart(h.path, arrival, alive, pixel, key, h.path.index);
            bool fresh = alive || begins;
            float t = INFINITY;
            int id = -1;
            closest_constant(h.path.origin, h.path.direction, h.path.leaving, t, id);
            h.t = t;
            h.id = id;
            bool waits = fresh && meets_tree(h.path.origin, h.path.direction, t);
            resume(resumes, resume_index, h);
            h.slot = alive || begins || resumes ? h.slot : NOTHING;
            // No room for the shadow rays of one more step: put down what is in hand.
            bool full = shadow_count + gl_SubgroupSize > SHADOWS;
            bool parks = waits || (full && h.slot != NOTHING);
            park(parks, h, !waits);
            h.slot = parks ? NOTHING : h.slot;
            loops += 1u + LIGHT_LOOPS;
            bool more = ray_head < ray_traced || (may_begin && next_path < paths);
            if (full || (subgroupAll(h.slot == NOTHING) && !more)) break;
        }
        subgroupMemoryBarrierBuffer();
        if (ray_tail - ray_head + shadow_count == 0u) break;

        // ---- trace what was parked, then go on with it
        trace_parked();
        subgroupMemoryBarrierBuffer();
        if (out_of_budget()) {
            complete = false;
            break;
        }
        collect_shadows();
        shadow_count = 0u;
        ray_traced = ray_tail;
        round += 1.0;
        subgroupMemoryBarrierBuffer();
    }
    subgroupMemoryBarrierBuffer();

    // ---- the film, in the order of the samples, up to the first sample that did not end
    uint committed = 0u;
    uint bad = 0u;
    for (uint p = gl_SubgroupInvocationID; p < TILE; p += gl_SubgroupSize) {
        uint pixel;
        if (tile + p < end_slot && pixel_of_slot(tile + p, pixel)) {
            FilmPixel film_pixel = film_load(tile + p);
            uint first = film_pixel.count;
            for (uint s = 0u; s < samples; ++s) {
                vec4 direct = queue[path_slot(s * TILE + p)];
                bool ended = direct.w > 0.0 && (complete || direct.w < round);
                if (!ended || film_pixel.count >= target_samples) break;
                vec3 radiance = direct.xyz + queue[path_slot(s * TILE + p) + 1u].xyz;
                bad += film_add(film_pixel, radiance) ? 0u : 1u;
            }
            film_store(tile + p, film_pixel);
            committed += film_pixel.count - first;
        }
    }
    release_region(r);
    atomicAdd(counters[COUNT_SAMPLES], committed);
    atomicAdd(counters[COUNT_RAYS], rays);
    atomicAdd(counters[COUNT_SHADOW], shadow_rays);
    if (PATH_STATS) atomicAdd(counters[COUNT_STEPS], steps);
    if (PATH_STATS) atomicAdd(counters[COUNT_TREE_RAYS], tree_rays);
    if (bad > 0u) atomicAdd(counters[COUNT_BAD], bad);
}
