/* Types and functions that the files of this folder share: a mesh cut along its creases, its charts, and
 * their places in an atlas. */
#pragma once

#include "base/job.h"
#include "base/vec.h"
#include "geometry/mesh.h"

#include <stdint.h>
#include <vdbshade/lightmap.h>

#define VSHI_NONE UINT32_MAX

/* --- a mesh cut along creases (cut_mesh.c) */

/* Side 3 i + k of triangle i runs from its corner k to corner k + 1, in the mesh's order. Normals follow that
 * order; a mirrored mesh has them inwards, which does not matter to charts. */
typedef struct vshi_cut_mesh {
    const vsh_mesh *mesh;
    size_t count;    /* triangles */
    double scale;    /* world units in one surface unit, a power of two: the surface is about as large as 1 */
    vshi_vec *place; /* [vertex_count], surface units: as in the world, without the translation */
    double *area;    /* [count]; 0: not in the atlas */
    vshi_vec *normal; /* [count]: unit */
    uint32_t
        *partner;   /* [3 count]: the side beyond, running the other way; VSHI_NONE: a border or a crease */
    uint8_t *soft;  /* [3 count]: no seam of shading normals or UVs runs along the side */
    uint32_t *unit; /* [count]: triangles that stay together: parts of a plane, a quad */
    uint32_t *unit_begin; /* [unit_count + 2] in `unit_list` */
    uint32_t *unit_list;  /* triangles by unit, ascending */
    uint32_t unit_count;  /* without the units of triangles without area */
} vshi_cut_mesh;

/* Upper bound of the bytes for a mesh's surface, its charts, and the work on both. */
double vshi_cut_mesh_bytes(const vsh_mesh *mesh);

/* Cuts a mesh along creases or, with `by_uvs`, where the UVs of two sides differ. The mesh has passed
 * vshi_mesh_check_data(), and lives on. Free with vshi_cut_mesh_free(), after a failure too. Errors:
 * VSH_ERROR_LIMIT (2^32 / 3 triangles), VSH_ERROR_MEMORY. */
vsh_result vshi_cut_mesh_make(const vsh_mesh *mesh, size_t index, bool by_uvs, vshi_cut_mesh *surface,
                              vsh_error *error);
void vshi_cut_mesh_free(vshi_cut_mesh *surface);

static inline void vshi_cut_mesh_corners(const vshi_cut_mesh *surface, size_t i, vshi_vec corner[3]) {
    for (int k = 0; k < 3; ++k) {
        corner[k] = surface->place[surface->mesh->indices[3 * i + (size_t)k]];
    }
}

static inline uint32_t vshi_next_side(uint32_t side) {
    return side % 3 == 2 ? side - 2 : side + 1;
}

static inline double vshi_side_length(const vshi_cut_mesh *s, uint32_t side) {
    return vshi_length(
        vshi_sub(s->place[s->mesh->indices[side]], s->place[s->mesh->indices[vshi_next_side(side)]]));
}

/* --- charts grown over a surface (grow.c) */

/* Writes each triangle's chart, or VSHI_NONE, into chart_of[count]. A chart consists of whole units, is
 * connected, and its normals are within some 60° of their mean. Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
vsh_result vshi_grow_charts(const vshi_cut_mesh *surface, vshi_job *job, uint32_t *chart_of,
                            uint32_t *chart_count, vsh_error *error);

/* A binary heap, the least key first. Numbers break ties, so the order of pushing does not matter. */
typedef struct vshi_heap_entry {
    double key;
    uint32_t what, by;
} vshi_heap_entry;

typedef struct vshi_heap {
    vshi_heap_entry *entries;
    size_t count, capacity;
} vshi_heap;

/* Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_heap_push(vshi_heap *heap, double key, uint32_t what, uint32_t by, vsh_error *error);

/* The heap must not be empty. */
vshi_heap_entry vshi_heap_pop(vshi_heap *heap);

/* --- patches: charts as meshes of their own (patch.c) */

/* Angles of a patch in the atlas, 22.5° apart, and the quarter turns of each. */
enum { VSHI_ANGLES = 4, VSHI_QUARTERS = 4 };

typedef struct vshi_patch {
    const vshi_cut_mesh *surface;
    uint32_t *triangles; /* [count] of the surface, ascending */
    uint32_t count;
    uint32_t vertex_count; /* corners connected by the patch's edges are one vertex */
    uint32_t (*corner)[3]; /* [count]: vertices */
    uint32_t *beyond;      /* [3 count]: the patch's side beyond each, or VSHI_NONE: its border */
    vshi_vec *place;       /* [vertex_count], surface units */
    double (*uv)[2];       /* [vertex_count], surface units: as much area as the triangles have */
    double area;           /* surface units² */
    double stretch;        /* L2, see vsh_atlas_chart */
    bool kept;             /* uv are the mesh's own, so their area may be anything */
    uint32_t depth;        /* how often it was cut out of another */
    double low[VSHI_ANGLES][2], size[VSHI_ANGLES][2]; /* box of `uv` at each angle, once straightened */
} vshi_patch;

/* Owns `triangles` from now on, even after a failure; uv is 0. Free with vshi_patch_free(), after a failure
 * too. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patch_make(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count,
                           vshi_patch *patch, vsh_error *error);
void vshi_patch_free(vshi_patch *patch);

/* The box around its uv, turned by an angle anticlockwise. */
void vshi_patch_box(const vshi_patch *patch, const double cosine_sine[2], double low[2], double high[2]);

/* Twice the area of a patch's triangle in UVs, positive if it runs anticlockwise. */
static inline double vshi_patch_doubled_area(const vshi_patch *p, uint32_t i) {
    const double *a = p->uv[p->corner[i][0]], *b = p->uv[p->corner[i][1]], *c = p->uv[p->corner[i][2]];
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Charts of one surface. */
typedef struct vshi_patches {
    vshi_patch *list; /* [count] */
    size_t count, capacity;
} vshi_patches;

/* Moves the patch into the list, or frees it after a failure; *patch is empty then. Errors: VSH_ERROR_MEMORY.
 */
vsh_result vshi_patches_add(vshi_patches *patches, vshi_patch *patch, vsh_error *error);
void vshi_patches_free(vshi_patches *patches);

/* Adds a patch for each part of a patch, the last part first. These have triangles and a depth only.
 * part[count] is each triangle's part. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patches_split(const vshi_patch *patch, const uint32_t *part, uint32_t parts, vshi_patches *to,
                              vsh_error *error);

/* Lays triangles (ascending, owned from now on) out as one chart, or as several if one would fold or stretch
 * beyond the limit. Adds the charts to `patches`. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lay_out(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count, double max_stretch,
                        vshi_patches *patches, vsh_error *error);

/* --- laying a chart out flat (flatten.c, overlap.c) */

/* Fills the patch's uv and stretch. Parts of a plane are projected; else least squares conformal maps (Lévy
 * and others, 2002), made as rigid as possible (Liu and others, "A local/global approach to mesh
 * parameterization", 2008) if that stretches less. *flat: no triangle flips, none lies over another, and the
 * stretch is within the limit. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_flatten(vshi_patch *patch, double max_stretch, bool *flat, vsh_error *error);

/* Scales uv to the patch's area and measures its stretch; false if a triangle flips or has no area. */
bool vshi_flatten_measure(vshi_patch *patch);

/* Whether a patch without flipped triangles lies over itself. Borders may touch. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patch_overlaps(const vshi_patch *patch, bool *overlaps, vsh_error *error);

/* --- charts of the UVs that a mesh has (uvs.c) */

/* Checks whether the UVs of a surface that was cut by them are usable: they lie in the unit square, all
 * triangles that have area have area in them and run the same way, and no two overlap. If they are, adds a
 * patch for each connected part. All are scaled alike, so that together they have the surface's area.
 * Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_keep_charts(const vshi_cut_mesh *surface, vshi_patches *patches, bool *usable,
                            vsh_error *error);

/* --- meshes to lay out: each set of instances once (shapes.c) */

typedef struct vshi_shape {
    const vsh_mesh *mesh; /* the first of its instances */
    vshi_cut_mesh surface;
    vshi_patches patches;
    bool kept; /* patches are those of the mesh's UVs */
} vshi_shape;

/* The shape of a mesh. */
typedef struct vshi_instance {
    uint32_t shape;
    double scale; /* size of this mesh over the size of the shape's first mesh */
} vshi_instance;

typedef struct vshi_shapes {
    const vsh_mesh *meshes; /* [mesh_count] */
    size_t mesh_count;
    vshi_shape *list; /* [count] */
    size_t count;
    vshi_instance *instances; /* [mesh_count] */
} vshi_shapes;

/* Finds which meshes are instances of one shape. Free with vshi_shapes_free(), after a failure too. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_shapes_find(const vsh_mesh *meshes, size_t mesh_count, vshi_shapes *shapes, vsh_error *error);
void vshi_shapes_free(vshi_shapes *shapes);

/* Makes their charts, straightened, by the options. The stage is "unwrap". Errors: VSH_ERROR_LIMIT (2^32 / 3
 * triangles), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_shapes_lay_out(vshi_shapes *shapes, const vsh_unwrap_options *options, const vsh_run *run,
                               vsh_error *error);

/* --- texels that a chart touches (mask.c) */

/* How a patch lies on texels, before it has a place: uv times `matrix` plus `offset` is in texels from the
 * mask's corner. */
typedef struct vshi_fit {
    double matrix[2][2], offset[2];
    double uneven;         /* scale along one side over that along the other */
    int32_t width, height; /* texels of its box */
} vshi_fit;

/* Texels begin … end - 1 of a row. */
typedef struct vshi_run {
    int32_t begin, end;
} vshi_run;

typedef struct vshi_mask {
    int32_t width, height;
    uint32_t *row;  /* [height + 1] in `runs` */
    vshi_run *runs; /* ascending, apart */
    uint64_t touched;
} vshi_mask;

/* Turns a patch's uv so that its box is the smallest, begins at 0 and is at least as wide as high. Measures
 * its box at each angle. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patch_straighten(vshi_patch *patch, vsh_error *error);

/* Whether a patch nearly fills its box at angle 0: other angles do not help then. */
bool vshi_patch_is_box(const vshi_patch *patch);

/* Fits a patch at an angle, with `density` texels to its unit. A patch that nearly fills its box becomes a
 * whole number of texels wide and high, if its stretch stays within the limit. Its borders then lie near
 * texels' centres, so that a lookup between texels inside of it reads its own texels alone. */
vshi_fit vshi_mask_fit(const vshi_patch *patch, int angle, double density, double max_stretch);

/* The texels that triangles of the patch touch with more than their border. Free with vshi_mask_free(), after
 * a failure too. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_mask_make(const vshi_patch *patch, const vshi_fit *fit, vshi_mask *mask, vsh_error *error);
void vshi_mask_free(vshi_mask *mask);

/* The mask turned by 1 to 3 quarter turns anticlockwise. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_mask_turn(const vshi_mask *mask, int quarters, vshi_mask *turned, vsh_error *error);

/* Sets bits begin … end - 1 of a row. */
void vshi_bits_set(uint64_t *row, int32_t begin, int32_t end);

/* The first bit from x on that is `value`, else `width`. */
int32_t vshi_bits_next(const uint64_t *row, int32_t x, int32_t width, bool value);

/* Turns a point of the fit as vshi_mask_turn() turns the mask: texels from the turned mask's corner. */
void vshi_fit_turn(const vshi_fit *fit, int quarters, const double uv[2], double at[2]);

/* --- charts packed into pages (pack.c) */

typedef struct vshi_place {
    uint32_t page;
    int32_t x, y;            /* texel of the mask's corner */
    int32_t angle, quarters; /* the patch is turned by the angle, and its mask by quarters then */
    vshi_fit fit;
    uint64_t touched; /* texels */
} vshi_place;

/* A chart to pack, and the place that it gets. */
typedef struct vshi_pack_item {
    const vshi_patch *patch; /* straightened */
    double factor;           /* texels to a unit of the patch at a density of 1 */
    uint32_t mesh;           /* mesh that has the chart */
    vshi_place at;
} vshi_pack_item;

typedef struct vshi_packing {
    int32_t width, height, padding;
    uint32_t max_pages;
    double max_stretch;
    double density; /* as given, or 0: then the one found */
    uint32_t pages; /* used */
} vshi_packing;

/* Bytes for packing beside the items. */
double vshi_pack_bytes(const vshi_packing *packing, size_t count);

/* Gives each item its place; items are in the order of their meshes. Advances the job by `units` in all.
 * Errors: VSH_ERROR_LIMIT (they do not fit at the density; or at any), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED.
 */
vsh_result vshi_pack(vshi_packing *packing, vshi_pack_item *items, size_t count, vshi_job *job, size_t units,
                     vsh_error *error);

/* Packs at the given density, on one page. *fits tells whether there was room; if not, the items are
 * unchanged. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_pack_one(vshi_packing *packing, vshi_pack_item *items, size_t count, vshi_job *job,
                         bool *fits, vsh_error *error);

/* --- the atlas (atlas.c) */

typedef struct vshi_pages {
    vsh_atlas_page *list; /* [count]: sizes and densities; free with free() */
    size_t count;
} vshi_pages;

/* Makes an atlas of charts that have their places. `items` [item_count] follow the order of the meshes, and
 * for each mesh the order of its shape's patches. The atlas owns the pages' list from now on. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_atlas_make(const vshi_shapes *shapes, vshi_pages *pages, const vshi_pack_item *items,
                           size_t item_count, vsh_atlas **atlas, vsh_error *error);
