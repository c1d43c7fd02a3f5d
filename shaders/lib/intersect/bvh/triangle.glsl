// Ray–triangle tests. Both report a hit only for t > 0.

#ifndef TRIANGLE_GLSL
#define TRIANGLE_GLSL

#include "../shear.glsl"

// Whether a ray that hits a triangle comes from behind: by the sign of the determinant, that of the direction along its axis, and whether
// axes have changed places.
bool is_from_behind(Shear r, float det) {
    return int(floatBitsToUint(det) ^ floatBitsToUint(r.s.z)) < 0 != (r.along_x || r.along_y);
}

// How far away the ray meets the plane of a triangle, at a point that edge functions tell, which have this determinant.
float distance_at(Shear r, Edges e, float det, vec3 z) {
    precise float inverse = 1.0 / det;
    precise float sum = (e.u * z.x + e.v * z.y) + e.w * z.z;
    return sum * r.s.z * inverse;
}

// Whether the ray hits a triangle, of whose corners these are the distances along its axis, where, and whether from behind.
bool hits_triangle(Shear r, Edges e, vec3 z, out float t, out bool behind) {
    // All on one side, or all on the other. Both hold only where all are 0, and so is the determinant.
    bool inside = (fast_min(fast_min(e.u, e.v), e.w) >= 0.0) != (fast_max(fast_max(e.u, e.v), e.w) <= 0.0);
    float det = determinant(e);
    behind = is_from_behind(r, det);
    t = distance_at(r, e, det, z);
    return inside && t > 0.0;
}

// The same for two triangles, v0, v1, v2 and v3, v2, v1: the function of their common edge is that of the other, negative.
bvec2 watertight(Shear r, vec3 o, vec3 v0, vec3 v1, vec3 v2, vec3 v3, out vec2 ts, out bvec2 behind) {
    vec3 a = sheared(r, o, v0);
    vec3 b = sheared(r, o, v1);
    vec3 c = sheared(r, o, v2);
    vec3 d = sheared(r, o, v3);
    float common_edge = edge(c, b);
    float other_way = MUTATION == MUTATE_EDGES ? edge(b, c) : -common_edge;
    return bvec2(hits_triangle(r, Edges(common_edge, edge(a, c), edge(b, a)), vec3(a.z, b.z, c.z), ts.x, behind.x),
                 hits_triangle(r, Edges(other_way, edge(d, b), edge(c, d)), vec3(d.z, c.z, b.z), ts.y, behind.y));
}

// Möller and Trumbore, JGT 1997, for comparison. Rays aimed at a shared edge may miss both of its triangles.
bool moller_trumbore(vec3 o, vec3 d, vec3 v0, vec3 v1, vec3 v2, out float t, out bool behind) {
    vec3 e1 = v1 - v0;
    vec3 e2 = v2 - v0;
    vec3 p = cross(d, e2);
    float det = dot(e1, p);
    behind = det < 0.0;
    float inverse = 1.0 / det;
    vec3 s = o - v0;
    float v = dot(s, p) * inverse;
    vec3 q = cross(s, e1);
    float w = dot(d, q) * inverse;
    t = dot(e2, q) * inverse;
    return det != 0.0 && v >= 0.0 && w >= 0.0 && v + w <= 1.0 && t > 0.0;
}

#endif
