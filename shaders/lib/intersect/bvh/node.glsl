// A record of the BVH: an inner node with the boxes of up to four children, which take a byte a plane (Ylitie, Karras
// and Laine, HPG 2017), or what a leaf holds: a sphere, a triangle, or two with a common edge. src/accel/record.rs packs them.
//
//   inner node   origin | first child, above all coordinates,  lo | exponents,  hi | children and their order
//   triangles    v0 | v3.x,  v1 | v3.y,  v2 | v3.z: of v0, v1, v2 and of v3, v2, v1, which has no area if there is only one
//   sphere       centre | -,  (radius, -, -) | -2,  -
//
// Coordinates of triangles are below 2: bit 30 of a word is free. In x of v0 (of v1: of the second triangle) it says that the back lets rays
// pass, in y that the material has alpha.
//
// After all records are the numbers of the primitives that each holds, two a record (bvh.glsl).
//
// A group is a word for the children of a node that are still to be visited: their first record in bits 7.., the
// order in which to visit them in three bits, and a bit for each of them.

#ifndef NODE_GLSL
#define NODE_GLSL

#include "slab.glsl"
#include "triangle.glsl"

struct BvhRay {
    vec3 origin;
    vec3 direction;
    vec3 inverse;
    vec3 near_offset;   // of the distances to planes on the near sides of boxes,
    vec3 far_offset;    // and to those on the far sides
    uint octant;        // where a node has the order of its children for the ray's direction
    Shear shear;
};

// Where a node has bits that are 0. Rays that ask only whether there is any hit visit children in the order of their records:
// they meet as many on the way (within .3%; armadillos, a bunny, a dragon, a height field), and the next one is found sooner.
const uint NO_ORDER = 31u;

// With `any_hit`, for a traversal that ends at the first hit.
BvhRay bvh_ray(vec3 o, vec3 d, bool any_hit) {
    vec3 inverse = safe_inverse(d);
    // Three bits for each octant.
    uint octant = (inverse.x < 0.0 ? 3u : 0u) + (inverse.y < 0.0 ? 6u : 0u) + (inverse.z < 0.0 ? 12u : 0u);
    vec3 offset = -o * inverse;
    vec3 margin = box_margin(o) * abs(inverse);
    return BvhRay(o, d, inverse, offset - margin, offset + margin, any_hit ? NO_ORDER : octant, shear_of(d));
}

const uint COORDINATE_BITS = 0xbfffffffu;

// As fetched.
struct BvhRecord {
    uvec4 a;
    uvec4 b;
    uvec4 c;
};

BvhRecord bvh_record(int record) {
    return BvhRecord(bvh_texel(3 * record), bvh_texel(3 * record + 1),
                      bvh_texel(3 * record + 2));
}

// No coordinate is negative and as large as this is as a float: 2^125.
const uint FIRST_INNER = 0xfe000000u;
bool is_leaf(BvhRecord q) { return q.a.w < FIRST_INNER; }

uvec4 bytes_of(uint word) { return uvec4(word, word >> 8, word >> 16, word >> 24) & 0xffu; }

// The group of those children of an inner node whose boxes the ray meets before t_max.
uint children_hit(BvhRay r, BvhRecord q, float t_max) {
    // Planes lie at origin + scale·byte, and are met at (plane − r.origin)·inverse, give or take the margin: at b + a·byte.
    vec3 scale = uintBitsToFloat(uvec3(q.b.w << 23, q.b.w << 15, q.b.w << 7) & 0x7f800000u);
    vec3 a = scale * r.inverse;
    vec3 b = uintBitsToFloat(q.a.xyz) * r.inverse;
    vec3 b0 = b + r.near_offset;
    vec3 b1 = b + r.far_offset;
    // As integers: a CPU chooses by the sign bit itself, and needs no comparison. None is 0.
    bvec3 back = lessThan(floatBitsToInt(r.inverse), ivec3(0));
    uvec3 lo = q.b.xyz ^ 0x40404040u;
    uvec3 near = mix(lo, q.c.xyz, back);
    uvec3 far = mix(q.c.xyz, lo, back);
    // Distances as the bits of floats: in the same order where none is negative, and below 0 where one is. The smallest of several
    // integers takes a CPU one instruction, of floats often three. One axis after the other, so that a CPU needs few registers.
    ivec4 enter = ivec4(0);
    ivec4 leave = ivec4(floatBitsToInt(t_max));
#define AXIS(x)                                                                  \
    enter = max(enter, floatBitsToInt(vec4(bytes_of(near.x)) * a.x + b0.x));     \
    leave = min(leave, floatBitsToInt(vec4(bytes_of(far.x)) * a.x + b1.x));
    AXIS(x) AXIS(y) AXIS(z)
#undef AXIS
    uvec4 met = mix(uvec4(0u), uvec4(1u, 2u, 4u, 8u), lessThanEqual(enter, leave));
    return (q.a.w << 7) | ((q.c.w >> r.octant) & 0x70u) | ((met.x | met.y | met.z | met.w) & q.c.w);
}

// Whether a group has members.
bool is_left(uint group) { return (group & 15u) != 0u; }

// Takes the next member out of a group that has some: its record. Bits are not made into conditions, of which drivers for CPUs make
// longer code.
int take_child(inout uint group) {
    uint second = (group >> 4) & 2u;                            // 2: of the second pair
    second ^= ((group >> second) & 3u) == 0u ? 2u : 0u;
    uint pair = group >> second;                                // bits 0 and 1: who is left of it; bit 4: the second one first
    uint member = ((pair >> 1) & ~(pair & ~(pair >> 4)) & 1u) | second;
    uint record = (group >> 7) + member;
    group &= ~(1u << member);
    return int(record);
}

// The same of a group that has no order.
int take_any_child(inout uint group) {
    uint others = group & (group - 1u);
    uint first = group ^ others;    // 1, 2, 4 or 8
    group = others;
    return int((others >> 7) + (first >> 1) - (first >> 3));
}

#endif
