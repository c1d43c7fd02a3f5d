// A vertex of a path: what a ray has met, seen from the side from which it came, and how that scatters light.

#ifndef VERTEX_GLSL
#define VERTEX_GLSL

#include "surface.glsl"
#include "bsdf/bsdf.glsl"

struct Vertex {
    Surface surface;
    Bsdf bsdf;
    int self_id;        // of the hit
    vec3 normal;        // shading normal
    vec3 up;            // geometric normal
    vec3 outside;       // the hit, moved off the surface by its error bound
    vec3 throughput;    // before the surface scatters
    bool front;
    bool last;          // the next ray can only meet light
    bool first;         // with REUSE: no reconnectable surface was met before
    int medium;         // with absorption: what the ray came through
    int beyond;         // likewise: what is on the other side of the surface
    bool bent;          // `normal` is, away from where the microfacets' normals would have it (bent_normal)
    bool shareable;     // a second hit that other pixels can use as well: the path goes on with throughput 1
    uint hits;
};

// The hit, moved off the surface to its other side.
vec3 inside_of(Vertex v) { return v.surface.position - v.up * v.surface.offset; }

// Puts layers over the BSDF of a vertex.
void cover_bsdf(inout Vertex v, vec3 wo) {
    Material m = v.surface.material;
    if (HAS_SHEEN && m.sheen.xyz != vec3(0.0)) v.bsdf.sheen = sheen_of(min(m.sheen.xyz, vec3(1.0)), m.sheen.w, dot(v.normal, wo));
    if (HAS_COAT && m.coat > 0.0) {
        vec3 normal = v.front ? m.coat_normal : -m.coat_normal;
        if (MUTATION == MUTATE_COAT_NORMAL) normal = v.normal;
        if (SMOOTH_NORMALS) {
            normal = dot(normal, v.up) < 0.0 ? -normal : normal;
            normal = bent_normal(normal, v.up, wo);
        }
        v.bsdf.coat = coat_of(m.coat, m.coat_roughness, normal, wo);
    }
    cover(v.bsdf);
}

// The surface that a ray has met; what a path makes of it is still to be told.
Vertex vertex_at(inout Hit hit, Ray ray) {
    Vertex v;
    v.surface = surface_at(hit, ray);
    v.self_id = hit.self_id;
    v.front = dot(ray.direction, v.surface.normal) <= 0.0;
    v.normal = v.front ? v.surface.shading : -v.surface.shading;
    v.up = v.front ? v.surface.normal : -v.surface.normal;
    v.bent = false;
    if (HAS_METALLIC_ROUGHNESS && SMOOTH_NORMALS && MUTATION != MUTATE_BEND) {
        vec3 normal = v.normal;
        v.normal = bends_normal(v.surface.material) ? bent_normal(v.normal, v.up, -ray.direction) : v.normal;
        if (HAS_PARTS) v.bent = v.normal != normal;
    }
    v.bsdf = bsdf_of(v.surface.material, v.front, v.normal, -ray.direction);
    if (HAS_COVER) cover_bsdf(v, -ray.direction);
    v.outside = v.surface.position + v.up * v.surface.offset;
    v.throughput = vec3(0.0);
    v.medium = v.beyond = -1;
    v.last = v.first = v.shareable = false;
    v.hits = 0u;
    return v;
}

#endif
