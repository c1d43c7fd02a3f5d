// One path, one hit at a time. The schedulers (path_trace.comp, path_queue.comp) decide when; this decides what.

#ifndef PATH_GLSL
#define PATH_GLSL

#include "layout.glsl"
#include "math.glsl"
#include "sampler.glsl"
#include "camera.glsl"
#include "surface.glsl"
#include "bsdf/diffuse.glsl"
#include "bsdf/mirror.glsl"
#include "bsdf/dielectric.glsl"
#include "light/point.glsl"

// A path's next ray and what it has gathered.
struct Path {
    vec3 origin;
    vec3 direction;
    int leaving;        // id of the primitive the ray starts on (with INSIDE on a sphere's inner side), or -1
    vec3 throughput;
    uint hits;          // surface hits so far
    uint index;         // of the sample in its pixel
};

// A shadow ray and the light that arrives if nothing is in its way.
struct ShadowRay {
    vec3 origin;
    vec3 direction;
    float distance;
    int leaving;
    vec3 radiance;
    bool wanted;
};

// Whether a path is followed one hit further than MAX_DEPTH, for light that it meets there.
const bool LIGHT_AFTER_LAST_HIT = HAS_BACKGROUND || HAS_EMITTER;

Path path_begin(uint pixel, uint key, uint index) {
    vec2 u = sample_pair(key, index, PAIR_PIXEL, 0u);
    return Path(vec3(0.0), camera_direction(pixel, u), -1, vec3(1.0), 0u, index);
}

// Whether a constant sphere lies between the start of a shadow ray and the light.
bool spheres_occlude(ShadowRay ray) {
    if (LIGHT_COUNT == 1u && EMITTER_COUNT == 0u) {
        return any_sphere_before_point(vec3(POINT_X, POINT_Y, POINT_Z), ray.direction, ray.distance, ray.leaving);
    }
    return any_sphere(ray.origin, ray.direction, ray.distance, ray.leaving);
}

// Light from the point lights at a diffuse surface, before it is known whether anything is in between.
ShadowRay direct_light(Surface s, vec3 n, vec3 origin, int id, vec3 reflected, uint key, Path path) {
    ShadowRay ray = ShadowRay(origin, n, 0.0, id, vec3(0.0), false);
    if (LIGHT_COUNT == 0u) return ray;
    uint chosen = 0u;
    float weight = 1.0;
    if (LIGHT_COUNT > 1u) {
        // One light, in proportion to what each would contribute unoccluded.
        float u = sample_pair(key, path.index, pair_choice(path.hits), path.hits).x;
        float total = 0.0;
        for (uint i = 0u; i < LIGHT_COUNT; ++i) {
            PointLight l = point_light(i);
            vec3 to = l.position - s.position;
            float r2 = dot(to, to);
            float c = upper(dot(n, to), 0.0) * inversesqrt(r2) / r2;
            float w = c * (l.intensity.x + l.intensity.y + l.intensity.z);
            total += w;
            // Weighted reservoir with one number, stretched again after each decision.
            float p = total > 0.0 ? w / total : 0.0;
            bool take = u < p;
            chosen = take ? i : chosen;
            weight = take ? w : weight;
            u = take ? u / p : (u - p) / (1.0 - p);
        }
        weight = total > 0.0 ? total / weight : 0.0;
    }
    PointLight light = point_light(chosen);
    vec3 to = light.position - origin;
    float r2 = dot(to, to);
    float inverse = 1.0 / sqrt(r2);
    float c = dot(n, to) * inverse;
    if (MUTATION == MUTATE_COSINE) c = c > 0.0 ? 1.0 : c;
    ray.direction = to * inverse;
    ray.distance = r2 * inverse;
    ray.radiance = reflected * light.intensity * (weight * c * inverse * inverse);
    ray.wanted = c > 0.0 && dot(s.normal, ray.direction) * dot(s.normal, n) > 0.0 && r2 > 0.0;
    return ray;
}

// What happens where the path's ray meets surface `id` at distance t (id < 0: it leaves the scene).
// Adds emitted light to `radiance`, gives a shadow ray, and turns the path into its next ray.
// Returns false when the path ends; then its ray is that of the pixel's next sample.
bool path_scatter(inout Path path, int id, float t, uint pixel, uint key, inout vec3 radiance, out ShadowRay shadow) {
    shadow = ShadowRay(vec3(0.0), vec3(0.0, 0.0, 1.0), 0.0, -1, vec3(0.0), false);
    bool met = id >= 0;
    if (HAS_BACKGROUND && !met) radiance += path.throughput * background.rgb;
    id = met ? id : (SPHERE_COUNT > 0u ? 0 : TREE_ID);
    Surface s = surface_at(id, path.origin, path.direction, met ? t : 0.0);
    float facing = -dot(path.direction, s.normal);
    bool front = facing >= 0.0;
    uint hits = path.hits + 1u;
    if (HAS_EMITTER && met && s.kind == KIND_EMITTER && front) radiance += path.throughput * s.color;

    bool diffuse = HAS_DIFFUSE && s.kind == KIND_DIFFUSE;
    bool alive = met && hits <= MAX_DEPTH && s.kind != KIND_EMITTER;
    vec3 weight = HAS_DIELECTRIC && s.kind > 0.0 ? vec3(1.0) : s.color;
    if (MUTATION == MUTATE_ALBEDO) weight *= 1.01;
    vec3 throughput = path.throughput * weight;
    alive = alive && upper(upper(throughput.x, throughput.y), throughput.z) > 0.0;
    vec3 n = front ? s.shading : -s.shading;
    vec3 up = front ? s.normal : -s.normal;
    vec3 outside = s.position + up * s.offset;

    if (HAS_DIFFUSE) {
        Path here = path;
        here.hits = hits;
        shadow = direct_light(s, n, outside, leaving_id(id, s, front), throughput, key, here);
        shadow.wanted = shadow.wanted && alive && diffuse;
    }

    // A path of MAX_DEPTH hits may still meet light with its last ray.
    bool last = hits == MAX_DEPTH || (!INDIRECT && diffuse);
    alive = alive && (LIGHT_AFTER_LAST_HIT || !last);
    if (ROULETTE_DEPTH > 0u && hits >= ROULETTE_DEPTH) {
        float survive = lower(upper(upper(throughput.x, throughput.y), throughput.z), 0.95);
        alive = alive && sample_independent(key, path.index, hits) < survive;
        throughput *= 1.0 / survive;
    }
    if (MAX_DEPTH == 1u && !LIGHT_AFTER_LAST_HIT) alive = false;

    // One evaluation of the sampler serves the next direction of a path that goes on and the first of the next sample.
    uint index = path.index + (alive ? 0u : 1u);
    uint hit = alive ? hits : 0u;
    vec2 u = sample_pair(key, index, hit, hit);
    vec3 first = camera_direction(pixel, u);
    vec3 next = vec3(0.0);
    bool crossed = false;
    if (HAS_DIFFUSE) next = diffuse_sample(n, u);
    if (HAS_MIRROR && s.kind == KIND_MIRROR) next = mirror_sample(path.direction, s.shading);
    if (HAS_DIELECTRIC && s.kind > 0.0) next = dielectric_sample(path.direction, n, front, s.kind, u.x, crossed);
    // A shading normal may send the ray to the wrong side of the surface: nothing is there to be seen.
    if (SMOOTH_NORMALS) {
        bool above = dot(next, up) > 0.0;
        throughput = above != crossed ? throughput : vec3(0.0);
    }
    path.origin = alive ? (crossed ? s.position - up * s.offset : outside) : vec3(0.0);
    path.direction = alive ? next : first;
    path.leaving = alive ? leaving_id(id, s, front != crossed) : -1;
    path.throughput = alive ? throughput : vec3(1.0);
    path.hits = alive ? (last ? MAX_DEPTH : hits) : 0u;
    path.index = index;
    return alive;
}

#endif
