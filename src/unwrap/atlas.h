/* What an atlas holds. */
#ifndef VSHI_UNWRAP_ATLAS_H
#define VSHI_UNWRAP_ATLAS_H

#include "unwrap/pack.h"
#include "unwrap/shapes.h"

/* --- the pages of an atlas: what lies on each, and how large each is */

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

/* --- the atlas */

/* The arrays that instances share. Vertices of charts come first, chart by chart; then those of triangles
 * without area. */
typedef struct vshi_atlas_shape {
    uint32_t *sources;      /* [vertex_count] */
    uint32_t *indices;      /* [triangle_count][3] */
    uint32_t *vertex_chart; /* [chart_vertices]: chart, from 0, of the shape */
    uint32_t *patch_vertex; /* [chart_vertices]: its vertex in the patch */
    uint32_t *charts;       /* [triangle_count]: chart, from 0, of the shape, or VSH_NO_CHART */
    size_t vertex_count, chart_vertices, triangle_count, chart_count;
} vshi_atlas_shape;

struct vsh_atlas {
    vshi_atlas_shape *shapes; /* [shape_count] */
    size_t shape_count;
    vsh_atlas_mesh *meshes; /* [mesh_count]; sources and indices belong to their shapes */
    float **uvs;            /* [mesh_count] */
    uint32_t **mesh_charts; /* [mesh_count] */
    size_t mesh_count;
    vsh_atlas_chart *charts; /* [info.charts] */
    vsh_atlas_page *pages;   /* [info.pages] */
    vsh_atlas_info info;
};

/* Bytes that a shape's part and each of its instances' take, at most. */
double vshi_atlas_shape_bytes(size_t triangle_count);
double vshi_atlas_mesh_bytes(size_t triangle_count);

/* Makes an atlas of charts that have their places: `items` [item_count] are those of the meshes in their
 * order, and of each mesh of its shape's patches in theirs. The atlas takes the pages' list. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_atlas_make(size_t mesh_count, const vshi_shapes *shapes, vshi_pages *pages,
                           const vshi_item *items, size_t item_count, vsh_atlas **atlas, vsh_error *error);

#endif
