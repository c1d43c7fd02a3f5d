// What is recorded of paths in memory: of each its light, or L once the second hit is diffuse; then, when it arrives at its second
// hit, x and y, their normals, and the light from x itself.
//
// The lanes of a group fetch that once paths have ended, and share it as reuse_lanes.glsl does.

#ifndef REUSE_QUEUE_GLSL
#define REUSE_QUEUE_GLSL

#include "gradient.glsl"
#include "reuse_lanes.glsl"

const uint SLOT_BITS = 11u;     // of a path's number in its workgroup

const uint ROW_LIGHT = 0u;      // light; then one of the states below
const uint ROW_FIRST = 1u;      // x; the id that a ray from it leaves
const uint ROW_FIRST_NORMAL = 2u;   // shading normal; which hit of its path x is
const uint ROW_SECOND = 3u;     // y; β.g
const uint ROW_SECOND_NORMAL = 4u;  // geometric normal; β.b
const uint ROW_DIRECT = 5u;     // light from x itself, β.r
const uint ROW_FIRST_UP = 6u;   // with SMOOTH_NORMALS: geometric normal of x
const uint ROW_FIRST_PART = 7u; // with HAS_PARTS: β, which the rows of y leave out, and FirstVertex::share;
const uint ROW_FIRST_FADING = 8u;   // of x,
const uint ROW_SECOND_FADING = 9u;  // and of y;
const uint ROW_SECOND_SHADING = 10u;    // shading normal of y

const float PATH_OPEN = 0.0;    // it has not ended
const float PATH_ENDED = 1.0;   // all its light is its own
const float PATH_GIVES = 2.0;   // its light leaves y
const float PATH_MET = 3.0;     // it has x and y, but all its light is its own

// A row of all paths after another: lanes write next to each other.
int path_texel(uint path, uint row) { return int(row * (REGIONS << SLOT_BITS) + path); }
vec4 path_load(uint path, uint row) { return uintBitsToFloat(imageLoad(path_texels, path_texel(path, row))); }
void path_store(uint path, uint row, vec4 value) { path_rows[path_texel(path, row)] = value; }

// Only where loops have a budget some paths may not end.
const bool STATES_ARE_CLEARED = LOOP_BUDGET > 0u;

// The path has not begun.
void path_clear(uint path) {
    if (STATES_ARE_CLEARED) path_store(path, ROW_LIGHT, vec4(0.0, 0.0, 0.0, PATH_OPEN));
}

// The pixel of the workgroup's tiles that a path is of, and the number of its sample.
uint pixel_of_path(uint path) { return path & (work_pixels - 1u); }
uint sample_of_path(uint path) { return path >> (TILE_BITS + tile_bits); }

// Records a path at its first hit.
void record_first_hit(uint path, Vertex v) {
    FirstVertex first = first_vertex_of(v);
    if (SMOOTH_NORMALS) path_store(path, ROW_FIRST_UP, vec4(first.up, 0.0));
    if (HAS_PARTS && is_reconnectable(v.bsdf)) {
        path_store(path, ROW_FIRST_PART, vec4(first.beta, first.share));
        path_store(path, ROW_FIRST_FADING, first.fading);
    }
}

// Records a path that arrives at its second hit, with the light from its first one.
void record_second_hit(uint path, Path p, Vertex v, float t, vec3 direct) {
    vec3 y = end_of_segment(v, t);
    [[dont_unroll]] for (uint row = ROW_FIRST; row <= ROW_DIRECT; ++row) {
        vec4 value = vec4(p.origin, intBitsToFloat(p.self_id));
        if (row == ROW_FIRST_NORMAL) value = vec4(p.normal, float(p.hits));
        if (row == ROW_SECOND) value = vec4(y, p.throughput.y);
        if (row == ROW_SECOND_NORMAL) value = vec4(v.shareable ? v.up : vec3(0.0), p.throughput.z);
        if (row == ROW_DIRECT) value = vec4(direct, p.throughput.x);
        path_store(path, row, value);
    }
    if (HAS_PARTS) {
        path_store(path, ROW_SECOND_FADING, fading_of(v.bsdf));
        if (SMOOTH_NORMALS) path_store(path, ROW_SECOND_SHADING, vec4(shading_of_second(v), 0.0));
    }
}

// What has been recorded of a path that has ended.
EndedPath recorded_path(uint path) {
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
        FirstVertex first = first_vertex_none();
        vec3 beta = vec3(direct.w, y.w, ny.w);
        vec3 shading = ny.xyz;
        vec4 fading = vec4(0.0);
        if (SMOOTH_NORMALS) first.up = path_load(path, ROW_FIRST_UP).xyz;
        if (HAS_PARTS) {
            vec4 part = path_load(path, ROW_FIRST_PART);
            beta = part.xyz;
            first.share = part.w;
            first.fading = path_load(path, ROW_FIRST_FADING);
            fading = path_load(path, ROW_SECOND_FADING);
            if (SMOOTH_NORMALS) shading = path_load(path, ROW_SECOND_SHADING).xyz;
        }
        ended.vertices = PathVertices(x.xyz, nx.w, floatBitsToInt(x.w), nx.xyz, first, beta, y.xyz, ny.xyz, shading, fading,
                                direct.xyz, light.w == PATH_GIVES);
    }
    return ended;
}

// Shares the recorded paths of a workgroup's tiles, `samples` for each pixel, and adds them to the film in their order, up to the
// first that did not end. Returns how many there were; `reused` of those pixels that serve others.
uint share_recorded(uint tile, uint region, uint samples, inout uint shadow_rays, inout uint loops, inout uint bad,
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
        bool enabled = real && count < target;
        [[dont_unroll]] for (uint s = 0u; s < samples && any_lane(enabled && complete); ++s) {
            uint path = region + s * work_pixels + p;
            EndedPath ended = ended_none();
            if (LOOP_BUDGET > 0u) {
                // Either all of a group have a sample or none.
                float open = sum_of_group(enabled && path_load(path, ROW_LIGHT).w == PATH_OPEN ? 1.0 : 0.0);
                complete = complete && open == 0.0;
            }
            if (enabled && complete) ended = recorded_path(path);
            complete = share_sample(ended, film_pixel, gradients, key, shadow_rays, loops, bad) && complete;
            enabled = real && film_pixel.count < target;
        }
        if (real) {
            film_store(slot, film_pixel);
            gradients_store(slot, gradients);
        }
        added += film_pixel.count - count;
        reused += reuses() ? film_pixel.count - count : 0u;
    }
    return added;
}

#endif
