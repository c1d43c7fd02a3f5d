// Emitting triangles and parallelograms, sampled uniformly by area; but rectangles that look large by solid angle. They emit
// from the front only: the side from which v0, v1, v2 run counter-clockwise.

#ifndef LIGHT_TRIANGLE_GLSL
#define LIGHT_TRIANGLE_GLSL

#include "point.glsl"
#include "rectangle.glsl"

// Where on its edges from v0 a point lies that is chosen uniformly by area.
vec2 flat_point(float kind, vec2 u) {
    // Uniform barycentrics of a triangle (Turk, Graphics Gems, 1990).
    float root = sqrt(u.x);
    return kind == LIGHT_TRIANGLE ? vec2(root * (1.0 - u.y), root * u.y) : u;
}

// Density per solid angle of sampling a point of such an area uniformly, seen at squared distance r2 under cosine `cos_light`.
float area_pdf(float area, float r2, float cos_light) { return r2 / (area * cos_light); }

// Density per solid angle with which flat_sample gives such a point.
float flat_pdf(float kind, vec3 v0, vec3 v1, vec3 v2, float area, vec3 from, float r2, float cos_light) {
    float pdf = area_pdf(area, r2, cos_light);
    if (HAS_RECTANGLES && kind == LIGHT_RECTANGLE) {
        SeenRectangle seen = seen_rectangle(v0, v1, v2, normalize(cross(v1 - v0, v2 - v0)), from);
        pdf = looks_large(seen) ? 1.0 / seen.solid_angle : pdf;
    }
    return pdf;
}

// A triangle v0 v1 v2, or the parallelogram or rectangle with the corner v0 between v1 and v2.
LightSample flat_sample(float kind, vec3 v0, vec3 v1, vec3 v2, float area, vec3 radiance, vec3 from, vec3 n, vec2 u) {
    vec2 b = flat_point(kind, u);
    vec3 normal = normalize(cross(v1 - v0, v2 - v0));
    SeenRectangle seen;
    bool large = false;
    if (HAS_RECTANGLES) {
        seen = seen_rectangle(v0, v1, v2, normal, from);
        large = kind == LIGHT_RECTANGLE && looks_large(seen);
        if (large) b = rectangle_point(seen, u);
    }
    vec3 p0 = (1.0 - b.x - b.y) * v0;
    vec3 p1 = b.x * v1;
    vec3 p2 = b.y * v2;
    // Off the triangle by a bound on the error of the point, and of the distance at which a ray from so far away meets
    // it: the shadow ray must end before the light. (The absolute error of n·d alone is γ(3), whatever the angle.)
    vec3 p = p0 + p1 + p2;
    vec3 apart = abs(p - from);
    vec3 point = p + normal * (GAMMA_7 * (dot(abs(p0) + abs(p1) + abs(p2), abs(normal)) + (apart.x + apart.y + apart.z)));
    if (HAS_RECTANGLES && large) point = p + seen.off;
    vec3 to = point - from;
    float r2 = dot(to, to);
    float inverse = 1.0 / sqrt(r2);
    float cos_light = -dot(normal, to) * inverse;
    float c = dot(n, to) * inverse;
    bool lit = cos_light > 0.0 && c > 0.0 && r2 > 0.0;
    float pdf = lit ? area_pdf(area, r2, cos_light) : 1.0;
    if (HAS_RECTANGLES && large) pdf = 1.0 / seen.solid_angle;
    return LightSample(point, lit ? radiance * (c / (PI * pdf)) : vec3(0.0), pdf);
}

#endif
