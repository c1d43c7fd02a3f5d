// What a ray meets: position, normals and material at a hit.
//
// shape_texels: for each constant sphere three texels: (centre, 1/radius with the normal's sign), its material, and the
// number of its light; for each facet the same with (unit normal n, n·p of its points) first; then for each facet four
// texels with its corners, and those four numbers again; then materials and vertex normals, one texel each. A material
// is (rgb, kind): rgb is reflectance or radiance, and kind is one of the numbers below or, if positive, the index of
// refraction of a dielectric.

#ifndef SURFACE_GLSL
#define SURFACE_GLSL

#include "lane_table.glsl"
#include "layout.glsl"
#include "math.glsl"
#include "intersect/tree.glsl"

const float KIND_DIFFUSE = 0.0;
const float KIND_MIRROR = -1.0;
const float KIND_EMITTER = -2.0;

struct Surface {
    vec3 position;
    vec3 normal;        // geometric, unit, towards the material's front
    vec3 shading;       // normal for cosines, on the same side as `normal`
    vec3 color;
    float kind;
    float offset;       // bound on the error of `position` along the normal
    float curvature;    // of a sphere, negative if its normal points inward; 0 for a triangle
    int light;          // of an emitter: its number in light/choice.glsl
};

// A unit vector but for rounding: one Newton step of 1/sqrt restores its length to 1 ulp.
vec3 renormalize(vec3 n) { return n * (1.5 - 0.5 * dot(n, n)); }

// The three texels of a constant shape.
struct Constant {
    vec4 shape;
    vec4 material;
    int light;
};

Constant fetch_constant(int id) {
    int light = -1;
    if (EMITTER_COUNT > 0u) light = floatBitsToInt(shape_texel(3 * id + 2).x);
    return Constant(shape_texel(3 * id), shape_texel(3 * id + 1), light);
}

// Tables of eight, see lane_table.glsl.
const uint CONSTANTS = SPHERE_COUNT + FACET_COUNT;
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
    return Constant(second ? b.shape : a.shape, second ? b.material : a.material, second ? b.light : a.light);
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

Surface surface_of_constant(int id, vec3 p) {
    Constant constant = constant_of(id);
    vec4 shape = constant.shape;
    vec4 material = constant.material;
    vec3 n = renormalize((p - shape.xyz) * shape.w);
    float curvature = shape.w;
    float offset = 0.0;
    if (FACET_COUNT > 0u) {
        bool flat_ = id >= int(SPHERE_COUNT);
        n = flat_ ? shape.xyz : n;
        curvature = flat_ ? 0.0 : curvature;
        // Back onto the plane; then the error is that of the sums n·p and p, bounded by γ(7) times their terms.
        p = flat_ && MUTATION != MUTATE_PROJECTION ? p - n * (dot(n, p) - shape.w) : p;
        offset = flat_ ? GAMMA_7 * (dot(abs(n), abs(p)) + abs(shape.w)) : 0.0;
    }
    return Surface(p, n, n, material.rgb, material.w, offset, curvature, constant.light);
}

// Of the primitive TREE_ID + slot. Besides its record it has two texels apart: normal | surface, and attributes, light, kind (2 of a
// sphere), and for how many turns of its corners they are in the order of the record.
Surface surface_of_slot(int slot, vec3 o, vec3 d, float t) {
    TreeRecord q = tree_record(slot >> 1);
    uvec4 apart = texelFetch(tree_texels, 3 * int(record_count) + 2 * slot);
    uvec4 more = texelFetch(tree_texels, 3 * int(record_count) + 2 * slot + 1);
    bool second = (slot & 1) != 0;
    vec3 v0 = uintBitsToFloat(second ? uvec3(q.a.w, q.b.w, q.c.w) : q.a.xyz);
    vec3 v1 = uintBitsToFloat(second ? q.c.xyz : q.b.xyz);
    vec3 v2 = uintBitsToFloat(second ? q.b.xyz : q.c.xyz);
    vec4 material = shape_texel(int(apart.w));
    vec3 n = uintBitsToFloat(apart.xyz);
    vec3 ns = n;
    // From barycentrics: closer to the plane than o + t·d, with pbrt's bound γ(7)(|b0 v0| + |b1 v1| + |b2 v2|).
    vec3 b = vec3(0.0);
    if (TREE_TRIANGLES) b = barycentrics(shear_of(d), o, v0, v1, v2);
    vec3 p0 = b.x * v0;
    vec3 p1 = b.y * v1;
    vec3 p2 = b.z * v2;
    vec3 p = MUTATION == MUTATE_BARYCENTRIC ? o + t * d : p0 + p1 + p2;
    float curvature = 0.0;
    float offset = MUTATION == MUTATE_OFFSET ? 0.0 : GAMMA_7 * dot(abs(p0) + abs(p1) + abs(p2), abs(n));
    if (SMOOTH_NORMALS) {
        int row = int(more.x);
        if (row >= 0) {
            b = more.w == 1u ? b.zxy : (more.w == 2u ? b.yzx : b);
            vec3 s = b.x * shape_texel(row).xyz + b.y * shape_texel(row + 1).xyz +
                     b.z * shape_texel(row + 2).xyz;
            float length2 = dot(s, s);
            s = length2 > 0.0 ? s * inversesqrt(length2) : n;
            ns = dot(s, n) < 0.0 ? -s : s;
        }
    }
    if (TREE_SPHERES && (!TREE_TRIANGLES || more.z == 2u)) {
        p = o + t * d;
        n = normalize(p - v0) * (v1.y < 0.0 ? -1.0 : 1.0);
        ns = n;
        offset = 0.0;
        curvature = v1.y;
    }
    return Surface(p, n, ns, material.rgb, material.w, offset, curvature, int(more.y));
}

// A surface for rays that meet none: shapes have room for a constant one even if there is nothing at all.
const int SOME_ID = SPHERE_COUNT + FACET_COUNT == 0u && HAS_TREE ? TREE_ID : 0;

Surface surface_at(int id, vec3 o, vec3 d, float t) {
    if (!HAS_TREE) return surface_of_constant(id, o + t * d);
    if (SPHERE_COUNT + FACET_COUNT == 0u) return surface_of_slot(id - TREE_ID, o, d, t);
    Surface s = surface_of_constant(id < TREE_ID ? id : 0, o + t * d);
    if (id >= TREE_ID) s = surface_of_slot(id - TREE_ID, o, d, t);
    return s;
}

// `id`, marked if a ray on the given side of the normal runs inside the sphere.
int leaving_id(int id, Surface s, bool on_front) {
    return s.curvature != 0.0 && (s.curvature > 0.0) != on_front ? (id | INSIDE) : id;
}

#endif
