// What kernels fetch of the scene when they begin.

#ifndef SCENE_GLSL
#define SCENE_GLSL

#include "light/choice.glsl"
#include "surface.glsl"

void load_scene() {
    load_intersection();
    load_point();
    load_lights();
    load_constants();
}

#endif
