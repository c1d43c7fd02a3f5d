// The order in which pixels are handed out: tiles of 8×8, so that neighbouring lanes trace neighbouring rays.

#ifndef PIXEL_ORDER_GLSL
#define PIXEL_ORDER_GLSL

#include "layout.glsl"

// Which part of the work this workgroup takes. Drivers on CPUs give each thread an equal share of consecutive
// workgroups; a stride that has no divisor in common with their number spreads each share over the whole image, so that
// none gets all of the costly pixels.
uint group_of_work() { return gl_WorkGroupID.x * group_stride % gl_NumWorkGroups.x; }

// The pixel of a slot; false for slots that pad the tiles at the right and lower edge.
bool pixel_of_slot(uint slot, out uint pixel) {
    uint tiles_x = (width + 7u) / 8u;
    uint tile = slot / 64u;
    uint x = (tile % tiles_x) * 8u + (slot & 7u);
    uint y = (tile / tiles_x) * 8u + ((slot >> 3) & 7u);
    pixel = y * width + x;
    return x < width && y < height;
}

#endif
