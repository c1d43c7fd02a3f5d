// Flat polygons, written out: the triangles and convex quadrilaterals of small meshes. Walking a tree over a few polygons costs
// more than testing them all, if all that depends on the polygon alone is folded: its directions are specialization constants
// (many are 0). Where the polygon is, as seen from the camera, is fetched when a kernel begins: a camera may move without a
// kernel being compiled anew.
//
// Corners are projected along the ray into a plane across it; there the sign of a two-dimensional cross product tells
// on which side of an edge the ray passes. Polygons that share corners see the same projected points, and the same
// edge run the other way gives exactly the negated value: rays slip through neither at edges nor at corners.
//
// For nearly all rays a simpler test is enough, for half the cost: the point at which the ray meets the plane, and
// its distance from each edge. Where such a distance is too small for the rounding, the facet is tested anew, as
// above.

#ifndef FACET_GLSL
#define FACET_GLSL

#include "../geometry.glsl"
#include "../loops.glsl"
#include "../layout.glsl"
#include "../math.glsl"
#include "nearer.glsl"
#include "../unroll.glsl"

struct Facet {
    vec3 a, b, c, d;    // corners, counter-clockwise from the front; a triangle has d = c
    vec4 plane;         // unit normal n, and n·a
};

// A ray with two axes across it.
struct Across {
    vec3 origin, x, y;
};

Across across(vec3 o, vec3 d) {
    Across r;
    r.origin = o;
    basis(d, r.x, r.y);
    return r;
}

vec2 project(Across r, vec3 corner) {
    precise vec3 v = corner - r.origin;
    precise float x = (v.x * r.x.x + v.y * r.x.y) + v.z * r.x.z;
    precise float y = (v.x * r.y.x + v.y * r.y.y) + v.z * r.y.z;
    return vec2(x, y);
}

// `precise`: contracted to FMA the two directions of an edge would not round alike.
float edge_side(vec2 a, vec2 b) {
    precise float side = a.x * b.y - a.y * b.x;
    return side;
}

bool between_edges(Facet f, Across r) {
    vec2 a = project(r, f.a);
    vec2 b = project(r, f.b);
    vec2 c = project(r, f.c);
    vec2 d = project(r, f.d);
    float u = edge_side(a, b);
    float v = edge_side(b, c);
    float w = edge_side(c, d);
    float x = edge_side(d, a);
    float least = lower(lower(u, v), lower(w, x));
    float most = upper(upper(u, v), upper(w, x));
    // Either all on one side, or all on the other. Both hold where all are 0: the polygon is too small for the
    // precision at its distance, or seen edge on, and must not count as met all over its plane.
    return (least >= 0.0) != (most <= 0.0);
}

// Along a ray with the reciprocal of n·d.
float plane_distance(vec4 plane, vec3 o, float inverse) { return (plane.w - dot(plane.xyz, o)) * inverse; }

// Whether the ray meets the facet, and where.
bool meets_facet(Facet f, Across r, vec3 d, out float t) {
    t = plane_distance(f.plane, r.origin, 1.0 / dot(f.plane.xyz, d));
    return t > 0.0 && between_edges(f, r);
}

// A facet for the simpler test: seen along the axis that its normal is closest to, edge i is where x·u + y·v + z is
// 0, u and v being the other two coordinates, in the order of the axes. That is the distance from the edge over
// 48·2^-24 s / l, s being the largest distance of two corners, and l the shortest edge; where a triangle has no edge,
// 1e30.
struct QuickFacet {
    vec3 edge0, edge1, edge2, edge3;
    vec4 plane;
};

// Bit n: the normal of facet n is closest to the x axis, to the y axis.
layout(constant_id = 208) const uint FACETS_ACROSS_X = 0u;
layout(constant_id = 209) const uint FACETS_ACROSS_Y = 0u;

// Where a ray meets the plane of a facet.
struct PlaneHit {
    float t;
    float inside;       // of the edges' functions the least
    float margin;       // if `inside` is closer to 0 than this, rounding may decide
};

// The products of edge_side stem from coordinates that are off by 3·2^-24 D, D being the distance of the corners: it
// may have the wrong sign up to a distance of 12·2^-24 D s / (l |n·d|) from an edge. This test is off by at most
// 30·2^-24 D / |n·d|. `reach` is not less than D.
PlaneHit plane_hit(QuickFacet f, uint bit, vec3 o, vec3 d, float reach) {
    float inverse = 1.0 / dot(f.plane.xyz, d);
    float t = plane_distance(f.plane, o, inverse);
    vec3 at = o + t * d;
    vec2 uv = (FACETS_ACROSS_X & bit) != 0u ? at.yz : ((FACETS_ACROSS_Y & bit) != 0u ? at.xz : at.xy);
    float inside = lower(lower(dot(f.edge0.xy, uv) + f.edge0.z, dot(f.edge1.xy, uv) + f.edge1.z),
                         lower(dot(f.edge2.xy, uv) + f.edge2.z, dot(f.edge3.xy, uv) + f.edge3.z));
    return PlaneHit(t, inside, MUTATION == MUTATE_DOUBT ? 0.0 : reach * abs(inverse));
}

// Not less than the distance of any corner: in render space they are within a distance of 2 of the camera.
float reach_from(vec3 o) { return length(o) + 2.0; }

#define FACET_CONSTANTS(n, base)                                        \
    layout(constant_id = base) const float FACET_##n##_AX = 0.0;         \
    layout(constant_id = base + 1) const float FACET_##n##_AY = 0.0;     \
    layout(constant_id = base + 2) const float FACET_##n##_BX = 0.0;     \
    layout(constant_id = base + 3) const float FACET_##n##_BY = 0.0;     \
    layout(constant_id = base + 4) const float FACET_##n##_CX = 0.0;     \
    layout(constant_id = base + 5) const float FACET_##n##_CY = 0.0;     \
    layout(constant_id = base + 6) const float FACET_##n##_DX = 0.0;     \
    layout(constant_id = base + 7) const float FACET_##n##_DY = 0.0;     \
    layout(constant_id = base + 8) const float FACET_##n##_NX = 0.0;     \
    layout(constant_id = base + 9) const float FACET_##n##_NY = 0.0;     \
    layout(constant_id = base + 10) const float FACET_##n##_NZ = 0.0;    \
    vec4 facet_edges_##n;                                                \
    float facet_plane_##n;

FACET_CONSTANTS(0, 256)
FACET_CONSTANTS(1, 272)
FACET_CONSTANTS(2, 288)
FACET_CONSTANTS(3, 304)
FACET_CONSTANTS(4, 320)
FACET_CONSTANTS(5, 336)
FACET_CONSTANTS(6, 352)
FACET_CONSTANTS(7, 368)
FACET_CONSTANTS(8, 384)
FACET_CONSTANTS(9, 400)
FACET_CONSTANTS(10, 416)
FACET_CONSTANTS(11, 432)
FACET_CONSTANTS(12, 448)
FACET_CONSTANTS(13, 464)
FACET_CONSTANTS(14, 480)
FACET_CONSTANTS(15, 496)
FACET_CONSTANTS(16, 512)
FACET_CONSTANTS(17, 528)
FACET_CONSTANTS(18, 544)
FACET_CONSTANTS(19, 560)
FACET_CONSTANTS(20, 576)
FACET_CONSTANTS(21, 592)
FACET_CONSTANTS(22, 608)
FACET_CONSTANTS(23, 624)
FACET_CONSTANTS(24, 640)
FACET_CONSTANTS(25, 656)
FACET_CONSTANTS(26, 672)
FACET_CONSTANTS(27, 688)
FACET_CONSTANTS(28, 704)
FACET_CONSTANTS(29, 720)
FACET_CONSTANTS(30, 736)
FACET_CONSTANTS(31, 752)

#define QUICK_FACET_OF(n)                                                                                            \
    QuickFacet(vec3(FACET_##n##_AX, FACET_##n##_AY, facet_edges_##n.x), vec3(FACET_##n##_BX, FACET_##n##_BY, facet_edges_##n.y), \
               vec3(FACET_##n##_CX, FACET_##n##_CY, facet_edges_##n.z), vec3(FACET_##n##_DX, FACET_##n##_DY, facet_edges_##n.w), \
               vec4(FACET_##n##_NX, FACET_##n##_NY, FACET_##n##_NZ, facet_plane_##n))

// BODY(n) for each facet.
#define FOR_EACH_FACET(BODY) FOR_0_TO_15(FACET_COUNT, BODY) FOR_16_TO_31(FACET_COUNT, BODY)

// To be called when a kernel begins.
void load_facets() {
#define LOAD_FACET(n)                                    \
    facet_edges_##n = facet_values[2 * n];               \
    facet_plane_##n = facet_values[2 * n + 1].x;
    FOR_EACH_FACET(LOAD_FACET)
#undef LOAD_FACET
}

// A facet from the table of primitives: written out once for any of them, where time does not matter.
Facet facet_of_table(int n) {
    uvec4 shape = primitive_shape(int(SPHERE_COUNT) + n);
    vec3 normal = uintBitsToFloat(primitive_attributes(int(SPHERE_COUNT) + n).xyz);
    uint first = shape.x;
    return Facet(vertex_position(first), vertex_position(first + 1u), vertex_position(first + 2u), vertex_position(first + 3u),
                 vec4(normal, uintBitsToFloat(shape.y)));
}

// The facet's bit if a hit, `near` enough, is in doubt.
uint doubt_of(PlaneHit hit, bool near, uint bit) { return near && abs(hit.inside) <= hit.margin ? bit : 0u; }

// Takes the first of some facets that are in doubt.
int take_facet(inout uint doubts) {
    int n = findLSB(doubts);
    doubts &= doubts - 1u;
    return n;
}

// Nearest facet. Its id follows those of the constant spheres.
void closest_facet(vec3 o, vec3 d, int leaving, inout float t, inout int id) {
    int first_id = int(SPHERE_COUNT);
    float reach = reach_from(o);
    float nearest = t;
    int nearest_id = id;
    uint doubts = 0u;
    Across ray = across(o, d);
#define TEST_CLOSEST(n)                                                                              \
    {                                                                                                \
        PlaneHit hit = plane_hit(QUICK_FACET_OF(n), 1u << n, o, d, reach);                           \
        bool near = hit.t > 0.0 && hit.t < nearest && leaving != first_id + n;                       \
        doubts |= doubt_of(hit, near, 1u << n);                                                      \
        bool closer = near && hit.inside > hit.margin;                                               \
        nearest = closer ? hit.t : nearest;                                                          \
        nearest_id = closer ? first_id + n : nearest_id;                                             \
    }
    FOR_EACH_FACET(TEST_CLOSEST)
#undef TEST_CLOSEST
    count_doubtful(uint(bitCount(doubts)));
    while (doubts != 0u) {
        int n = take_facet(doubts);
        float h;
        bool closer = meets_facet(facet_of_table(n), ray, d, h) && is_nearer(h, first_id + n, nearest, nearest_id);
        nearest = closer ? h : nearest;
        nearest_id = closer ? first_id + n : nearest_id;
    }
    t = nearest;
    id = nearest_id;
}

// Bit n: facet n may lie between two points of the scene. The others bound its convex hull.
layout(constant_id = 206) const uint FACET_OCCLUDERS = 0xffffffffu;

// Whether a facet lies between o and the point at `distance`; of a ray that is not `wanted`, what is quickly known. (Many of those run
// along a facet, and past its edges.)
bool any_facet(vec3 o, vec3 d, float distance, int leaving, bool wanted) {
    int first_id = int(SPHERE_COUNT);
    float reach = reach_from(o);
    int occluding = 0;      // below 0: some facet does, see solid_occludes
    uint doubts = 0u;
    Across ray = across(o, d);
#define TEST_ANY(n)                                                                                  \
    if ((FACET_OCCLUDERS & (1u << n)) != 0u) {                                                       \
        PlaneHit hit = plane_hit(QUICK_FACET_OF(n), 1u << n, o, d, reach);                           \
        bool near = hit.t > 0.0 && hit.t < distance && leaving != first_id + n;                      \
        doubts |= doubt_of(hit, near, 1u << n);                                                      \
        occluding |= near ? floatBitsToInt(hit.margin - hit.inside) : 0;                             \
    }
    FOR_EACH_FACET(TEST_ANY)
#undef TEST_ANY
    bool occluded = occluding < 0;
    doubts = occluded || !wanted ? 0u : doubts;
    count_doubtful(uint(bitCount(doubts)));
    while (doubts != 0u) {
        float h;
        bool between = meets_facet(facet_of_table(take_facet(doubts)), ray, d, h) && h < distance;
        occluded = occluded || between;
    }
    return occluded;
}

#endif
