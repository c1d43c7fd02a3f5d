// Point lights: isotropic, total power Φ. Irradiance at distance r: Φ cosθ/(4π r²); reflected by a diffuse surface:
// radiance = Φ/(4π r²)·ρ/π·cosθ. light_texels hold, for each light, position and then Φ/(4π²).

#ifndef POINT_GLSL
#define POINT_GLSL

#include "../layout.glsl"
#include "../math.glsl"

layout(constant_id = 200) const float POINT_X = 0.0;    // the only light, where there is only one
layout(constant_id = 201) const float POINT_Y = 0.0;
layout(constant_id = 202) const float POINT_Z = 0.0;
layout(constant_id = 203) const float POINT_R = 0.0;
layout(constant_id = 204) const float POINT_G = 0.0;
layout(constant_id = 205) const float POINT_B = 0.0;

struct PointLight {
    vec3 position;
    vec3 intensity;     // Φ/(4π²)
};

PointLight point_light(uint i) {
    if (LIGHT_COUNT == 1u) return PointLight(vec3(POINT_X, POINT_Y, POINT_Z), vec3(POINT_R, POINT_G, POINT_B));
    return PointLight(texelFetch(light_texels, int(2u * i)).xyz, texelFetch(light_texels, int(2u * i + 1u)).xyz);
}

#endif
