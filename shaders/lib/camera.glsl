// A pinhole at the origin of render space.

#ifndef CAMERA_GLSL
#define CAMERA_GLSL

#include "layout.glsl"
#include "math.glsl"

// Offset from the pixel's centre, in pixels, distributed as the reconstruction filter: weight 1 for every sample.
vec2 filter_offset(vec2 u) {
    if (FILTER == 0u) return u - 0.5;
    // Box–Muller; 1 − u lies in (0, 1], so that the logarithm is finite. Standard deviation: half a pixel.
    float radius = 0.5 * sqrt(-2.0 * log_accurate(1.0 - u.x));
    return radius * cos_sin_2pi(u.y);
}

// Unit direction of the camera ray through a point of the pixel at column and row `at`.
vec3 camera_direction(uvec2 at, vec2 u) {
    vec2 p = vec2(at) + 0.5 + filter_offset(u);
    float x = p.x * (2.0 / float(width)) - 1.0;
    float y = 1.0 - p.y * (2.0 / float(height));
    return normalize(camera_forward.xyz + x * camera_right.xyz + y * camera_up.xyz);
}

#endif
