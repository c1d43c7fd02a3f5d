// Constant spheres and polygons together.

#ifndef CONSTANTS_GLSL
#define CONSTANTS_GLSL

#include "../ray.glsl"
#include "polygon.glsl"
#include "sphere.glsl"

// Nearest of the constant spheres and polygons.
void closest_constant(Ray ray, inout float t, inout int id) {
    closest_sphere(ray.origin, ray.direction, ray.self_id, t, id);
    if (POLYGON_COUNT > 0u) closest_polygon(ray.origin, ray.direction, ray.self_id, t, id);
}

// Whether any constant sphere lies between the start of a ray and the point at `distance`.
bool any_constant_sphere(Ray ray, float distance) {
    return any_sphere(ray.origin, ray.direction, distance, ray.self_id);
}

// The same for a light there.
bool any_constant_sphere_before_light(Ray ray, float distance) {
    if (SINGLE_POINT) return any_sphere_before_point(ray.direction, distance, ray.self_id);
    return any_constant_sphere(ray, distance);
}

// The same for polygons; of a ray that is not `enabled`, what is quickly known. For all lanes to call: it counts for the subgroup.
bool any_constant_polygon(Ray ray, float distance, bool enabled) {
    return POLYGON_COUNT > 0u && any_polygon(ray.origin, ray.direction, distance, ray.self_id, enabled);
}

#endif
