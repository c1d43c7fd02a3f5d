// Rays and boxes (Kay and Kajiya, 1986), conservative in single precision.

#ifndef SLAB_GLSL
#define SLAB_GLSL

#include "../../layout.glsl"
#include "../../math.glsl"

// No box may come between a ray and what the watertight test reports. In units of 2^-24 of the distance to the
// primitive along an axis, that test moves vertices across the ray by up to 10.5 (v − o: 1 along each of two axes;
// shear: 6, of which a reciprocal of 2.5 ulp is 5; its product and the difference: 2; edge functions: 0.5); distances
// to planes are off by 9 (a reciprocal: 5; products with planes or o: 1; the margin and two sums: 3), boxes by 1 when
// they are built. For a box to be entered that is all. Which of two hits that nearly agree is the nearer one depends on
// t, which is off by 18 more (v − o: 1, the sums of distances and of weights: 5, products: 2, two reciprocals: 10), or
// without a bound where a triangle is thin as seen by the ray. The distance is at most |v| + |o|: for the first, boxes
// are widened when they are built (src/accel/record.rs), for the second here. What is relative to the size of a box
// src/accel/quantised.rs allows for.
const float BOX_ERROR = MUTATION == MUTATE_BOX_MARGIN || MUTATION == MUTATE_ALL_MARGINS ? 0.0 : 40.0 / 16777216.0;

// By how much boxes are to be larger for a ray from o, on all sides.
float box_margin(vec3 o) { return BOX_ERROR * fast_max(fast_max(abs(o.x), abs(o.y)), abs(o.z)); }

// 1/d without infinities: 0·∞ must not arise in the slab test, where NaN would be lost or win by chance; nor may boxes
// be met at infinity, which is not beyond a t_max of infinity: a ray without direction would traverse all of an octant.
vec3 safe_inverse(vec3 d) {
    if (MUTATION == MUTATE_INVERSE) return 1.0 / d;
    const float tiny = 1e-30;
    vec3 clamped = vec3(abs(d.x) < tiny ? tiny : d.x, abs(d.y) < tiny ? tiny : d.y, abs(d.z) < tiny ? tiny : d.z);
    return 1.0 / clamped;
}

// Whether the ray meets a box before t_max, widened by a margin.
bool meets_box(vec3 o, vec3 inverse, vec3 lo, vec3 hi, float margin, float t_max) {
    vec3 a = (lo - margin - o) * inverse;
    vec3 b = (hi + margin - o) * inverse;
    vec3 n = vec3(fast_min(a.x, b.x), fast_min(a.y, b.y), fast_min(a.z, b.z));
    vec3 f = vec3(fast_max(a.x, b.x), fast_max(a.y, b.y), fast_max(a.z, b.z));
    float t = fast_max(fast_max(n.x, n.y), fast_max(n.z, 0.0));
    return t <= fast_min(fast_min(f.x, f.y), fast_min(f.z, t_max));
}

#endif
