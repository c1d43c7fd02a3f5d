// What a ray meets: position, normals and material at a hit.

#ifndef SURFACE_GLSL
#define SURFACE_GLSL

#include "coverage.glsl"
#include "geometry.glsl"
#include "lane_table.glsl"
#include "material.glsl"
#include "layout.glsl"
#include "math.glsl"
#include "texture.glsl"
#include "intersect/intersect.glsl"

struct Surface {
    vec3 position;
    vec3 normal;        // geometric, unit, towards the material's front
    vec3 shading;       // normal for cosines, on the same side as `normal`
    Material material;
    float offset;       // bound on the error of `position` along the normal
    float curvature;    // of a sphere, negative if its normal points inward; 0 for a triangle
    int light;          // of an emitter: its number in light/choice.glsl
};

// A unit vector but for rounding: one Newton step of 1/sqrt restores its length to 1 ulp.
vec3 renormalize(vec3 n) { return n * (1.5 - 0.5 * dot(n, n)); }

// A constant sphere or polygon.
struct Constant {
    vec4 shape;         // centre, 1/radius with the normal's sign; or normal, n·p of its points
    Material material;
    int light;
};

Constant fetch_constant(int primitive) {
    uvec4 shape = primitive_shape(primitive);
    uvec4 attributes = primitive_attributes(primitive);
    bool flat_ = POLYGON_COUNT > 0u && primitive >= int(SPHERE_COUNT);
    uvec4 bits = flat_ ? uvec4(attributes.xyz, shape.y) : uvec4(shape.xyz, attributes.y);
    return Constant(uintBitsToFloat(bits), fetch_material(material_index(shape.w)), int(attributes.w));
}

// Tables of eight, see lane_table.glsl.
const bool CONSTANTS_IN_LANES = LANE_TABLES && CONSTANTS <= 4u * TABLE_ROWS;
Constant constants_0, constants_8, constants_16, constants_24;

// To be called when a kernel begins.
void load_constants() {
    if (!CONSTANTS_IN_LANES) return;
    if (CONSTANTS > 0u) constants_0 = fetch_constant(row_of_lane(0u, CONSTANTS));
    if (CONSTANTS > 8u) constants_8 = fetch_constant(row_of_lane(8u, CONSTANTS));
    if (CONSTANTS > 16u) constants_16 = fetch_constant(row_of_lane(16u, CONSTANTS));
    if (CONSTANTS > 24u) constants_24 = fetch_constant(row_of_lane(24u, CONSTANTS));
}

Constant constant_of_table(Constant table, int row) {
    int light = EMITTER_COUNT > 0u ? table_value(table.light, row) : table.light;
    return Constant(table_value(table.shape, row), table_value(table.material, row), light);
}

Constant either_constant(bool second, Constant b, Constant a) {
    return Constant(second ? b.shape : a.shape, either_material(second, b.material, a.material), second ? b.light : a.light);
}

Constant constant_of(int id) {
    if (!CONSTANTS_IN_LANES) return fetch_constant(id);
    int row = CONSTANTS > 8u ? id & 7 : id;
    Constant c = constant_of_table(constants_0, row);
    if (CONSTANTS > 8u) c = either_constant(id >= 8, constant_of_table(constants_8, row), c);
    if (CONSTANTS > 16u) c = either_constant(id >= 16, constant_of_table(constants_16, row), c);
    if (CONSTANTS > 24u) c = either_constant(id >= 24, constant_of_table(constants_24, row), c);
    return c;
}

Surface surface_of_constant(int primitive, vec3 p) {
    Constant constant = constant_of(primitive);
    vec4 shape = constant.shape;
    vec3 n = renormalize((p - shape.xyz) * shape.w);
    float curvature = shape.w;
    float offset = 0.0;
    if (POLYGON_COUNT > 0u) {
        bool flat_ = primitive >= int(SPHERE_COUNT);
        n = flat_ ? shape.xyz : n;
        curvature = flat_ ? 0.0 : curvature;
        // Back onto the plane; then the error is that of the sums n·p and p, bounded by γ(7) times their terms.
        p = flat_ && MUTATION != MUTATE_PROJECTION ? p - n * (dot(n, p) - shape.w) : p;
        offset = flat_ ? GAMMA_7 * (dot(abs(n), abs(p)) + abs(shape.w)) : 0.0;
    }
    return Surface(p, n, n, constant.material, offset, curvature, constant.light);
}

// Of a triangle, or of a sphere that is no constant; `p` is a point near the hit.
Surface surface_of_primitive(inout Hit hit, Ray ray, vec3 p) {
    int primitive = max(hit.primitive, 0);
    uvec4 shape = primitive_shape(primitive);
    uvec4 attributes = primitive_attributes(primitive);
    bool sphere = is_sphere(shape);
    vec3 n = uintBitsToFloat(attributes.xyz);
    vec3 ns = n;
    float curvature = 0.0;
    float offset = 0.0;
    if (BVH_TRIANGLES) {
        // From barycentrics of the exact vertices, whatever has found the hit: closer to the plane than o + t·d, with pbrt's bound
        // γ(7)(|b0 v0| + |b1 v1| + |b2 v2|).
        Triangle corners = triangle_of(shape);
        vec3 b = barycentrics_of(ray.origin, ray.direction, corners);
        hit.barycentrics = b.yz;
        vec3 p0 = b.x * corners.v0;
        vec3 p1 = b.y * corners.v1;
        vec3 p2 = b.z * corners.v2;
        if (MUTATION != MUTATE_BARYCENTRIC) p = sphere ? p : p0 + p1 + p2;
        if (MUTATION != MUTATE_OFFSET) offset = sphere ? 0.0 : GAMMA_7 * dot(abs(p0) + abs(p1) + abs(p2), abs(n));
        if (SMOOTH_NORMALS && (shape.w & IS_SMOOTH) != 0u) {
            vec3 s = b.x * vertex_normal(shape.x) + b.y * vertex_normal(shape.y) + b.z * vertex_normal(shape.z);
            float length2 = dot(s, s);
            ns = length2 > 0.0 ? s * inversesqrt(length2) : n;
        }
    }
    if (sphere) {
        curvature = uintBitsToFloat(attributes.y);
        n = normalize(p - uintBitsToFloat(shape.xyz)) * (curvature < 0.0 ? -1.0 : 1.0);
        ns = n;
    }
    return Surface(p, n, ns, fetch_material(material_index(shape.w)), offset, curvature, int(attributes.w));
}

vec3 unit_or_zero(vec3 v) { return v * inversesqrt(max(dot(v, v), 1e-30)); }

// Reflection of a dielectric by textures, if it has some.
void vary_dielectric(inout Material m, int layers, vec4 uvs) {
    ivec2 textures = ivec2(uintBitsToFloat(geometry_texel(layers + 4).zw));
    if (textures.x < 0 && textures.y < 0) return;
    float strength = m.dielectric.w;
    if (textures.x >= 0) m.dielectric.w *= texture_value(uint(textures.x), uvs).w;
    vec3 color = textures.y >= 0 ? texture_value(uint(textures.y), uvs).xyz : vec3(1.0);
    m.dielectric.xyz = min(m.dielectric.xyz * color, vec3(1.0)) * (MUTATION == MUTATE_SPECULAR ? strength : m.dielectric.w);
}

// A normal that a texture gives in the frame of the tangent, the bitangent and the normal n of a triangle.
vec3 mapped_normal(vec4 value, float scale, uvec3 corners, vec3 b, vec3 n) {
    vec3 tangent = b.x * vertex_tangent(corners.x) + b.y * vertex_tangent(corners.y) + b.z * vertex_tangent(corners.z);
    vec3 bitangent = b.x * vertex_bitangent(corners.x) + b.y * vertex_bitangent(corners.y) + b.z * vertex_bitangent(corners.z);
    vec3 relief = (2.0 * value.xyz - 1.0) * vec3(scale, scale, 1.0);
    if (MUTATION == MUTATE_TANGENT) relief.y = -relief.y;
    vec3 mapped = unit_or_zero(tangent) * relief.x + unit_or_zero(bitangent) * relief.y + n * relief.z;
    return dot(mapped, mapped) > 1e-12 ? normalize(mapped) : n;
}

// The coat of a material with layers, as the material has it.
void fetch_coat(inout Material m, int layers, vec3 n) {
    vec2 coat = uintBitsToFloat(geometry_texel(layers).xy);
    m.coat = coat.x;
    m.coat_roughness = coat.y;
    m.coat_normal = n;
}

// The same, changed by textures; n is the normal that is not.
void vary_coat(inout Material m, int layers, vec4 uvs, uvec3 corners, vec3 b, vec3 n) {
    ivec3 textures = ivec3(uintBitsToFloat(geometry_texel(layers + 3).xyz));
    if (textures.x >= 0) m.coat *= texture_value(uint(textures.x), uvs).x;
    if (textures.y >= 0) m.coat_roughness *= texture_value(uint(textures.y), uvs).y;
    if (HAS_NORMAL_MAPS && textures.z >= 0) {
        float scale = uintBitsToFloat(geometry_texel(layers).z);
        m.coat_normal = mapped_normal(texture_value(uint(textures.z), uvs), scale, corners, b, n);
    }
}

// Sheen, changed by textures.
void vary_sheen(inout Material m, int layers, vec4 uvs) {
    ivec2 textures = ivec2(uintBitsToFloat(geometry_texel(layers + 4).xy));
    if (textures.x >= 0) m.sheen.xyz *= texture_value(uint(textures.x), uvs).xyz;
    if (textures.y >= 0) m.sheen.w *= texture_value(uint(textures.y), uvs).w;
}

// Anisotropy, about the normal n. Where there are no tangents they run around the vertical axis.
void add_anisotropy(inout Material m, int layers, bool is_triangle, uvec3 corners, vec2 barycentrics, vec3 n) {
    vec3 numbers = uintBitsToFloat(geometry_texel(layers + 2).xyz);
    m.anisotropy = numbers.x;
    vec2 direction = numbers.yz;
    vec3 tangent = vec3(0.0);
    vec3 bitangent = vec3(0.0);
    if (is_triangle) {
        vec3 b = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
        tangent = unit_or_zero(b.x * vertex_tangent(corners.x) + b.y * vertex_tangent(corners.y) + b.z * vertex_tangent(corners.z));
        bitangent = unit_or_zero(b.x * vertex_bitangent(corners.x) + b.y * vertex_bitangent(corners.y)
                                 + b.z * vertex_bitangent(corners.z));
    }
    if (dot(tangent, tangent) < 0.5) {
        vec3 around = cross(vec3(0.0, 1.0, 0.0), n);
        tangent = dot(around, around) > 1e-12 ? normalize(around) : vec3(1.0, 0.0, 0.0);
        bitangent = cross(n, tangent);
    }
    if (HAS_TEXTURES && is_triangle) {
        int number = int(uintBitsToFloat(geometry_texel(layers + 3).w));
        if (number >= 0) {
            vec3 value = texture_value(uint(number), uvs_at(corners, barycentrics)).xyz;
            vec2 turn = 2.0 * value.xy - 1.0;
            float length2 = dot(turn, turn);
            turn = length2 > 1e-12 ? turn * inversesqrt(length2) : vec2(1.0, 0.0);
            m.anisotropy *= value.z;
            direction = vec2(direction.x * turn.x - direction.y * turn.y, direction.x * turn.y + direction.y * turn.x);
        }
    }
    if (MUTATION == MUTATE_ANISOTROPY) direction.y = -direction.y;
    m.tangent = tangent * direction.x + bitangent * direction.y;
}

// What varies over a surface: its material by textures and the colours of vertices, and its normal.
void add_details(inout Surface s, int primitive, vec2 barycentrics) {
    Material m = s.material;
    if ((m.type & DETAILED) == 0u) return;
    int texel = details_texel(m.ior);
    vec4 numbers = uintBitsToFloat(geometry_texel(texel));
    int layers = HAS_LAYERS ? layers_texel(uintBitsToFloat(geometry_texel(texel + 2).y)) : -1;
    int conductor = -1;
    if (HAS_CONDUCTOR && (m.type & CONDUCTOR) != 0u) {
        conductor = layers;
        layers = -1;
    }
    m.metallic = numbers.x;
    m.roughness = numbers.y;
    m.dielectric = uintBitsToFloat(geometry_texel(texel + 1));
    vec3 smooth_normal = s.shading;
    if (HAS_SHEEN && layers >= 0) m.sheen = uintBitsToFloat(geometry_texel(layers + 1));
    if (HAS_COAT && layers >= 0) fetch_coat(m, layers, smooth_normal);
    uvec4 shape = primitive_shape(primitive);
    uvec3 corners = shape.xyz;
    bool is_triangle = BVH_TRIANGLES && primitive >= int(CONSTANTS) && !is_sphere(shape);
    vec3 b = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    vec4 glass = vec4(0.0);
    if (HAS_TRANSMISSION) {
        glass = uintBitsToFloat(geometry_texel(texel + 4));
        m.transmission = glass.x;
        m.glass_ior = glass.z;
        m.body = glass.w > 0.0 ? int(m.ior) : -1;
    }
    if (HAS_VERTEX_COLORS && is_triangle) {
        vec3 color = b.x * vertex_color(corners.x).xyz + b.y * vertex_color(corners.y).xyz + b.z * vertex_color(corners.z).xyz;
        m.reflectance *= color;
        if ((m.type & UNLIT) != 0u) m.emission *= color;
    }
    if (HAS_ANISOTROPY && layers >= 0) add_anisotropy(m, layers, is_triangle, corners, barycentrics, smooth_normal);
    if (HAS_TEXTURES && is_triangle) {
        ivec4 textures = ivec4(uintBitsToFloat(geometry_texel(texel + 3)));
        bool is_textured = any(greaterThanEqual(textures, ivec4(0)));
        if (HAS_LAYERS) is_textured = is_textured || layers >= 0;
        if (HAS_TRANSMISSION) is_textured = is_textured || glass.y >= 0.0;
        if (is_textured) {
            vec4 uvs = uvs_at(corners, barycentrics);
            if (HAS_TRANSMISSION && glass.y >= 0.0) m.transmission *= texture_value(uint(glass.y), uvs).x;
            if (textures.x >= 0) m.reflectance *= texture_value(uint(textures.x), uvs).xyz;
            if (textures.y >= 0) {
                vec4 value = texture_value(uint(textures.y), uvs);
                m.roughness *= value.y;
                m.metallic *= value.z;
            }
            if (HAS_NORMAL_MAPS && textures.z >= 0) {
                float scale = uintBitsToFloat(geometry_texel(texel + 2).x);
                s.shading = mapped_normal(texture_value(uint(textures.z), uvs), scale, corners, b, s.shading);
            }
            if (HAS_VARIED_EMISSION && textures.w >= 0) m.emission *= texture_value(uint(textures.w), uvs).xyz;
            if (HAS_SHEEN && layers >= 0) vary_sheen(m, layers, uvs);
            if (HAS_COAT && layers >= 0) vary_coat(m, layers, uvs, corners, b, smooth_normal);
            if (HAS_SPECULAR_TEXTURES && layers >= 0) vary_dielectric(m, layers, uvs);
        }
    }
    if (HAS_CONDUCTOR && conductor >= 0) {
        m.dielectric = uintBitsToFloat(geometry_texel(conductor));
        m.k = uintBitsToFloat(geometry_texel(conductor + 1).xyz);
        m.reflectance = uintBitsToFloat(geometry_texel(conductor + 2).xyz);
    }
    // Filtered values of the range end there.
    m.reflectance = min(m.reflectance, vec3(1.0));
    s.material = m;
}

// The surface that a ray meets, and the barycentrics there. For rays that meet none it is some surface: the table has a primitive even
// if the scene is empty.
Surface surface_at(inout Hit hit, Ray ray) {
    vec3 p = ray.origin + (hit.primitive >= 0 ? hit.t : 0.0) * ray.direction;
    bool is_constant = hit.primitive < int(CONSTANTS);
    Surface s;
    if (!HAS_BVH) {
        s = surface_of_constant(max(hit.primitive, 0), p);
    } else if (CONSTANTS == 0u) {
        s = surface_of_primitive(hit, ray, p);
    } else {
        s = surface_of_constant(is_constant ? max(hit.primitive, 0) : 0, p);
        if (!is_constant) s = surface_of_primitive(hit, ray, p);
    }
    if (HAS_DETAILS) add_details(s, max(hit.primitive, 0), hit.barycentrics);
    if (HAS_TRANSMISSION) {
        // Other numbers than those by which alpha stops rays.
        float number = number_of_ray(ray.origin, ray.direction, hit.primitive);
        choose_glass(s.material, unit_float(hash(floatBitsToUint(number) ^ 0x3c6ef372u)));
    }
    if (SMOOTH_NORMALS) s.shading = dot(s.shading, s.normal) < 0.0 ? -s.shading : s.shading;
    return s;
}

// `id`, marked if a ray on the given side of the normal runs inside the sphere.
int self_id_of(int id, Surface s, bool on_front) {
    return s.curvature != 0.0 && (s.curvature > 0.0) != on_front ? (id | INSIDE) : id;
}

#endif
