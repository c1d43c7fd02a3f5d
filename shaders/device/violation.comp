#version 460
#extension GL_EXT_ray_query : require
// A ray query that begins behind the ray's start, which Vulkan forbids: to see whether validation on the device is awake.

layout(local_size_x = 1) in;
layout(binding = 0) uniform accelerationStructureEXT acceleration_structure;
layout(push_constant) uniform Push { float least; };
layout(std430, binding = 1) writeonly buffer Found { uint found; };

void main() {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, acceleration_structure, gl_RayFlagsOpaqueEXT, 255u, vec3(0.0), least, vec3(0.0, 0.0, 1.0), 1.0);
    rayQueryProceedEXT(query);
    found = rayQueryGetIntersectionTypeEXT(query, true);
}
