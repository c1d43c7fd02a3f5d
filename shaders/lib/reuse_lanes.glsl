// Reuse of paths among the lanes of a subgroup: eight lanes side by side are a group and keep in registers what their
// paths have met. Nothing goes through memory, but a group's lanes have to wait for the longest of its paths.

#ifndef REUSE_LANES_GLSL
#define REUSE_LANES_GLSL

#include "gradient.glsl"
#include "reuse.glsl"
#include "votes.glsl"

// A path's first two hits. A normal of 0 stands for a hit that is not there.
struct PathVertices {
    vec3 x;
    float hit;      // which of its path x is
    int self_id;    // the id that a ray from x leaves
    vec3 nx;        // shading normal at x
    FirstVertex first;
    vec3 beta;      // throughput at x
    vec3 y;
    vec3 ny;        // geometric normal; 0 too if y does not give its light to others
    vec3 shading;   // with HAS_PARTS: shading normal at y,
    vec4 fading;    // and what light that leaves y is multiplied by
    vec3 direct;    // light from x itself
    bool shareable;
};

PathVertices vertices_none() {
    const vec3 none = vec3(0.0);
    return PathVertices(none, 0.0, -1, none, first_vertex_none(), none, none, none, none, vec4(0.0), none, false);
}

// The normal about which light leaves y.
vec3 shading_of_second(Vertex v) { return v.bsdf.type == BSDF_METALLIC_ROUGHNESS ? v.normal : v.up; }

// The path arrives at its second hit, with the light from its first one.
PathVertices vertices_at(Path p, Vertex v, float t, vec3 direct, FirstVertex first) {
    return PathVertices(p.origin, float(p.hits), p.self_id, p.normal, first, HAS_PARTS ? first.beta : p.throughput, end_of_segment(v, t),
                   v.shareable ? v.up : vec3(0.0), shading_of_second(v), fading_of(v.bsdf), direct, v.shareable);
}

// A path that waits for the others of its group.
struct EndedPath {
    PathVertices vertices;
    vec3 light;     // of the path from its second hit on, or all if there is none: what leaves y if that is given away
    bool there;
};

EndedPath ended_none() { return EndedPath(vertices_none(), vec3(0.0), false); }

// A path ends with the light that it has gathered, and the lane may begin another.
EndedPath path_ends(inout PathVertices vertices, vec3 light) {
    EndedPath ended = EndedPath(vertices, light, true);
    vertices = vertices_none();
    return ended;
}

// Whether the lane is in the group that begins at lane `first`.
bool in_group(uint first) { return gl_SubgroupInvocationID / MEMBERS == first / MEMBERS; }

// What a member of the lane's group holds. `member` must be the same in all lanes.
float of_member(float value, uint member) {
    if (SHUFFLES) return subgroupShuffle(value, gl_SubgroupInvocationID / MEMBERS * MEMBERS + member);
    float theirs = subgroupBroadcast(value, member);
    [[unroll]] for (uint first = MEMBERS; first < SUBGROUP_LANES; first += MEMBERS) {
        float others = subgroupBroadcast(value, first + member);
        theirs = in_group(first) ? others : theirs;
    }
    return theirs;
}

vec3 of_member(vec3 value, uint member) {
    return vec3(of_member(value.x, member), of_member(value.y, member), of_member(value.z, member));
}

vec4 of_member(vec4 value, uint member) { return vec4(of_member(value.xyz, member), of_member(value.w, member)); }

// Sum over the lane's group, in the order of its members.
float sum_of_group(float value) {
    float sum = of_member(value, 0u);
    [[unroll]] for (uint member = 1u; member < MEMBERS; ++member) sum += of_member(value, member);
    return sum;
}

// The differences of what the lane's pixel has gathered from that of the ones on its right and below; 0 where they are not
// of its group or outside the image. To be called by all lanes, with whether they have a sample.
void differences(vec3 gathered, bool there, out vec3 right, out vec3 down) {
    uint me = gl_SubgroupInvocationID % MEMBERS;
    right = vec3(0.0);
    down = vec3(0.0);
    [[dont_unroll]] for (uint member = 1u; member < MEMBERS; ++member) {
        vec3 theirs = of_member(gathered, member);
        if (of_member(there ? 1.0 : 0.0, member) == 0.0) theirs = gathered;
        if (member == me + 1u && has_right(me)) right = gathered - theirs;
        if (member == me + 4u) down = gathered - theirs;
    }
}

// Whether nothing hides what a ray aims at, if that is wanted. For all lanes to call. (Not for the only light, a point, which has a
// test of its own for spheres: light_occluded.)
bool arrives(ShadowRay ray, inout uint shadow_rays, inout uint loops) {
    shadow_rays += ray.enabled ? 1u : 0u;
    bool occluded = occluded(ray_of(ray), ray.distance, ray.enabled, loops);
    return ray.enabled && (!occluded || MUTATION == MUTATE_REUSE);
}

// Whether a path has gone on from x, and not just because it might meet light: then further samples of lights are taken there.
bool goes_on_from_first(PathVertices m) { return m.nx != vec3(0.0) && uint(m.hit) < MAX_DEPTH; }

// The ray of one of these, `index` being that of the path's own sample.
ShadowRay light_ray_at_first(PathVertices m, uint key, uint index, uint nth) {
    LightNumbers n = light_numbers(key, index_at_first(index), uint(m.hit), nth, true);
    // The surface there is reconnectable, with its reflectance in beta.
    Bsdf bsdf = diffuse_bsdf(HAS_PARTS ? m.beta * m.first.share : m.beta);
    ShadowRay ray = light_ray(m.x, bsdf, m.nx, m.first.up, m.nx, m.self_id, vec3(1.0), n, LIGHT_SAMPLES, 0.0);
    if (HAS_PARTS) ray.radiance *= fading(m.first.fading, dot(m.nx, ray.direction));
    ray.enabled = ray.enabled && goes_on_from_first(m);
    return ray;
}

// Light from x itself: the mean of the sample that the path has taken and of the further ones, whose sum this is.
vec3 mean_at_first(PathVertices m, vec3 further) {
    return goes_on_from_first(m) ? (m.direct + further) / float(LIGHT_SAMPLES) : m.direct;
}

// What light by a segment in such a direction, from x to y of normals `ny` and `shading`, is multiplied by at both ends; 0 also where the
// normal of y would be bent for light that goes there (bent_normal): a path that has met y from there keeps that to itself.
float fading_of_segment(PathVertices m, vec3 direction, vec3 ny, vec3 shading, vec4 fading_of_y) {
    if (SMOOTH_NORMALS && dot(mirrored(-direction, shading), ny) <= 0.0) return 0.0;
    return fading(m.first.fading, dot(m.nx, direction)) * fading(fading_of_y, -dot(shading, direction));
}

// All light of the lane's pixel for one sample, whose path has ended. To be called by all lanes. The part of it that comes by
// what the group shares is `gathered`; it would be `unshared` without the others.
vec3 shared_light(EndedPath ended, uint key, uint index, inout uint shadow_rays, inout uint loops, out vec3 gathered,
                  out vec3 unshared) {
    PathVertices m = ended.vertices;
    uint me = gl_SubgroupInvocationID % MEMBERS;
    bool shareable = m.shareable && is_worth_sharing(ended.light);
    vec3 shared_radiance = shareable ? ended.light : vec3(0.0);
    vec3 ny = shareable ? m.ny : vec3(0.0);
    vec3 sum = vec3(0.0);
    vec3 further = vec3(0.0);
    float of_own = 1.0;     // what light by its own second hit is multiplied by
    // Segments to the second hits of all members, and then further samples of lights: what traces a ray is compiled once.
    uint first = any_lane(shareable) ? 0u : MEMBERS;
    uint rays = MEMBERS + (LIGHT_SAMPLES > 1u && any_lane(goes_on_from_first(m)) ? LIGHT_SAMPLES - 1u : 0u);
    [[dont_unroll]] for (uint number = first; number < rays; ++number) {
        bool is_segment = LIGHT_SAMPLES == 1u || number < MEMBERS;
        uint from = number % MEMBERS;
        ShadowRay ray = ShadowRay(m.x, m.nx, 0.0, m.self_id, vec3(0.0), false);
        float value = 0.0;
        float faded = 1.0;
        if (is_segment) {
            vec3 y = of_member(m.y, from);
            vec3 normal = of_member(ny, from);
            value = geometry_term(m.x, m.nx, y, normal, ray.direction, ray.distance);
            if (SMOOTH_NORMALS) value = from == me || dot(m.first.up, ray.direction) > 0.0 ? value : 0.0;
            if (HAS_PARTS) {
                vec3 shading = SMOOTH_NORMALS ? of_member(m.shading, from) : normal;
                vec4 fading_of_y = of_member(m.fading, from);
                if (value > 0.0) faded = fading_of_segment(m, ray.direction, normal, shading, fading_of_y);
                if (SMOOTH_NORMALS) value = faded > 0.0 ? value : 0.0;
                of_own = from == me ? faded : of_own;
            }
            if (SEES_THROUGH) value = of_member(m.hit, from) == m.hit ? value : 0.0;
            // The path itself has shown that nothing is in between.
            ray.enabled = value > 0.0 && from != me;
        } else {
            ray = light_ray_at_first(m, key, index, 1u + number - MEMBERS);
            loops += LIGHT_LOOPS;
        }
        bool lit = arrives(ray, shadow_rays, loops);
        if (is_segment) {
            value = ray.enabled && !lit ? 0.0 : value;
            float all = sum_of_group(value);
            vec3 theirs = of_member(shared_radiance, from);
            if (HAS_PARTS) theirs *= faded;
            if (value > 0.0) sum += theirs * (value / all);
        } else {
            further += lit ? ray.radiance : vec3(0.0);
        }
        loops += 1u;
    }
    vec3 direct = m.direct;
    if (LIGHT_SAMPLES > 1u) direct = mean_at_first(m, further);
    vec3 own = shareable ? vec3(0.0) : ended.light;
    unshared = m.beta * shared_radiance;
    if (HAS_PARTS) unshared *= of_own;
    gathered = m.beta * sum;
    // (Of a last hit it is the pixel's own: whether there is a meeting depends on what else is compiled.)
    if (lights_correlated() && goes_on_from_first(m)) {
        unshared += m.direct;
        gathered += direct;
    } else {
        own += direct;
    }
    return own + gathered;
}

// Shares the paths of all lanes, and adds to each lane's pixel the sample whose path has ended; `key` is the group's. To be called
// by all lanes. Returns whether that was within the budget of loops; if not, nothing is added.
bool share_sample(EndedPath ended, inout FilmPixel film_pixel, inout Gradients gradients, uint key, inout uint shadow_rays,
                  inout uint loops, inout uint bad) {
    // Drivers bound the loops of the slowest lane.
    loops = subgroupMax(loops) + 1u;
    fallback_loops = subgroupMax(fallback_loops);
    vec3 gathered, unshared;
    uint index = index_of_member(index_after(film_pixel.multipliers, film_pixel.count), gl_SubgroupInvocationID % MEMBERS);
    vec3 light = shared_light(ended, key, index, shadow_rays, loops, gathered, unshared);
    bool within_budget = LOOP_BUDGET == 0u || subgroupMax(loops + fallback_loops) < LOOP_BUDGET;
    // What is not finite counts as black, and tells nothing of the noise.
    bool good = is_finite(brightness(light));
    if (!good) {
        gathered = vec3(0.0);
        unshared = vec3(0.0);
    }
    vec3 right, down;
    differences(gathered, ended.there, right, down);
    if (ended.there && within_budget) {
        film_pixel.pilot += good ? pilot_sign(film_pixel.count) * brightness(light - gathered) : 0.0;
        gradients_add(gradients, film_pixel.count, gathered, brightness(unshared), right, down);
        bad += film_add(film_pixel, light) ? 0u : 1u;
    }
    return within_budget;
}

#endif
