// Ray–triangle tests. Both report a hit only for t > 0 and not beyond the given distance.

#ifndef TRIANGLE_GLSL
#define TRIANGLE_GLSL

#include "../layout.glsl"
#include "../math.glsl"

// What the watertight test needs of a ray: the axis along which the direction is largest, and the shear that maps
// the ray onto it (Woop, Benthin and Wald, JCGT 2013).
struct Shear {
    bool along_x;
    bool along_y;   // else along z, unless along_x
    vec3 s;         // (d_kx, d_ky, 1) / d_kz
};

Shear shear_of(vec3 d) {
    vec3 a = abs(d);
    Shear r;
    r.along_x = a.x > a.y && a.x > a.z;
    r.along_y = !r.along_x && a.y > a.z;
    vec3 p = r.along_x ? d.yzx : (r.along_y ? d.zxy : d);
    float inverse = 1.0 / p.z;
    r.s = vec3(p.x * inverse, p.y * inverse, inverse);
    return r;
}

vec3 along(Shear r, vec3 v) { return r.along_x ? v.yzx : (r.along_y ? v.zxy : v); }

// a·b − c·d as a compiler may contract it: the first product unrounded (tests only).
float contracted(float a, float b, float c, float d) {
    float p, e;
    two_product(a, b, p, e);
    precise float r = (p - c * d) + e;
    return r;
}

// Barycentrics (u, v, w for v0, v1, v2; not normalised), their sum and the scaled distance. The edge functions are
// `precise`: contracted to FMA they would no longer agree between the two triangles of an edge (3% leaks).
// Paper's fall-back to double where one is 0 is not needed: 0 counts as inside on both sides of an edge.
bool watertight(Shear r, vec3 o, vec3 v0, vec3 v1, vec3 v2, float t_max, out float t, out vec3 barycentric) {
    vec3 a = along(r, v0 - o);
    vec3 b = along(r, v1 - o);
    vec3 c = along(r, v2 - o);
    precise float ax = a.x - r.s.x * a.z;
    precise float ay = a.y - r.s.y * a.z;
    precise float bx = b.x - r.s.x * b.z;
    precise float by = b.y - r.s.y * b.z;
    precise float cx = c.x - r.s.x * c.z;
    precise float cy = c.y - r.s.y * c.z;
    precise float u = cx * by - cy * bx;
    precise float v = ax * cy - ay * cx;
    precise float w = bx * ay - by * ax;
    if (MUTATION == MUTATE_EDGES) {
        u = contracted(cx, by, cy, bx);
        v = contracted(ax, cy, ay, cx);
        w = contracted(bx, ay, by, ax);
    }
    bool inside = lower(lower(u, v), w) >= 0.0 || upper(upper(u, v), w) <= 0.0;
    precise float det = (u + v) + w;
    precise float inverse = 1.0 / det;
    precise float z = (u * a.z + v * b.z) + w * c.z;
    t = z * r.s.z * inverse;
    barycentric = vec3(u, v, w) * inverse;
    return inside && det != 0.0 && t > 0.0 && t <= t_max;
}

// Möller and Trumbore, JGT 1997: the report's test. Rays aimed at a shared edge may miss both of its triangles.
bool moller_trumbore(vec3 o, vec3 d, vec3 v0, vec3 v1, vec3 v2, float t_max, out float t, out vec3 barycentric) {
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
    barycentric = vec3(1.0 - v - w, v, w);
    return det != 0.0 && v >= 0.0 && w >= 0.0 && v + w <= 1.0 && t > 0.0 && t <= t_max;
}

#endif
