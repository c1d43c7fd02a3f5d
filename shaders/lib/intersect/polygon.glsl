// Flat polygons, written out: the triangles and convex quadrilaterals of small meshes. Traversing a BVH over a few polygons costs
// more than testing them all, if all that depends on the polygon alone is folded: its directions are specialization constants
// (many are 0). Where the polygon is, as seen from the camera, is fetched when a kernel begins: a camera may move without a
// kernel being compiled anew.
//
// Corners are projected along the ray into a plane across it; there the sign of a two-dimensional cross product tells
// on which side of an edge the ray passes. Polygons that share corners see the same projected points, and the same
// edge run the other way gives exactly the negated value: rays slip through neither at edges nor at corners.
//
// For nearly all rays a simpler test is enough, for half the cost: the point at which the ray meets the plane, and
// its distance from each edge. Where such a distance is too small for the rounding, the polygon is tested anew, as
// above.

#ifndef POLYGON_GLSL
#define POLYGON_GLSL

#include "../geometry.glsl"
#include "../loops.glsl"
#include "../layout.glsl"
#include "../math.glsl"
#include "nearer.glsl"
#include "../unroll.glsl"

struct InlinePolygon {
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

bool between_edges(InlinePolygon f, Across r) {
    vec2 a = project(r, f.a);
    vec2 b = project(r, f.b);
    vec2 c = project(r, f.c);
    vec2 d = project(r, f.d);
    float u = edge_side(a, b);
    float v = edge_side(b, c);
    float w = edge_side(c, d);
    float x = edge_side(d, a);
    float least = fast_min(fast_min(u, v), fast_min(w, x));
    float most = fast_max(fast_max(u, v), fast_max(w, x));
    // Either all on one side, or all on the other. Both hold where all are 0: the polygon is too small for the
    // precision at its distance, or seen edge on, and must not count as met all over its plane.
    return (least >= 0.0) != (most <= 0.0);
}

// Along a ray with the reciprocal of n·d.
float plane_distance(vec4 plane, vec3 o, float inverse) { return (plane.w - dot(plane.xyz, o)) * inverse; }

// Whether the ray meets the polygon, and where.
bool meets_polygon(InlinePolygon f, Across r, vec3 d, out float t) {
    t = plane_distance(f.plane, r.origin, 1.0 / dot(f.plane.xyz, d));
    return t > 0.0 && between_edges(f, r);
}

// A polygon for the simpler test: seen along the axis that its normal is closest to, edge i is where x·u + y·v + z is
// 0, u and v being the other two coordinates, in the order of the axes. That is the distance from the edge over
// 48·2^-24 s / l, s being the largest distance of two corners, and l the shortest edge; where a triangle has no edge,
// 1e30.
struct QuickPolygon {
    vec3 edge0, edge1, edge2, edge3;
    vec4 plane;
};

// Where a ray meets the plane of a polygon.
struct PlaneHit {
    float t;
    float inside;       // of the edges' functions the least
    float margin;       // if `inside` is closer to 0 than this, rounding may decide
};

// The products of edge_side stem from coordinates that are off by 3·2^-24 D, D being the distance of the corners: it
// may have the wrong sign up to a distance of 12·2^-24 D s / (l |n·d|) from an edge. This test is off by at most
// 30·2^-24 D / |n·d|. `reach` is not less than D.
PlaneHit plane_hit(QuickPolygon f, uint bit, vec3 o, vec3 d, float reach) {
    float inverse = 1.0 / dot(f.plane.xyz, d);
    float t = plane_distance(f.plane, o, inverse);
    vec3 at = o + t * d;
    vec2 uv = (POLYGONS_ACROSS_X & bit) != 0u ? at.yz : ((POLYGONS_ACROSS_Y & bit) != 0u ? at.xz : at.xy);
    float inside = fast_min(fast_min(dot(f.edge0.xy, uv) + f.edge0.z, dot(f.edge1.xy, uv) + f.edge1.z),
                         fast_min(dot(f.edge2.xy, uv) + f.edge2.z, dot(f.edge3.xy, uv) + f.edge3.z));
    return PlaneHit(t, inside, MUTATION == MUTATE_DOUBT ? 0.0 : reach * abs(inverse));
}

// Not less than the distance of any corner: in render space they are within a distance of 2 of the camera.
float reach_from(vec3 o) { return length(o) + 2.0; }

#define POLYGON_CONSTANTS(n, base)                                      \
    layout(constant_id = base) const float POLYGON_##n##_AX = 0.0;      \
    layout(constant_id = base + 1) const float POLYGON_##n##_AY = 0.0;  \
    layout(constant_id = base + 2) const float POLYGON_##n##_BX = 0.0;  \
    layout(constant_id = base + 3) const float POLYGON_##n##_BY = 0.0;  \
    layout(constant_id = base + 4) const float POLYGON_##n##_CX = 0.0;  \
    layout(constant_id = base + 5) const float POLYGON_##n##_CY = 0.0;  \
    layout(constant_id = base + 6) const float POLYGON_##n##_DX = 0.0;  \
    layout(constant_id = base + 7) const float POLYGON_##n##_DY = 0.0;  \
    layout(constant_id = base + 8) const float POLYGON_##n##_NX = 0.0;  \
    layout(constant_id = base + 9) const float POLYGON_##n##_NY = 0.0;  \
    layout(constant_id = base + 10) const float POLYGON_##n##_NZ = 0.0; \
    vec4 polygon_edges_##n;                                             \
    float polygon_plane_##n;

POLYGON_CONSTANTS(0, 256)
POLYGON_CONSTANTS(1, 272)
POLYGON_CONSTANTS(2, 288)
POLYGON_CONSTANTS(3, 304)
POLYGON_CONSTANTS(4, 320)
POLYGON_CONSTANTS(5, 336)
POLYGON_CONSTANTS(6, 352)
POLYGON_CONSTANTS(7, 368)
POLYGON_CONSTANTS(8, 384)
POLYGON_CONSTANTS(9, 400)
POLYGON_CONSTANTS(10, 416)
POLYGON_CONSTANTS(11, 432)
POLYGON_CONSTANTS(12, 448)
POLYGON_CONSTANTS(13, 464)
POLYGON_CONSTANTS(14, 480)
POLYGON_CONSTANTS(15, 496)
POLYGON_CONSTANTS(16, 512)
POLYGON_CONSTANTS(17, 528)
POLYGON_CONSTANTS(18, 544)
POLYGON_CONSTANTS(19, 560)
POLYGON_CONSTANTS(20, 576)
POLYGON_CONSTANTS(21, 592)
POLYGON_CONSTANTS(22, 608)
POLYGON_CONSTANTS(23, 624)
POLYGON_CONSTANTS(24, 640)
POLYGON_CONSTANTS(25, 656)
POLYGON_CONSTANTS(26, 672)
POLYGON_CONSTANTS(27, 688)
POLYGON_CONSTANTS(28, 704)
POLYGON_CONSTANTS(29, 720)
POLYGON_CONSTANTS(30, 736)
POLYGON_CONSTANTS(31, 752)

#define QUICK_POLYGON_OF(n)                                                                                            \
    QuickPolygon(vec3(POLYGON_##n##_AX, POLYGON_##n##_AY, polygon_edges_##n.x), vec3(POLYGON_##n##_BX, POLYGON_##n##_BY, polygon_edges_##n.y), \
               vec3(POLYGON_##n##_CX, POLYGON_##n##_CY, polygon_edges_##n.z), vec3(POLYGON_##n##_DX, POLYGON_##n##_DY, polygon_edges_##n.w), \
               vec4(POLYGON_##n##_NX, POLYGON_##n##_NY, POLYGON_##n##_NZ, polygon_plane_##n))

// BODY(n) for each polygon.
#define FOR_EACH_POLYGON(BODY) FOR_0_TO_15(POLYGON_COUNT, BODY) FOR_16_TO_31(POLYGON_COUNT, BODY)

// To be called when a kernel begins.
void load_polygons() {
#define LOAD_POLYGON(n)                                    \
    polygon_edges_##n = polygon_values[2 * n];               \
    polygon_plane_##n = polygon_values[2 * n + 1].x;
    FOR_EACH_POLYGON(LOAD_POLYGON)
#undef LOAD_POLYGON
}

// A polygon from the table of primitives: written out once for any of them, where time does not matter.
InlinePolygon polygon_of_table(int n) {
    uvec4 shape = primitive_shape(int(SPHERE_COUNT) + n);
    vec3 normal = uintBitsToFloat(primitive_attributes(int(SPHERE_COUNT) + n).xyz);
    uint first = shape.x;
    return InlinePolygon(vertex_position(first), vertex_position(first + 1u), vertex_position(first + 2u), vertex_position(first + 3u),
                 vec4(normal, uintBitsToFloat(shape.y)));
}

// The polygon's bit if a hit, `near` enough, is in doubt.
uint doubt_of(PlaneHit hit, bool near, uint bit) { return near && abs(hit.inside) <= hit.margin ? bit : 0u; }

// Takes the first of some polygons that are in doubt.
int take_polygon(inout uint doubts) {
    int n = findLSB(doubts);
    doubts &= doubts - 1u;
    return n;
}

// Nearest polygon. Its id follows those of the constant spheres.
void closest_polygon(vec3 o, vec3 d, int self_id, inout float t, inout int id) {
    int first_id = int(SPHERE_COUNT);
    float reach = reach_from(o);
    float nearest = t;
    int nearest_id = id;
    uint doubts = 0u;
    Across ray = across(o, d);
#define TEST_CLOSEST(n)                                                                              \
    {                                                                                                \
        PlaneHit hit = plane_hit(QUICK_POLYGON_OF(n), 1u << n, o, d, reach);                           \
        bool near = hit.t > 0.0 && hit.t < nearest && self_id != first_id + n;                       \
        doubts |= doubt_of(hit, near, 1u << n);                                                      \
        bool closer = near && hit.inside > hit.margin;                                               \
        nearest = closer ? hit.t : nearest;                                                          \
        nearest_id = closer ? first_id + n : nearest_id;                                             \
    }
    FOR_EACH_POLYGON(TEST_CLOSEST)
#undef TEST_CLOSEST
    count_fallback(uint(bitCount(doubts)));
    while (doubts != 0u) {
        int n = take_polygon(doubts);
        float h;
        bool closer = meets_polygon(polygon_of_table(n), ray, d, h) && is_nearer(h, first_id + n, nearest, nearest_id);
        nearest = closer ? h : nearest;
        nearest_id = closer ? first_id + n : nearest_id;
    }
    t = nearest;
    id = nearest_id;
}

// Whether a polygon lies between o and the point at `distance`, those that bound the scene's convex hull left out; of a ray that is not
// `enabled`, what is quickly known. (Many of those run along a polygon, and past its edges.)
bool any_polygon(vec3 o, vec3 d, float distance, int self_id, bool enabled) {
    int first_id = int(SPHERE_COUNT);
    float reach = reach_from(o);
    int occluding = 0;      // below 0: some polygon does, see solid_occludes
    uint doubts = 0u;
    Across ray = across(o, d);
#define TEST_ANY(n)                                                                                  \
    if ((POLYGON_OCCLUDERS & (1u << n)) != 0u) {                                                       \
        PlaneHit hit = plane_hit(QUICK_POLYGON_OF(n), 1u << n, o, d, reach);                           \
        bool near = hit.t > 0.0 && hit.t < distance && self_id != first_id + n;                      \
        doubts |= doubt_of(hit, near, 1u << n);                                                      \
        occluding |= near ? floatBitsToInt(hit.margin - hit.inside) : 0;                             \
    }
    FOR_EACH_POLYGON(TEST_ANY)
#undef TEST_ANY
    bool occluded = occluding < 0;
    doubts = occluded || !enabled ? 0u : doubts;
    count_fallback(uint(bitCount(doubts)));
    while (doubts != 0u) {
        float h;
        bool between = meets_polygon(polygon_of_table(take_polygon(doubts)), ray, d, h) && h < distance;
        occluded = occluded || between;
    }
    return occluded;
}

#endif
