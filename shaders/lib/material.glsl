// What surfaces do with light, as the table of geometry.glsl has it, two texels a material:
//
//   reflectance | type of the BSDF;  emission | index of refraction

#ifndef MATERIAL_GLSL
#define MATERIAL_GLSL

#include "bsdf/closure.glsl"
#include "geometry.glsl"
#include "lane_table.glsl"

// Some surface emits on both sides (src/render/light/table.rs).
const bool HAS_TWO_SIDED = (LIGHT_KINDS & 1u << 6) != 0u;
// In a material's type: it does.
const uint TWO_SIDED = 0x100u;

struct Material {
    uint type;          // BSDF_… (bsdf/closure.glsl) | TWO_SIDED
    vec3 reflectance;
    vec3 emission;      // radiance that leaves its front, or both sides
    float ior;          // of a dielectric: index of refraction of the back over that of the front
};

const uint MATERIAL_TEXELS = 2u;

Material fetch_material(uint index) {
    int texel = int(first_material + MATERIAL_TEXELS * index);
    uvec4 a = texelFetch(geometry_texels, texel);
    Material m = Material(a.w, uintBitsToFloat(a.xyz), vec3(0.0), 1.0);
    if (HAS_EMITTER || HAS_DIELECTRIC) {
        vec4 b = uintBitsToFloat(texelFetch(geometry_texels, texel + 1));
        m.emission = b.xyz;
        m.ior = b.w;
    }
    return m;
}

// Of a table in registers, see lane_table.glsl.
Material table_value(Material m, int row) {
    m.type = uint(table_value(int(m.type), row));
    m.reflectance = table_value(m.reflectance, row);
    if (HAS_EMITTER) m.emission = table_value(m.emission, row);
    if (HAS_DIELECTRIC) m.ior = table_value(m.ior, row);
    return m;
}

Material either_material(bool second, Material b, Material a) {
    return Material(second ? b.type : a.type, second ? b.reflectance : a.reflectance, second ? b.emission : a.emission,
                    second ? b.ior : a.ior);
}

// Whether a material emits from that side, if it emits.
bool shines_from(Material m, bool front) { return front || (HAS_TWO_SIDED && (m.type & TWO_SIDED) != 0u); }

// How a material scatters light that comes from its front, or from its back.
Bsdf bsdf_of(Material m, bool front) {
    Bsdf b = Bsdf(HAS_TWO_SIDED ? m.type & ~TWO_SIDED : m.type, m.reflectance, 1.0);
    if (HAS_DIELECTRIC) b.eta = front != (MUTATION == MUTATE_IOR) ? m.ior : 1.0 / m.ior;
    if (MUTATION == MUTATE_ALBEDO) b.reflectance *= 1.01;
    return b;
}

#endif
