// Choosing one light of many, in proportion to a bound on what it may contribute, by descending a binary tree
// (Conty Estevez and Kulla, HPG 2018). The bound is positive wherever a light can contribute: none is ever lost.
//
// light_texels: nodes of three texels, then lights of four.
//   node   box lo | power,  box hi | first child, or ~light,  axis of emission | cos of the cone around it
//   light  a | kind,  b | area or radius,  c | path from the root (bit k: which child at depth k),  radiance | depth
//   kind 0: point at a, b = Φ/(4π²);  1: triangle a, b, c;  2: sphere around a;  3: the same, emitting inward;
//   4: parallelogram, corner a between b and c

#ifndef LIGHT_TREE_GLSL
#define LIGHT_TREE_GLSL

#include "point.glsl"
#include "triangle.glsl"
#include "sphere.glsl"

layout(constant_id = 29) const uint LIGHT_NODES = 0u;

const float LIGHT_POINT = 0.0;
const float LIGHT_TRIANGLE = 1.0;
const float LIGHT_SPHERE = 2.0;
const float LIGHT_INWARD = 3.0;
const float LIGHT_PARALLELOGRAM = 4.0;

// cos(max(0, a − b)) from cosines and sines of angles in [0, π].
float cos_difference(float cos_a, float sin_a, float cos_b, float sin_b) {
    return cos_a > cos_b ? 1.0 : cos_a * cos_b + sin_a * sin_b;
}

float sine(float c) { return sqrt(upper(1.0 - c * c, 0.0)); }

// Bound on the contribution of a node's lights to a diffuse surface at p with normal n.
float light_importance(int node, vec3 p, vec3 n) {
    vec4 q0 = texelFetch(light_texels, 3 * node);
    vec4 q1 = texelFetch(light_texels, 3 * node + 1);
    vec4 q2 = texelFetch(light_texels, 3 * node + 2);
    vec3 half_size = 0.5 * (q1.xyz - q0.xyz);
    vec3 to = (q0.xyz + half_size) - p;
    float radius2 = dot(half_size, half_size);
    float d2 = dot(to, to);
    if (d2 == 0.0) return radius2 > 0.0 ? q0.w / radius2 : 0.0;
    vec3 direction = to * inversesqrt(d2);
    // Angle under which the box's sphere is seen; from inside everything is possible.
    bool inside = d2 <= radius2;
    float sin_box = inside ? 0.0 : sqrt(radius2 / d2);
    float cos_box = inside ? -1.0 : sine(sin_box);
    float cos_n = dot(n, direction);
    float receive = cos_difference(cos_n, sine(cos_n), cos_box, sin_box);
    float cos_axis = -dot(q2.xyz, direction);
    float toward = cos_difference(cos_axis, sine(cos_axis), q2.w, sine(q2.w));
    float emit = cos_difference(toward, sine(toward), cos_box, sin_box);
    // A little more than the bounds, for their rounding.
    const float slack = radius2 > 0.0 ? 1e-4 : 0.0;
    receive = inside ? 1.0 : receive + slack;
    emit = inside || q2.w <= -1.0 ? 1.0 : emit + slack;
    return receive > 0.0 && emit > 0.0 ? q0.w * receive * emit / upper(d2, radius2) : 0.0;
}

// Probabilities of a node and of its neighbour, which are siblings; both 0 if neither can contribute.
vec2 sibling_shares(int first, vec3 p, vec3 n) {
    float w0 = light_importance(first, p, n);
    float w1 = light_importance(first + 1, p, n);
    float sum = w0 + w1;
    float share = w0 / sum;
    return sum > 0.0 ? vec2(share, 1.0 - share) : vec2(0.0);
}

// The light of a number u in [0, 1), and the probability of choosing it; −1 if no light can contribute.
int light_choose(vec3 p, vec3 n, float u, out float probability) {
    probability = 1.0;
    int node = 0;
    int next = floatBitsToInt(texelFetch(light_texels, 1).w);
    while (next >= 0) {
        vec2 shares = sibling_shares(next, p, n);
        bool first = u < shares.x;
        float share = first ? shares.x : shares.y;
        u = lower((first ? u : u - shares.x) / share, 0.99999994);
        probability *= share;
        node = next + (first ? 0 : 1);
        next = floatBitsToInt(texelFetch(light_texels, 3 * node + 1).w);
    }
    return probability > 0.0 ? ~next : -1;
}

// Probability with which light_choose picks `light`.
float light_probability(vec3 p, vec3 n, int light) {
    uint path = floatBitsToUint(texelFetch(light_texels, int(3u * LIGHT_NODES) + 4 * light + 2).w);
    float probability = 1.0;
    int next = floatBitsToInt(texelFetch(light_texels, 1).w);
    while (next >= 0) {
        vec2 shares = sibling_shares(next, p, n);
        bool first = (path & 1u) == 0u;
        path >>= 1;
        probability *= first ? shares.x : shares.y;
        next = floatBitsToInt(texelFetch(light_texels, 3 * (next + (first ? 0 : 1)) + 1).w);
    }
    return probability;
}

// Samples the light that u chooses at the point that `uv` chooses. `pdf` of the result includes the choice.
LightSample light_sample(vec3 from, vec3 n, float u, vec2 uv) {
    float probability;
    int light = light_choose(from, n, u, probability);
    if (light < 0) return LightSample(from, vec3(0.0), 1.0);
    int row = int(3u * LIGHT_NODES) + 4 * light;
    vec4 a = texelFetch(light_texels, row);
    vec4 b = texelFetch(light_texels, row + 1);
    vec4 c = texelFetch(light_texels, row + 2);
    vec4 d = texelFetch(light_texels, row + 3);
    LightSample s;
    if (a.w == LIGHT_POINT) {
        s = point_sample(a.xyz, b.xyz, from, n);
    } else if (a.w == LIGHT_TRIANGLE || a.w == LIGHT_PARALLELOGRAM) {
        s = triangle_sample(a.xyz, b.xyz, c.xyz, a.w == LIGHT_PARALLELOGRAM, b.w, d.xyz, from, n, uv);
    } else {
        s = sphere_sample(a.xyz, b.w, a.w == LIGHT_INWARD, d.xyz, from, n, uv);
    }
    s.radiance /= probability;
    s.pdf *= probability;
    return s;
}

// Density per solid angle with which light_sample, called for (from, n), returns the point of an emitter that a ray
// has hit at distance t, under the cosine `cos_light` at the emitter.
float light_pdf(vec3 from, vec3 n, int light, float t, float cos_light) {
    int row = int(3u * LIGHT_NODES) + 4 * light;
    vec4 a = texelFetch(light_texels, row);
    vec4 b = texelFetch(light_texels, row + 1);
    bool flat_ = a.w == LIGHT_TRIANGLE || a.w == LIGHT_PARALLELOGRAM;
    float pdf = flat_ ? triangle_pdf(b.w, t * t, cos_light)
                      : sphere_pdf(a.xyz, b.w, a.w == LIGHT_INWARD, from, t * t, cos_light);
    return light_probability(from, n, light) * pdf;
}

// Power heuristic (Veach 1997) for the technique of density `mine` against `other`.
float mis_weight(float mine, float other) {
    // Scaled by the larger, so that squares do not overflow.
    float m = upper(mine, other);
    float x = mine / m;
    float y = other / m;
    return x * x / (x * x + y * y);
}

#endif
