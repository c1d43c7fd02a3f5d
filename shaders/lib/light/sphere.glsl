// Emitting spheres: from outside by the solid angle that they subtend, from inside (inward normal) by area.

#ifndef LIGHT_SPHERE_GLSL
#define LIGHT_SPHERE_GLSL

#include "../cone.glsl"
#include "point.glsl"

// Density per solid angle of sampling a point that lies on the sphere at squared distance r2 under `cos_light`.
float sphere_pdf(Light l, vec3 from, float r2, float cos_light) {
    vec3 to = l.a - from;
    float sin2 = l.size * l.size / dot(to, to);
    if (is_kind(l, LIGHT_INWARD)) return r2 / (4.0 * PI * l.size * l.size * cos_light);
    return 1.0 / (TWO_PI * cone_depth(fast_min(sin2, 1.0)));
}

LightSample sphere_sample(Light l, vec3 from, vec2 u) {
    vec3 center = l.a;
    float radius = l.size;
    vec3 to_center = center - from;
    float d2 = dot(to_center, to_center);
    float r2 = radius * radius;
    // A bound on how far off the sphere a ray meets it. The shadow ray ends that much before the surface: where it enters a sphere so much
    // larger, for a ray that grazes the sphere meets it anywhere between the two.
    float slack = 1e-6 * (radius + abs(center.x) + abs(center.y) + abs(center.z) + sqrt(d2));
    LightSample s;
    // `precise`: of what is divided by the other kind's density, or by this one's alone, drivers would make different things.
    precise float pdf;
    bool visible;
    if (is_kind(l, LIGHT_INWARD)) {
        float z = 1.0 - 2.0 * u.y;
        vec2 disc = sqrt(fast_max(1.0 - z * z, 0.0)) * cos_sin_2pi(u.x);
        vec3 m = vec3(disc, z);
        vec3 to = center + (radius - slack) * m - from;
        float l2 = dot(to, to);
        s.distance = sqrt(l2);
        s.direction = to / s.distance;
        float cos_light = dot(m, s.direction);
        // From the sphere itself it is seen, on whichever side of it rounding puts the start.
        visible = d2 < (radius + slack) * (radius + slack) && cos_light > 0.0;
        pdf = l2 / (4.0 * PI * r2 * cos_light);
    } else {
        visible = d2 > r2;
        float sin2_max = fast_min(r2 / d2, 1.0);
        float depth = u.y * cone_depth(sin2_max);
        float cos_a = 1.0 - depth;
        float sin2_a = depth * (2.0 - depth);
        vec3 axis = to_center * inversesqrt(d2);
        vec3 tangent, bitangent;
        basis(axis, tangent, bitangent);
        vec2 disc = sqrt(sin2_a) * cos_sin_2pi(u.x);
        s.direction = normalize(tangent * disc.x + bitangent * disc.y + axis * cos_a);
        // The near root of the larger sphere: d cosα − √(r² − d² sin²α).
        float larger2 = MUTATION == MUTATE_LIMB ? r2 : (radius + slack) * (radius + slack);
        s.distance = fast_max(sqrt(d2) * cos_a - sqrt(fast_max(larger2 - d2 * sin2_a, 0.0)), 0.0);
        if (MUTATION == MUTATE_LIMB) s.distance = fast_max(s.distance - slack, 0.0);
        pdf = 1.0 / (TWO_PI * cone_depth(sin2_max));
    }
    visible = visible && s.distance > 0.0;
    pdf = visible ? pdf : 1.0;
    precise float weight = 1.0 / pdf;
    s.radiance = visible ? l.radiance * weight : vec3(0.0);
    s.pdf = pdf;
    return s;
}

#endif
