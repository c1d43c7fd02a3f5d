// What lights are: points and emitters, as light_texels has them (src/render/lights.rs).
//
//   light  a | kind,  b | area or radius,  c | leaf,  radiance | -
//   kind 0: point at a, b = Φ/(4π²);  1: triangle a, b, c;  2: sphere around a;  3: the same, emitting inward;
//   4: parallelogram, corner a between b and c;  5: rectangle, likewise, sampled by solid angle

#ifndef LIGHT_GLSL
#define LIGHT_GLSL

#include "../layout.glsl"
#include "../math.glsl"

layout(constant_id = 29) const uint LIGHT_NODES = 0u;       // texels before those of the lights, see choice.glsl

const float LIGHT_POINT = 0.0;
const float LIGHT_TRIANGLE = 1.0;
const float LIGHT_SPHERE = 2.0;
const float LIGHT_INWARD = 3.0;
const float LIGHT_PARALLELOGRAM = 4.0;
const float LIGHT_RECTANGLE = 5.0;

// What there is of them: emitters that are flat (triangles, parallelograms and rectangles), and spheres.
const bool HAS_FLATS = (LIGHT_KINDS & 0x32u) != 0u;
const bool HAS_BALLS = (LIGHT_KINDS & 0xcu) != 0u;
const bool HAS_RECTANGLES = (LIGHT_KINDS & 0x20u) != 0u;

struct Light {
    float kind;
    vec3 a, b, c;
    float size;         // area or radius
    vec3 radiance;
    vec3 normal;        // of one that is flat: of its front
};

// A kind is not asked for where all lights are of one, so that nothing else is compiled.
bool is_kind(Light l, float kind, uint bit) {
    return (LIGHT_KINDS & bit) != 0u && (LIGHT_KINDS == bit || l.kind == kind);
}
bool is_point(Light l) { return is_kind(l, LIGHT_POINT, 1u); }
bool is_triangle(Light l) { return is_kind(l, LIGHT_TRIANGLE, 2u); }
bool is_inward(Light l) { return is_kind(l, LIGHT_INWARD, 8u); }
bool is_rectangle(Light l) { return is_kind(l, LIGHT_RECTANGLE, 0x20u); }
// Of one that is no point.
bool is_flat(Light l) { return HAS_FLATS && (!HAS_BALLS || l.kind == LIGHT_TRIANGLE || l.kind >= LIGHT_PARALLELOGRAM); }

// First texel of a light.
int light_row(int light) { return int(LIGHT_NODES) + 4 * light; }

Light light_of(int light) {
    int row = light_row(light);
    vec4 a = light_texel(row);
    vec4 b = light_texel(row + 1);
    Light l = Light(a.w, a.xyz, b.xyz, vec3(0.0), b.w, b.xyz, vec3(0.0));
    if (is_point(l)) return l;
    l.radiance = light_texel(row + 3).xyz;
    if (!is_flat(l)) return l;
    l.c = light_texel(row + 2).xyz;
    l.normal = normalize(cross(l.b - l.a, l.c - l.a));
    return l;
}

// Where a light was sampled, as seen from a surface point.
struct LightSample {
    vec3 point;         // end of the shadow ray
    vec3 radiance;      // arriving, times cos/π of a white diffuse surface over the density of the choice
    float pdf;          // per solid angle; 0 for a point light, which no ray can hit
};

#endif
