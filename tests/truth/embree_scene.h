/* An Embree scene of triangles for embree.c and the benchmarks. */
#pragma once

#include "embree.h"

#include <embree3/rtcore.h>

struct truth_mesh {
    RTCDevice device;
    RTCScene scene;
    double center[3]; /* subtracted in double, because Embree uses floats */
};

enum { TRUTH_AT_ONCE = 256 };

/* body(user, begin, end) over 0 … count - 1 in pieces of at most TRUTH_AT_ONCE, on `threads` threads (0: all
 * cores). Returns 0, or -1 if not all threads could be started; the work is done in any case. */
int truth_in_pieces(size_t count, int threads, void (*body)(void *user, size_t begin, size_t end),
                    void *user);
