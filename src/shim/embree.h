/* Occlusion rays against triangles. Without Embree (VSH_EMBREE not defined) no vsh_triangles ever exists. */
#ifndef VSHI_EMBREE_H
#define VSHI_EMBREE_H

#include "base/segment.h"
#include "caster/sheet.h"

#include <stdbool.h>
#include <vdbshade/trace.h>

/* Whether each of `count` rays meets a triangle. Thread safe. */
void vshi_triangles_blocked(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                            bool *blocked);

/* Whether every ray of each of `count` beams, in world space, meets a triangle; false also where that cannot
 * be told from `most` triangles that hang together. Thread safe. */
void vshi_triangles_cut(const vsh_triangles *triangles, const vshi_sheet_beam *beams, size_t count, int most,
                        bool *cut);

#endif
