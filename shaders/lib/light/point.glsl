// Point lights: isotropic, of intensity I = Φ/4π; irradiance at distance r under θ: I cosθ/r².

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

LightSample point_sample(vec3 position, vec3 intensity, vec3 from) {
    vec3 to = position - from;
    float r2 = dot(to, to);
    float inverse = 1.0 / sqrt(r2);
    return LightSample(r2 > 0.0 ? intensity * (inverse * inverse) : vec3(0.0), to * inverse, r2 * inverse, 0.0);
}

#endif
