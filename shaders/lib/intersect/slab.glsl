// Rays and boxes (Kay and Kajiya, 1986), conservative in single precision.

#ifndef SLAB_GLSL
#define SLAB_GLSL

#include "../layout.glsl"
#include "../math.glsl"

// Widens the slab test: each of the two distances has a relative error of 8 roundings of 2^-24, those of the reciprocal
// (2.5 ulp) among them. What is relative to the size of the box, not to the distance, src/accel/quantised.rs allows for.
const float SLAB_MARGIN = MUTATION == MUTATE_SLAB ? 1.0 : 1.000001;

// 1/d without infinities: 0·∞ must not arise in the slab test, where NaN would be lost or win by chance; nor may boxes be
// met at infinity, which is not beyond a t_max of infinity: a ray without direction would walk all of an octant.
vec3 safe_inverse(vec3 d) {
    if (MUTATION == MUTATE_INVERSE) return 1.0 / d;
    const float tiny = 1e-30;
    vec3 clamped = vec3(abs(d.x) < tiny ? tiny : d.x, abs(d.y) < tiny ? tiny : d.y, abs(d.z) < tiny ? tiny : d.z);
    return 1.0 / clamped;
}

// Whether the ray meets a box before t_max. That has a margin too: the hit it stems from may lie in front of the box by
// rounding alone, and equal hits must be compared.
bool meets_box(vec3 o, vec3 inverse, vec3 lo, vec3 hi, float t_max) {
    vec3 a = (lo - o) * inverse;
    vec3 b = (hi - o) * inverse;
    vec3 n = vec3(lower(a.x, b.x), lower(a.y, b.y), lower(a.z, b.z));
    vec3 f = vec3(upper(a.x, b.x), upper(a.y, b.y), upper(a.z, b.z));
    float t = upper(upper(n.x, n.y), upper(n.z, 0.0));
    return t <= lower(lower(lower(f.x, f.y), f.z), t_max) * SLAB_MARGIN;
}

#endif
