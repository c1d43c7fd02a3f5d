// Arithmetic that does not depend on the precision of a driver's built-in functions.

#ifndef MATH_GLSL
#define MATH_GLSL

#include "layout.glsl"

const float PI = 3.14159265358979;
const float TWO_PI = 6.28318530717959;
const float GAMMA_7 = 4.2e-7;   // γ(7): what seven roundings may amount to, relative (Higham 2002, section 3.1)
#define INFINITY uintBitsToFloat(0x7f800000u)

// `a < b ? a : b` is one instruction on x86, where the built-ins pay for IEEE NaN rules.
float fast_min(float a, float b) { return a < b ? a : b; }
float fast_max(float a, float b) { return a > b ? a : b; }

bool is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

// The largest whole number that is not above x, for x in [−2^22, 2^22]. Of this sum the last bit stands for 1. A conversion would do
// more: drivers that take care of numbers that are too large do it lane by lane (lavapipe 25: some seventy instructions for eight).
int floor_int(float x) { return floatBitsToInt(floor(x) + 12582912.0) - 0x4b400000; }

// a + b = sum + error exactly (Knuth, TAOCP 2, 4.2.2). `precise` keeps compilers from simplifying it.
void two_sum(float a, float b, out float sum, out float error) {
    precise float s = a + b;
    precise float v = s - a;
    precise float e = (a - (s - v)) + (b - v);
    sum = s;
    error = e;
}

// a·b = product + error exactly (Dekker 1971), by splitting at bit 12: fma() need not be fused.
void two_product(float a, float b, out float product, out float error) {
    precise float p = a * b;
    precise float ca = 4097.0 * a;
    precise float ah = ca - (ca - a);
    precise float al = a - ah;
    precise float cb = 4097.0 * b;
    precise float bh = cb - (cb - b);
    precise float bl = b - bh;
    precise float e = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    product = p;
    error = e;
}

// x without the lower 12 bits of its 24: products of two such numbers, or of one and what another has left, are exact.
float upper_half(float x) { return uintBitsToFloat(floatBitsToUint(x) & 0xfffff000u); }

// (cos, sin) of 2πu for u in [−2, 2]; error < 1.5e-7 absolute. Vulkan's sin and cos may be off by 2^-11.
// Reduced to |a| <= π/4 exactly (quadrants of u), then Taylor polynomials of degree 9 and 8.
vec2 cos_sin_2pi(float u) {
    int quadrant = floor_int(u * 4.0 + 0.5);
    float a = (u - 0.25 * float(quadrant)) * TWO_PI;
    float a2 = a * a;
    float s = a * (1.0 + a2 * (-1.6666667e-1 + a2 * (8.3333333e-3 + a2 * (-1.9841270e-4 + a2 * 2.7557319e-6))));
    float c = 1.0 + a2 * (-0.5 + a2 * (4.1666667e-2 + a2 * (-1.3888889e-3 + a2 * 2.4801587e-5)));
    // What Vulkan allows the built-in functions.
    if (MUTATION == MUTATE_SINCOS) s += 4.8828125e-4;
    bool odd = (quadrant & 1) != 0;
    ivec2 at = floatBitsToInt(odd ? vec2(s, c) : vec2(c, s));
    // Bit 1 becomes the sign.
    return intBitsToFloat(at ^ ((ivec2(quadrant + 1, quadrant) & 2) << 30));
}

// Arc tangent; error < 2e-7 absolute. Vulkan's may be off by 4096 ulp. Of the smaller of |t| and 1/|t| by a polynomial of degree
// 15 in [0, 1], fitted to an error of 5e-8.
float atan_accurate(float t) {
    float a = abs(t);
    bool steep = a > 1.0;
    float x = steep ? 1.0 / a : a;
    float x2 = x * x;
    float series = -5.7773129e-2 + x2 * (2.3039813e-2 - x2 * 4.3553161e-3);
    series = -3.3331659e-1 + x2 * (1.9962702e-1 + x2 * (-1.397657e-1 + x2 * (9.7942018e-2 + x2 * series)));
    float angle = x + x * x2 * series;
    angle = steep ? 0.5 * PI - angle : angle;
    return t < 0.0 ? -angle : angle;
}

// Natural logarithm of a normal x > 0; error < 2 ulp + 1e-7. Vulkan's log may be off by 5% near 1.
// x = m·2^e with m in [√½, √2); log m = 2 atanh((m − 1)/(m + 1)) by its series.
float log_accurate(float x) {
    uint bits = floatBitsToUint(x);
    int e = int(bits - 0x3f3504f3u) >> 23;
    float m = uintBitsToFloat(bits - (uint(e) << 23));
    float r = (m - 1.0) / (m + 1.0);
    float r2 = r * r;
    float series = r2 * (0.33333333 + r2 * (0.2 + r2 * (0.14285714 + r2 * 0.11111111)));
    float allowed = MUTATION == MUTATE_LOG ? 4.7683716e-7 : 0.0;
    return float(e) * 0.69314718 + 2.0 * (r + r * series) + allowed;
}

// Exponential of x <= 0; error < 2 ulp, and 0 below −87. Vulkan's exp may be off by some fifty.
// x = n·ln 2 + r, with ln 2 in two parts, of which the first times n is exact; e^r by its series up to r⁶.
float exp_accurate(float x) {
    float n = floor(x * 1.4426950 + 0.5);
    float r = (x - n * 0.693359375) + n * 2.12194440e-4;
    float series = 0.5 + r * (0.16666667 + r * (4.1666667e-2 + r * (8.3333333e-3 + r * (1.3888889e-3 + r * 1.9841270e-4))));
    float power = 1.0 + (r + r * r * series);
    return x < -87.0 ? 0.0 : uintBitsToFloat(floatBitsToUint(power) + (uint(int(n)) << 23));
}

// Two unit vectors that make a right-handed orthonormal basis with the unit vector n (Duff et al., JCGT 2017).
void basis(vec3 n, out vec3 tangent, out vec3 bitangent) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    tangent = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    bitangent = vec3(b, s + n.y * n.y * a, -n.y);
}

float largest(vec3 v) { return fast_max(fast_max(v.x, v.y), v.z); }

const float BELOW_ONE = 0.99999994;

// Takes one of two ways, the first with probability `share`; what is left of u is as random as before.
bool takes_first(float share, inout float u) {
    bool first = u < share;
    u = fast_min((first ? u : u - share) / (first ? share : 1.0 - share), BELOW_ONE);
    return first;
}

float brightness(vec3 light) { return light.x + light.y + light.z; }

#endif
