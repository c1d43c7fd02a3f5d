#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_query : require
// What single ray queries find, of rays with flags, a mask and an interval. Words: check/cases/query_flags.rs.

#include "io.glsl"

layout(local_size_x_id = 1) in;

layout(binding = 2) uniform accelerationStructureEXT acceleration_structure;

// Of each ray.
const uint GIVEN = 10u;
const uint FOUND = 4u;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= first) return;
    uint at = GIVEN * i;
    vec3 origin = vec3(uintBitsToFloat(given[at]), uintBitsToFloat(given[at + 1u]), uintBitsToFloat(given[at + 2u]));
    vec3 direction = vec3(uintBitsToFloat(given[at + 3u]), uintBitsToFloat(given[at + 4u]), uintBitsToFloat(given[at + 5u]));
    float t_min = uintBitsToFloat(given[at + 6u]);
    float t_max = uintBitsToFloat(given[at + 7u]);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, acceleration_structure, given[at + 8u], given[at + 9u], origin, t_min, direction, t_max);
    uint triangles = 0u;
    uint boxes = 0u;
    uint opaque_boxes = 0u;
    for (uint n = 0u; n < 16u && rayQueryProceedEXT(query); ++n) {
        if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionTriangleEXT) triangles += 1u;
        else {
            boxes = 1u;
            if (rayQueryGetIntersectionCandidateAABBOpaqueEXT(query)) opaque_boxes = 1u;
        }
    }
    uint kind = rayQueryGetIntersectionTypeEXT(query, true);
    bool committed = kind != gl_RayQueryCommittedIntersectionNoneEXT;
    at = FOUND * i;
    found[at] = triangles | (boxes << 8) | (opaque_boxes << 9);
    found[at + 1u] = kind;
    found[at + 2u] = committed ? floatBitsToUint(rayQueryGetIntersectionTEXT(query, true)) : 0u;
    found[at + 3u] = committed ? uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true)) : 0u;
}
