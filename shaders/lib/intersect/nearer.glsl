// Which of two hits a ray meets first.

#ifndef NEARER_GLSL
#define NEARER_GLSL

// Whether a hit at distance t, of the primitive `id`, is nearer than another, whatever the order in which they are found: of equal
// distances the lower id wins. (What is as far away as the far end, whose id is -1, is not met.)
bool is_nearer(float t, int id, float other_t, int other_id) { return t < other_t || (t == other_t && id < other_id); }

#endif
