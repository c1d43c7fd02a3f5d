// The stack of a walk: groups (node.glsl), at most one for each level of the tree.
//
// In a tree of few levels it is a shift register. A CPU driver stores into an array lane by lane, each behind a branch;
// to move a dozen registers by one costs less. Where lanes are threads it is an array.

#ifndef STACK_GLSL
#define STACK_GLSL

#include "../layout.glsl"

const int SHORT_LEVELS = 16;
const bool SHORT_STACK = !THREADS && TREE_LEVELS <= uint(SHORT_LEVELS);
const int MOST_LEVELS = 64;         // two more than any tree has (accel::MAX_DEPTH)

struct Stack {
    uint levels[SHORT_LEVELS + 1];  // the top first, and groups without members below the bottom; or, in deep_stack,
    int top;                        // the number of groups
};

uint deep_stack[MOST_LEVELS];

Stack stack_empty() {
    // A group without members ends the walk, which may ask what is below it.
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

// Returns the group on top, and puts another one there, or takes it away, or neither.
uint stack_shift(inout Stack s, uint group, bool push, bool pop) {
    if (SHORT_STACK) {
        uint old[SHORT_LEVELS + 1] = s.levels;
        s.levels[0] = push ? group : (pop ? old[1] : old[0]);
#define SHIFT(n) if (n < TREE_LEVELS) s.levels[n] = push ? old[n - 1u] : (pop ? old[n + 1u] : old[n]);
        SHIFT(1u) SHIFT(2u) SHIFT(3u) SHIFT(4u) SHIFT(5u) SHIFT(6u)
        SHIFT(7u) SHIFT(8u) SHIFT(9u) SHIFT(10u) SHIFT(11u) SHIFT(12u)
        SHIFT(13u) SHIFT(14u) SHIFT(15u)
#undef SHIFT
        return old[0];
    }
    uint top = deep_stack[s.top - 1];
    // Unconditional store, conditional count: a masked store costs six times as much on a CPU.
    deep_stack[s.top] = group;
    s.top += push ? 1 : 0;
    s.top -= pop ? 1 : 0;
    return top;
}

#endif
