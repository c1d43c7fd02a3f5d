// The order in which pixels are handed out. 64 consecutive slots are a tile of 8×8 pixels: eight groups of 4×2 pixels, in
// a block of 32×64 pixels that 32 tiles share. Paths are reused within a group (reuse.glsl): its pixels see most alike
// surfaces. Where an image is made from gradients, half of the samples are taken with groups that lie half a
// group further to the right and down, so that every two neighbours are of one group in some samples.

#ifndef PIXEL_ORDER_GLSL
#define PIXEL_ORDER_GLSL

#include "layout.glsl"

const uint TILE_BITS = 6u;
const uint TILE = 1u << TILE_BITS;  // slots of a tile
const uint MEMBERS = 8u;        // of a group
const uint GROUP_BITS = 3u;     // log2 of the groups of a tile

// Which member of its group a pixel is, and the same group's pixel of another member. Likewise for paths, the lowest bits of whose
// numbers are those of their pixels.
uint member_of(uint p) { return p >> GROUP_BITS & (MEMBERS - 1u); }
uint for_member(uint p, uint member) { return p & ~((MEMBERS - 1u) << GROUP_BITS) | member << GROUP_BITS; }

// The pixel of such a number where the members of a group come one after another.
uint pixel_in_groups(uint number) { return for_member(number & ~(TILE - 1u) | number / MEMBERS % MEMBERS, number % MEMBERS); }

// A workgroup of path_queue.comp takes several tiles side by side if each gets few samples: at the end of its work lanes are
// idle. Their number is a power of two, of which the first one's is a multiple, so that they are in one block. Their pixels
// are numbered one tile after another.
uint work_pixels = TILE << tile_bits;

// The upper left pixel of a tile.
uvec2 tile_corner(uint tile) {
    uint blocks_x = (width + 31u) / 32u;
    uint block = tile / 32u;
    uvec2 tile_of_block = uvec2(tile & 3u, (tile >> 2) & 7u);
    uint row = block / blocks_x;
    return uvec2(32u, 64u) * uvec2(block - row * blocks_x, row) + 8u * tile_of_block;
}

// A pixel of a tile, or of several, relative to the first one's corner: bits 0 to 2 of its number tell the group, 3 to 5 the
// member, those above the tile.
uvec2 place_in_tile(uint p) {
    uvec2 tile = uvec2(p >> TILE_BITS & 3u, p >> (TILE_BITS + 2u));
    return 8u * tile + uvec2((p & 1u) << 2 | (p >> 3 & 3u), (p & 6u) | (p >> 5 & 1u));
}

// Scattered, a workgroup's tile is made of one group of each of eight tiles, which are neighbours: two rows of four.
const uint SCATTERED_TILES = 8u;
bool is_scattered() { return REUSE && in_mode(MODE_SCATTERED); }

// What pixel p of a scattered tile is in its own tile.
uint scattered_pixel(uint p) { return p & (7u << GROUP_BITS) | (p * 3u + (modes >> MODES_TURN)) % MEMBERS; }

// The slot of pixel p of the tiles, or of the scattered ones, whose first begins at slot `tile`.
uint slot_of_tile(uint tile, uint p) {
    return is_scattered() ? tile + p % SCATTERED_TILES * TILE + scattered_pixel(p) : tile + p;
}

// The slot that an invocation works on, where each has one; where paths are reused, groups lie side by side.
uint slot_of_invocation(uint number) {
    uint p = number % TILE;
    if (REUSE) p = pixel_in_groups(p);
    return slot_of_tile(first_slot + number / TILE * tile_step * TILE, p);
}

// The number of the pixel at column and row `at`.
uint pixel_number(uvec2 at) { return at.y * width + at.x; }

// Columns of all blocks side by side, and the first row of the film's band: a division takes eight on a CPU, one for each lane.
uint columns = (width + 31u) / 32u * 32u;
uint band_top = band_first / (64u * columns) * 64u;

// A pixel of the tile with such a corner. What is shifted out of the film's band comes in again on the other side.
uvec2 pixel_of_tile(uvec2 corner, uint p) {
    uvec2 at = corner + place_in_tile(p);
    if (REUSE && in_mode(MODE_SHIFTED)) {
        at += uvec2(2u, 1u);
        at.x -= at.x >= columns ? columns : 0u;
        at.y -= at.y >= band_top + band_rows ? band_rows : 0u;
    }
    return at;
}

// The pixel that a workgroup works on, whose first tile has such a corner.
uvec2 pixel_of_work(uvec2 corner, uint p) {
    if (!is_scattered()) return pixel_of_tile(corner, p);
    return corner + 8u * uvec2(p & 3u, p >> 2 & 1u) + place_in_tile(scattered_pixel(p));
}

// Column and row of the pixel that a slot stands for in the dispatch; false for what pads the blocks at the right and lower
// edge.
bool pixel_of_slot(uint slot, out uvec2 at) {
    at = pixel_of_tile(tile_corner(slot / TILE), slot % TILE);
    return at.x < width && at.y < height;
}

// Where the film holds the pixel that a slot stands for.
uint film_slot(uint slot) {
    if (!REUSE || !in_mode(MODE_SHIFTED)) return slot;
    uvec2 at = pixel_of_tile(tile_corner(slot / TILE), slot % TILE);
    uint block = (at.y >> 6) * ((width + 31u) / 32u) + (at.x >> 5);
    uint tile = block << 5 | (at.y >> 3 & 7u) << 2 | (at.x >> 3 & 3u);
    return tile << 6 | (at.y & 1u) << 5 | (at.x & 3u) << 3 | (at.y & 6u) | (at.x >> 2 & 1u);
}

#endif
