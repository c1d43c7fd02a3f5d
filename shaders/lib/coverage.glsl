// Alpha: surfaces that let some rays pass. A ray that passes has not met the surface.
//
// The part alpha of rays is stopped at random: by a number that the ray and the primitive make, so that it is the same whenever a
// traversal comes by.

#ifndef COVERAGE_GLSL
#define COVERAGE_GLSL

#include "geometry.glsl"
#include "layout.glsl"
#include "material.glsl"
#include "ray.glsl"
#include "intersect/shear.glsl"
#include "sampler.glsl"
#include "texture.glsl"

vec4 uvs_at(uvec3 corners, vec2 barycentrics) {
    vec4 first = vertex_uvs(corners.x);
    return first + barycentrics.x * (vertex_uvs(corners.y) - first) + barycentrics.y * (vertex_uvs(corners.z) - first);
}

// A number in [0, 1).
float number_of_ray(vec3 origin, vec3 direction, int primitive) {
    uvec3 o = floatBitsToUint(origin);
    uvec3 d = floatBitsToUint(direction);
    return unit_float(hash(hash(o.x ^ hash(o.y ^ hash(o.z ^ hash(d.x ^ hash(d.y ^ hash(d.z)))))) ^ uint(primitive)));
}

// Alpha at a point of a triangle whose material has these details.
float alpha_at(uvec3 corners, vec2 barycentrics, int details, float alpha) {
    if (HAS_VERTEX_COLORS) {
        alpha *= (1.0 - barycentrics.x - barycentrics.y) * vertex_color(corners.x).w + barycentrics.x * vertex_color(corners.y).w
               + barycentrics.y * vertex_color(corners.z).w;
    }
    if (HAS_TEXTURES) {
        float base = uintBitsToFloat(geometry_texel(details + 3).x);
        if (base >= 0.0) alpha *= texture_value(uint(base), uvs_at(corners, barycentrics)).w;
    }
    return alpha;
}

// What textures and alpha leave of the emission of an emitter; `normal` is that of the side that is sampled.
vec3 emission_part(int primitive, vec2 barycentrics, vec3 normal) {
    vec3 part = vec3(1.0);
    // The back has its corners in the other order.
    if (dot(uintBitsToFloat(primitive_attributes(primitive).xyz), normal) < 0.0) barycentrics = barycentrics.yx;
    uvec4 shape = primitive_shape(primitive);
    Material m = fetch_material(material_index(shape.w));
    if ((m.type & DETAILED) == 0u || is_sphere(shape) || primitive < int(CONSTANTS)) return part;
    int details = details_texel(m.ior);
    float texture_ = uintBitsToFloat(geometry_texel(details + 3).w);
    if (HAS_TEXTURES && texture_ >= 0.0) part = texture_value(uint(texture_), uvs_at(shape.xyz, barycentrics)).xyz;
    vec2 alpha = uintBitsToFloat(geometry_texel(details).zw);
    if (HAS_COVERAGE && alpha.y != 0.0) {
        float covered = alpha_at(shape.xyz, barycentrics, details, alpha.x);
        part *= alpha.y > 0.0 ? (covered >= alpha.y ? 1.0 : 0.0) : covered;
    }
    return part;
}

// Whether a triangle whose material has alpha stops a ray that meets it.
bool stops_ray(int primitive, vec3 origin, vec3 direction) {
    uvec4 shape = primitive_shape(primitive);
    int details = details_texel(fetch_material(material_index(shape.w)).ior);
    vec2 alpha = uintBitsToFloat(geometry_texel(details).zw);
    vec2 barycentrics = barycentrics_of(origin, direction, triangle_of(shape)).yz;
    float part = alpha_at(shape.xyz, barycentrics, details, alpha.x);
    float least = MUTATION == MUTATE_ALPHA ? 0.5 : number_of_ray(origin, direction, primitive);
    return alpha.y > 0.0 ? part >= alpha.y : least < part;
}

#endif
