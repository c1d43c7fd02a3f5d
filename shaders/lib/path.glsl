// One path, one hit at a time. The schedulers (path_trace.comp, path_turns.comp, path_queue.comp) decide when; this decides what.

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
#include "light/beam.glsl"

// A path's next ray and what it has gathered.
struct Path {
    vec3 origin;
    vec3 direction;
    int leaving;        // id of the primitive the ray starts on (with INSIDE on a sphere's inner side), or -1
    vec3 throughput;    // with REUSE: below 0 if light from where the ray goes does not count
    uint hits;          // surface hits so far
    uint index;         // of the sample in its pixel
    vec3 normal;        // with REUSE: at the start of the ray; 0 as long as nothing diffuse has been met
    float pdf;          // the ray's density per solid angle there; 0: no light sampling competes with it
    float x2;           // with beams: square of the distance at which the camera sees the first hit, if that is diffuse, else
                        // 0: no beams compete with it, see light/beam.glsl
    bool second;        // the ray starts at the first diffuse hit
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

// The numbers of a sample's place in its pixel are the pixel's own, and do without the member that it is of its group. When groups
// move (pixel_order.glsl) that changes; the places go on as they began, and are spread as well as if groups had not moved.
Path path_begin(Camera camera, uvec2 at, uint key, uint index) {
    vec2 u = sample_pair(key, index_of_sample(index), PAIR_PIXEL, 0u);
    return Path(vec3(0.0), camera_direction(camera, at, u), -1, vec3(1.0), 0u, index, vec3(0.0), 0.0, 0.0, false);
}

// The only light is a point light.
const bool SINGLE_POINT = LIGHT_COUNT == 1u && EMITTER_COUNT == 0u;

// Whether a constant sphere lies between the start of a shadow ray and the light.
bool spheres_occlude(ShadowRay ray) {
    if (SINGLE_POINT) {
        return any_sphere_before_point(ray.direction, ray.distance, ray.leaving);
    }
    return any_sphere(ray.origin, ray.direction, ray.distance, ray.leaving);
}

// Whether the members of a group of pixels sample lights alike where they first meet a diffuse surface (reuse.glsl), and the
// index of their numbers there.
bool lights_alike() { return REUSE && LIGHT_COUNT > 0u && !SINGLE_POINT && in_mode(MODE_ALIKE); }
uint index_at_first(uint index) { return lights_alike() ? index_of_sample(index) : index; }

// What arriving at a surface leaves for the departure.
struct Arrival {
    Surface surface;
    int id;
    vec3 normal;        // shading normal on the side from which the ray came
    vec3 up;            // geometric normal on that side
    vec3 outside;       // the hit, moved off the surface by its error bound
    vec3 throughput;
    bool front;
    bool last;          // the next ray can only meet light
    bool first;         // with REUSE: nothing diffuse was met before
    bool gives;         // a second hit that other pixels can use as well: the path goes on with throughput 1
    uint hits;
};

// A sample of the lights: which, and where on it.
struct LightNumbers {
    vec2 u;
    vec2 uv;
};

// The numbers of sample `nth` of the lights at a path's hit of number `hit`. Where LIGHT_SAMPLES of them are taken (`several`) each
// has a quarter of every lamp to itself, and the same place in it, so that over all of a path's samples they are spread evenly.
// The choices of lights are evenly apart (light_sample also takes the light that is half of all away), but each may be any: all
// of a lamp is for all choices.
LightNumbers light_numbers(uint key, uint index, uint hit, uint nth, bool several) {
    LightNumbers n = LightNumbers(sample_pair(key, index, pair_choice(hit), hit), vec2(0.0));
    if (EMITTER_COUNT > 0u) n.uv = sample_pair(key, index, pair_light(hit), hit);
    if (LIGHT_SAMPLES > 1u) {
        n.u.x = several ? 0.5 * fract(n.u.x + float(nth) / float(LIGHT_SAMPLES)) : n.u.x;
        n.uv = several ? 0.5 * (n.uv + vec2(float(nth & 1u), float(nth >> 1))) : n.uv;
    }
    return n;
}

// Light from one light at a point of a diffuse surface, before it is known whether anything is in between. `up` is the geometric
// normal; `count` samples like this are taken there.
ShadowRay light_ray(vec3 from, vec3 normal, vec3 up, int leaving, vec3 throughput, LightNumbers n, uint count) {
    ShadowRay ray = ShadowRay(from, normal, 0.0, leaving, vec3(0.0), false);
    if (LIGHT_COUNT == 0u) return ray;
    LightSample light;
    if (SINGLE_POINT) light = point_sample(point_at, point_power, from, normal);
    else light = light_sample(from, normal, n.u, n.uv);
    vec3 to = light.point - from;
    float r2 = dot(to, to);
    float inverse = 1.0 / sqrt(r2);
    ray.direction = to * inverse;
    ray.distance = r2 * inverse;
    if (EMITTER_COUNT > 0u && light.pdf > 0.0) {
        light.radiance *= mis_weight(float(count) * light.pdf, diffuse_pdf(dot(normal, ray.direction)));
    }
    ray.radiance = throughput * light.radiance;
    ray.wanted = brightness(light.radiance) > 0.0;
    if (SMOOTH_NORMALS) ray.wanted = ray.wanted && dot(up, ray.direction) > 0.0;
    return ray;
}

// The same at a path's hit, which gets `count` samples.
ShadowRay direct_light(Arrival a, uint index, uint key, uint count) {
    LightNumbers n = LightNumbers(vec2(0.0), vec2(0.0));
    if (LIGHT_COUNT > 0u && !SINGLE_POINT) {
        n = light_numbers(key, a.first ? index_at_first(index) : index, a.hits, 0u, count > 1u && !a.last);
    }
    return light_ray(a.outside, a.normal, a.up, leaving_id(a.id, a.surface, a.front), a.throughput, n, count);
}

// The path's ray meets surface `id` at distance t (id < 0: it leaves the scene). Adds emitted light to `radiance` and
// gives a shadow ray. A first diffuse hit gets `light_samples` samples of lights. Returns false when the path ends here.
bool path_arrive(Path path, int id, float t, uint key, uint light_samples, inout vec3 radiance, out Arrival a,
                 out ShadowRay shadow) {
    bool met = id >= 0;
    vec3 seen = radiance;
    vec3 throughput = path.throughput;
    // A direction that its pixel gets no light from, although it does from what is shared.
    if (REUSE && SMOOTH_NORMALS && any(lessThan(throughput, vec3(0.0)))) throughput = vec3(0.0);
    if (HAS_BACKGROUND && !met) radiance += throughput * background.rgb;
    a.id = met ? id : SOME_ID;
    a.surface = surface_at(a.id, path.origin, path.direction, met ? t : 0.0);
    a.front = dot(path.direction, a.surface.normal) <= 0.0;
    a.hits = path.hits + 1u;
    float kind = a.surface.kind;
    bool glows = HAS_EMITTER && met && kind == KIND_EMITTER && a.front;
    bool by_beams = HAS_BEAMS && glows && path.pdf == 0.0 && path.x2 > 0.0 && path.hits <= BEAM_HITS && a.surface.light >= 0;
    if (HAS_BEAMS) count_doubtful(by_beams ? BEAM_TARGETS : 0u);
    if (glows) {
        float weight = 1.0;
        if (EMITTER_COUNT > 0u && path.pdf > 0.0 && a.surface.light >= 0) {
            float cos_light = -dot(path.direction, a.surface.normal);
            float of_light = light_pdf(path.origin, a.surface.light, t, cos_light);
            if (path.second) of_light *= float(light_samples);
            weight *= mis_weight(path.pdf, of_light);
        }
        // The constant lets the program drop this before the driver sees it (src/gpu/prune.rs).
        if (HAS_BEAMS && by_beams) {
            vec3 y = path.origin + t * path.direction;
            float cos_light = -dot(path.direction, a.surface.normal);
            weight /= 1.0 + beams_per_path(a.surface.light, y, -path.direction, cos_light, path.x2);
        }
        // A grazing hit has no cosine, and an infinite density on the light's side: it adds nothing.
        if (weight > 0.0) radiance += throughput * a.surface.color * weight;
    }

    bool diffuse = HAS_DIFFUSE && kind == KIND_DIFFUSE;
    a.first = REUSE && path.normal == vec3(0.0);
    bool alive = met && a.hits <= MAX_DEPTH && kind != KIND_EMITTER;
    // Samples that are no light, but tell what the camera sees, directly or in mirrors: the place of a diffuse surface
    // (gradient.glsl), or what decides about the sample map.
    if (REUSE && in_mode(MODE_SURVEY)) radiance = alive && diffuse ? a.surface.position : vec3(0.0);
    if (SAMPLE_MAP && in_mode(MODE_EMITTERS)) {
        float emitted = glows ? brightness(throughput * a.surface.color) : 0.0;
        radiance = seen + vec3(emitted, alive && kind == KIND_MIRROR ? 1.0 : 0.0, alive && kind > 0.0 ? 1.0 : 0.0);
    }
    bool surveys = (REUSE || SAMPLE_MAP) && in_mode(MODE_SURVEY | MODE_EMITTERS);
    if (surveys) alive = alive && HAS_MIRROR && kind == KIND_MIRROR;
    vec3 weight = HAS_DIELECTRIC && kind > 0.0 ? vec3(1.0) : a.surface.color;
    if (MUTATION == MUTATE_ALBEDO) weight *= 1.01;
    a.gives = REUSE && path.second && diffuse && alive && throughput != vec3(0.0);
    a.throughput = (a.gives ? vec3(1.0) : throughput) * weight;
    float strongest = upper(upper(a.throughput.x, a.throughput.y), a.throughput.z);
    alive = alive && strongest > 0.0;
    a.normal = a.front ? a.surface.shading : -a.surface.shading;
    a.up = a.front ? a.surface.normal : -a.surface.normal;
    a.outside = a.surface.position + a.up * a.surface.offset;

    // A path of MAX_DEPTH hits may still meet light with its last ray. Further samples of lights are for those that go on otherwise.
    a.last = a.hits == MAX_DEPTH || (!INDIRECT && diffuse);
    shadow = ShadowRay(vec3(0.0), vec3(0.0, 0.0, 1.0), 0.0, -1, vec3(0.0), false);
    if (HAS_DIFFUSE) {
        shadow = direct_light(a, path.index, key, a.first ? light_samples : 1u);
        shadow.wanted = shadow.wanted && alive && diffuse;
    }
    alive = alive && (LIGHT_AFTER_LAST_HIT || !a.last);
    // Where it gets further light the throughput must be what light counts.
    bool may_end = !surveys && !(light_samples > 1u && a.first && diffuse);
    // The constant alone, so that nothing of it is left where there is no roulette (src/gpu/prune.rs).
    if (ROULETTE_DEPTH > 0u) {
        if (a.hits >= ROULETTE_DEPTH && may_end) {
            // A path is safe while its throughput is above ¼: ending strong paths costs more in noise than it saves.
            float survive = lower(4.0 * strongest, 0.95);
            alive = alive && sample_independent(key, path.index, a.hits) < survive;
            a.throughput *= 1.0 / survive;
        }
    }
    if (MAX_DEPTH == 1u && !LIGHT_AFTER_LAST_HIT) alive = false;
    return alive;
}

// Turns the path into its next ray; or, if it is not alive, into the first ray of sample `index` of the pixel at `at`.
// One evaluation of the sampler serves all, so that lanes of either kind share the work.
void path_depart(inout Path path, Arrival a, bool alive, Camera camera, uvec2 at, uint key, uint index) {
    uint hit = alive ? a.hits : 0u;
    vec2 u = sample_pair(key, alive ? index : index_of_sample(index), hit, hit);
    vec3 first = camera_direction(camera, at, u);
    vec3 next = vec3(0.0);
    bool crossed = false;
    float kind = a.surface.kind;
    if (HAS_DIFFUSE) next = diffuse_sample(a.normal, u);
    if (HAS_MIRROR && kind == KIND_MIRROR) next = mirror_sample(path.direction, a.surface.shading);
    if (HAS_DIELECTRIC && kind > 0.0) next = dielectric_sample(path.direction, a.normal, a.front, kind, u.x, crossed);
    // A shading normal may send the ray to the wrong side of the surface: nothing is there to be seen.
    if (SMOOTH_NORMALS && (dot(next, a.up) > 0.0) == crossed) {
        // The throughput of x still counts for the second hits of others.
        a.throughput = REUSE && a.first && kind == KIND_DIFFUSE ? -a.throughput : vec3(0.0);
    }
    vec3 start = HAS_DIELECTRIC && crossed ? a.surface.position - a.up * a.surface.offset : a.outside;
    path.origin = alive ? start : vec3(0.0);
    path.direction = alive ? next : first;
    path.leaving = alive ? leaving_id(a.id, a.surface, a.front != crossed) : -1;
    path.throughput = alive ? a.throughput : vec3(1.0);
    path.hits = alive ? (a.last ? MAX_DEPTH : a.hits) : 0u;
    path.index = index;
    path.second = REUSE && alive && a.first && kind == KIND_DIFFUSE;
    if (REUSE) path.normal = alive && (kind == KIND_DIFFUSE || !a.first) ? a.normal : vec3(0.0);
    if (EMITTER_COUNT > 0u) path.pdf = alive && kind == KIND_DIFFUSE ? diffuse_pdf(dot(a.normal, next)) : 0.0;
    if (HAS_BEAMS) {
        if (hit == 1u && kind == KIND_DIFFUSE) path.x2 = dot(a.outside, a.outside);
        if (hit == 0u) path.x2 = 0.0;
    }
}

#endif
