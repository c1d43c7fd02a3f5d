// Point lights: isotropic, total power Φ. Irradiance at distance r: Φ cosθ/(4π r²); reflected by a diffuse surface:
// radiance = Φ/(4π r²)·ρ/π·cosθ. The tables hold Φ/(4π²).

#ifndef POINT_GLSL
#define POINT_GLSL

#include "../layout.glsl"
#include "../math.glsl"

// The only light of a scene, where that is a point light.
layout(constant_id = 200) const float POINT_X = 0.0;
layout(constant_id = 201) const float POINT_Y = 0.0;
layout(constant_id = 202) const float POINT_Z = 0.0;
layout(constant_id = 203) const float POINT_R = 0.0;
layout(constant_id = 204) const float POINT_G = 0.0;
layout(constant_id = 205) const float POINT_B = 0.0;

// Where a light was sampled, as seen from a surface point.
struct LightSample {
    vec3 point;         // end of the shadow ray
    vec3 radiance;      // arriving, times cos/π of a white diffuse surface over the density of the choice
    float pdf;          // per solid angle; 0 for a point light, which no ray can hit
};

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
