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

// Density of one coordinate of that offset, if normally distributed.
float normal_density(float x) { return 0.7978846 * exp(-2.0 * x * x); }

// What the directions of camera rays need of the frame. To be fetched once, not for each ray.
struct Camera {
    vec3 right, up, forward;
    float column, row;      // distance of two pixels, half the image being 1
};

Camera frame_camera() {
    return Camera(camera_right.xyz, camera_up.xyz, camera_forward.xyz, 2.0 / float(width), 2.0 / float(height));
}

// Unit direction of the camera ray through a point of the pixel at column and row `at`.
vec3 camera_direction(Camera camera, uvec2 at, vec2 u) {
    vec2 p = vec2(at) + 0.5 + (REUSE && in_mode(MODE_SURVEY) ? vec2(0.0) : filter_offset(u));
    float x = p.x * camera.column - 1.0;
    float y = 1.0 - p.y * camera.row;
    return normalize(camera.forward + x * camera.right + y * camera.up);
}

#endif
