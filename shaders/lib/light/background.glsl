// Light from where a ray meets nothing: of the same radiance in all directions, which light sampling leaves to rays that meet nothing, or
// a map.

#ifndef BACKGROUND_GLSL
#define BACKGROUND_GLSL

#include "../layout.glsl"
#include "environment.glsl"

vec3 background_radiance(vec3 direction) { return has_map() ? environment_radiance(direction) : background.rgb; }

// Density per solid angle with which light sampling chooses a direction from which the background shines.
float background_pdf(vec3 direction) { return has_map() ? environment_share * environment_pdf(direction) : 0.0; }

#endif
