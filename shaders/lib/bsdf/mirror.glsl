// Perfect mirror.

#ifndef MIRROR_GLSL
#define MIRROR_GLSL

// The direction that d is reflected into, for a unit normal on either side.
vec3 mirror_sample(vec3 d, vec3 n) { return d - 2.0 * dot(d, n) * n; }

#endif
