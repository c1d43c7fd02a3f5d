// Images on surfaces: fetched texel by texel, so that every driver filters alike and exactly.
//
// texture_texels holds the table of albedos (bsdf/albedo.glsl), then three texels a texture, then the images
// (src/render/scene/textures.rs).
//   texture  first texel of the image, width | height << 16, TEXTURE_… ;  row of the map from coordinates to u;  row for v
//   image    blocks of 2 × 2 pixels, row by row. A block is one texel of 8-bit codes, two of 16-bit codes (a row of pixels each), or four
//            of floats. Blocks at the edges are filled up.

#ifndef TEXTURE_GLSL
#define TEXTURE_GLSL

#include "bsdf/albedo.glsl"
#include "layout.glsl"
#include "math.glsl"

const uint TEXTURE_WRAP_V = 2u;         // shift; the wrap along u is in bits 0 and 1
const uint TEXTURE_SRGB = 0x10u;
const uint TEXTURE_NEAREST = 0x20u;
const uint TEXTURE_SECOND_UV = 0x40u;
const uint TEXTURE_CODES_16 = 0x80u;
const uint TEXTURE_FLOATS = 0x100u;

const uint WRAP_REPEAT = 0u;
const uint WRAP_MIRROR = 1u;
const uint WRAP_CLAMP = 2u;

// A coordinate, brought near the image: repeated parts are subtracted exactly.
float wrapped(float x, uint wrap) {
    if (wrap == WRAP_CLAMP) return clamp(x, -1.0, 2.0);
    return wrap == WRAP_MIRROR ? x - 2.0 * floor(0.5 * x) : x - floor(x);
}

// The number of a pixel that may be one beyond the image, or, mirrored, in the one next to it.
int wrapped_pixel(int i, int size, uint wrap) {
    if (wrap == WRAP_CLAMP) return clamp(i, 0, size - 1);
    if (wrap == WRAP_MIRROR) {
        i = i < 0 ? -1 - i : i;
        i = i >= size ? 2 * size - 1 - i : i;
        return max(i, 0);
    }
    i = i < 0 ? i + size : i;
    return i >= size ? i - size : i;
}

// IEC 61966-2-1: of a code in [0, 1]. The power 2.4 is y²·√y^0.8, the last by a polynomial with a relative error below 2.5e-6:
// Vulkan's pow may be off by much more.
vec3 srgb_to_linear(vec3 code) {
    vec3 y = (code + 0.055) * (1.0 / 1.055);
    vec3 s = sqrt(y);
    vec3 power = 0.57962281 + s * -0.12512471;
    power = 1.3214047 + s * (-1.1546037 + s * power);
    power = 0.03118247 + s * (1.3884624 + s * (-1.0409463 + s * power));
    return mix(y * y * power, code * (1.0 / 12.92), lessThanEqual(code, vec3(0.04045)));
}

vec4 codes_of_word(uint word) {
    return vec4(word & 0xffu, (word >> 8) & 0xffu, (word >> 16) & 0xffu, word >> 24) * (1.0 / 255.0);
}

vec4 codes_of_words(uvec2 words) {
    return vec4(words.x & 0xffffu, words.x >> 16, words.y & 0xffffu, words.y >> 16) * (1.0 / 65535.0);
}

vec4 image_pixel(uvec4 head, int i, int j) {
    int blocks = int((head.y & 0xffffu) + 1u) >> 1;
    int block = (j >> 1) * blocks + (i >> 1);
    int first = int(head.x);
    vec4 value;
    if ((head.z & TEXTURE_FLOATS) != 0u) {
        value = uintBitsToFloat(texture_texel(first + 4 * block + 2 * (j & 1) + (i & 1)));
    } else if ((head.z & TEXTURE_CODES_16) != 0u) {
        uvec4 row = texture_texel(first + 2 * block + (j & 1));
        value = codes_of_words((i & 1) != 0 ? row.zw : row.xy);
    } else {
        uvec4 four = texture_texel(first + block);
        uvec2 two = (j & 1) != 0 ? four.zw : four.xy;
        value = codes_of_word((i & 1) != 0 ? two.y : two.x);
    }
    if ((head.z & TEXTURE_SRGB) != 0u && MUTATION != MUTATE_SRGB) value.rgb = srgb_to_linear(value.rgb);
    return value;
}

// A texture's value at the coordinates of both sets.
vec4 texture_value(uint number, vec4 uvs) {
    int row = int(TEXTURE_ROWS + 3u * number);
    uvec4 head = texture_texel(row);
    vec3 to_u = uintBitsToFloat(texture_texel(row + 1).xyz);
    vec3 to_v = uintBitsToFloat(texture_texel(row + 2).xyz);
    vec3 uv = vec3((head.z & TEXTURE_SECOND_UV) != 0u ? uvs.zw : uvs.xy, 1.0);
    uint wrap_u = head.z & 3u;
    uint wrap_v = (head.z >> TEXTURE_WRAP_V) & 3u;
    ivec2 size = ivec2(head.y & 0xffffu, head.y >> 16);
    bool nearest = (head.z & TEXTURE_NEAREST) != 0u;
    vec2 place = vec2(wrapped(dot(to_u, uv), wrap_u), wrapped(dot(to_v, uv), wrap_v)) * vec2(size) - (nearest ? 0.0 : 0.5);
    ivec2 at = ivec2(floor_int(place.x), floor_int(place.y));
    vec2 f = nearest ? vec2(0.0) : place - vec2(at);
    int i = wrapped_pixel(at.x, size.x, wrap_u);
    int j = wrapped_pixel(at.y, size.y, wrap_v);
    vec4 value = image_pixel(head, i, j);
    if (!nearest) {
        int right = wrapped_pixel(at.x + 1, size.x, wrap_u);
        int below = wrapped_pixel(at.y + 1, size.y, wrap_v);
        value = mix(mix(value, image_pixel(head, right, j), f.x), mix(image_pixel(head, i, below), image_pixel(head, right, below), f.x),
                    f.y);
    }
    return value;
}

#endif
