// Ray queries in which the device tests triangles itself, as GPUs do fastest. Its distances are not used: that of the triangle it has found
// is computed as ours are, from the exact corners. Spheres are in boxes, and tested by us.
//
// The device does not know which surface a ray leaves. If that is what it finds, the query is repeated from beyond.

#ifndef QUERY_TRIANGLES_GLSL
#define QUERY_TRIANGLES_GLSL

#include "query.glsl"

// Queries for a ray: of any hit, of the nearest hit, and beyond surfaces that do not count.
const uint MAX_QUERIES = 4u;

// Corners of a triangle of the BVH.
Triangle triangle_of_handle(int handle) {
    BvhRecord q = bvh_record(record_of(handle));
    vec3 v0 = uintBitsToFloat(q.a.xyz);
    vec3 v1 = uintBitsToFloat(q.b.xyz);
    vec3 v2 = uintBitsToFloat(q.c.xyz);
    vec3 v3 = uintBitsToFloat(uvec3(q.a.w, q.b.w, q.c.w));
    if (((handle - BVH_ID) & 1) != 0) return Triangle(v3, v2, v1);
    return Triangle(v0, v1, v2);
}

// How far away a ray meets a triangle, in the middle of it with the bits of the watertight test; where that says that the ray passes beside it,
// at its edge. Infinite or NaN where the ray lies in its plane.
float distance_to_triangle(BvhRay r, Triangle triangle) {
    vec3 a = sheared(r.shear, r.origin, triangle.v0);
    vec3 b = sheared(r.shear, r.origin, triangle.v1);
    vec3 c = sheared(r.shear, r.origin, triangle.v2);
    vec3 weights = vec3(edge(c, b), edge(a, c), edge(b, a));
    bool front = determinant(Edges(weights.x, weights.y, weights.z)) > 0.0;
    weights = front ? max(weights, 0.0) : min(weights, 0.0);
    return distance_at(r.shear, Edges(weights.x, weights.y, weights.z), vec3(a.z, b.z, c.z));
}

// The next larger number, of one that is not negative.
float next_up(float x) { return uintBitsToFloat(floatBitsToUint(x) + 1u); }

// As query_leaves. A step is a query, or what one has asked about.
void query_triangles(Ray ray, float t_max, bool any_hit, uint loops, out float nearest, out int nearest_id, out uint steps) {
    BvhRay r = bvh_ray(ray.origin, ray.direction, any_hit);
    nearest = t_max;
    nearest_id = -1;
    steps = 0u;
    float from = 0.0;
    bool first_counts = any_hit;
    rayQueryEXT query;
    for (uint n = 0u; n < MAX_QUERIES && from < t_max && (LOOP_BUDGET == 0u || loops + steps < LOOP_BUDGET); ++n) {
        steps += 1u;
        float sphere_distance = t_max;
        uint flags = first_counts ? gl_RayFlagsTerminateOnFirstHitEXT : gl_RayFlagsNoneEXT;
        rayQueryInitializeEXT(query, acceleration_structure, flags, MASK, ray.origin, from, without_zeros(ray.direction), t_max);
        while ((LOOP_BUDGET == 0u || loops + steps < LOOP_BUDGET) && rayQueryProceedEXT(query)) {
            steps += 1u;
            int number = rayQueryGetIntersectionPrimitiveIndexEXT(query, false) + rayQueryGetIntersectionInstanceCustomIndexEXT(query, false);
            int handle = query_handle(number);
            if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionTriangleEXT) {
                if (handle != ray.self_id && stops_ray(bvh_primitive(handle), ray.origin, ray.direction)) rayQueryConfirmIntersectionEXT(query);
            } else {
                float t;
                int id;
                int record = record_of(handle);
                if (leaf_test(r, record, bvh_record(record), ray.self_id, t, id) && t >= from && t < sphere_distance) {
                    // A triangle may be nearer.
                    bool has_triangle = rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT;
                    if (!has_triangle || t < rayQueryGetIntersectionTEXT(query, true)) {
                        sphere_distance = t;
                        rayQueryGenerateIntersectionEXT(query, t);
                    }
                }
            }
        }
        uint kind = rayQueryGetIntersectionTypeEXT(query, true);
        if (kind == gl_RayQueryCommittedIntersectionNoneEXT) break;
        int number = rayQueryGetIntersectionPrimitiveIndexEXT(query, true) + rayQueryGetIntersectionInstanceCustomIndexEXT(query, true);
        int handle = query_handle(number);
        bool is_triangle = kind == gl_RayQueryCommittedIntersectionTriangleEXT;
        float t = is_triangle ? distance_to_triangle(r, triangle_of_handle(handle)) : sphere_distance;
        bool leaves_it = is_triangle && handle == ray.self_id && MUTATION != MUTATE_QUERY_SELF;
        if (!leaves_it && t > 0.0 && t < t_max) {
            nearest = t;
            nearest_id = handle;
            break;
        }
        // What comes first need not be nearest.
        if (first_counts) first_counts = false;
        else from = next_up(rayQueryGetIntersectionTEXT(query, true));
    }
}

#endif
