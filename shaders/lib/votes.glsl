// Votes among the lanes of a subgroup, for kernels that only CPUs execute, where paths are shared or rays queued, and for rays that
// are timed (probe/traverse.comp). There a driver makes a loop over the lanes of a vote or a ballot, through memory, and straight code of a sum (lavapipe 25.0.7: rooms of spheres
// whose paths are shared take .81 to .86 of the time with sums).

#ifndef VOTES_GLSL
#define VOTES_GLSL

// In how many lanes this holds, and whether in any.
uint lanes(bool wanted) { return subgroupAdd(wanted ? 1u : 0u); }
bool any_lane(bool wanted) { return lanes(wanted) > 0u; }

#endif
