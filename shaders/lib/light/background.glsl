// The background: a light at infinity, of the same radiance in all directions. Light sampling leaves it to rays that meet nothing.

#ifndef BACKGROUND_GLSL
#define BACKGROUND_GLSL

#include "../layout.glsl"

vec3 background_radiance(vec3 direction) { return background.rgb; }

// Density per solid angle with which light sampling chooses a direction from which the background shines.
float background_pdf(vec3 direction) { return 0.0; }

#endif
