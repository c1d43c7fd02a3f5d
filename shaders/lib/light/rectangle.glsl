// Emitting rectangles that look large, sampled uniformly by solid angle (Ureña, Fajardo and King, "An area-preserving
// parametrization for spherical rectangles", EGSR 2013). By area, an emitter near a surface is sampled where it is far as often as
// where it is near, although the near part sends most of the light.
//
// The paper's angles between great circles cancel where a rectangle looks small. Here the solid angle is the sum over the
// corners of ±atan(x y/(|z| r)), (x, y, z) a corner at distance r in the frame of the rectangle; what is sampled follows
// from the same four numbers. From SOLID_ANGLE on, in single precision, the density is right to 1e-7 in the median, 1e-4 at worst,
// and so is the share of the solid angle up to a sampled point; for strips of 1:100 to 4e-3 at worst.

#ifndef RECTANGLE_GLSL
#define RECTANGLE_GLSL

#include "light.glsl"

// From which solid angle on rectangles are sampled by it, sr. Smaller ones look alike from everywhere on them.
const float SOLID_ANGLE = 0.1;

// A rectangle as it is seen from a point, in a frame around that point.
struct SeenRectangle {
    vec2 lo;            // its extent along its edges
    vec2 hi;
    float depth;        // where it is along the normal of its front: below 0 if that is seen
    float turn;         // of the sampled angle: where it begins
    float solid_angle;
};

// Solid angle of the rectangle from (0, 0) to (x, y) in the plane at z, with the signs of x and y.
float corner_angle(float x, float y, float z) { return atan_accurate(x * y / (abs(z) * sqrt(x * x + y * y + z * z))); }

SeenRectangle seen_rectangle(Light l, vec3 from) {
    vec3 v0 = l.a;
    vec3 normal = l.normal;
    SeenRectangle r;
    vec3 along = l.b - v0;
    vec3 across = l.c - v0;
    float width = length(along);
    float height = length(across);
    vec3 to = v0 - from;
    r.lo = vec2(dot(to, along / width), dot(to, across / height));
    r.hi = r.lo + vec2(width, height);
    r.depth = dot(to, normal);
    float lo_lo = corner_angle(r.lo.x, r.lo.y, r.depth);
    float lo_hi = corner_angle(r.lo.x, r.hi.y, r.depth);
    float hi_lo = corner_angle(r.hi.x, r.lo.y, r.depth);
    float hi_hi = corner_angle(r.hi.x, r.hi.y, r.depth);
    r.turn = lo_lo - lo_hi;
    r.solid_angle = (hi_hi - lo_hi) - (hi_lo - lo_lo);
    return r;
}

// Whether it is sampled by solid angle.
bool looks_large(SeenRectangle r) { return r.depth < 0.0 && r.solid_angle >= SOLID_ANGLE; }

// Where on the rectangle u chooses, as shares of its edges.
vec2 rectangle_point(SeenRectangle r, vec2 u) {
    float z2 = r.depth * r.depth;
    float b0 = -r.lo.y / sqrt(r.lo.y * r.lo.y + z2);
    float b1 = r.hi.y / sqrt(r.hi.y * r.hi.y + z2);
    // What lies below x has the share u.x of the solid angle.
    vec2 angle = cos_sin_2pi((r.turn - u.x * r.solid_angle) * (1.0 / TWO_PI));
    float c = -angle.x * b0 - b1;
    float s2 = angle.y * angle.y * (z2 / (r.lo.y * r.lo.y + z2));
    float x = -r.depth * (c < 0.0 ? -angle.y : angle.y) / sqrt(fast_max(c * c - s2, 1e-30));
    x = fast_min(fast_max(x, r.lo.x), r.hi.x);
    // Of the line at x, what lies below y has the share u.y of the angle's sine.
    float d2 = x * x + z2;
    float h0 = r.lo.y / sqrt(d2 + r.lo.y * r.lo.y);
    float h1 = r.hi.y / sqrt(d2 + r.hi.y * r.hi.y);
    float h = h0 + u.y * (h1 - h0);
    float y = h * sqrt(d2 / fast_max(1.0 - h * h, 1e-30));
    return (vec2(x, fast_min(fast_max(y, r.lo.y), r.hi.y)) - r.lo) / (r.hi - r.lo);
}

#endif
