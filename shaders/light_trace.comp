#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_maximal_reconvergence : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Light traced from emitters through glass and mirrors: see lib/light_tracing.glsl. An invocation traces light paths, and records for each the
// pixels that it lights and by how much. The host adds these up in the order of the light paths, so that the image has the same bits
// however they are scheduled (src/render/light_tracing/).

#include "lib/path.glsl"
#include "lib/counting.glsl"
#include "lib/scene.glsl"

layout(local_size_x_id = 61, local_size_y = 1, local_size_z = 1) in;

// Light, and its pixel (as bits): the first splats of all light paths of the dispatch, then the second ones, and so on, MAX_SPLATS of each.
layout(rgba32ui, binding = 10) uniform uimageBuffer splat_texels;

// In place of a pixel: there are no further splats; the loop budget was spent before the light path ended.
const uint NO_PIXEL = 0xffffffffu;
const uint UNFINISHED = 0xfffffffeu;
// Iterations of a light path's step: its own, and those in which the two loops over targets end.
const uint STEP_LOOPS = 3u;
// Light paths whose random numbers are spread evenly together: the table's lowest level.
const uint BLOCK = 1024u;

// A point on an emitter, off its surface, and its normal there.
void emitter_point(int light, vec2 u, out vec3 point, out vec3 normal) {
    Light l = light_of(light);
    if (!is_flat(l)) {
        float z = 1.0 - 2.0 * u.y;
        vec3 m = vec3(sqrt(fast_max(1.0 - z * z, 0.0)) * cos_sin_2pi(u.x), z);
        float slack = 1e-6 * (l.size + abs(l.a.x) + abs(l.a.y) + abs(l.a.z));
        bool inward = is_kind(l, LIGHT_INWARD);
        point = l.a + (inward ? l.size - slack : l.size + slack) * m;
        normal = inward ? -m : m;
        return;
    }
    vec2 w = flat_point(l, u);
    vec3 p0 = (1.0 - w.x - w.y) * l.a;
    vec3 p1 = w.x * l.b;
    vec3 p2 = w.y * l.c;
    normal = l.normal;
    vec3 p = p0 + p1 + p2;
    point = p + normal * (2.0 * GAMMA_7 * dot(abs(p0) + abs(p1) + abs(p2), abs(normal)));
}

// One of the places at integers that a normal distribution around them (camera.glsl) reaches x from, chosen by u in proportion
// to its density at x; `sum` is that of all.
int nearby_center(float x, float u, out float sum) {
    const int reach = 3;        // pixels; samples are not further from their pixel
    int first = floor_int(x) - reach + 1;
    sum = 0.0;
    [[unroll]] for (int i = 0; i < 2 * reach; ++i) sum += normal_density(x - float(first + i));
    float left = u * sum;
    int chosen = first;
    [[unroll]] for (int i = 0; i + 1 < 2 * reach; ++i) {
        left -= normal_density(x - float(first + i));
        if (left >= 0.0) chosen = first + i + 1;
    }
    return chosen;
}

// The pixel which x is recorded for, and what the light of a surface there counts per area, if the surface faces the camera by 1;
// NO_PIXEL if the camera does not see it.
uint pixel_at(Camera camera, vec3 x, vec2 u, out float importance) {
    float depth = dot(x, camera.forward);
    vec2 plane = vec2(dot(x, camera.right) / dot(camera.right, camera.right),
                      dot(x, camera.up) / dot(camera.up, camera.up)) / depth;
    vec2 p = vec2((plane.x + 1.0) / camera.column, (1.0 - plane.y) / camera.row);
    float d2 = dot(x, x);
    // Of a pixel at distance 1.
    float area = camera.column * camera.row * sqrt(dot(camera.right, camera.right) * dot(camera.up, camera.up));
    float cosine = depth * inversesqrt(d2);
    importance = 1.0 / (d2 * cosine * cosine * cosine * area);
    // What is far from the image may be beyond all integers.
    vec2 size = vec2(float(width), float(height));
    vec2 beyond = abs(p - 0.5 * size) - 0.5 * size;
    if (!(depth > 0.0 && beyond.x < 4.0 && beyond.y < 4.0)) return NO_PIXEL;
    ivec2 at = ivec2(floor_int(p.x), floor_int(p.y));
    if (FILTER == 1u) {
        vec2 sum;
        at = ivec2(nearby_center(p.x - 0.5, u.x, sum.x), nearby_center(p.y - 0.5, u.y, sum.y));
        importance *= sum.x * sum.y;
    }
    bool seen = at.x >= 0 && at.y >= 0 && at.x < int(width) && at.y < int(height);
    return seen ? uint(at.y) * width + uint(at.x) : NO_PIXEL;
}

// A light path on its way.
struct LightPath {
    int light;          // its emitter
    vec3 y;             // where it left that
    vec3 direction;     // and in which direction
    float cos_light;
    vec3 power;         // that it carries
    uint key;           // of its random numbers
    uint index;
    uint hits;          // surface hits so far
    uint splats;        // and splats
    vec3 origin;        // its next ray
    vec3 toward;
    int self_id;
};

// Of a lane that has had none yet.
LightPath light_path_none() {
    const vec3 none = vec3(0.0);
    return LightPath(0, none, none, 0.0, none, 0u, 0u, 0u, 0u, none, vec3(0.0, 0.0, 1.0), -1);
}

// Light path `number`, and whether it carries anything.
LightPath light_path_begin(uint number, out bool alive) {
    LightPath p;
    p.key = hash(number / BLOCK ^ hash(seed ^ 0x5be0cd19u));
    p.index = number % BLOCK;
    // An emitter with a target.
    const uint pairs = EMITTER_COUNT * CASTER_COUNT;
    float columns = float(pairs < 2u ? 1u : 2u << findMSB(pairs - 1u));     // of the table (src/render/light/alias.rs)
    float place = sample_pair(p.key, p.index, PAIR_PIXEL, 0u).x * columns;
    uint pair = uint(place);
    vec4 entry = light_texel(int(CASTER_TEXELS + CASTER_COUNT + pair));
    pair = place - float(pair) < entry.x ? pair : floatBitsToUint(entry.y);
    p.light = int(FIRST_EMITTER + pair / CASTER_COUNT);
    vec3 normal;
    emitter_point(p.light, sample_pair(p.key, p.index, pair_light(1u), 1u), p.y, normal);
    vec2 u = sample_pair(p.key, p.index, pair_choice(1u), 1u);
    p.direction = caster_direction(caster_bounds(pair % CASTER_COUNT), p.y, normal, u);
    p.cos_light = dot(normal, p.direction);
    float pdf = p.cos_light > 0.0 ? light_path_pdf(p.light, p.y, p.direction, p.cos_light) : 0.0;
    alive = pdf > 0.0;
    p.power = light_of(p.light).radiance * (emitter_area(p.light) * p.cos_light / pdf);
    p.hits = 0u;
    p.splats = 0u;
    p.origin = p.y;
    p.toward = p.direction;
    p.self_id = -1;
    return p;
}

// Numbers for the choice of a pixel near what a light path lights.
vec2 sample_near(LightPath p) {
    uint h = hash(hash(p.key ^ 0x1f83d9abu) + p.index * 0x9e3779b9u + p.hits * 0x63d83595u);
    return vec2(unit_float(h), unit_float(hash(h)));
}

// What shading normals do to light that comes from wi is not what they do to a path that goes there: a surface gets it by its geometric
// normal, and a path weighs it by the shading normal (Veach 1997, section 5.3). Light paths scatter as paths do the other way round.

bool is_flat(Vertex v) { return v.normal == v.up; }

// f(wo, wi) |wi·ns| of a path from wo, in place of |wi·ng|, times |wo·ng|: of light from wi that goes on to wo.
vec3 adjoint_eval(Vertex v, vec3 wi, vec3 wo) {
    bool as_path = is_flat(v) || MUTATION == MUTATE_ADJOINT;
    vec3 value = bsdf_eval(v.bsdf, v.normal, as_path ? wi : wo, as_path ? wo : wi).value;
    return as_path ? value : value * (dot(wo, v.up) / fast_max(dot(wi, v.up), 1e-7));
}

// A direction in which light from wi goes on. A diffuse surface sends it to all that is before its geometric normal.
BsdfSample adjoint_sample(Vertex v, vec3 wi, vec2 u) {
    bool diffuse = is_reconnectable(v.bsdf);
    BsdfSample s = bsdf_sample(v.bsdf, diffuse ? v.up : v.normal, wi, u);
    float arrives = fast_max(dot(wi, v.up), 1e-7);
    float leaves = dot(s.direction, v.up);
    float factor = abs(leaves) / arrives;
    if (s.crosses) factor *= abs(dot(wi, v.normal)) / fast_max(abs(dot(s.direction, v.normal)), 1e-7);
    if (MUTATION == MUTATE_ADJOINT) factor = 1.0;
    // From the other side of the surface no path comes.
    if ((leaves > 0.0) == s.crosses) factor = 0.0;
    if (diffuse) factor = fast_max(dot(wi, v.normal), 0.0) / arrives;
    if (!is_flat(v)) s.weight *= factor;
    return s;
}

// Records something of a light path of the dispatch.
void record_splat(uint light_path, uint number, uint pixel, vec3 light) {
    imageStore(splat_texels, int(number * (end_slot - first_slot) + light_path), uvec4(floatBitsToUint(light), pixel));
}

void main() [[maximally_reconverges]] {
    load_scene();
    // A lane whose light path has ended goes on with its next one.
    uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    uint next = gl_GlobalInvocationID.x;
    uint last = end_slot - first_slot;
    uint current = next;
    bool alive = false;
    LightPath light_path = light_path_none();
    Camera camera = frame_camera();
    Counts counts = Counts(0u, 0u, 0u, 0u, 0u, 0u, 0u);
    uint loops = 0u;
    while (subgroupAny(alive || next < last)) {
        loops += STEP_LOOPS;
        count_fallback(!alive && next < last ? CASTER_COUNT : 0u);
        if (!alive && next < last) {
            current = next;
            next += stride;
            light_path = light_path_begin(first_slot + current, alive);
            if (!alive) record_splat(current, 0u, NO_PIXEL, vec3(0.0));
        }
        bool travels = alive;
        light_path.hits += 1u;
        counts.rays += travels ? 1u : 0u;
        Ray way = Ray(light_path.origin, light_path.toward, light_path.self_id);
        Hit hit = intersect(way, loops);
        Vertex v = vertex_at(hit, way);
        vec3 wo = -light_path.toward;
        alive = alive && hit.primitive >= 0 && v.bsdf.type != BSDF_NONE;

        // What it lights is seen if it has met glass or a mirror first; other light is left to paths.
        float x2 = dot(v.outside, v.outside);
        float importance;
        vec2 near = FILTER == 1u ? sample_near(light_path) : vec2(0.0);
        uint pixel = pixel_at(camera, v.outside, near, importance);
        vec3 to_camera = -v.outside * inversesqrt(x2);
        bool delta = is_delta(v.bsdf);
        alive = alive && (delta || light_path.hits > 1u);
        if (SMOOTH_NORMALS) alive = alive && (delta || is_reconnectable(v.bsdf));
        bool shows = alive && is_reconnectable(v.bsdf) && pixel != NO_PIXEL && dot(v.up, to_camera) > 0.0;
        counts.shadow_rays += shows ? 1u : 0u;
        bool occluded = occluded(Ray(v.outside, to_camera, self_id_of(v.self_id, v.surface, v.front)), sqrt(x2), shows, loops);
        count_fallback(shows && !occluded ? CASTER_COUNT : 0u);
        if (shows && !occluded) {
            float r = light_path_ratio(light_path.light, light_path.y, light_path.direction, light_path.cos_light, x2);
            float weight = MUTATION == MUTATE_LIGHT_TRACING ? 1.0 : r / (1.0 + r);
            vec3 scattered = SMOOTH_NORMALS ? adjoint_eval(v, wo, to_camera) : bsdf_eval(v.bsdf, v.normal, wo, to_camera).value;
            vec3 light = light_path.power * scattered * (weight * importance);
            bool good = is_finite(brightness(light));
            counts.bad += good ? 0u : 1u;
            if (good) record_splat(current, light_path.splats++, pixel, light);
        }
        alive = alive && light_path.hits < MAX_DEPTH && light_path.hits < LIGHT_PATH_HITS;

        vec2 u = sample_pair(light_path.key, light_path.index, pair_direction(light_path.hits), light_path.hits);
        BsdfSample onward;
        if (SMOOTH_NORMALS) onward = adjoint_sample(v, wo, u);
        else onward = bsdf_sample(v.bsdf, v.normal, wo, u);
        vec3 share = onward.weight;
        if (SMOOTH_NORMALS) alive = alive && (is_flat(v) || share != vec3(0.0));
        if (!delta) {
            float survive = fast_min(largest(share), 1.0);
            alive = alive && sample_independent(light_path.key, light_path.index, light_path.hits) < survive;
            share *= 1.0 / survive;
        }
        // Paths leave out that radiance changes with the square of the index of refraction, which cancels out if emitter and surface are
        // in the same medium.
        if (HAS_DIELECTRIC && onward.crosses) share *= 1.0 / (v.bsdf.eta * v.bsdf.eta);
        if (travels && !alive && light_path.splats < MAX_SPLATS) record_splat(current, light_path.splats, NO_PIXEL, vec3(0.0));
        light_path.power *= share;
        light_path.origin = onward.crosses ? v.surface.position - v.up * v.surface.offset : v.outside;
        light_path.toward = onward.direction;
        light_path.self_id = self_id_of(v.self_id, v.surface, v.front != onward.crosses);
        // A traversal may have ended too early.
        if (LOOP_BUDGET > 0u) fallback_loops = subgroupMax(fallback_loops);
        if (LOOP_BUDGET > 0u && loops + fallback_loops >= LOOP_BUDGET) {
            if (travels) record_splat(current, 0u, UNFINISHED, vec3(0.0));
            for (; next < last; next += stride) record_splat(next, 0u, UNFINISHED, vec3(0.0));
            break;
        }
    }
    if (PATH_STATS) counts.steps = traversal_steps;
    add_counts(counts);
}
