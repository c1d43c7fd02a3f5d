// A ray pool: the few paths of a lane that wait for the BVH, see path_queue.comp.

#ifndef RAY_POOL_GLSL
#define RAY_POOL_GLSL

#include "path.glsl"
#include "reuse_queue.glsl"

// A word holds a path's slot, its flags, two more, and 16 bits for its hits.
const uint GIVES_BIT = 1u << (SLOT_BITS + PATH_FLAGS);
const uint MET_BIT = 2u << (SLOT_BITS + PATH_FLAGS);
const uint HITS_SHIFT = SLOT_BITS + PATH_FLAGS + 2u;
const uint NOTHING = 0xffffffffu;
const uint PLACES = 6u;                 // FOR_EACH_PLACE below
const uint ALL_PLACES = (1u << PLACES) - 1u;

// Places are written under conditions that stay conditions: turned into blends by the compiler, each number would be
// blended twice, for the condition and for the lanes that are on.
#define FOR_EACH_PLACE(BODY) BODY(0) BODY(1) BODY(2) BODY(3) BODY(4) BODY(5)

// A path in a lane's hands, with the hit of its ray.
struct Held {
    Path path;
    vec3 radiance;
    uint slot;      // NOTHING: no path
    float t;
    int id;
    bool dying;     // it has ended but for its last shadow ray
    bool met;       // it has arrived at its second hit,
    bool shareable;     // and its light is for other pixels too, see reuse_queue.glsl
};

// Sets of places, one bit each, and what the places hold.
struct RayPool {
    uint used;
    uint rays;          // of which these wait for their closest hit,
    uint shadows;       // these for their shadow ray;
    uint lit;           // of these it was not in shadow,
    uint dying;         // and these end with it.
    vec4 origin[PLACES];        // t of the hit
    vec4 direction[PLACES];     // id of the hit
    vec4 throughput[PLACES];    // id of the primitive left
    vec4 radiance[PLACES];      // slot, flags and number of hits
    vec4 toward[PLACES];        // direction of the shadow ray, distance
    vec4 light[PLACES];         // its radiance, index of the sample
    vec4 normal[PLACES];        // for reuse: normal; for emitters: density
    float x2[PLACES];           // for light paths
    int medium[PLACES];         // with absorption
    uint entry[PLACES];         // where the ray enters the BVH (root_hit_mask), and above that the shadow ray
};

// The ray in a lane's hands.
struct PoolTraversal {
    uint place;         // a bit; 0: none
    bool shadow;
    int self_id;
    BvhRay ray;
    Traversal traversal;
};

Held held_nothing() {
    Path path = Path(vec3(0.0), vec3(0.0, 0.0, 1.0), -1, vec3(0.0), 0u, 0u, vec3(0.0), 0.0, 0.0, 0u, -1);
    return Held(path, vec3(0.0), NOTHING, 0.0, -1, false, false, false);
}

RayPool pool_empty() {
    RayPool p;
    p.used = p.rays = p.shadows = p.lit = p.dying = 0u;
#define CLEAR(n)                                                                                         \
    p.origin[n] = p.direction[n] = p.throughput[n] = p.radiance[n] = p.toward[n] = p.light[n] = vec4(0.0); \
    p.normal[n] = vec4(0.0);                                                                              \
    p.x2[n] = 0.0;                                                                                        \
    p.medium[n] = -1;                                                                                     \
    p.entry[n] = 0u;
    FOR_EACH_PLACE(CLEAR)
#undef CLEAR
    return p;
}

PoolTraversal pool_traversal_idle() {
    return PoolTraversal(0u, false, -1, bvh_ray(vec3(0.0), vec3(0.0, 0.0, 1.0), false), traversal_idle());
}

uint lowest_bit(uint set) { return set & (~set + 1u); }
uint pool_waiting(RayPool p) { return p.rays | p.shadows; }
uint pool_traced(RayPool p) { return p.used & ~(p.rays | p.shadows); }
bool pool_has_room(RayPool p) { return p.used != ALL_PLACES; }

// Puts a path away until its ray and its shadow ray have been traced, as far as they enter the BVH. There must be room.
void pool_put(inout RayPool p, Held h, ShadowRay shadow, uint entry, uint root_mask_of_shadow) {
    bool waits = entry != 0u;
    bool later = root_mask_of_shadow != 0u;
    uint place = waits || later ? lowest_bit(~p.used) : 0u;
    p.used |= place;
    p.rays |= waits ? place : 0u;
    p.shadows |= later ? place : 0u;
    p.dying |= h.dying ? place : 0u;
    vec4 origin = vec4(h.path.origin, h.t);
    vec4 direction = vec4(h.path.direction, intBitsToFloat(h.id));
    vec4 throughput = vec4(h.path.throughput, intBitsToFloat(h.path.self_id));
    uint flags = (h.path.flags << SLOT_BITS) | (h.shareable ? GIVES_BIT : 0u) | (h.met ? MET_BIT : 0u);
    uint bits = h.slot | flags | (h.path.hits << HITS_SHIFT);
    vec4 radiance = vec4(h.radiance, uintBitsToFloat(bits));
    vec4 toward = vec4(shadow.direction, shadow.distance);
    vec4 light = vec4(shadow.radiance, uintBitsToFloat(h.path.index));
#define PUT(n)                                      \
    [[dont_flatten]] if (place == (1u << n)) {      \
        p.origin[n] = origin;                       \
        p.direction[n] = direction;                 \
        p.throughput[n] = throughput;               \
        p.radiance[n] = radiance;                   \
        p.toward[n] = toward;                       \
        p.light[n] = light;                         \
        p.entry[n] = entry | (root_mask_of_shadow << 4); \
        if (REUSE) p.normal[n].xyz = h.path.normal; \
        if (MEETS_LIGHTS) p.normal[n].w = h.path.pdf; \
        if (LIGHT_TRACING) p.x2[n] = h.path.x2;         \
        if (HAS_ABSORPTION) p.medium[n] = h.path.medium; \
    }
    FOR_EACH_PLACE(PUT)
#undef PUT
}

// Gives a lane without a path one whose rays have been traced, if there is one.
void pool_take(inout RayPool p, inout Held h) {
    uint place = h.slot == NOTHING ? lowest_bit(pool_traced(p)) : 0u;
    if (place != 0u) {
        vec4 origin = p.origin[0];
        vec4 direction = p.direction[0];
        vec4 throughput = p.throughput[0];
        vec4 radiance = p.radiance[0];
        vec4 light = p.light[0];
        vec4 normal = p.normal[0];
        float x2 = p.x2[0];
        int medium = p.medium[0];
#define TAKE(n)                                                        \
    if (n > 0) {                                                       \
        bvec4 here = bvec4(place == (1u << n));                        \
        origin = mix(origin, p.origin[n], here);                       \
        direction = mix(direction, p.direction[n], here);              \
        throughput = mix(throughput, p.throughput[n], here);           \
        radiance = mix(radiance, p.radiance[n], here);                 \
        light = mix(light, p.light[n], here);                          \
        if (REUSE) normal.xyz = mix(normal.xyz, p.normal[n].xyz, here.xyz); \
        if (MEETS_LIGHTS) normal.w = here.w ? p.normal[n].w : normal.w; \
        if (LIGHT_TRACING) x2 = here.x ? p.x2[n] : x2;                     \
        if (HAS_ABSORPTION) medium = here.x ? p.medium[n] : medium;        \
    }
        FOR_EACH_PLACE(TAKE)
#undef TAKE
        uint bits = floatBitsToUint(radiance.w);
        h.slot = bits & ((1u << SLOT_BITS) - 1u);
        h.path = Path(origin.xyz, direction.xyz, floatBitsToInt(throughput.w), throughput.xyz, bits >> HITS_SHIFT,
                      floatBitsToUint(light.w), normal.xyz, normal.w, x2, bits >> SLOT_BITS & ((1u << PATH_FLAGS) - 1u), medium);
        h.t = origin.w;
        h.id = floatBitsToInt(direction.w);
        h.radiance = radiance.xyz;
        if ((p.lit & place) != 0u) h.radiance += light.xyz;
        h.dying = (p.dying & place) != 0u;
        h.shareable = (bits & GIVES_BIT) != 0u;
        h.met = (bits & MET_BIT) != 0u;
        p.used &= ~place;
        p.lit &= ~place;
        p.dying &= ~place;
    }
}

// Gives a lane that traverses nothing the next ray; shadow rays first.
void pool_fetch(RayPool p, inout PoolTraversal w) {
    uint place = w.place == 0u ? lowest_bit(pool_waiting(p)) : 0u;
    if (place != 0u) {
        vec4 origin = p.origin[0];
        vec4 direction = p.direction[0];
        float self_id = p.throughput[0].w;
        vec4 toward = p.toward[0];
        uint entry = p.entry[0];
#define FETCH(n)                                          \
    if (n > 0) {                                          \
        bool here = place == (1u << n);                   \
        origin = mix(origin, p.origin[n], bvec4(here));   \
        direction = mix(direction, p.direction[n], bvec4(here)); \
        self_id = here ? p.throughput[n].w : self_id;     \
        toward = mix(toward, p.toward[n], bvec4(here));   \
        entry = here ? p.entry[n] : entry;                \
    }
        FOR_EACH_PLACE(FETCH)
#undef FETCH
        w.place = place;
        w.shadow = (p.shadows & place) != 0u;
        w.self_id = floatBitsToInt(self_id);
        w.ray = bvh_ray(origin.xyz, w.shadow ? toward.xyz : direction.xyz, w.shadow);
        w.traversal = traversal_begin(w.ray, w.shadow ? toward.w : origin.w, w.shadow ? entry >> 4 : entry & 15u);
    }
}

// Records the result of a traversal that is over.
void pool_finish(inout RayPool p, inout PoolTraversal w) {
    bool over = w.place != 0u && !w.traversal.running;
    bool hit = w.traversal.id >= 0;
    uint place = over ? w.place : 0u;
    p.lit |= w.shadow && !hit ? place : 0u;
    p.shadows &= ~(w.shadow ? place : 0u);
    p.rays &= ~(w.shadow ? 0u : place);
    uint closer = hit && !w.shadow ? place : 0u;
#define FINISH(n)                                           \
    [[dont_flatten]] if (closer == (1u << n)) {             \
        p.origin[n].w = w.traversal.t;                           \
        p.direction[n].w = intBitsToFloat(w.traversal.id);       \
    }
    FOR_EACH_PLACE(FINISH)
#undef FINISH
    w.place = over ? 0u : w.place;
}

#endif
