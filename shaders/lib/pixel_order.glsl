// The order in which pixels are handed out. 64 consecutive slots are a tile: eight patches of 4×2 pixels, each 16
// pixels away from the next, in a block of 32×64 pixels that 32 tiles share. Neighbouring lanes trace neighbouring rays;
// and pixels with the same place in the patches are a group whose paths are reused for each other (reuse.glsl): far
// enough apart that the noise which they then have in common is not seen as blotches, near enough to see alike surfaces.

#ifndef PIXEL_ORDER_GLSL
#define PIXEL_ORDER_GLSL

#include "layout.glsl"

const uint TILE = 64u;          // slots of a tile
const uint PATCH_BITS = 3u;     // log2 of the slots of a patch
const uint PATCHES = 8u;        // of a tile

// Which part of the work this workgroup takes. Drivers on CPUs give each thread an equal share of consecutive
// workgroups; a stride that has no divisor in common with their number spreads each share over the whole image, so that
// none gets all of the costly pixels.
uint group_of_work() { return gl_WorkGroupID.x * group_stride % gl_NumWorkGroups.x; }

// The upper left pixel of a tile.
uvec2 tile_corner(uint tile) {
    uint blocks_x = (width + 31u) / 32u;
    uint block = tile / 32u;
    uvec2 patch_of_block = uvec2(tile & 3u, (tile >> 2) & 7u);
    return uvec2(32u, 64u) * uvec2(block % blocks_x, block / blocks_x) + uvec2(4u, 2u) * patch_of_block;
}

// A pixel of a tile, relative to its corner.
uvec2 place_in_tile(uint p) { return uvec2((p & 3u) + ((p & 8u) << 1), ((p >> 2) & 1u) + (p & 48u)); }

// The slot that an invocation works on, where each has one; where paths are reused, groups lie side by side.
uint slot_of_invocation(uint number) {
    uint p = number % TILE;
    if (REUSE) p = p % PATCHES << PATCH_BITS | p / PATCHES;
    return first_slot + number / TILE * tile_step * TILE + p;
}

// The number of the pixel at column and row `at`.
uint pixel_number(uvec2 at) { return at.y * width + at.x; }

// Column and row of a slot's pixel; false for slots that pad the blocks at the right and lower edge.
bool pixel_of_slot(uint slot, out uvec2 at) {
    at = tile_corner(slot / TILE) + place_in_tile(slot % TILE);
    return at.x < width && at.y < height;
}

#endif
