// Conductors: microfacets that let no light in, with Fresnel's equations for an index η + ik, or the same reflectance at all angles.

#ifndef CONDUCTOR_GLSL
#define CONDUCTOR_GLSL

#include "../math.glsl"
#include "closure.glsl"

// Of unpolarised light under a cosine, for one channel. With the root a + ib of (η + ik)² − sin²θ, all is sums of squares.
float conductor_fresnel(float cosine, float eta, float k) {
    float sine2 = 1.0 - cosine * cosine;
    float real = (eta - k) * (eta + k) - sine2;
    float half_imaginary = eta * k;
    float root = sqrt(real * real + 4.0 * half_imaginary * half_imaginary);
    float larger = sqrt(fast_max(0.5 * (root + abs(real)), 1e-18));
    float other = half_imaginary / larger;
    float a = real > 0.0 ? larger : other;
    float b = real > 0.0 ? other : larger;
    float b2 = b * b;
    float across = ((cosine - a) * (cosine - a) + b2) / ((cosine + a) * (cosine + a) + b2);
    float c = a * cosine;
    b2 *= cosine * cosine;
    float along = ((c - sine2) * (c - sine2) + b2) / ((c + sine2) * (c + sine2) + b2);
    if (MUTATION == MUTATE_CONDUCTOR) along = 1.0;
    return 0.5 * across * (1.0 + along);
}

vec3 conductor_fresnel(float cosine, vec3 eta, vec3 k) {
    return vec3(conductor_fresnel(cosine, eta.x, k.x), conductor_fresnel(cosine, eta.y, k.y), conductor_fresnel(cosine, eta.z, k.z));
}

#endif
