// Ray–triangle tests. Both report a hit only for t > 0.

#ifndef TRIANGLE_GLSL
#define TRIANGLE_GLSL

#include "../layout.glsl"
#include "../math.glsl"

// What the watertight test needs of a ray: the axis along which the direction is largest, and the shear that maps
// the ray onto it (Woop, Benthin and Wald, JCGT 2013).
struct Shear {
    bool along_x;
    bool along_y;   // else along z, unless along_x
    vec3 s;         // (d_x', d_y', 1) / d_z'
};

// In axes x', y' and z' of which z' is the ray's: that and z change places. Where they do the functions of edges below are those of
// the paper with the other sign, all of them, which decides nothing.
vec3 along(bool along_x, bool along_y, vec3 v) {
    return vec3(along_x ? v.z : v.x, along_y ? v.z : v.y, along_x ? v.x : (along_y ? v.y : v.z));
}

Shear shear_of(vec3 d) {
    vec3 a = abs(d);
    Shear r;
    r.along_x = a.x > a.y && a.x > a.z;
    r.along_y = !r.along_x && a.y > a.z;
    vec3 p = along(r.along_x, r.along_y, d);
    float inverse = 1.0 / p.z;
    r.s = vec3(p.x * inverse, p.y * inverse, inverse);
    return r;
}

// a·b − c·d as a compiler may contract it: the first product unrounded (tests only).
float contracted(float a, float b, float c, float d) {
    float p, e;
    two_product(a, b, p, e);
    precise float r = (p - c * d) + e;
    return r;
}

// A corner, in axes of which z is the ray's.
vec3 sheared(Shear r, vec3 o, vec3 v) {
    vec3 a = along(r.along_x, r.along_y, v - o);
    precise vec2 across = a.xy - r.s.xy * a.z;
    return vec3(across, a.z);
}

// An edge function: a × b, of corners across the ray. It is `precise`: contracted to FMA it would no longer agree between the two
// triangles of an edge (3% leaks). Paper's fall-back to double where one is 0 is not needed: 0 counts as inside on both sides of an
// edge.
float edge(vec3 a, vec3 b) {
    if (MUTATION == MUTATE_EDGES) return contracted(a.x, b.y, a.y, b.x);
    precise float e = a.x * b.y - a.y * b.x;
    return e;
}

// Those of a triangle: barycentrics of v0, v1 and v2, not normalised.
struct Edges {
    float u;
    float v;
    float w;
};

// Their sum.
float determinant(Edges e) {
    precise float det = (e.u + e.v) + e.w;
    return det;
}

// Whether the ray hits a triangle, of whose corners these are the distances along its axis, and where.
bool hits_triangle(Shear r, Edges e, vec3 z, out float t) {
    // All on one side, or all on the other. Both hold only where all are 0, and so is the determinant.
    bool inside = (lower(lower(e.u, e.v), e.w) >= 0.0) != (upper(upper(e.u, e.v), e.w) <= 0.0);
    precise float inverse = 1.0 / determinant(e);
    precise float sum = (e.u * z.x + e.v * z.y) + e.w * z.z;
    t = sum * r.s.z * inverse;
    return inside && t > 0.0;
}

// The same for two triangles, v0, v1, v2 and v3, v2, v1: the function of their common edge is that of the other, negative.
// (Only one division, for the triangle that the ray passes within, if not for both: 1.0 to 1.03 of the time, lavapipe 25.0.7.)
bvec2 watertight(Shear r, vec3 o, vec3 v0, vec3 v1, vec3 v2, vec3 v3, out vec2 ts) {
    vec3 a = sheared(r, o, v0);
    vec3 b = sheared(r, o, v1);
    vec3 c = sheared(r, o, v2);
    vec3 d = sheared(r, o, v3);
    float common_edge = edge(c, b);
    float other_way = MUTATION == MUTATE_EDGES ? edge(b, c) : -common_edge;
    return bvec2(hits_triangle(r, Edges(common_edge, edge(a, c), edge(b, a)), vec3(a.z, b.z, c.z), ts.x),
                 hits_triangle(r, Edges(other_way, edge(d, b), edge(c, d)), vec3(d.z, c.z, b.z), ts.y));
}

// Barycentrics of the point at which a ray meets a triangle.
vec3 barycentrics(Shear r, vec3 o, vec3 v0, vec3 v1, vec3 v2) {
    vec3 a = sheared(r, o, v0);
    vec3 b = sheared(r, o, v1);
    vec3 c = sheared(r, o, v2);
    Edges e = Edges(edge(c, b), edge(a, c), edge(b, a));
    return vec3(e.u, e.v, e.w) * (1.0 / determinant(e));
}

// Möller and Trumbore, JGT 1997, for comparison. Rays aimed at a shared edge may miss both of its triangles.
bool moller_trumbore(vec3 o, vec3 d, vec3 v0, vec3 v1, vec3 v2, out float t) {
    vec3 e1 = v1 - v0;
    vec3 e2 = v2 - v0;
    vec3 p = cross(d, e2);
    float det = dot(e1, p);
    float inverse = 1.0 / det;
    vec3 s = o - v0;
    float v = dot(s, p) * inverse;
    vec3 q = cross(s, e1);
    float w = dot(d, q) * inverse;
    t = dot(e2, q) * inverse;
    return det != 0.0 && v >= 0.0 && w >= 0.0 && v + w <= 1.0 && t > 0.0;
}

#endif
