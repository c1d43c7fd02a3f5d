// The stack of a traversal: groups (node.glsl), at most one for each level of the BVH.
//
// In a BVH of few levels it is a shift register. A CPU driver stores into an array lane by lane, each behind a branch;
// to move a dozen registers by one costs less. Where lanes are threads it is an array.

#ifndef STACK_GLSL
#define STACK_GLSL

#include "../../layout.glsl"

const int SHORT_LEVELS = 16;
const bool SHORT_STACK = !THREADS && STACK_LEVELS <= uint(SHORT_LEVELS);
const int MOST_LEVELS = 64;         // two more than any BVH has (accel::MAX_DEPTH)

struct Stack {
    uint levels[SHORT_LEVELS + 1];  // the top first, and groups without members below the bottom; or, in deep_stack,
    int top;                        // the number of groups
};

uint deep_stack[MOST_LEVELS];

Stack stack_empty() {
    // A group without members ends the traversal, which may ask what is below it.
    deep_stack[0] = deep_stack[1] = 0u;
    return Stack(uint[](0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u), 2);
}

// Of threads, in deep_stack.
void stack_push(inout Stack s, uint group) {
    deep_stack[s.top] = group;
    s.top += 1;
}

uint stack_pop(inout Stack s) {
    s.top -= 1;
    return deep_stack[s.top];
}

// The group on top.
uint stack_top(Stack s) { return SHORT_STACK ? s.levels[0] : deep_stack[s.top - 1]; }

// Puts a group on top, or takes away what is there, or neither.
//
// What is written is not needed any more: a push goes from the bottom up, a pop from the top down. Were all levels written at once, a
// driver that keeps each in a variable would copy each twice, which took meshes 1.015 to 1.04 times the instructions (lavapipe 25.0.7).
void stack_shift(inout Stack s, uint group, bool push, bool pop) {
    if (SHORT_STACK) {
#define PUSH(n) if (n < STACK_LEVELS) s.levels[n] = push ? s.levels[n - 1u] : s.levels[n];
        PUSH(15u) PUSH(14u) PUSH(13u) PUSH(12u) PUSH(11u) PUSH(10u) PUSH(9u) PUSH(8u)
        PUSH(7u) PUSH(6u) PUSH(5u) PUSH(4u) PUSH(3u) PUSH(2u) PUSH(1u)
#undef PUSH
        s.levels[0] = push ? group : s.levels[0];
#define POP(n) if (n < STACK_LEVELS) s.levels[n] = pop ? s.levels[n + 1u] : s.levels[n];
        POP(0u) POP(1u) POP(2u) POP(3u) POP(4u) POP(5u) POP(6u) POP(7u)
        POP(8u) POP(9u) POP(10u) POP(11u) POP(12u) POP(13u) POP(14u) POP(15u)
#undef POP
        return;
    }
    // Unconditional store, conditional count: a masked store costs six times as much on a CPU.
    deep_stack[s.top] = group;
    s.top += push ? 1 : 0;
    s.top -= pop ? 1 : 0;
}

#endif
