/* Occlusion rays against triangles. Without Embree (VSH_EMBREE not defined) no vsh_triangles ever exists. */
#ifndef VSHI_EMBREE_H
#define VSHI_EMBREE_H

#include "base/segment.h"

#include <stdbool.h>
#include <vdbshade/trace.h>

/* Whether each of `count` rays meets a triangle. Thread safe. */
void vshi_triangles_blocked(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                            bool *blocked);

#endif
