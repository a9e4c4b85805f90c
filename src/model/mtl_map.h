/* The texture that a statement of an MTL names (Wavefront, "MTL material format", 1995): "map_d -clamp on
 * -imfchan r my leaf.png". */
#ifndef VSHI_MTL_MAP_H
#define VSHI_MTL_MAP_H

#include "model/scan.h"

#include <stdbool.h>

typedef struct vshi_mtl_map {
    vshi_token name;  /* of the file, all that follows the options; text NULL: there is none */
    int32_t channel;  /* VSH_MASK_CHANNEL_…: -imfchan */
    bool clamp;       /* -clamp on */
    double offset[2]; /* -o: looked up at scale × uv + offset */
    double scale[2];  /* -s */
    vshi_token other; /* an option that changes values or places, and is not taken; text NULL: none */
} vshi_mtl_map;

/* Reads what stands behind the keyword, up to `end`. False where an option, `other`, is unknown or lacks its
 * value. */
bool vshi_mtl_map_read(const char *at, const char *end, vshi_mtl_map *map);

/* The file of that name beside the MTL at `path`, in new memory; where none is called so, and a name has '\'
 * in it, those are '/'. NULL: memory is short. */
char *vshi_mtl_map_path(const char *path, vshi_token name);

#endif
