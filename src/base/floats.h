/* Public calls compute in the default floating-point environment (round to nearest, denormals kept, no traps)
 * and restore the host's. TBB's threads copy it from the thread that makes an arena, so set it before. */
#pragma once

#include <stdint.h>
#include <vdbshade/base.h>

#if !defined(__x86_64__) && !defined(__aarch64__)
#include <fenv.h>
#endif

VSH_BEGIN_C

typedef uint64_t vshi_floats;

#if defined(__x86_64__)

/* MXCSR: all exceptions masked, everything else 0. Its low six bits are flags of past exceptions. */
#define VSHI_FLOATS_DEFAULT 0x1f80u
#define VSHI_FLOATS_FLAGS 0x3fu

static inline vshi_floats vshi_floats_get(void) {
    uint32_t word;
    __asm__ volatile("stmxcsr %0" : "=m"(word) : : "memory");
    return word;
}

static inline void vshi_floats_set(vshi_floats floats) {
    const uint32_t word = (uint32_t)floats;
    __asm__ volatile("ldmxcsr %0" : : "m"(word) : "memory");
}

#elif defined(__aarch64__)

#define VSHI_FLOATS_DEFAULT 0u
#define VSHI_FLOATS_FLAGS 0u

static inline vshi_floats vshi_floats_get(void) {
    uint64_t word;
    __asm__ volatile("mrs %0, fpcr" : "=r"(word) : : "memory");
    return word;
}

static inline void vshi_floats_set(vshi_floats floats) {
    __asm__ volatile("msr fpcr, %0" : : "r"(floats) : "memory");
}

#else /* the rounding alone */

#define VSHI_FLOATS_DEFAULT ((vshi_floats)FE_TONEAREST)
#define VSHI_FLOATS_FLAGS 0u

static inline vshi_floats vshi_floats_get(void) {
    return (vshi_floats)fegetround();
}

static inline void vshi_floats_set(vshi_floats floats) {
    fesetround((int)floats);
}

#endif

/* Writing the register takes longer than reading it, and hardly any host changes it. */
static inline int vshi_floats_differ(vshi_floats floats) {
    return (floats & ~(vshi_floats)VSHI_FLOATS_FLAGS) != VSHI_FLOATS_DEFAULT;
}

static inline vshi_floats vshi_floats_begin(void) {
    const vshi_floats host = vshi_floats_get();
    if (vshi_floats_differ(host)) {
        vshi_floats_set(VSHI_FLOATS_DEFAULT);
    }
    return host;
}

static inline void vshi_floats_end(const vshi_floats *host) {
    if (vshi_floats_differ(*host)) {
        vshi_floats_set(*host);
    }
}

VSH_END_C

/* Put this first in a public function: it sets the default environment until the function returns. */
#define VSHI_FLOATS                                                                                          \
    const vshi_floats host_floats __attribute__((cleanup(vshi_floats_end), unused)) = vshi_floats_begin()
