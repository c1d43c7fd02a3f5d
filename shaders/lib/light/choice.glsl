// Choosing one light of many. Space is divided into cells, finest around the lights and without end outside; for each
// cell a table has the probabilities of lights, in proportion to what they may contribute there, or of groups of lights
// if there are many. A choice takes two accesses, and for groups a descent by the strengths of the lights alone. That
// knows nothing of the surface, so that two lights are drawn, and one of them is kept in proportion to what it
// contributes if nothing is in between (resampling: Talbot, Cline and Egbert 2005).
//
// That fails where a bright light is out of sight, behind the surface or a wall: it is nearly always drawn, and kept. So a share of the
// samples, even_share, draws entries regardless of probabilities, and keeps the weaker of two as often as the other (a defensive
// mixture: Hesterberg 1995). Weak lights are left to them (the cutoff heuristic: Veach 1997): kept beside a strong one such a light would
// count for both. That bounds the noise, whatever the lights' powers are. Where these differ little the share is 0.
//
// light_texels: nodes of a texel, lights of four (light.glsl), and entries of a texel (src/render/light/table.rs, grid.rs).
//   node   share of the first child, second child, strength (of the root's), light; or ~(end of what is below) if it
//          is no leaf
//   entry  threshold, alias, probability, light; or node if LIGHT_DEPTH > 0
// Nodes are in depth-first order, the entries of a cell in ascending order of what they stand for.

#ifndef LIGHT_CHOICE_GLSL
#define LIGHT_CHOICE_GLSL

#include "point.glsl"
#include "triangle.glsl"
#include "sphere.glsl"
#include "spot.glsl"
#include "environment.glsl"

// The share of these samples.
float even_part() { return MUTATION == MUTATE_CHOICE ? 0.0 : even_share; }

// First entry of the cell around p.
int light_cell(vec3 p) {
    vec3 x = p - light_grid.xyz;
    // From (−∞, ∞) to (0, cells).
    vec3 place = (x / (light_grid.w + abs(x)) + 1.0) * (0.5 * float(LIGHT_CELLS));
    ivec3 at = clamp(ivec3(floor_int(place.x), floor_int(place.y), floor_int(place.z)), 0, int(LIGHT_CELLS) - 1);
    int cell = (at.z * int(LIGHT_CELLS) + at.y) * int(LIGHT_CELLS) + at.x;
    return light_row(int(LIGHT_COUNT)) + cell * int(LIGHT_ENTRIES);
}

// A random number has so many binary digits.
const float LAST_DIGIT = 1.0 / 16777216.0;

// The probability of an entry, in samples of both kinds, for the one by which the table draws it.
float entry_probability(float by_table) {
    return by_table > 0.0 ? mix(by_table, 1.0 / float(LIGHT_ENTRIES), even_part()) : 0.0;
}

// What light of an entry is divided by in a sample of one kind: its probability over the weight of the kind.
float entry_divisor(float by_table, bool even) {
    float evenly = even_part() / float(LIGHT_ENTRIES);
    float unevenly = (1.0 - even_part()) * by_table;
    if (unevenly >= evenly) return evenly + unevenly;
    return even ? evenly : INFINITY;
}

// The light of a number u in [0, 1) for a surface in a cell, and the probability of choosing it; −1 if no light can
// shine there. `even`: all entries are drawn alike. `divisor`: of its light. Among thousands of lights the digits of u are soon used up:
// those of `more` follow them.
int light_choose(int cell, float u, float more, bool even, out float probability, out float divisor) {
    probability = divisor = 1.0;
    if (LIGHT_COUNT == 1u) return 0;
    float place = u * float(LIGHT_ENTRIES);
    int column = floor_int(fast_min(place, float(LIGHT_ENTRIES) - 0.5));
    u = place - float(column);
    vec4 entry = light_texel(cell + column);
    if (even) entry.x = 1.0;
    bool own = takes_first(entry.x, u);
    if (LIGHT_DEPTH > 0u) {
        float known = LAST_DIGIT * float(LIGHT_ENTRIES) / (own ? entry.x : 1.0 - entry.x);
        u = fast_min(u + more * known, BELOW_ONE);
    }
    if (!own) entry = light_texel(cell + floatBitsToInt(entry.y));
    probability = entry_probability(entry.z);
    divisor = entry_divisor(entry.z, even);
    int chosen = probability > 0.0 ? floatBitsToInt(entry.w) : -1;
    if (LIGHT_DEPTH > 0u && chosen >= 0) {
        int entered = chosen;
        vec4 node = light_texel(chosen);
        float strength = node.z;
        while (floatBitsToInt(node.w) < 0) {
            chosen = takes_first(node.x, u) ? chosen + 1 : floatBitsToInt(node.y);
            node = light_texel(chosen);
        }
        float share = strength > 0.0 ? node.z / strength : 0.0;
        if (chosen != entered) probability *= share;
        if (chosen != entered) divisor *= share;
        chosen = probability > 0.0 ? floatBitsToInt(node.w) : -1;
    }
    return chosen;
}

// The table's probability of the entry that a light is in; `share`: the light's among those of the entry.
float entry_of(int cell, int light, out float share) {
    share = 1.0;
    int key = light;
    if (LIGHT_DEPTH > 0u) key = floatBitsToInt(light_texel(light_row(light) + 2).w);
    // The last entry that is not beyond it.
    int last = 0;
    for (int step = int(LIGHT_ENTRIES) / 2; step > 0; step /= 2) {
        bool beyond = floatBitsToInt(light_texel(cell + last + step).w) > key;
        last += beyond ? 0 : step;
    }
    vec4 entry = light_texel(cell + last);
    int found = floatBitsToInt(entry.w);
    if (found == key) return entry.z;
    if (LIGHT_DEPTH == 0u || entry.z == 0.0) return 0.0;
    vec4 node = light_texel(found);
    int end = ~floatBitsToInt(node.w);
    share = found < key && key < end && node.z > 0.0 ? light_texel(key).z / node.z : 0.0;
    return entry.z;
}

// Probability with which light_choose picks `light`.
float light_probability(int cell, int light) {
    if (LIGHT_COUNT == 1u) return 1.0;
    float share;
    float by_table = entry_of(cell, light, share);
    return entry_probability(by_table) * share;
}

// Samples a light at the point that `uv` chooses. Density: of the point alone.
LightSample light_point(Light l, vec3 from, vec2 uv) {
    if (is_kind(l, LIGHT_POINT)) return point_sample(l.a, l.b, from);
    if (is_kind(l, LIGHT_SPOT)) return spot_sample(l, from);
    if (is_kind(l, LIGHT_DIRECTIONAL)) return LightSample(l.b, l.a, FAR_AWAY, 0.0);
    if (is_flat(l)) return flat_sample(l, from, uv);
    return sphere_sample(l, from, uv);
}

// Samples the light that u chooses (light_choose). The density includes the choice.
LightSample light_candidate(int cell, vec3 from, float u, float more, bool even, vec2 uv) {
    float probability, divisor;
    int light = light_choose(cell, u, more, even, probability, divisor);
    if (light < 0) return light_none();
    LightSample s = light_point(light_of(light), from, uv);
    s.radiance /= divisor;
    s.pdf *= probability;
    return s;
}

// What a light's direction counts for a surface with the normal n, which is 0 where light comes from both sides.
float towards(vec3 n, vec3 direction) {
    if (HAS_TRANSMISSION && n == vec3(0.0)) return 1.0;
    return fast_max(dot(n, direction), 0.0);
}

// Light from one of all lights, for a surface with the normal n: of two candidates one is kept by the light that it brings to a diffuse
// surface. `pdf` is that of a candidate: for weights against rays that hit lights by chance, which need no more than that both use the
// same.
LightSample light_sample(vec3 from, vec3 n, vec2 u, vec2 uv) {
    if (HAS_ENVIRONMENT) {
        if (LIGHT_COUNT == 0u) {
            if (!has_map()) return light_none();
            return environment_sample(uv);
        }
        if (takes_first(environment_share, u.x)) {
            LightSample s = environment_sample(uv);
            s.radiance /= environment_share;
            s.pdf *= environment_share;
            return s;
        }
    }
    int cell = light_cell(from);
    // Which of the two is kept hardly depends on the lower digits of u.y.
    float more = fract(4096.0 * u.y);
    float part = even_part();
    bool even = u.y < part;
    float keeps = even ? u.y / part : (u.y - part) / (1.0 - part);
    LightSample s = light_candidate(cell, from, u.x, more, even, uv);
    if (LIGHT_COUNT > 1u) {
        LightSample other = light_candidate(cell, from, u.x < 0.5 ? u.x + 0.5 : u.x - 0.5, more, even, uv);
        float mine = brightness(s.radiance) * towards(n, s.direction);
        float theirs = brightness(other.radiance) * towards(n, other.direction);
        bool takes = keeps * (mine + theirs) < theirs;
        float kept = (takes ? theirs : mine) / (mine + theirs);
        if (even && mine > 0.0 && theirs > 0.0) {
            // The weaker one first: its share of the numbers is one interval, in which stratified samples fall alike.
            takes = (keeps < 0.5) == (theirs < mine);
            kept = 0.5;
        }
        s.direction = takes ? other.direction : s.direction;
        s.distance = takes ? other.distance : s.distance;
        s.pdf = takes ? other.pdf : s.pdf;
        s.radiance = takes ? other.radiance : s.radiance;
        s.radiance *= kept > 0.0 ? 0.5 / kept : 0.0;
    }
    if (HAS_ENVIRONMENT) {
        s.radiance /= 1.0 - environment_share;
        s.pdf *= 1.0 - environment_share;
    }
    return s;
}

// Density per solid angle with which a candidate of light_sample is the point of an emitter that a ray has hit at
// distance t, under the cosine `cos_light` at the emitter.
float light_pdf(vec3 from, int light, float t, float cos_light) {
    Light l = light_of(light);
    float pdf;
    if (is_flat(l)) pdf = flat_pdf(l, from, t * t, cos_light);
    else pdf = sphere_pdf(l, from, t * t, cos_light);
    if (HAS_ENVIRONMENT) pdf *= 1.0 - environment_share;
    return light_probability(light_cell(from), light) * pdf;
}

// Power heuristic (Veach 1997) for the technique of density `mine` against `other`.
float mis_weight(float mine, float other) {
    // Scaled by the larger, so that squares do not overflow.
    float m = fast_max(mine, other);
    float x = mine / m;
    float y = other / m;
    return x * x / (x * x + y * y);
}

#endif
