// Cones of directions from a point towards a sphere that it is not within.

#ifndef CONE_GLSL
#define CONE_GLSL

#include "math.glsl"

// 1 − cos of the cone's half-angle, for sin² of it: without cancellation for a far sphere. Its solid angle is 2π times that.
float cone_depth(float sin2) { return sin2 / (1.0 + sqrt(fast_max(1.0 - sin2, 0.0))); }

// A uniform direction towards a sphere with its centre at `to` from here.
vec3 cone_sample(vec3 to, float radius, vec2 u) {
    float d2 = dot(to, to);
    float depth = u.y * cone_depth(radius * radius / d2);
    float sin2 = depth * (2.0 - depth);
    vec3 axis = to * inversesqrt(d2);
    vec3 tangent, bitangent;
    basis(axis, tangent, bitangent);
    vec2 disc = sqrt(fast_max(sin2, 0.0)) * cos_sin_2pi(u.x);
    return normalize(tangent * disc.x + bitangent * disc.y + axis * (1.0 - depth));
}

// Whether a direction leads to the sphere. Not by the cosine, which is 1 for all directions to a far one.
bool in_cone(vec3 to, float radius, vec3 direction) {
    vec3 aside = cross(to, direction);
    return dot(aside, aside) <= radius * radius && dot(to, direction) > 0.0;
}

#endif
