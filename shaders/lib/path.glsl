// One path, one hit at a time: at each vertex it adds emitted light, samples the lights, and goes on in a direction that the surface's
// BSDF gives. The schedulers (path_trace.comp, path_interleaved.comp, path_queue.comp) decide when; this decides what.

#ifndef PATH_GLSL
#define PATH_GLSL

#include "layout.glsl"
#include "math.glsl"
#include "sampler.glsl"
#include "camera.glsl"
#include "vertex.glsl"
#include "light/background.glsl"
#include "light_tracing.glsl"

// A path's next ray and what it has gathered.
struct Path {
    vec3 origin;
    vec3 direction;
    int self_id;        // handle of the surface that the ray leaves (with INSIDE on a sphere's inner side), or -1
    vec3 throughput;    // f·cos/pdf of all vertices so far
    uint hits;          // surface hits so far
    uint index;         // of the sample in its pixel
    vec3 normal;        // with REUSE: shading normal where the ray starts
    float pdf;          // of the ray's direction, per solid angle; 0: light sampling does not compete with it
    float x2;           // with light paths: square of the distance at which the camera sees the first hit, if that is diffuse, else
                        // 0: no light paths compete with it, see light_tracing.glsl
    uint flags;         // PATH_…
    int medium;         // with absorption: number of the details of what the ray runs in, or -1
};

// What REUSE needs to know of a path (reuse.glsl).
const uint PATH_RECONNECTABLE = 1u; // it has met a reconnectable surface
const uint PATH_FROM_FIRST = 2u;    // its ray starts at the first of these
const uint PATH_FOR_OTHERS = 4u;    // light from where its ray goes is for other pixels only
const uint PATH_FLAGS = 3u;         // number of them

bool has_flag(Path path, uint flag) { return REUSE && (path.flags & flag) != 0u; }

// A shadow ray and the light that arrives if nothing is in its way.
struct ShadowRay {
    vec3 origin;
    vec3 direction;
    float distance;
    int self_id;
    vec3 radiance;
    bool enabled;
};

ShadowRay shadow_none(vec3 from, int self_id) { return ShadowRay(from, vec3(0.0, 0.0, 1.0), 0.0, self_id, vec3(0.0), false); }

Ray ray_of(Path path) { return Ray(path.origin, path.direction, path.self_id); }
Ray ray_of(ShadowRay ray) { return Ray(ray.origin, ray.direction, ray.self_id); }

// Whether a path is followed one hit further than MAX_DEPTH, for light that it meets there.
const bool LIGHT_AFTER_LAST_HIT = HAS_BACKGROUND || HAS_EMITTER;

// The numbers of a sample's place in its pixel are the pixel's own, and do without the member that it is of its group. When groups
// move (pixel_order.glsl) that changes; the places go on as they began, and are spread as well as if groups had not moved.
Path path_begin(Camera camera, uvec2 at, uint key, uint index) {
    vec2 u = sample_pair(key, index_of_sample(index), PAIR_PIXEL, 0u);
    CameraRay ray = sampled_camera_ray(camera, at, u, key, index_of_sample(index));
    return Path(ray.origin, ray.direction, -1, vec3(1.0), 0u, index, vec3(0.0), 0.0, 0.0, 0u, -1);
}

// ---- what bodies absorb

// The part of light that is left after a distance in a medium, or in none (Beer and Lambert). What goes to infinity is in no body.
vec3 transmittance(int medium, float distance) {
    if (medium < 0 || distance >= FAR_AWAY) return vec3(1.0);
    vec3 absorption = uintBitsToFloat(geometry_texel(details_texel(float(medium)) + 5).xyz);
    vec3 depth = absorption * distance;
    return vec3(exp_accurate(-depth.x), exp_accurate(-depth.y), exp_accurate(-depth.z));
}

// ---- light that arrives directly

// Whether the members of a group of pixels sample lights alike where they first meet a reconnectable surface (reuse.glsl), and the
// index of their numbers there.
bool lights_correlated() { return REUSE && HAS_LIGHTS && !SINGLE_POINT && in_mode(MODE_CORRELATED); }
uint index_at_first(uint index) { return lights_correlated() ? index_of_sample(index) : index; }

// Random numbers for a sample of the lights: which, and where on it.
struct LightNumbers {
    vec2 u;
    vec2 uv;
};

// Where a sample of several falls on a light, counted in quadrants. Of surfaces with parts the microfacets get the light of the first alone:
// that must fall anywhere.
uint quadrant(uint key, uint index, uint hit, uint nth) {
    return HAS_PARTS ? (nth + (hash(key + index * 0x9e3779b9u + hit) >> 30)) & 3u : nth;
}

// The numbers of sample `nth` of the lights at a path's hit of number `hit`. Of several samples each takes a quadrant of the light's unit
// square, and the choices of lights are offset by equal parts; quadrant and choice are independent, so that every light is sampled in
// every quadrant. (light_sample also takes the light that is half of all away.)
LightNumbers light_numbers(uint key, uint index, uint hit, uint nth, bool several) {
    LightNumbers n = LightNumbers(sample_pair(key, index, pair_choice(hit), hit), vec2(0.0));
    if (MEETS_LIGHTS) n.uv = sample_pair(key, index, pair_light(hit), hit);
    if (LIGHT_SAMPLES > 1u) {
        float place = fract(n.u.x + float(nth) / float(LIGHT_SAMPLES));
        // By the same number light_sample chooses between the environment and lights.
        if (!HAS_ENVIRONMENT) place *= 0.5;
        n.u.x = several ? place : n.u.x;
        uint quadrant = quadrant(key, index, hit, nth);
        n.uv = several ? 0.5 * (n.uv + vec2(float(quadrant & 1u), float(quadrant >> 1))) : n.uv;
    }
    return n;
}

// What both parts of a surface scatter of a light of which the diffuse part gets `count` samples, and the microfacets one, which counts
// `repeated` times. Weights are for rays in the directions of each part.
vec3 light_of_parts(Bsdf b, vec3 n, vec3 wo, LightSample light, uint count, float repeated) {
    vec3 tangent, bitangent;
    basis(n, tangent, bitangent);
    LobeValues v = lobe_values(b.lobes, NO_COVER, to_frame(wo, tangent, bitangent, n), to_frame(light.direction, tangent, bitangent, n));
    vec3 diffuse = v.diffuse * v.cosine;
    vec3 microfacets = (v.single + v.multiple * v.cosine) * repeated;
    if (MEETS_LIGHTS && light.pdf > 0.0) {
        diffuse *= mis_weight(float(count) * light.pdf, v.cosine);
        microfacets *= mis_weight(light.pdf, mix(v.cosine, v.single_pdf, b.lobes.parts.z));
    }
    return (diffuse + microfacets) * light.radiance;
}

// Light from one light that a surface scatters towards wo, before it is known whether anything is in between. `normal` and `up` are the
// shading and the geometric normal; `count` samples like this are taken there. `repeated`: of both parts of the surface, see above, or 0.
ShadowRay light_ray(vec3 from, Bsdf bsdf, vec3 normal, vec3 up, vec3 wo, int self_id, vec3 throughput, LightNumbers n, uint count,
                    float repeated) {
    ShadowRay ray = shadow_none(from, self_id);
    if (!HAS_LIGHTS) return ray;
    LightSample light;
    if (SINGLE_POINT) light = point_sample(point_at, point_power, from);
    else light = light_sample(from, scatters_through(bsdf) ? vec3(0.0) : normal, n.u, n.uv);
    vec3 scattered;
    if (HAS_PARTS && repeated > 0.0) {
        scattered = light_of_parts(bsdf, normal, wo, light, count, repeated);
    } else {
        BsdfValue bsdf_value = bsdf_eval(bsdf, normal, wo, light.direction);
        scattered = bsdf_value.value * light.radiance;
        if (MEETS_LIGHTS && light.pdf > 0.0) {
            scattered *= mis_weight(float(count) * light.pdf, bsdf_value.pdf);
        }
    }
    ray.direction = light.direction;
    ray.distance = light.distance;
    ray.radiance = throughput * scattered;
    ray.enabled = brightness(ray.radiance) > 0.0;
    if (SMOOTH_NORMALS) {
        bool right = dot(up, ray.direction) > 0.0;
        if (HAS_TRANSMISSION) right = right == (dot(normal, ray.direction) > 0.0);
        ray.enabled = ray.enabled && right;
    }
    return ray;
}

// The same at a vertex, which gets `count` samples, if there are to be `several`.
ShadowRay direct_light(Vertex v, vec3 wo, uint index, uint key, uint count, bool several) {
    LightNumbers n = LightNumbers(vec2(0.0), vec2(0.0));
    if (HAS_LIGHTS && !SINGLE_POINT) {
        n = light_numbers(key, v.first ? index_at_first(index) : index, v.hits, 0u, several);
    }
    float repeated = 0.0;
    if (HAS_PARTS && v.first && v.bsdf.part != PART_WHOLE) repeated = several ? float(LIGHT_SAMPLES) : 1.0;
    ShadowRay ray = light_ray(v.outside, v.bsdf, v.normal, v.up, wo, self_id_of(v.self_id, v.surface, v.front), v.throughput, n, count,
                              repeated);
    bool crosses = false;
    if (HAS_TRANSMISSION) {
        crosses = scatters_through(v.bsdf) && dot(v.normal, ray.direction) < 0.0;
        ray.origin = crosses ? inside_of(v) : ray.origin;
        ray.self_id = self_id_of(v.self_id, v.surface, v.front != crosses);
    }
    if (HAS_ABSORPTION && MUTATION != MUTATE_SHADOW) ray.radiance *= transmittance(crosses ? v.beyond : v.medium, ray.distance);
    return ray;
}

// ---- light that the path meets

// The light that a path has met; -1 if none.
int light_met(Vertex v) {
    int light = v.surface.light;
    // The back is a light of its own.
    if (HAS_TWO_SIDED) light += !v.front && light >= 0 ? 1 : 0;
    return light;
}

// Whether light paths bring such light too (light_tracing.glsl).
bool by_light_paths(Path path, int light) {
    return LIGHT_TRACING && path.pdf == 0.0 && path.x2 > 0.0 && path.hits <= LIGHT_PATH_HITS && light >= 0;
}

// The weight of light that a path meets on an emitter at distance t, against that of light sampling, of which `light_samples` were taken
// at the first reconnectable vertex, and of light paths.
float emission_weight(Path path, Vertex v, float t, uint light_samples) {
    float weight = 1.0;
    float cos_light = -dot(path.direction, v.up);
    int light = light_met(v);
    if (EMITTER_COUNT > 0u && path.pdf > 0.0 && light >= 0) {
        float of_light = light_pdf(path.origin, light, t, cos_light);
        if (has_flag(path, PATH_FROM_FIRST)) of_light *= float(light_samples);
        weight = mis_weight(path.pdf, of_light);
    }
    // The constant lets the program drop this before the driver sees it (src/gpu/prune.rs).
    if (LIGHT_TRACING && by_light_paths(path, light)) {
        vec3 y = path.origin + t * path.direction;
        weight /= 1.0 + light_path_ratio(light, y, -path.direction, cos_light, path.x2);
    }
    return weight;
}

// Light that a path's ray has met: emitted by a surface, or from the background.
vec3 emitted_light(Path path, Vertex v, bool met, float t, uint light_samples) {
    vec3 light = vec3(0.0);
    if (HAS_BACKGROUND && !met) {
        float of_light = background_pdf(path.direction);
        if (has_flag(path, PATH_FROM_FIRST)) of_light *= float(light_samples);
        light = background_radiance(path.direction) * (path.pdf > 0.0 && of_light > 0.0 ? mis_weight(path.pdf, of_light) : 1.0);
    }
    if (HAS_ENVIRONMENT && has_map() && environment_turn.w == 0.0 && path.hits == 0u && !met) light = vec3(0.0);
    bool glows = HAS_EMITTER && met && shines_from(v.surface.material, v.front) && v.surface.material.emission != vec3(0.0);
    // Before the branch: all lanes count.
    if (LIGHT_TRACING) count_fallback(glows && by_light_paths(path, light_met(v)) ? CASTER_COUNT : 0u);
    if (HAS_EMITTER && glows) {
        float weight = emission_weight(path, v, t, light_samples);
        // A grazing hit has no cosine, and an infinite density on the light's side: it adds nothing.
        light = weight > 0.0 ? v.surface.material.emission * weight : vec3(0.0);
    }
    return light;
}

// ---- a step of a path

// What other pixels may use of a path: where it first meets a surface with a diffuse part, and where it goes from there, unless that shines
// itself or its normal is bent for wo. There it goes on by one part of the surface. That is chosen alike for all members of a group at the
// first hit, so that neighbours do not differ.
void choose_part(inout Vertex v, Path path, uint key) {
    bool second = has_flag(path, PATH_FROM_FIRST);
    bool alone = second && (v.bent || v.surface.material.emission != vec3(0.0));
    if (!(v.first || second) || alone || !has_parts(v.bsdf)) return;
    float number = sample_alone(key, v.first ? index_of_sample(path.index) : path.index, v.hits);
    choose_part(v.bsdf, number, second);
}

// The path's ray meets a surface, or leaves the scene. Adds emitted light to `radiance` and gives a shadow ray. The first reconnectable
// vertex gets `light_samples` samples of lights. Returns false when the path ends here.
bool path_arrive(Path path, Hit hit, uint key, uint light_samples, inout vec3 radiance, out Vertex v, out ShadowRay shadow) {
    bool met = hit.primitive >= 0;
    vec3 throughput = has_flag(path, PATH_FOR_OTHERS) ? vec3(0.0) : path.throughput;
    v = vertex_at(hit, ray_of(path));
    v.hits = path.hits + 1u;
    if (HAS_ABSORPTION) {
        // What meets the back of a body has come through it, whatever it left.
        int body = v.surface.material.body;
        v.medium = met && body >= 0 && !v.front ? body : path.medium;
        v.beyond = body >= 0 ? (v.front ? body : -1) : v.medium;
        if (met) throughput *= transmittance(v.medium, hit.t);
    }
    radiance += throughput * emitted_light(path, v, met, hit.t, light_samples);

    v.first = REUSE && !has_flag(path, PATH_RECONNECTABLE);
    if (HAS_PARTS && in_mode(MODE_REUSED)) choose_part(v, path, key);
    bool reconnectable = is_reconnectable(v.bsdf);
    bool alive = met && v.hits <= MAX_DEPTH;
    v.shareable = has_flag(path, PATH_FROM_FIRST) && reconnectable && alive && throughput != vec3(0.0);
    // What shines is weighted against samples of lights at one first hit.
    if (HAS_EMITTER) v.shareable = v.shareable && v.surface.material.emission == vec3(0.0);
    v.throughput = v.shareable ? vec3(1.0) : throughput;
    vec3 expected = v.throughput * bsdf_albedo(v.bsdf);
    float strongest = largest(expected);
    alive = alive && strongest > 0.0;

    // A path of MAX_DEPTH hits may still meet light with its last ray. Further samples of lights are for those that go on otherwise.
    v.last = v.hits == MAX_DEPTH || (!INDIRECT && !is_delta(v.bsdf));
    shadow = shadow_none(vec3(0.0), -1);
    if (HAS_DENSITIES) {
        bool counts = v.first && reconnectable;
        bool several = counts && light_samples > 1u && !v.last;
        // Weights are the same, by whichever part the path goes on.
        if (HAS_PARTS) counts = counts || (v.first && v.bsdf.part != PART_WHOLE);
        shadow = direct_light(v, -path.direction, path.index, key, counts ? light_samples : 1u, several);
        shadow.enabled = shadow.enabled && alive;
    }
    alive = alive && (LIGHT_AFTER_LAST_HIT || !v.last);
    // The constant alone, so that nothing of it is left where there is no roulette (src/gpu/prune.rs).
    if (ROULETTE_DEPTH > 0u) {
        // A path is safe while its throughput is above ¼: ending strong paths costs more in noise than it saves. Where the path gets
        // further samples of light, its throughput must be what light counts.
        bool may_end = v.hits >= ROULETTE_DEPTH && !(light_samples > 1u && v.first && reconnectable);
        float survive = may_end ? fast_min(4.0 * strongest, 0.95) : 1.0;
        alive = alive && sample_independent(key, path.index, v.hits) < survive;
        v.throughput *= 1.0 / survive;
    }
    if (MAX_DEPTH == 1u && !LIGHT_AFTER_LAST_HIT) alive = false;
    // Of the samples of lights there the mean is taken (reuse_lanes.glsl): what the path has gathered before is no part of it.
    if (LIGHT_SAMPLES > 1u && light_samples > 1u && alive && v.first && reconnectable && !v.last) radiance *= float(LIGHT_SAMPLES);
    return alive;
}

// Turns the path into its next ray; or, if it is not alive, into the first ray of sample `index` of the pixel at `at`.
// One evaluation of the sampler serves all, so that lanes of either kind share the work.
void path_depart(inout Path path, Vertex v, bool alive, Camera camera, uvec2 at, uint key, uint index) {
    uint hit = alive ? v.hits : 0u;
    vec2 u = sample_pair(key, alive ? index : index_of_sample(index), hit, hit);
    CameraRay first = sampled_camera_ray(camera, at, u, key, index_of_sample(index));
    BsdfSample next = bsdf_sample(v.bsdf, v.normal, -path.direction, u);
    // A shading normal may send the ray to the wrong side of the surface. Glass and mirrors would lose that light: theirs is bent.
    bool bent = false;
    if (SMOOTH_NORMALS && is_delta(v.bsdf) && MUTATION != MUTATE_BEND) {
        vec3 side = next.crosses ? -v.up : v.up;
        bent = !(dot(next.direction, side) > 0.0);
        next.direction = on_side(next.direction, side);
    }
    bool reconnectable = is_reconnectable(v.bsdf);
    vec3 throughput = v.throughput * next.weight;
    uint flags = path.flags & PATH_RECONNECTABLE;
    if (reconnectable) flags |= v.first ? PATH_RECONNECTABLE | PATH_FROM_FIRST : PATH_RECONNECTABLE;
    // On the wrong side of a diffuse surface nothing is to be seen.
    if (SMOOTH_NORMALS && (dot(next.direction, v.up) > 0.0) == next.crosses) {
        // What the second hit sends back still counts for other pixels.
        if (REUSE && v.first && reconnectable) flags |= PATH_FOR_OTHERS;
        else throughput = vec3(0.0);
    }
    vec3 start = v.outside;
    if (LETS_THROUGH) start = next.crosses ? inside_of(v) : v.outside;
    path.origin = alive ? start : first.origin;
    path.direction = alive ? next.direction : first.direction;
    path.self_id = alive ? self_id_of(v.self_id, v.surface, v.front != next.crosses) : -1;
    path.throughput = alive ? throughput : vec3(1.0);
    path.hits = alive ? (v.last ? MAX_DEPTH : v.hits) : 0u;
    path.index = index;
    if (REUSE) {
        path.flags = alive ? flags : 0u;
        path.normal = alive ? v.normal : vec3(0.0);
    }
    if (MEETS_LIGHTS) path.pdf = alive ? next.pdf : 0.0;
    if (LIGHT_TRACING) {
        if (hit == 1u && reconnectable) path.x2 = dot(v.outside, v.outside);
        if (hit == 0u) path.x2 = 0.0;
        // Light paths do not come by bent rays, nor by surfaces that look at the normal from one side and are neither of these.
        if (SMOOTH_NORMALS && (bent || !(is_delta(v.bsdf) || reconnectable))) path.x2 = 0.0;
    }
    if (HAS_ABSORPTION) path.medium = alive ? (next.crosses ? v.beyond : v.medium) : -1;
}

#endif
