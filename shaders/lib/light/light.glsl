// What lights are: points and emitters, as light_texels has them (src/render/light/table.rs).
//
//   light  a | kind,  b | area or radius,  c | leaf,  radiance | primitive
//   kind 0: point at a, b = intensity;  1: triangle a, b, c;  2: sphere around a;  3: the same, emitting inward;
//   4: parallelogram, corner a between b and c;  5: rectangle, likewise, sampled by solid angle;
//   7: spot, likewise as a point, c = axis, then scale and offset of the part of the cone, and 1/range;  8: light from direction a

#ifndef LIGHT_GLSL
#define LIGHT_GLSL

#include "../lane_table.glsl"
#include "../layout.glsl"
#include "../math.glsl"

const uint LIGHT_POINT = 0u;
const uint LIGHT_TRIANGLE = 1u;
const uint LIGHT_SPHERE = 2u;
const uint LIGHT_INWARD = 3u;
const uint LIGHT_PARALLELOGRAM = 4u;
const uint LIGHT_RECTANGLE = 5u;
const uint LIGHT_SPOT = 7u;
const uint LIGHT_DIRECTIONAL = 8u;

// The kinds of emitters that are spheres, and of those that are flat; and what there is of them.
const uint BALLS = 1u << LIGHT_SPHERE | 1u << LIGHT_INWARD;
const uint FLATS = 1u << LIGHT_TRIANGLE | 1u << LIGHT_PARALLELOGRAM | 1u << LIGHT_RECTANGLE;
const bool HAS_BALLS = (LIGHT_KINDS & BALLS) != 0u;
const bool HAS_FLATS = (LIGHT_KINDS & FLATS) != 0u;
const bool HAS_RECTANGLES = (LIGHT_KINDS & 1u << LIGHT_RECTANGLE) != 0u;

// A light as fetched.
struct Light {
    float kind;
    vec3 a, b, c;
    float size;         // area or radius
    vec3 radiance;
    vec3 normal;        // of one that is flat: of its front
    int primitive;      // of a surface, with HAS_VARIED_EMISSION
};

// A kind is not asked for where all lights are of one, so that nothing else is compiled.
bool is_kind(Light l, uint kind) {
    return (LIGHT_KINDS & 1u << kind) != 0u && (LIGHT_KINDS == 1u << kind || l.kind == float(kind));
}
// Of one that is no point.
bool is_flat(Light l) { return HAS_FLATS && (!HAS_BALLS || (FLATS & 1u << uint(l.kind)) != 0u); }

// First texel of a light.
int light_row(int light) { return int(LIGHT_NODES) + 4 * light; }

Light fetch_light(int light) {
    int row = light_row(light);
    vec4 a = light_texel(row);
    vec4 b = light_texel(row + 1);
    Light l = Light(a.w, a.xyz, b.xyz, vec3(0.0), b.w, b.xyz, vec3(0.0), 0);
    if (is_kind(l, LIGHT_POINT) || is_kind(l, LIGHT_DIRECTIONAL)) return l;
    if (is_kind(l, LIGHT_SPOT)) {
        l.c = light_texel(row + 2).xyz;
        l.normal = light_texel(row + 3).xyz;
        return l;
    }
    vec4 color = light_texel(row + 3);
    l.radiance = color.xyz;
    if (HAS_VARIED_EMISSION) l.primitive = floatBitsToInt(color.w);
    if (!is_flat(l)) return l;
    l.c = light_texel(row + 2).xyz;
    l.normal = normalize(cross(l.b - l.a, l.c - l.a));
    return l;
}

// Lanes of a CPU hold the only light if that is an emitter, and few lights in a table (lane_table.glsl).
const bool HOLDS_EMITTER = !THREADS && LIGHT_COUNT == 1u && EMITTER_COUNT == 1u;
const bool LIGHTS_IN_LANES = LANE_TABLES && LIGHT_COUNT > 1u && LIGHT_COUNT <= TABLE_ROWS;
Light held_light;

// To be called when a kernel begins.
void load_lights() {
    if (HOLDS_EMITTER) held_light = fetch_light(0);
    if (LIGHTS_IN_LANES) held_light = fetch_light(row_of_lane(0u, LIGHT_COUNT));
}

// The light of that number.
Light light_of(int light) {
    if (HOLDS_EMITTER) return held_light;
    if (!LIGHTS_IN_LANES) return fetch_light(light);
    Light l = held_light;
    return Light(table_value(l.kind, light), table_value(l.a, light), table_value(l.b, light), table_value(l.c, light),
                 table_value(l.size, light), table_value(l.radiance, light), table_value(l.normal, light),
                 HAS_VARIED_EMISSION ? table_value(l.primitive, light) : 0);
}

// A distance beyond everything, whose square is a number.
const float FAR_AWAY = 1e18;

// Light that arrives at a point from one of the lights, if nothing is in between. It knows nothing of the surface there.
struct LightSample {
    vec3 radiance;      // over the density of the sample; 0 if the light does not shine there
    vec3 direction;     // unit, towards the light
    float distance;     // to where the shadow ray ends
    float pdf;          // density per solid angle; 0 of a point light, which no ray can hit
};

LightSample light_none() { return LightSample(vec3(0.0), vec3(0.0, 0.0, 1.0), 0.0, 1.0); }

#endif
