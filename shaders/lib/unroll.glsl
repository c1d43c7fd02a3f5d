// BODY(n) for each n below COUNT, a specialization constant: written out, since constants have names and no index.

#ifndef UNROLL_GLSL
#define UNROLL_GLSL

#define FOR_0_TO_7(COUNT, BODY) \
    if (COUNT > 0u) { BODY(0) } if (COUNT > 1u) { BODY(1) } \
    if (COUNT > 2u) { BODY(2) } if (COUNT > 3u) { BODY(3) } \
    if (COUNT > 4u) { BODY(4) } if (COUNT > 5u) { BODY(5) } \
    if (COUNT > 6u) { BODY(6) } if (COUNT > 7u) { BODY(7) }

#define FOR_0_TO_15(COUNT, BODY) \
    FOR_0_TO_7(COUNT, BODY) \
    if (COUNT > 8u) { BODY(8) } if (COUNT > 9u) { BODY(9) } \
    if (COUNT > 10u) { BODY(10) } if (COUNT > 11u) { BODY(11) } \
    if (COUNT > 12u) { BODY(12) } if (COUNT > 13u) { BODY(13) } \
    if (COUNT > 14u) { BODY(14) } if (COUNT > 15u) { BODY(15) }

#define FOR_16_TO_31(COUNT, BODY) \
    if (COUNT > 16u) { BODY(16) } if (COUNT > 17u) { BODY(17) } \
    if (COUNT > 18u) { BODY(18) } if (COUNT > 19u) { BODY(19) } \
    if (COUNT > 20u) { BODY(20) } if (COUNT > 21u) { BODY(21) } \
    if (COUNT > 22u) { BODY(22) } if (COUNT > 23u) { BODY(23) } \
    if (COUNT > 24u) { BODY(24) } if (COUNT > 25u) { BODY(25) } \
    if (COUNT > 26u) { BODY(26) } if (COUNT > 27u) { BODY(27) } \
    if (COUNT > 28u) { BODY(28) } if (COUNT > 29u) { BODY(29) } \
    if (COUNT > 30u) { BODY(30) } if (COUNT > 31u) { BODY(31) }

#endif
