// The scene's primitives, vertices and materials, whatever finds the hits. Primitives are numbered in the order of the scene: constant
// spheres, polygons, other spheres, triangles. src/render/scene/geometry.rs packs the table: two texels a primitive, two a material
// (material.glsl), materials' details, then of vertices a texel each: position, normal, coordinates of textures (both sets), colour; and two,
// tangent and bitangent.
//
//   triangle    vertex 0, vertex 1, vertex 2, material | flags;      normal | light
//   sphere      centre | material | flags;                           radius, 1/radius with the normal's sign, - | light
//   polygon     first of 4 vertices, n·p of its points, -, material; normal | light

#ifndef GEOMETRY_GLSL
#define GEOMETRY_GLSL

#include "layout.glsl"

const uint IS_SPHERE = 0x80000000u;
const uint IS_SMOOTH = 0x40000000u;     // vertices have normals
const uint MATERIAL_BITS = 0x3fffffffu;

// Constant spheres and polygons: they come first.
const uint CONSTANTS = SPHERE_COUNT + POLYGON_COUNT;

uvec4 primitive_shape(int primitive) { return geometry_texel(2 * primitive); }
uvec4 primitive_attributes(int primitive) { return geometry_texel(2 * primitive + 1); }

vec3 vertex_position(uint vertex) { return uintBitsToFloat(geometry_texel(int(first_position + vertex)).xyz); }
vec3 vertex_normal(uint vertex) { return uintBitsToFloat(geometry_texel(int(first_normal + vertex)).xyz); }

vec4 vertex_uvs(uint vertex) { return uintBitsToFloat(geometry_texel(int(first_uv + vertex))); }
vec4 vertex_color(uint vertex) { return uintBitsToFloat(geometry_texel(int(first_color + vertex))); }
vec3 vertex_tangent(uint vertex) { return uintBitsToFloat(geometry_texel(int(first_tangent + 2u * vertex)).xyz); }
vec3 vertex_bitangent(uint vertex) { return uintBitsToFloat(geometry_texel(int(first_tangent + 2u * vertex) + 1).xyz); }

// Of a primitive with such a word.
uint material_index(uint word) { return word & MATERIAL_BITS; }

// Whether a primitive of the BVH is a sphere, whose first texel this is.
bool is_sphere(uvec4 shape) { return BVH_SPHERES && (!BVH_TRIANGLES || (shape.w & IS_SPHERE) != 0u); }

struct Triangle {
    vec3 v0, v1, v2;
};

// The triangle whose first texel this is. (Of a sphere some triangle.)
Triangle triangle_of(uvec4 shape) {
    if (is_sphere(shape)) shape = uvec4(0u);
    return Triangle(vertex_position(shape.x), vertex_position(shape.y), vertex_position(shape.z));
}

#endif
