// What surfaces do with light, as the table of geometry.glsl has it, two texels a material:
//
//   reflectance | type of the BSDF and flags;  emission | index of refraction, or of what has details their number
//
// Details are what not all materials have, in texels after those of all materials:
//   metalness, roughness, alpha, coverage: 0 opaque, > 0 where alpha is at least this, < 0 the part alpha;  F0 and F90 of the dielectric;
//   scale of normals, texel of its layers after the first of all details, or −1, -, -;
//   textures of base colour, of metalness and roughness, of normals, of emission, or −1;
//   part that lets light through, its texture, or −1, index of refraction, 1 of a body or 0 of a thin wall;
//   what the body absorbs on a length of 1, -
// Layers are what few materials have:
//   strength and roughness of the coat, scale of its normals, -;  colour and roughness of the sheen;
//   anisotropy, cosine and sine of its rotation, -;
//   textures of the coat's strength, roughness and normals, of anisotropy;  of the sheen's colour and roughness, of F90, of F0
// or, of a conductor, η or what it reflects, and 1 if it is η;  k, -;  the mean of Fresnel's term, -;  two that are not used

#ifndef MATERIAL_GLSL
#define MATERIAL_GLSL

#include "bsdf/closure.glsl"
#include "bsdf/glass.glsl"
#include "bsdf/metallic_roughness.glsl"
#include "geometry.glsl"
#include "lane_table.glsl"

// Some surface emits on both sides (src/render/light/table.rs).
const bool HAS_TWO_SIDED = (LIGHT_KINDS & 1u << 6) != 0u;
// In a material's type: it does.
const uint TWO_SIDED = 0x100u;
// It has details.
const uint DETAILED = 0x200u;
// Its emission has the colour of the vertices.
const uint UNLIT = 0x400u;
// Its microfacets are those of a conductor.
const uint CONDUCTOR = 0x800u;
const uint BSDF_TYPE_BITS = 0xffu;

struct Material {
    uint type;          // BSDF_… (bsdf/closure.glsl) | flags
    vec3 reflectance;
    vec3 emission;      // radiance that leaves its front, or both sides
    float ior;          // of a dielectric: index of refraction of the back over that of the front; or the number of its details
    float metallic;     // with details:
    float roughness;
    vec4 dielectric;    // F0 and F90 of the dielectric; of a conductor η, or what it reflects, and whether it is η
    vec3 k;             // of a conductor
    float anisotropy;
    vec3 tangent;       // along which it is rougher
    float coat;         // strength
    float coat_roughness;
    vec4 sheen;         // colour and roughness
    vec3 coat_normal;   // on the front, or, without a coat, 0
    float transmission; // part of the dielectric that lets light through
    float glass_ior;    // its index of refraction
    int body;           // number of its details if it has an inside, else -1
};

const uint MATERIAL_TEXELS = 2u;

// First of the texels of details.
int details_texel(float number) { return int(first_detail) + 6 * int(number); }

// First of the texels of layers, or −1.
int layers_texel(float number) { return number < 0.0 ? -1 : int(first_detail) + int(number); }

Material fetch_material(uint index) {
    int texel = int(first_material + MATERIAL_TEXELS * index);
    uvec4 a = geometry_texel(texel);
    Material m = Material(a.w, uintBitsToFloat(a.xyz), vec3(0.0), 1.0, 0.0, 1.0, vec4(0.0), vec3(0.0), 0.0, vec3(0.0), 0.0, 0.0,
                          vec4(0.0), vec3(0.0), 0.0, 1.0, -1);
    if (HAS_EMITTER || HAS_DIELECTRIC || HAS_DETAILS) {
        vec4 b = uintBitsToFloat(geometry_texel(texel + 1));
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
    if (HAS_DIELECTRIC || HAS_DETAILS) m.ior = table_value(m.ior, row);
    return m;
}

Material either_material(bool second, Material b, Material a) {
    a.type = second ? b.type : a.type;
    a.reflectance = second ? b.reflectance : a.reflectance;
    a.emission = second ? b.emission : a.emission;
    a.ior = second ? b.ior : a.ior;
    return a;
}

// Whether a material emits from that side, if it emits.
bool shines_from(Material m, bool front) { return front || (HAS_TWO_SIDED && (m.type & TWO_SIDED) != 0u); }

// At random, by a number: either what lets light through or what does not, of which the other parts are left.
void choose_glass(inout Material m, float number) {
    if (m.transmission <= 0.0 || (m.type & BSDF_TYPE_BITS) != BSDF_METALLIC_ROUGHNESS) return;
    float part = (1.0 - m.metallic) * m.transmission;
    if (number < part) m.type = (m.type & ~BSDF_TYPE_BITS) | (m.body >= 0 ? BSDF_GLASS : BSDF_WALL);
    else m.metallic /= 1.0 - part;
}

// What it is that scatters.
uint bsdf_type(Material m) { return HAS_TWO_SIDED || HAS_DETAILS ? m.type & BSDF_TYPE_BITS : m.type; }

// Whether it is evaluated about a normal that is bent (bent_normal in bsdf.glsl): not of smooth glass, which bends directions.
bool bends_normal(Material m) {
    uint type = bsdf_type(m);
    return type == BSDF_METALLIC_ROUGHNESS || (HAS_TRANSMISSION && is_glass(type) && m.roughness > MIN_ROUGHNESS);
}

// How a material scatters light that comes from its front, or from its back, along wo about the normal n.
Bsdf bsdf_of(Material m, bool front, vec3 n, vec3 wo) {
    Bsdf b = bsdf_of_type(bsdf_type(m), m.reflectance, 1.0);
    if (HAS_METALLIC_ROUGHNESS && b.type == BSDF_METALLIC_ROUGHNESS) {
        vec3 o = vec3(0.0, 0.0, dot(n, wo));
        if (HAS_ANISOTROPY && m.anisotropy > 0.0) {
            b.tangent = m.tangent;
            vec3 tangent, bitangent;
            frame_about(n, b.tangent, tangent, bitangent);
            o = to_frame(wo, tangent, bitangent, n);
        }
        b.lobes = lobes_of(m.reflectance, m.metallic, m.roughness, m.dielectric.xyz, m.dielectric.w, m.anisotropy, o);
        if (HAS_CONDUCTOR && (m.type & CONDUCTOR) != 0u) {
            vec4 k = vec4(m.k, m.dielectric.w > 0.0 ? 1.0 : -1.0);
            b.lobes = conductor_lobes(m.dielectric.xyz, k, m.reflectance, m.roughness, dot(n, wo));
        }
    }
    if (HAS_DIELECTRIC) b.eta = front != (MUTATION == MUTATE_IOR) ? m.ior : 1.0 / m.ior;
    if (HAS_TRANSMISSION && is_glass(b.type)) {
        bool inside = !front && b.type == BSDF_GLASS;
        b.eta = inside != (MUTATION == MUTATE_IOR) ? 1.0 / m.glass_ior : m.glass_ior;
        set_glass(b, m.dielectric.xyz, m.dielectric.w, m.roughness, dot(n, wo));
    }
    if (MUTATION == MUTATE_ALBEDO) b.reflectance *= 1.01;
    return b;
}

#endif
