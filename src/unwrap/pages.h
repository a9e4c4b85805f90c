/* The pages of an atlas: what lies on each, and how large each is. */
#ifndef VSHI_UNWRAP_PAGES_H
#define VSHI_UNWRAP_PAGES_H

#include "unwrap/pack.h"
#include "unwrap/shapes.h"

typedef struct vshi_pages {
    vsh_atlas_page *list; /* [count]: without what is counted of charts; to be freed */
    size_t count;
} vshi_pages;

/* Gives each item its place, as the options have it: items are those of the meshes in their order, which are
 * instances of shapes. The stage is "pack". Errors: as vshi_pack(), with the object's name where it has a
 * page of its own; VSH_ERROR_LIMIT (run->memory_limit). */
vsh_result vshi_pages_pack(const vsh_unwrap_options *options, const vsh_mesh *meshes, size_t mesh_count,
                           const vshi_shapes *shapes, vshi_item *items, size_t item_count, const vsh_run *run,
                           vshi_pages *pages, vsh_error *error);

#endif
