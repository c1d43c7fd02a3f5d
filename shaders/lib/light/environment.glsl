// A map of radiance from all around, in latitude and longitude (src/scene/environment.rs).
//
// Light sampling draws a direction by a density that is constant in each of 512 × 256 cells of the map, in proportion to radiance and solid
// angle: first the left or the right half, then a quarter of what was drawn, eight times. So stratified numbers stay stratified
// (Clarberg et al., "Wavelet Importance Sampling", 2005). A texel of the density has the sums of four quarters
// (src/render/light/environment.rs).

#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL

#include "../layout.glsl"
#include "../math.glsl"
#include "light.glsl"

// A kernel that could have a map may have none.
bool has_map() { return HAS_ENVIRONMENT && environment_map.y > 0u; }

const uint ENVIRONMENT_LEVELS = 8u;
const float ENVIRONMENT_CELLS = 512.0 * 256.0;

// The angle of (x, y) from the x axis, in parts of a whole turn from −½ to ½.
float turn_of(float y, float x) {
    float a = abs(x);
    float b = abs(y);
    bool steep = b > a;
    float t = steep ? a / b : (a > 0.0 ? b / a : 0.0);
    float turn = atan_accurate(t) * (1.0 / TWO_PI);
    turn = steep ? 0.25 - turn : turn;
    turn = x < 0.0 ? 0.5 - turn : turn;
    return y < 0.0 ? -turn : turn;
}

// Where a direction is on the map, from 0 to 1.
vec2 environment_place(vec3 d) {
    vec2 turned = vec2(environment_turn.x, environment_turn.y);
    if (MUTATION == MUTATE_TURN) turned.y = -turned.y;
    float x = turned.x * d.x - turned.y * d.z;
    float z = turned.y * d.x + turned.x * d.z;
    return vec2(0.5 + turn_of(x, -z), 2.0 * turn_of(sqrt(x * x + z * z), d.y));
}

vec3 environment_pixel(int i, int j) {
    int width = int(environment_map.y);
    i = i < 0 ? i + width : i;
    i = i >= width ? i - width : i;
    j = clamp(j, 0, int(environment_map.z) - 1);
    return uintBitsToFloat(texture_texel(int(environment_map.x) + j * width + i).xyz);
}

vec3 environment_radiance(vec3 direction) {
    vec2 place = environment_place(direction) * vec2(environment_map.yz) - 0.5;
    ivec2 at = ivec2(floor_int(place.x), floor_int(place.y));
    vec2 f = place - vec2(at);
    vec3 upper = mix(environment_pixel(at.x, at.y), environment_pixel(at.x + 1, at.y), f.x);
    vec3 lower = mix(environment_pixel(at.x, at.y + 1), environment_pixel(at.x + 1, at.y + 1), f.x);
    return mix(upper, lower, f.y) * environment_turn.z;
}

// The texel of a level's cell, of 2·2^level columns and 2^level rows.
int density_texel(uint level, uint x, uint y) {
    return int(environment_map.w + 2u * ((1u << 2u * level) - 1u) / 3u + (y << (level + 1u)) + x);
}

// Density per solid angle at a place of the map, from that of its cell among all.
float environment_density(float part, float sine) {
    if (MUTATION == MUTATE_SINE) sine = 1.0;
    return sine > 0.0 ? part * ENVIRONMENT_CELLS / (2.0 * PI * PI * sine) : 0.0;
}

float environment_pdf(vec3 direction) {
    vec2 place = environment_place(direction);
    uvec2 cell = uvec2(clamp(place, vec2(0.0), vec2(0.9999999)) * vec2(512.0, 256.0));
    uint level = ENVIRONMENT_LEVELS - 1u;
    vec4 quarters = uintBitsToFloat(texture_texel(density_texel(level, cell.x >> 1, cell.y >> 1)));
    vec2 row = (cell.y & 1u) != 0u ? quarters.zw : quarters.xy;
    return environment_density((cell.x & 1u) != 0u ? row.y : row.x, sqrt(max(1.0 - direction.y * direction.y, 0.0)));
}

// Light from a direction; the density is that of the direction alone.
LightSample environment_sample(vec2 u) {
    uvec2 cell = uvec2(takes_first(environment_half, u.x) ? 0u : 1u, 0u);
    float part = 0.0;
    for (uint level = 0u; level < ENVIRONMENT_LEVELS; ++level) {
        vec4 quarters = uintBitsToFloat(texture_texel(density_texel(level, cell.x, cell.y)));
        vec2 rows = quarters.xz + quarters.yw;
        bool upper = takes_first(rows.x / (rows.x + rows.y), u.y);
        vec2 row = upper ? quarters.xy : quarters.zw;
        bool left = takes_first(row.x / (row.x + row.y), u.x);
        part = left ? row.x : row.y;
        cell = 2u * cell + uvec2(left ? 0u : 1u, upper ? 0u : 1u);
    }
    vec2 place = (vec2(cell) + u) / vec2(512.0, 256.0);
    vec2 across = cos_sin_2pi(place.x - 0.5);
    vec2 down = cos_sin_2pi(0.5 * place.y);
    float sine = down.y;
    vec3 d = vec3(sine * across.y, down.x, -sine * across.x);
    vec3 direction = vec3(environment_turn.x * d.x + environment_turn.y * d.z, d.y, environment_turn.x * d.z - environment_turn.y * d.x);
    float pdf = environment_density(part, sine);
    vec3 radiance = pdf > 0.0 ? environment_radiance(direction) / pdf : vec3(0.0);
    return LightSample(radiance, direction, FAR_AWAY, pdf > 0.0 ? pdf : 1.0);
}

#endif
