// Ray queries in which the device tests triangles itself, as GPUs do fastest. Its distances are not used: that of the triangle it has found
// is computed as ours are, from the exact corners. Spheres are in boxes, and tested by us.
//
// The device does not know which surface a ray leaves. If that is what it finds, the query is repeated from beyond.

#ifndef QUERY_TRIANGLES_GLSL
#define QUERY_TRIANGLES_GLSL

#include "query.glsl"

// Queries for a ray: of any hit, of the nearest hit, and beyond surfaces that do not count.
const uint MAX_QUERIES = 4u;

// A triangle of the BVH: its corners, and whether rays may pass it, all from behind and some anywhere.
struct QueryTriangle {
    Triangle corners;
    bool culls_back;
    bool has_alpha;
};

QueryTriangle triangle_of_handle(int handle) {
    BvhRecord q = bvh_record(record_of(handle));
    bool second = ((handle - BVH_ID) & 1) != 0;
    uvec2 marks = (second ? q.b.xy : q.a.xy) & ~COORDINATE_BITS;
    if (HAS_PASSABLE) {
        q.a.xy &= COORDINATE_BITS;
        q.b.xy &= COORDINATE_BITS;
    }
    vec3 v0 = uintBitsToFloat(q.a.xyz);
    vec3 v1 = uintBitsToFloat(q.b.xyz);
    vec3 v2 = uintBitsToFloat(q.c.xyz);
    vec3 v3 = uintBitsToFloat(uvec3(q.a.w, q.b.w, q.c.w));
    Triangle corners = second ? Triangle(v3, v2, v1) : Triangle(v0, v1, v2);
    return QueryTriangle(corners, HAS_CULLED_BACKS && marks.x != 0u, HAS_COVERAGE && marks.y != 0u);
}

// Edge functions of a ray that the device says hits a triangle, and the distances of its corners along the axis of the ray. Where ours say
// that the ray passes beside it, they are those of its edge.
Edges edges_of(BvhRay r, Triangle corners, out vec3 z) {
    vec3 a = sheared(r.shear, r.origin, corners.v0);
    vec3 b = sheared(r.shear, r.origin, corners.v1);
    vec3 c = sheared(r.shear, r.origin, corners.v2);
    vec3 weights = vec3(edge(c, b), edge(a, c), edge(b, a));
    bool positive = determinant(Edges(weights.x, weights.y, weights.z)) > 0.0;
    weights = positive ? max(weights, 0.0) : min(weights, 0.0);
    z = vec3(a.z, b.z, c.z);
    return Edges(weights.x, weights.y, weights.z);
}

// How far away a ray meets a triangle, in the middle of it with the bits of the watertight test. Infinite or NaN where the ray lies in its
// plane.
float distance_to_triangle(BvhRay r, Triangle corners) {
    vec3 z;
    Edges e = edges_of(r, corners, z);
    return distance_at(r.shear, e, determinant(e), z);
}

// Whether a triangle that rays may pass stops this one.
bool stops(BvhRay r, int handle) {
    QueryTriangle triangle = triangle_of_handle(handle);
    vec3 z;
    if (triangle.culls_back && is_from_behind(r.shear, determinant(edges_of(r, triangle.corners, z)))) return false;
    return !triangle.has_alpha || stops_ray(bvh_primitive(handle), r.origin, r.direction);
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
                if (handle != ray.self_id && stops(r, handle)) rayQueryConfirmIntersectionEXT(query);
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
        float t = is_triangle ? distance_to_triangle(r, triangle_of_handle(handle).corners) : sphere_distance;
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
