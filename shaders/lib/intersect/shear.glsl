// A ray's shear, and the edge functions of triangles under it: for the watertight test, and for the barycentrics of any hit.

#ifndef SHEAR_GLSL
#define SHEAR_GLSL

#include "../geometry.glsl"
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

// Barycentrics of the point at which a ray meets a triangle. Each has a relative error of its own: 1 minus the other two would be
// rounded at the size of 1, which moves the point where a vertex is far away.
vec3 barycentrics_of(vec3 o, vec3 d, Triangle triangle) {
    Shear r = shear_of(d);
    vec3 a = sheared(r, o, triangle.v0);
    vec3 b = sheared(r, o, triangle.v1);
    vec3 c = sheared(r, o, triangle.v2);
    Edges e = Edges(edge(c, b), edge(a, c), edge(b, a));
    return vec3(e.u, e.v, e.w) * (1.0 / determinant(e));
}

#endif
