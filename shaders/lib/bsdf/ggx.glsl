// Reflection by GGX microfacets with height-correlated Smith shadowing (Walter et al. 2007; Heitz 2014), in the frame of the normal.
//
// The half vector is not normalised, and distances from the normal are not differences of squares: exact to a few ulp however small α is.

#ifndef GGX_GLSL
#define GGX_GLSL

#include "../math.glsl"
#include "mirror.glsl"

// Distribution of normals at the half vector h of any length.
float ggx_distribution(vec3 h, float alpha) {
    float a2 = alpha * alpha;
    float stretched = dot(h, h) / (a2 * h.z * h.z + (h.x * h.x + h.y * h.y));
    return a2 * (1.0 / PI) * stretched * stretched;
}

// √(cos² + α² sin²): Smith's function is Λ = (this/cos − 1)/2.
float ggx_root(vec3 w, float alpha) { return sqrt(w.z * w.z + alpha * alpha * (w.x * w.x + w.y * w.y)); }

// D·G/(4·cos θo), the distribution over directions without Fresnel's term, and 1 − cosine between wo and h.
float ggx_eval(vec3 wo, vec3 wi, float alpha, out float fresnel_angle) {
    vec3 h = wo + wi;
    fresnel_angle = clamp(1.0 - 0.5 * sqrt(dot(h, h)), 0.0, 1.0);
    return ggx_distribution(h, alpha) * wi.z * 0.5 / (wo.z * ggx_root(wi, alpha) + wi.z * ggx_root(wo, alpha));
}

// How far below the horizon visible normals are bounded, as a factor of wo.z (Eto and Tokuyoshi, "Bounded VNDF Sampling for Smith–GGX
// Reflections", 2023): no reflected direction that is lost is left out, few others are drawn.
float ggx_bound(vec3 wo, float alpha) {
    float s = 1.0 + sqrt(wo.x * wo.x + wo.y * wo.y);
    float s2 = s * s;
    return (1.0 - alpha * alpha) * s2 / (s2 + alpha * alpha * wo.z * wo.z);
}

// Density of ggx_sample per solid angle.
float ggx_pdf(vec3 wo, vec3 wi, float alpha) {
    return ggx_distribution(wo + wi, alpha) / (2.0 * (ggx_bound(wo, alpha) * wo.z + ggx_root(wo, alpha)));
}

// A visible normal (Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023), within ggx_bound, or with 1 any.
vec3 ggx_normal(vec3 wo, float alpha, float bound, vec2 u) {
    vec3 stretched = normalize(vec3(alpha * wo.xy, wo.z));
    float lowest = bound * stretched.z;
    float z = (1.0 - u.y) * (1.0 + lowest) - lowest;
    vec3 cap = vec3(sqrt(clamp(1.0 - z * z, 0.0, 1.0)) * cos_sin_2pi(u.x), z) + stretched;
    return normalize(vec3(alpha * cap.xy, fast_max(cap.z, 1e-12)));
}

// A direction of reflection, by a visible normal.
vec3 ggx_sample(vec3 wo, float alpha, vec2 u) { return mirrored(wo, ggx_normal(wo, alpha, ggx_bound(wo, alpha), u)); }

#endif
