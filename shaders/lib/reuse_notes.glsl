// What is noted of paths in memory: of each its light, or L once the second hit is diffuse; then, when it arrives at its second
// hit, x and y, their normals, and the light from x itself.
//
// Where a subgroup has room for the lanes of a group they fetch that once paths have ended, and share it as reuse_lanes.glsl
// does (mesh of 69 thousand triangles in a room, lavapipe 25: .83 of the time). Elsewhere, and, without further samples of lights,
// where a branch that no lane takes is executed all the same (lavapipe 22: .8 to 1 of the time), a path reads in memory what the
// others have noted: then couplings are noted too, and a normal of 0 stands for a hit that is not there.

#ifndef REUSE_NOTES_GLSL
#define REUSE_NOTES_GLSL

#include "gradient.glsl"
#include "reuse_lanes.glsl"

const uint SLOT_BITS = 11u;     // of a path's number in its workgroup

const uint ROW_LIGHT = 0u;      // light; then one of the states below
const uint ROW_FIRST = 1u;      // x; the id that a ray from it leaves
const uint ROW_FIRST_NORMAL = 2u;   // shading normal; which hit of its path x is
const uint ROW_SECOND = 3u;     // y; β.g
const uint ROW_SECOND_NORMAL = 4u;  // geometric normal; β.b
const uint ROW_DIRECT = 5u;     // light from x itself, β.r; in memory in the end what its pixel has gathered, see gradient.glsl
const uint ROW_COUPLINGS = 6u;  // two rows: a(x, y) of its y and each member's x
const uint ROW_FIRST_UP = 8u;   // with SMOOTH_NORMALS: geometric normal of x
const uint ROW_LIGHT_AT_FIRST = 9u;    // in memory, with LIGHT_SAMPLES: the mean of the light from x itself

const float PATH_UNWANTED = -1.0;   // its pixel is to get no such sample
const float PATH_OPEN = 0.0;    // it has not ended
const float PATH_ENDED = 1.0;   // all its light is its own
const float PATH_GIVES = 2.0;   // its light leaves y
const float PATH_MET = 3.0;     // it has x and y, but all its light is its own

// Whether lanes share what has been noted, or memory is where it is shared.
layout(constant_id = 201) const bool SHARED_BY_LANES = false;

// A row of all paths after another: lanes write next to each other.
int path_texel(uint path, uint row) { return int(row * (REGIONS << SLOT_BITS) + path); }
vec4 path_load(uint path, uint row) { return uintBitsToFloat(imageLoad(path_texels, path_texel(path, row))); }
void path_store(uint path, uint row, vec4 value) { path_rows[path_texel(path, row)] = value; }

// Where loops have no budget all paths end, and lanes know which of them are wanted.
const bool NOTES_ARE_CLEARED = LOOP_BUDGET > 0u || !SHARED_BY_LANES;

// The path has not begun; `reusing`: it may serve others.
void path_clear(uint path, bool wanted, bool reusing) {
    // A loop: less code to compile.
    [[dont_unroll]] for (uint i = 0u; i < 3u; ++i) {
        uint row = i == 0u ? ROW_LIGHT : (i == 1u ? ROW_FIRST_NORMAL : ROW_SECOND_NORMAL);
        if (i == 0u || (reusing && !SHARED_BY_LANES)) path_store(path, row, vec4(0.0, 0.0, 0.0, i == 0u && !wanted ? PATH_UNWANTED : PATH_OPEN));
    }
}

// Notes a(x, y) of a path's y and of the x of a member of its group.
void note_coupling(uint path, uint member, float value) {
    path_numbers[4 * path_texel(path, ROW_COUPLINGS + member / 4u) + int(member % 4u)] = value;
}

// The pixel of the workgroup's tiles that a path is of, and the number of its sample.
uint pixel_of_path(uint path) { return path & (work_pixels - 1u); }
uint sample_of_path(uint path) { return path >> (TILE_BITS + tile_bits); }

// Notes a path that arrives at its second hit, with the light from its first one.
void note_second_hit(uint path, Path p, Arrival a, float t, vec3 direct) {
    vec3 y = end_of_segment(a, t);
    [[dont_unroll]] for (uint row = ROW_FIRST; row <= ROW_DIRECT; ++row) {
        vec4 value = vec4(p.origin, intBitsToFloat(p.leaving));
        if (row == ROW_FIRST_NORMAL) value = vec4(p.normal, float(p.hits));
        if (row == ROW_SECOND) value = vec4(y, abs(p.throughput.y));
        if (row == ROW_SECOND_NORMAL) value = vec4(a.gives ? a.up : vec3(0.0), abs(p.throughput.z));
        if (row == ROW_DIRECT) value = vec4(direct, abs(p.throughput.x));
        path_store(path, row, value);
    }
    if (SHARED_BY_LANES) return;
    vec3 direction;
    float distance;
    note_coupling(path, member_of(path), coupling(p.origin, p.normal, y, a.up, direction, distance));
}

// The segment from the first hit of path `to` to the second hit y of path `from`; `wanted` if light can take it.
ShadowRay connect(uint from, vec3 y, vec3 normal, uint to, out float value) {
    vec4 x = path_load(to, ROW_FIRST);
    ShadowRay ray = ShadowRay(x.xyz, normal, 0.0, floatBitsToInt(x.w), vec3(0.0), false);
    vec4 nx = path_load(to, ROW_FIRST_NORMAL);
    value = coupling(x.xyz, nx.xyz, y, normal, ray.direction, ray.distance);
    if (SEES_THROUGH) value = nx.w == path_load(from, ROW_FIRST_NORMAL).w ? value : 0.0;
    if (SMOOTH_NORMALS) value = dot(path_load(to, ROW_FIRST_UP).xyz, ray.direction) > 0.0 ? value : 0.0;
    ray.wanted = value > 0.0;
    return ray;
}

// All light of a path's pixel for one sample, and PATH_ENDED; or PATH_OPEN if any path of the group that is wanted has
// not ended: either all of a group have a sample or none. The part of it that comes by what the group shares is
// `gathered`; it would be `unshared` without the others.
vec4 shared_light(uint path, out vec3 gathered, out vec3 unshared) {
    bool complete = true;
    vec3 own = vec3(0.0);
    vec3 sum = vec3(0.0);
    vec3 given = vec3(0.0);
    uint me = member_of(path);
    [[dont_unroll]] for (uint member = 0u; member < MEMBERS; ++member) {
        uint from = for_member(path, member);
        vec4 light = path_load(from, ROW_LIGHT);
        vec4 a = path_load(from, ROW_COUPLINGS);
        vec4 b = path_load(from, ROW_COUPLINGS + 1u);
        vec4 four = me < 4u ? a : b;
        vec2 two = (me & 2u) == 0u ? four.xy : four.zw;
        float mine = (me & 1u) == 0u ? two.x : two.y;
        float all = ((((((a.x + a.y) + a.z) + a.w) + b.x) + b.y) + b.z) + b.w;
        complete = complete && light.w != PATH_OPEN;
        if (member == me && light.w != PATH_GIVES) own = light.xyz;
        if (member == me && light.w == PATH_GIVES) given = light.xyz;
        if (light.w == PATH_GIVES && mine > 0.0) sum += light.xyz * (mine / all);
    }
    gathered = vec3(0.0);
    unshared = vec3(0.0);
    vec4 normal = path_load(path, ROW_FIRST_NORMAL);
    if (normal.xyz != vec3(0.0)) {
        vec4 direct_row = path_load(path, ROW_DIRECT);
        vec3 direct = direct_row.xyz;
        if (LIGHT_SAMPLES > 1u) direct = path_load(path, ROW_LIGHT_AT_FIRST).xyz;
        vec3 beta = vec3(direct_row.w, path_load(path, ROW_SECOND).w, path_load(path, ROW_SECOND_NORMAL).w);
        unshared = beta * given;
        gathered = beta * sum;
        // As for lanes (goes_on_from_first).
        if (lights_alike() && uint(normal.w) < MAX_DEPTH) {
            unshared += direct_row.xyz;
            gathered += direct;
        } else {
            own += direct;
        }
        own += gathered;
    }
    return vec4(own, complete ? PATH_ENDED : PATH_OPEN);
}

// The difference of what a pixel has gathered from that of a neighbour; 0 if that lies outside the image.
vec3 difference(vec3 gathered, uint neighbour) {
    bool there = path_load(neighbour, ROW_LIGHT).w != PATH_UNWANTED;
    return there ? gathered - path_load(neighbour, ROW_DIRECT).xyz : vec3(0.0);
}

// Notes the gradients of a pixel, whose first path in the tile this is, once its group's pixels have their samples.
void note_gradients(uint first_path, uint slot) {
    uvec2 samples = floatBitsToUint(path_load(first_path, ROW_FIRST).xy);
    uint member = member_of(first_path);
    uint right_of = has_right(member) ? for_member(first_path, member + 1u) : first_path;
    uint below = has_down(member) ? for_member(first_path, member + 4u) : first_path;
    Gradients g = gradients_load(slot);
    for (uint index = samples.x; index < samples.y; ++index) {
        uint later = (index - samples.x) * work_pixels;
        vec4 own = path_load(first_path + later, ROW_DIRECT);
        vec3 right = difference(own.xyz, right_of + later);
        vec3 down = difference(own.xyz, below + later);
        gradients_add(g, index, own.xyz, own.w, right, down);
    }
    gradients_store(slot, g);
}

// What has been noted of a path that has ended.
EndedPath noted_path(uint path) {
    EndedPath ended = ended_none();
    vec4 light = path_load(path, ROW_LIGHT);
    ended.light = light.xyz;
    ended.there = true;
    if (light.w == PATH_GIVES || light.w == PATH_MET) {
        vec4 x = path_load(path, ROW_FIRST);
        vec4 nx = path_load(path, ROW_FIRST_NORMAL);
        vec4 y = path_load(path, ROW_SECOND);
        vec4 ny = path_load(path, ROW_SECOND_NORMAL);
        vec4 direct = path_load(path, ROW_DIRECT);
        vec3 up = vec3(0.0);
        if (SMOOTH_NORMALS) up = path_load(path, ROW_FIRST_UP).xyz;
        ended.meeting = Meeting(x.xyz, nx.w, floatBitsToInt(x.w), nx.xyz, up, vec3(direct.w, y.w, ny.w), y.xyz, ny.xyz,
                                direct.xyz, light.w == PATH_GIVES);
    }
    return ended;
}

// Notes the light that the paths of a workgroup's tiles get at their first hits, in the order of their samples. Returns for how
// many of each pixel's samples the budget of loops did.
uint note_light_at_first(uint tile, uint region, uint samples, inout uint shadow_rays, inout uint loops) {
    uvec2 corner = tile_corner(tile / TILE);
    [[dont_unroll]] for (uint s = 0u; s < samples; ++s) {
        [[dont_unroll]] for (uint first = 0u; first < work_pixels; first += gl_SubgroupSize) {
            // In all lanes: what the slowest of them takes counts.
            uint p = min(first + gl_SubgroupInvocationID, work_pixels - 1u);
            uint path = region + s * work_pixels + p;
            uint slot = film_slot(slot_of_tile(tile, p));
            uint index = index_of_member(index_after(film_multipliers(slot), film_count(slot)) + s, member_of_group(p));
            Meeting meeting = noted_path(path).meeting;
            uint traced = 0u;
            vec3 light = light_at_first(meeting, key_of_group(corner, p), index, traced, loops);
            if (first + gl_SubgroupInvocationID < work_pixels) {
                path_store(path, ROW_LIGHT_AT_FIRST, vec4(light, 0.0));
                shadow_rays += traced;
            }
            if (LOOP_BUDGET > 0u && subgroupMax(loops + doubtful_loops) >= LOOP_BUDGET) return s;
        }
    }
    return samples;
}

// ---- where lanes share

// Shares the noted paths of a workgroup's tiles, `samples` for each pixel, and adds them to the film in their order, up to the
// first that did not end. Returns how many there were; `reused` of those pixels that serve others.
uint share_noted(uint tile, uint region, uint samples, inout uint shadow_rays, inout uint loops, inout uint bad,
                 inout uint reused) {
    uvec2 corner = tile_corner(tile / TILE);
    uint added = 0u;
    [[dont_unroll]] for (uint first = 0u; first < work_pixels; first += SUBGROUP_LANES) {
        uint p = pixel_in_groups(first + gl_SubgroupInvocationID);
        uint work_slot = slot_of_tile(tile, p);
        uint slot = film_slot(work_slot);
        uvec2 at;
        bool real = first + gl_SubgroupInvocationID < work_pixels && work_slot < end_slot && pixel_of_slot(work_slot, at);
        FilmPixel film_pixel = film_empty();
        Gradients gradients = Gradients(vec4(0.0), vec4(0.0), vec4(0.0));
        if (real) {
            film_pixel = film_load(slot);
            gradients = gradients_load(slot);
        }
        uint key = key_of_group(corner, p);
        uint count = film_pixel.count;
        uint target = target_of(film_pixel.multipliers);
        bool complete = true;
        bool wanted = real && count < target;
        [[dont_unroll]] for (uint s = 0u; s < samples && any_lane(wanted && complete); ++s) {
            uint path = region + s * work_pixels + p;
            EndedPath ended = ended_none();
            if (LOOP_BUDGET > 0u) {
                // Either all of a group have a sample or none.
                float open = sum_of_group(wanted && path_load(path, ROW_LIGHT).w == PATH_OPEN ? 1.0 : 0.0);
                complete = complete && open == 0.0;
            }
            if (wanted && complete) ended = noted_path(path);
            complete = share_sample(ended, film_pixel, gradients, key, shadow_rays, loops, bad) && complete;
            wanted = real && film_pixel.count < target;
        }
        if (real) {
            film_store(slot, film_pixel);
            gradients_store(slot, gradients);
        }
        added += film_pixel.count - count;
        reused += reuses(p) ? film_pixel.count - count : 0u;
    }
    return added;
}

#endif
