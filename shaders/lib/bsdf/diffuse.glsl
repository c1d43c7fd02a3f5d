// Lambert: f = reflectance/π on both sides. Sampled proportionally to the cosine, so that f·cosθ/pdf = reflectance.

#ifndef DIFFUSE_GLSL
#define DIFFUSE_GLSL

#include "../math.glsl"

// Direction around the unit normal n; pdf = cosθ/π per solid angle.
vec3 diffuse_sample(vec3 n, vec2 u) {
    vec3 tangent, bitangent;
    basis(n, tangent, bitangent);
    vec2 disc = sqrt(u.y) * cos_sin_2pi(u.x);
    return tangent * disc.x + bitangent * disc.y + n * sqrt(1.0 - u.y);
}

float diffuse_pdf(float cos_theta) { return upper(cos_theta, 0.0) * (1.0 / PI); }

#endif
