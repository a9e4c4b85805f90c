/* Occlusion rays against triangles. Without Embree (VSH_EMBREE not defined) no vsh_triangles ever exists. */
#ifndef VSHI_EMBREE_H
#define VSHI_EMBREE_H

#include "caster/sheet.h"

#include <stdbool.h>
#include <vdbshade/trace.h>

/* A ray in world space, from `origin` up to `far` along the unit `direction`. */
typedef struct vshi_segment_ray {
    double origin[3];
    double direction[3];
    double far; /* may be infinite */
} vshi_segment_ray;

/* Whether each of `count` rays meets a triangle. Thread safe. */
void vshi_triangles_blocked(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                            bool *blocked);

/* Whether every ray of each of `count` beams, in world space, meets a triangle; false also where that cannot be told
 * from `most` triangles that hang together. Thread safe. */
void vshi_triangles_cut(const vsh_triangles *triangles, const vshi_sheet_beam *beams, size_t count, int most,
                        bool *cut);

#endif
