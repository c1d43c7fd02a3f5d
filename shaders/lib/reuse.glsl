// Reuse of paths (Bekaert, Sbert and Halton, "Accelerating Path Tracing by Re-Using Paths", EGWR 2002).
//
// Eight pixels are a group. Each has a path whose first hit x is diffuse, in general, and the second hit y too. Then the
// light that leaves y goes to all eight first hits, and each pixel gets eight estimates of its indirect light for the
// cost of one path and seven visibility tests. With a(x, y) = cos(x→y) cos(y→x)/|x − y|² · V(x, y), the density with
// which x would have sampled y is a/π per area, and the balance heuristic (Veach 1997) over the eight gives pixel i
//
//     β_i Σ_j L_j a(x_i, y_j) / Σ_k a(x_k, y_j),
//
// L_j the light that leaves y_j, β_i the throughput at x_i. This is exact for any visibility, as long as it is the same
// in both places. A path whose second hit is not diffuse keeps its light to itself, and its first hit still receives.
//
// Of each path there are noted: its light, or L once the second hit is diffuse; then, when it arrives at its second
// hit, x and y, their normals, and the light from x itself. A normal of 0 stands for a hit that is not there.
//
// That pays where indirect light makes most of the noise; elsewhere it only costs time. So the first TRIAL samples of each
// pixel are a trial, of which the film notes how far the mean of the earlier half is from that of the later half, with
// reuse and, from the same paths, without. The host decides from that (src/render/renderer/trial.rs), apart for the two
// halves of the image that adaptive sampling keeps independent of each other (src/render/progression.rs).

#ifndef REUSE_GLSL
#define REUSE_GLSL

#include "film.glsl"
#include "path.glsl"
#include "pixel_order.glsl"

const uint SLOT_BITS = 11u;     // of a path's number in its workgroup
const uint MEMBERS = PATCHES;   // of a group

const uint ROW_LIGHT = 0u;      // light; then one of the states below
const uint ROW_FIRST = 1u;      // x; the id that a ray from it leaves
const uint ROW_FIRST_NORMAL = 2u;   // shading normal; β.r
const uint ROW_SECOND = 3u;     // y; β.g
const uint ROW_SECOND_NORMAL = 4u;  // geometric normal; β.b
const uint ROW_OWN = 5u;        // light from x itself
const uint ROW_COUPLINGS = 6u;  // two rows: a(x, y) of the group's members, the path itself first
const uint ROW_FIRST_UP = 8u;   // with SMOOTH_NORMALS: geometric normal of x

const uint TRIAL = 4u;          // samples

const float PATH_UNWANTED = -1.0;   // its pixel is to get no such sample
const float PATH_OPEN = 0.0;    // it has not ended
const float PATH_ENDED = 1.0;   // all its light is its own
const float PATH_GIVES = 2.0;   // its light leaves y

// A row of all paths after another: lanes write next to each other.
int path_texel(uint path, uint row) { return int(row * (REGIONS << SLOT_BITS) + path); }
vec4 path_load(uint path, uint row) { return imageLoad(path_texels, path_texel(path, row)); }
void path_store(uint path, uint row, vec4 value) { path_rows[path_texel(path, row)] = value; }

// Slower, but less code to compile.
void path_store_compactly(uint path, uint row, vec4 value) {
    imageStore(path_texels, path_texel(path, row), value);
}

// The path has not begun; `reusing`: it may serve others.
void path_clear(uint path, bool wanted, bool reusing) {
    path_store_compactly(path, ROW_LIGHT, vec4(0.0, 0.0, 0.0, wanted ? PATH_OPEN : PATH_UNWANTED));
    if (reusing) {
        path_store_compactly(path, ROW_FIRST_NORMAL, vec4(0.0));
        path_store_compactly(path, ROW_SECOND_NORMAL, vec4(0.0));
    }
}

// Notes a(x, y) of a path's y and of the x of a member of its group.
void note_coupling(uint path, uint member, float value) {
    path_numbers[4 * path_texel(path, ROW_COUPLINGS + member / 4u) + int(member % 4u)] = value;
}

// Whether the paths of a slot of a tile serve several pixels.
bool reuses(uint p) { return ((reused_halves >> ((p ^ (p >> 2)) & 1u)) & 1u) != 0u; }

// Notes a sample of a pixel under trial: with reuse, and the path by itself.
void trial_note(inout FilmPixel pixel, vec3 shared_one, vec3 alone) {
    vec2 light = vec2(shared_one.x + shared_one.y + shared_one.z, alone.x + alone.y + alone.z);
    pixel.trial += pixel.count < TRIAL / 2u ? light : -light;
}

// Which member of its group a pixel of a tile is, and the first one, whose scramble all use from their first hits on.
uint member_of_group(uint p) { return REUSE ? p >> PATCH_BITS : 0u; }
uint first_of_group(uint p) { return REUSE ? p & ((1u << PATCH_BITS) - 1u) : p; }

// Number `member` of a group seen from another: 0 is the path itself.
uint group_member(uint path, uint member) { return path ^ (member << PATCH_BITS); }

// Geometry between a first hit x and a second hit y: cos cos/r², and the direction and distance from x to y.
float coupling(vec3 x, vec3 nx, vec3 y, vec3 ny, out vec3 direction, out float distance) {
    vec3 to = y - x;
    float r2 = dot(to, to);
    float inverse = 1.0 / sqrt(r2);
    direction = to * inverse;
    distance = r2 * inverse;
    float cx = dot(nx, direction);
    float cy = -dot(ny, direction);
    // So close that the square would underflow, the direction means nothing.
    return cx > 0.0 && cy > 0.0 && r2 > 1e-30 ? cx * cy * inverse * inverse : 0.0;
}

// Where a segment that comes from elsewhere may end at a hit: off its surface.
vec3 end_of_segment(Arrival a, float t) {
    if (a.surface.curvature == 0.0) return a.outside;
    // A sphere is told from what leaves it by its id, not by an offset; that does not help at the far end.
    vec3 p = a.surface.position;
    return p + a.up * (1e-6 * (abs(p.x) + abs(p.y) + abs(p.z) + t));
}

// Notes a path that arrives at its second hit.
void note_second_hit(uint path, Path p, Arrival a, float t, vec3 radiance) {
    vec3 y = end_of_segment(a, t);
    [[dont_unroll]] for (uint row = ROW_FIRST; row <= ROW_OWN; ++row) {
        vec4 value = vec4(p.origin, intBitsToFloat(p.leaving));
        if (row == ROW_FIRST_NORMAL) value = vec4(p.normal, p.throughput.x);
        if (row == ROW_SECOND) value = vec4(y, p.throughput.y);
        if (row == ROW_SECOND_NORMAL) value = vec4(a.gives ? a.up : vec3(0.0), p.throughput.z);
        if (row == ROW_OWN) value = vec4(a.gives ? radiance : vec3(0.0), 0.0);
        path_store(path, row, value);
    }
    vec3 direction;
    float distance;
    note_coupling(path, 0u, coupling(p.origin, p.normal, y, a.up, direction, distance));
}

// The segment from the first hit of path `to` to the second hit y of another; `wanted` if light can take it.
ShadowRay connect(vec3 y, vec3 normal, uint to, out float value) {
    vec4 x = path_load(to, ROW_FIRST);
    ShadowRay ray = ShadowRay(x.xyz, normal, 0.0, floatBitsToInt(x.w), vec3(0.0), false);
    value = coupling(x.xyz, path_load(to, ROW_FIRST_NORMAL).xyz, y, normal, ray.direction, ray.distance);
    if (SMOOTH_NORMALS) value = dot(path_load(to, ROW_FIRST_UP).xyz, ray.direction) > 0.0 ? value : 0.0;
    ray.wanted = value > 0.0;
    return ray;
}

// All light of a path's pixel for one sample, and PATH_ENDED; or PATH_OPEN if any path of the group that is wanted has
// not ended: either all of a group have a sample or none. `alone`: what it would be without the others.
vec4 shared_light(uint path, out vec3 alone) {
    bool complete = true;
    vec3 own = vec3(0.0);
    vec3 sum = vec3(0.0);
    vec3 given = vec3(0.0);
    [[dont_unroll]] for (uint member = 0u; member < MEMBERS; ++member) {
        uint from = group_member(path, member);
        vec4 light = path_load(from, ROW_LIGHT);
        vec4 a = path_load(from, ROW_COUPLINGS);
        vec4 b = path_load(from, ROW_COUPLINGS + 1u);
        vec4 four = member < 4u ? a : b;
        vec2 two = (member & 2u) == 0u ? four.xy : four.zw;
        float mine = (member & 1u) == 0u ? two.x : two.y;
        vec4 sums = a + b;
        float all = (sums.x + sums.y) + (sums.z + sums.w);
        complete = complete && light.w != PATH_OPEN;
        if (member == 0u && light.w != PATH_GIVES) own = light.xyz;
        if (member == 0u && light.w == PATH_GIVES) given = light.xyz;
        if (light.w == PATH_GIVES && mine > 0.0) sum += light.xyz * (mine / all);
    }
    alone = own;
    vec4 normal = path_load(path, ROW_FIRST_NORMAL);
    if (normal.xyz != vec3(0.0)) {
        vec3 beta = vec3(normal.w, path_load(path, ROW_SECOND).w, path_load(path, ROW_SECOND_NORMAL).w);
        own += path_load(path, ROW_OWN).xyz;
        alone = own + beta * given;
        own += beta * sum;
    }
    return vec4(own, complete ? PATH_ENDED : PATH_OPEN);
}

#endif
