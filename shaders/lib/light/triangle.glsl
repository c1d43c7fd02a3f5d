// Emitting triangles and parallelograms, sampled uniformly by area; but rectangles that look large by solid angle. They emit
// from the front only: the side from which v0, v1, v2 run counter-clockwise.

#ifndef LIGHT_TRIANGLE_GLSL
#define LIGHT_TRIANGLE_GLSL

#include "point.glsl"
#include "rectangle.glsl"
#include "../coverage.glsl"

// Where on its edges from `a` a point lies that is chosen uniformly by area.
vec2 flat_point(Light l, vec2 u) {
    // Uniform barycentrics of a triangle (Turk, Graphics Gems, 1990).
    float root = sqrt(u.x);
    return is_kind(l, LIGHT_TRIANGLE) ? vec2(root * (1.0 - u.y), root * u.y) : u;
}

// Density per solid angle of sampling a point of such an area uniformly, seen at squared distance r2 under cosine `cos_light`.
float area_pdf(float area, float r2, float cos_light) { return r2 / (area * cos_light); }

// Density per solid angle with which flat_sample gives such a point.
float flat_pdf(Light l, vec3 from, float r2, float cos_light) {
    float pdf = area_pdf(l.size, r2, cos_light);
    if (HAS_RECTANGLES && is_kind(l, LIGHT_RECTANGLE)) {
        SeenRectangle seen = seen_rectangle(l, from);
        pdf = looks_large(seen) ? 1.0 / seen.solid_angle : pdf;
    }
    return pdf;
}

// A bound on how far off an emitter's plane, along its normal, a ray from a point `apart` from there meets it: 7 roundings of the point's
// terms, and 32 of the distance, for the tests of intersect/ (slab.glsl). However flat the ray.
float plane_error(vec3 terms, vec3 normal, vec3 apart) {
    return GAMMA_7 * dot(terms, abs(normal)) + 32.0 / 16777216.0 * (apart.x + apart.y + apart.z);
}

// A point of a triangle, parallelogram or rectangle. The shadow ray ends where the emitter cannot be met yet, so that it does not hide
// itself.
LightSample flat_sample(Light l, vec3 from, vec2 u) {
    vec2 b = flat_point(l, u);
    vec3 normal = l.normal;
    SeenRectangle seen;
    bool large = false;
    if (HAS_RECTANGLES) {
        seen = seen_rectangle(l, from);
        large = is_kind(l, LIGHT_RECTANGLE) && looks_large(seen);
        if (large) b = rectangle_point(seen, u);
    }
    vec3 p0 = (1.0 - b.x - b.y) * l.a;
    vec3 p1 = b.x * l.b;
    vec3 p2 = b.y * l.c;
    vec3 to = p0 + p1 + p2 - from;
    float r2 = dot(to, to);
    float inverse = 1.0 / sqrt(r2);
    vec3 direction = to * inverse;
    float cos_light = -dot(normal, direction);
    bool lit = cos_light > 0.0 && r2 > 0.0;
    float pdf = lit ? area_pdf(l.size, r2, cos_light) : 1.0;
    if (HAS_RECTANGLES && large) pdf = 1.0 / seen.solid_angle;
    float before = plane_error(abs(p0) + abs(p1) + abs(p2), normal, abs(to)) / (lit ? cos_light : 1.0);
    vec3 radiance = l.radiance;
    if (HAS_VARIED_EMISSION) radiance *= emission_part(l.primitive, b, l.normal);
    return LightSample(lit ? radiance / pdf : vec3(0.0), direction, fast_max(r2 * inverse - before, 0.0), pdf);
}

#endif
