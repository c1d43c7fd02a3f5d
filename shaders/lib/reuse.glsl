// Reuse of paths (Bekaert, Sbert and Halton, "Accelerating Path Tracing by Re-Using Paths", EGWR 2002).
//
// Eight pixels are a group. Each has a path with a diffuse hit x, in general, and the next hit y is diffuse too. Then the
// light that leaves y goes to all eight x, and each pixel gets eight estimates of its indirect light for the
// cost of one path and seven visibility tests. With a(x, y) = cos(x→y) cos(y→x)/|x − y|² · V(x, y), the density with
// which x would have sampled y is a/π per area, and the balance heuristic (Veach 1997) over the eight gives pixel i
//
//     β_i Σ_j L_j a(x_i, y_j) / Σ_k a(x_k, y_j),
//
// L_j the light that leaves y_j, β_i the throughput at x_i. This is exact for any visibility, as long as it is the same
// in both places. A path whose y is not diffuse keeps its light to itself, and its x still receives. In what follows x is
// called the first hit, y the second one.
//
// x is where a path first meets a diffuse surface: mirrors and glass may come before. Where a path goes on by the diffuse part of a surface
// (bsdf/parts.glsl), that is x or y too: what it scatters is multiplied by a function of the cosine at either end.
//
// If gradients are made (gradient.glsl), all members of a group sample lights at x alike, with the same random numbers: what
// they get from there errs alike, and the difference between two of them is known well, as that of the light by y is.
//
// What comes to x from lights directly is the mean of LIGHT_SAMPLES samples, all but one of which are taken when the paths of a
// group are shared, if this one has gone on: the lanes of a subgroup then trace such rays from neighbouring pixels side by
// side, in a third of the time that they take among the rays of paths.
//
// All that pays where the light at x makes most of the noise; elsewhere it only costs time. So before a rendering there is a
// pilot pass of PILOT_SAMPLES samples in one group, or a few, of every tile, of which the film records how far they are from each other
// (gradient.glsl). The host decides from that (src/render/reuse/decision.rs).
//
// The paths of a group meet in the lanes of a subgroup (reuse_lanes.glsl): as they end, or, in the queue, once all have been recorded in
// memory (reuse_queue.glsl).

#ifndef REUSE_GLSL
#define REUSE_GLSL

#include "film.glsl"
#include "path.glsl"
#include "pixel_order.glsl"

// Whether paths serve several pixels.
bool reuses() { return REUSE && in_mode(MODE_REUSED); }

// Which member of its group a pixel of a tile is, and the first one, whose scramble all use from their first hits on.
uint member_of_group(uint p) { return REUSE ? member_of(p) : 0u; }
uint first_of_group(uint p) { return REUSE ? for_member(p, 0u) : p; }

// The key of all random numbers of a path from its first hit on, `first` being the first pixel of its group. A shifted group has
// that of the unshifted one in which its first pixel is, whose samples it goes on with: their errors make up for each other in the
// pixels of both, and by differences in those around.
uint group_key(uvec2 first) { return pixel_key(pixel_number(REUSE ? first & ~uvec2(3u, 1u) : first)); }

// The same for pixel p of a workgroup's, whose first tile has such a corner.
uint key_of_group(uvec2 corner, uint p) { return group_key(pixel_of_work(corner, first_of_group(p))); }

// Paths may meet mirrors, glass or metals before x. Then those of a group may have x at different hits, and what leaves y is not the
// same for both if light is followed over a number of hits.
const bool SEES_THROUGH = HAS_MIRROR || HAS_DIELECTRIC || HAS_METALLIC_ROUGHNESS;

// What is kept of x until the path arrives at y.
struct FirstVertex {
    vec3 up;        // with SMOOTH_NORMALS: geometric normal
    vec3 beta;      // with HAS_PARTS: throughput, without what depends on where the path goes,
    float share;    // which is this times that of light from lights,
    vec4 fading;    // and that
};

FirstVertex first_vertex_none() { return FirstVertex(vec3(0.0), vec3(0.0), 1.0, vec4(0.0)); }

FirstVertex first_vertex_of(Vertex v) {
    Bsdf b = v.bsdf;
    bool part = HAS_PARTS && b.part == PART_DIFFUSE;
    return FirstVertex(v.up, v.throughput * (part ? b.lobes.diffuse / b.part_share : b.reflectance), part ? b.part_share : 1.0, fading_of(b));
}

// Geometry between a first hit x and a second hit y: cos cos/r², and the direction and distance from x to y.
float geometry_term(vec3 x, vec3 nx, vec3 y, vec3 ny, out vec3 direction, out float distance) {
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

// Whether it is worth finding out who sees light that leaves a second hit. (Not if it is none, nor if it is no number.) The lanes
// of a group ask when they share their paths, not in the loop that traces rays.
bool is_worth_sharing(vec3 light) { return brightness(light) > 0.0; }

// Where a segment that comes from elsewhere may end at a hit: off its surface.
vec3 end_of_segment(Vertex v, float t) {
    if (v.surface.curvature == 0.0) return v.outside;
    // A sphere is told from what leaves it by its id, not by an offset; that does not help at the far end.
    vec3 p = v.surface.position;
    return p + v.up * (1e-6 * (abs(p.x) + abs(p.y) + abs(p.z) + t));
}

#endif
