// Point lights: isotropic, total power Φ. Irradiance at distance r: Φ cosθ/(4π r²); reflected by a diffuse surface:
// radiance = Φ/(4π r²)·ρ/π·cosθ. The tables hold Φ/(4π²).

#ifndef POINT_GLSL
#define POINT_GLSL

#include "light.glsl"

// The only light of a scene, where that is a point light.
vec3 point_at;
vec3 point_power;

// To be called when a kernel begins.
void load_point() {
    point_at = point_position.xyz;
    point_power = point_intensity.rgb;
}

LightSample point_sample(vec3 position, vec3 intensity, vec3 from, vec3 n) {
    vec3 to = position - from;
    float r2 = dot(to, to);
    float inverse = 1.0 / sqrt(r2);
    float c = dot(n, to) * inverse;
    if (MUTATION == MUTATE_COSINE) c = c > 0.0 ? 1.0 : c;
    bool lit = c > 0.0 && r2 > 0.0;
    return LightSample(position, lit ? intensity * (c * inverse * inverse) : vec3(0.0), 0.0);
}

#endif
