// A camera at the origin of render space: a pinhole, a thin lens around it, or a plane through it that parallel rays start from.

#ifndef CAMERA_GLSL
#define CAMERA_GLSL

#include "layout.glsl"
#include "math.glsl"
#include "sampler.glsl"

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

// Where a camera ray starts, and its unit direction.
struct CameraRay {
    vec3 origin;
    vec3 direction;
};

// The camera ray through a point of the image, in pixels from its upper left corner, and the point of the lens that v chooses evenly.
CameraRay camera_ray(Camera camera, vec2 p, vec2 v) {
    float x = p.x * camera.column - 1.0;
    float y = 1.0 - p.y * camera.row;
    if (!HAS_LENS && !ORTHOGRAPHIC) return CameraRay(vec3(0.0), normalize(camera.forward + x * camera.right + y * camera.up));
    vec3 origin = vec3(0.0);
    vec3 direction = camera.forward + x * camera.right + y * camera.up;
    if (ORTHOGRAPHIC && camera_forward.w != 0.0) {
        float narrow = MUTATION == MUTATE_VIEW ? 0.98 : 1.0;
        origin = narrow * x * camera.right + narrow * y * camera.up;
        direction = camera.forward;
    }
    if (HAS_LENS && camera_right.w > 0.0) {
        // All rays of a point meet in the plane that is in focus.
        float radius = camera_right.w * (MUTATION == MUTATE_LENS ? v.x : sqrt(v.x));
        vec2 at = radius * cos_sin_2pi(v.y);
        vec3 on_lens = at.x * normalize(camera.right) + at.y * normalize(camera.up);
        origin += on_lens;
        direction = camera_up.w * direction - on_lens;
    }
    return CameraRay(origin, normalize(direction));
}

// The camera ray of a sample: through a point of the pixel at column and row `at`, chosen by u.
CameraRay sampled_camera_ray(Camera camera, uvec2 at, vec2 u, uint key, uint sample_index) {
    vec2 lens = HAS_LENS && camera_right.w > 0.0 ? sample_pair(key, sample_index, PAIR_LENS, 0u) : vec2(0.0);
    return camera_ray(camera, vec2(at) + 0.5 + filter_offset(u), lens);
}

#endif
