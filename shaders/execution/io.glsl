// What shaders about execution share: words in, words out, of one function a module.

#ifndef EXECUTION_IO_GLSL
#define EXECUTION_IO_GLSL

layout(std430, binding = 0) readonly buffer Given { uint given[]; };
layout(std430, binding = 1) coherent buffer Found { uint found[]; };
layout(push_constant) uniform Push { uint first; uint second; };
layout(constant_id = 2) const uint FUNCTION = 0u;

// Of each invocation, where it has several.
const uint WORDS = 16u;

#endif
