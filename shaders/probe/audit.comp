#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Which triangles of a scene rays meet, says the device, and says our own test, asked about each of them. Records: check/probe/audit.rs.

#include "io.glsl"
#include "../lib/path.glsl"
#include "../lib/scene.glsl"

#ifdef RAY_QUERY
// Where a ray meets the plane of a triangle.
struct Meeting {
    bool hit;
    bool at_edge;       // rounding may decide
    bool grazing;       // rounding decides where
    float t;
    vec2 barycentrics;
};

// Units in the last place of the distance by which tests may move corners.
const float ROUNDING = 64.0 / 16777216.0;
const float GRAZING = 0.05;

Meeting meeting_of(BvhRay r, int handle) {
    // Its corners in the order that the device has them in.
    Triangle triangle = triangle_of(primitive_shape(bvh_primitive(handle)));
    vec3 a = sheared(r.shear, r.origin, triangle.v0);
    vec3 b = sheared(r.shear, r.origin, triangle.v1);
    vec3 c = sheared(r.shear, r.origin, triangle.v2);
    Edges e = Edges(edge(c, b), edge(a, c), edge(b, a));
    Meeting m;
    bool behind;
    m.hit = hits_triangle(r.shear, e, vec3(a.z, b.z, c.z), m.t, behind);
    vec3 weights = vec3(e.u, e.v, e.w) / determinant(e);
    m.barycentrics = weights.yz;
    float least = min(weights.x, min(weights.y, weights.z));
    vec3 normal = cross(triangle.v1 - triangle.v0, triangle.v2 - triangle.v0);
    float far = length(r.origin) + max(length(triangle.v0), max(length(triangle.v1), length(triangle.v2)));
    // Both are NaN where there is no area.
    m.at_edge = !(abs(least) > ROUNDING * far / sqrt(length(normal)));
    m.grazing = !(abs(dot(normalize(normal), normalize(r.direction))) > GRAZING);
    return m;
}

// Units in the last place between positive numbers.
uint ulps(float a, float b) { return uint(abs(floatBitsToInt(a) - floatBitsToInt(b))); }

void audit(uint i) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    BvhRay r = bvh_ray(o.xyz, d.xyz, false);
    uint proposed = 0u;
    uint agreed = 0u;           // far from edges
    uint extra = 0u;            // likewise
    uint at_edges = 0u;
    uint worst_t = 0u;
    float worst_barycentric = 0.0;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, acceleration_structure, gl_RayFlagsNoneEXT, MASK, r.origin, 0.0, r.direction, INFINITY);
    while (rayQueryProceedEXT(query)) {
        proposed += 1u;
        Meeting m = meeting_of(r, query_handle(rayQueryGetIntersectionPrimitiveIndexEXT(query, false)));
        if (m.at_edge) at_edges += 1u;
        else if (!m.hit) extra += 1u;
        else {
            agreed += 1u;
            if (!m.grazing) {
                worst_t = max(worst_t, ulps(rayQueryGetIntersectionTEXT(query, false), m.t));
                vec2 off = abs(rayQueryGetIntersectionBarycentricsEXT(query, false) - m.barycentrics);
                worst_barycentric = max(worst_barycentric, max(off.x, off.y));
            }
        }
    }
    uint expected = 0u;
    for (int record = 0; record < int(record_count); ++record) {
        if (!is_leaf(bvh_record(record))) continue;
        for (int slot = 0; slot < 2; ++slot) {
            int handle = BVH_ID + 2 * record + slot;
            if (bvh_primitive(handle) < 0) continue;
            Meeting m = meeting_of(r, handle);
            expected += m.hit && !m.at_edge ? 1u : 0u;
        }
    }
    // What is proposed is proposed once, and what is agreed on is expected.
    probe_out[2u * i] = uvec4(proposed, at_edges, extra, expected - agreed);
    probe_out[2u * i + 1u] = uvec4(worst_t, floatBitsToUint(worst_barycentric), 0u, 0u);
}
#endif

void main() {
    load_scene();
    uint i = gl_GlobalInvocationID.x;
#ifdef RAY_QUERY
    if (USES_RAY_QUERY && i < end_slot) audit(i);
#endif
}
