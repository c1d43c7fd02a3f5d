// Several invocations for the samples of a pixel. A GPU that holds more invocations than an image has pixels is kept busy that way,
// and a costly pixel does not take longer than all others together.
//
// Each invocation takes samples that follow one another, and records the light of each. Then one of them adds it all up in the order of
// the samples: to the same bits as if it had taken them itself.

#ifndef SPLIT_GLSL
#define SPLIT_GLSL

#include "film.glsl"
#include "work.glsl"

// Pixels of a workgroup, the invocation's number among those of the dispatch, and which of its pixel's invocations it is.
uint split_pixels() { return gl_WorkGroupSize.x / SPLIT; }
uint split_number() {
    uint local = gl_LocalInvocationID.x;
    if (SPLIT > 1u) local %= split_pixels();
    return place_of_work_item(gl_WorkGroupID.x) * split_pixels() + local;
}
uint split_part() { return SPLIT > 1u ? gl_LocalInvocationID.x / split_pixels() : 0u; }

// The invocation's share of a pixel's samples: from which on, and how many.
uvec2 split_share(uint samples) {
    uint each = (samples + SPLIT - 1u) / SPLIT;
    uint begin = min(split_part() * each, samples);
    return uvec2(begin, min(each, samples - begin));
}

const float SPLIT_DONE = 1.0;

// Where the light of a sample is recorded. What is not is 0.
uint split_row(uint nth) { return nth * work_items * split_pixels() + split_number(); }
void split_record(uint nth, vec3 radiance) { path_rows[split_row(nth)] = vec4(radiance, SPLIT_DONE); }

// Adds to the film what has been recorded of a pixel's samples, up to the first that has not ended, and forgets it all. To be called by
// all invocations of a workgroup. Returns how many samples were not finite.
uint split_add(inout FilmPixel p, uint samples) {
    memoryBarrierBuffer();
    barrier();
    uint bad = 0u;
    if (split_part() == 0u) {
        bool complete = true;
        for (uint nth = 0u; nth < samples; ++nth) {
            uint row = split_row(nth);
            vec4 light = path_rows[row];
            complete = complete && light.w == SPLIT_DONE;
            if (complete) bad += film_add(p, light.xyz) ? 0u : 1u;
            path_rows[row] = vec4(0.0);
        }
    }
    return bad;
}

#endif
