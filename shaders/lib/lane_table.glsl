// Small tables in registers: lane i of eight holds row i, and a lane reads the row that it needs from another's register. With
// SHUFFLES that is one instruction for a number of all eight lanes of a CPU's vector, where a texel fetch takes a hundred and more.
//
// Rows are fetched by all lanes when a kernel begins, so that workgroups must fill their subgroups. They may be read when lanes that
// hold them have left a loop, which Vulkan leaves undefined. So SHUFFLES is set for one CPU driver alone, llvmpipe
// (src/render/kernel/driver_traits.rs): such a lane is an element of a vector, and keeps what it holds behind a mask.

#ifndef LANE_TABLE_GLSL
#define LANE_TABLE_GLSL

#include "layout.glsl"

const bool LANE_TABLES = SHUFFLES && !THREADS;
const uint TABLE_ROWS = 8u;

// The row that the lane holds of those from `first` on, of which there are `count` in all.
int row_of_lane(uint first, uint count) { return int(min(first + gl_SubgroupInvocationID, count - 1u)); }

// What is held by the lane that has such a row, of eight.
float table_value(float value, int row) { return subgroupShuffle(value, uint(row)); }
int table_value(int value, int row) { return subgroupShuffle(value, uint(row)); }
vec3 table_value(vec3 value, int row) {
    return vec3(table_value(value.x, row), table_value(value.y, row), table_value(value.z, row));
}
vec4 table_value(vec4 value, int row) { return vec4(table_value(value.xyz, row), table_value(value.w, row)); }

#endif
