/* Measures Embree: traces the rays of truth_mesh_light() and truth_mesh_ao() in each way that could be the
 * fastest. Values may differ from the truth by single rays, because packets and single rays use other code.
 */
#pragma once

#include "embree.h"

/* rtcOccluded1; packets of 8 and 16 rays of one point; packets of one ray of 8 and 16 successive points. */
enum {
    TRUTH_LONE_RAYS,
    TRUTH_POINT_8,
    TRUTH_POINT_16,
    TRUTH_NEIGHBOURS_8,
    TRUTH_NEIGHBOURS_16,
    TRUTH_PACKINGS
};

/* "occluded1", "occluded8 of a point" …; a static string. */
const char *truth_packing_name(int packing);

typedef struct truth_question {
    size_t count;
    const double *origins; /* [count][3] */
    const float *normals;  /* [count][3], unit; NULL: shadows without a horizon */
    const double *towards; /* [3], towards the light; NULL: AO */
    double w;              /* the light's radius at unit distance */
    double distance;       /* AO distance */
    size_t rays;
} truth_question;

/* Answers [count], 0 dark … 1; `threads` 0: all cores. Returns 0, or -1 without enough threads or memory,
 * or without Embree. */
int truth_mesh_packets(const truth_mesh *truth, int packing, const truth_question *question, int threads,
                       float *values);
