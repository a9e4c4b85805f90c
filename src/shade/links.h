/* Which neighbouring texels lie next to each other in the world too. */
#ifndef VSHI_LINKS_H
#define VSHI_LINKS_H

#include "shade/window.h"

#include <vdbshade/shade.h>

/* Sets `left` and `above` of texels [height][width]. `at`: the number of each one's point + 1, 0: none. */
void vshi_links_find(const vsh_points *points, const uint32_t *at, int32_t width, int32_t height,
                     vshi_window_texel *texels);

#endif
