// Points that shine within a cone and as far as a range (KHR_lights_punctual).

#ifndef SPOT_GLSL
#define SPOT_GLSL

#include "point.glsl"

LightSample spot_sample(Light l, vec3 from) {
    LightSample s = point_sample(l.a, l.b, from);
    float part = clamp(l.normal.y - l.normal.x * dot(s.direction, l.c), 0.0, 1.0);
    float near = s.distance * l.normal.z;
    near *= near;
    float window = fast_max(1.0 - near * near, 0.0);
    s.radiance *= (MUTATION == MUTATE_SPOT ? part : part * part) * (MUTATION == MUTATE_RANGE ? 1.0 : window);
    return s;
}

#endif
