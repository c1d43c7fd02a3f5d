// What all probes share: arrays of inputs and outputs in 16-byte words, one invocation an input. The function is chosen
// by a constant; `end_slot` is the number of inputs.

#ifndef IO_GLSL
#define IO_GLSL

#include "../lib/layout.glsl"

layout(local_size_x_id = 61, local_size_y = 1, local_size_z = 1) in;
layout(constant_id = 240) const uint PROBE = 0u;

// Words of integers: floats that hold NaN or integer bits pass unchanged.
layout(std430, binding = 8) readonly buffer ProbeInput { uvec4 probe_in[]; };
layout(std430, binding = 9) writeonly buffer ProbeOutput { uvec4 probe_out[]; };

vec4 input_floats(uint word) { return uintBitsToFloat(probe_in[word]); }
void output_floats(uint word, vec4 v) { probe_out[word] = floatBitsToUint(v); }

#endif
