// Gradients of the image (Lehtinen et al., "Gradient-domain Metropolis light transport", SIGGRAPH 2013; Kettunen et al.,
// "Gradient-domain path tracing", SIGGRAPH 2015), for the light that comes to a pixel by what its group shares: second hits,
// and random numbers for lights (reuse.glsl). All pixels of a group err alike: the difference between two neighbours is known
// much better than either of them. The film records the sum of that light, and of its differences from the neighbours on the
// right and below, over the samples in which these are of the same group. From both the host makes the image
// (src/render/gradient/develop.rs).
//
// A slot has 3 texels: that sum, and the two of differences. Each is there with the difference between the two samples of
// the pilot pass (reuse.glsl), from which the host learns how large its noise is; the first with that of what this
// light would be without the group. The film holds the same for all other light of the pixel.
//
// Which differences are small depends on the surfaces. Before a rendering the host finds the place of the diffuse surface at
// the centre of each pixel, also if that is seen in mirrors (first_hit.comp, src/render/gradient/surfaces.rs).

#ifndef GRADIENT_GLSL
#define GRADIENT_GLSL

#include "film.glsl"
#include "pixel_order.glsl"

// Samples of a pixel of which gradients are recorded. More would be lost in the rounding of their sums.
const uint MOST_GRADIENTS = 4096u;

const uint PILOT_SAMPLES = 2u;          // samples

struct Gradients {
    vec4 light;
    vec4 right;
    vec4 down;
};

Gradients gradients_load(uint slot) {
    int row = int(GRADIENT_ROWS * (slot - band_first));
    return Gradients(uintBitsToFloat(imageLoad(gradient_texels, row)), uintBitsToFloat(imageLoad(gradient_texels, row + 1)),
                     uintBitsToFloat(imageLoad(gradient_texels, row + 2)));
}

void gradients_store(uint slot, Gradients g) {
    uint row = GRADIENT_ROWS * (slot - band_first);
    [[dont_unroll]] for (uint i = 0u; i < GRADIENT_ROWS; ++i) {
        gradient_rows[row + i] = i == 0u ? g.light : (i == 1u ? g.right : g.down);
    }
}

// Whether a member of a group has a neighbour in it on the right.
bool has_right(uint member) { return (member & 3u) != 3u; }

// What a pixel's sample `index` counts in the pilot pass.
float pilot_sign(uint index) { return index < PILOT_SAMPLES / 2u ? 1.0 : (index < PILOT_SAMPLES ? -1.0 : 0.0); }

// Adds sample `index` of a pixel, of whose light the group has gathered a part that would be so bright without the others.
void gradients_add(inout Gradients g, uint index, vec3 gathered, float unshared, vec3 right, vec3 down) {
    if (index >= MOST_GRADIENTS) return;
    float pilot = pilot_sign(index);
    g.light += vec4(gathered, pilot == 0.0 ? 0.0 : pilot * unshared);
    g.right += vec4(right, pilot * brightness(right));
    g.down += vec4(MUTATION == MUTATE_GRADIENTS ? -down : down, pilot * brightness(down));
}

#endif
