// Rays and hits, as whatever intersects rays with the scene takes and gives them (intersect/intersect.glsl).

#ifndef RAY_GLSL
#define RAY_GLSL

struct Ray {
    vec3 origin;
    vec3 direction;
    int self_id;        // of the surface that the ray leaves (with INSIDE on a sphere's inner side), or -1
};

struct Hit {
    float t;
    int primitive;      // its number in geometry.glsl; -1: the ray meets nothing
    int instance;       // 0: instances are primitives of their own
    vec2 barycentrics;  // of a triangle: weights of its vertices 1 and 2; known once surface_at has been called (surface.glsl)
    int self_id;        // handle by which rays that leave the surface name it; only code in intersect/ knows what it means
};

#endif
