/* The planes of a lightmap. This table names channels, counts memory and lists what the bake shades. */
#pragma once

#include "base/job.h"

#include <stdbool.h>
#include <vdbshade/lightmap.h>

/* Counts the planes that are shaded by themselves, as AO is. Cannot fail. */
int32_t vshi_planes_shaded(const vsh_planes *planes);

/* The needs of planes. */
enum {
    VSHI_NEEDS_LIGHTS = 1, /* the visibility of lights; planes of lights are filled as they are shaded */
    VSHI_NEEDS_AO = 2,     /* AO; planes of AO are filled like those of lights */
    VSHI_NEEDS_OPEN = 4    /* shading of its own, by the method of AO */
};

enum { VSHI_NO_WISH = -1 };

/* The meaning of values, for writing them as integers. */
enum { VSHI_HOLDS_DATA, VSHI_HOLDS_LIGHT, VSHI_HOLDS_VECTOR };

/* Ranges of values, for the stitching of seams. It leaves planes without a range as they are. */
enum {
    VSHI_RANGE_NONE = 0,
    VSHI_RANGE_SHARE, /* 0 … 1 */
    VSHI_RANGE_LIGHT  /* ≥ 0; errors are relative to nearby light */
};

/* A kind of plane. To add one: its member of vsh_lightmap, its wish in vsh_planes, a row, and the code for
 * its values (bake_tile.c, page.c). */
typedef struct vshi_plane_kind {
    const char *name; /* name of its channel in files: "ao"; "shadow.NAME" if each light has one */
    const char
        *axes; /* names of three interleaved components: channels "irradiance.R"; NULL: one component */
    int holds; /* VSHI_HOLDS_… */
    bool per_light;
    int range;   /* VSHI_RANGE_… */
    bool padded; /* values are padded beyond their chart; errors and properties of the texel itself are not */
    uint32_t needs;
    int wish;     /* offset in vsh_planes; VSHI_NO_WISH: a scene has other members for it */
    size_t plane; /* offset in vsh_lightmap: of float *, or per_light of float *const * [lights] */
} vshi_plane_kind;

/* The kinds, in the order of their channels in files. */
const vshi_plane_kind *vshi_plane_kinds(size_t *count);

static inline size_t vshi_plane_components(const vshi_plane_kind *kind) {
    return kind->axes != NULL ? 3 : 1;
}

/* A plane that a lightmap has. */
typedef struct vshi_plane_cursor {
    const vshi_plane_kind *kind; /* NULL: before the first plane */
    size_t light;                /* if each light has a plane */
    float *values;
} vshi_plane_cursor;

/* Moves the cursor to the lightmap's next plane, in the order of kinds and then of lights. False: none. */
bool vshi_plane_next(const vsh_lightmap *lightmap, size_t light_count, vshi_plane_cursor *cursor);

/* Whether the lightmap has the plane, or the list of planes of lights. */
static inline bool vshi_plane_given(const vsh_lightmap *lightmap, const vshi_plane_kind *kind) {
    return *(const void *const *)((const char *)lightmap + kind->plane) != NULL;
}

/* Sets the plane to planes[0], or the list of planes of lights to `planes`, which must outlive the lightmap.
 */
void vshi_plane_set(vsh_lightmap *lightmap, const vshi_plane_kind *kind, float *const *planes);

/* The needs, VSHI_NEEDS_…, of all planes that are not NULL. Either all lights have planes or none. */
uint32_t vshi_planes_need(const vsh_lightmap *lightmap);

/* --- rows */

/* The texels from a row of the planes to the next. */
static inline size_t vshi_plane_row(const vsh_lightmap *lightmap, size_t width) {
    return lightmap->row_texels > 0 ? (size_t)lightmap->row_texels : width;
}

/* The place of texel y × width + x in the planes. */
static inline size_t vshi_plane_place(const vsh_lightmap *lightmap, size_t width, size_t texel) {
    const size_t row = vshi_plane_row(lightmap, width);
    return row == width ? texel : texel / width * row + texel % width;
}

/* Checks row_texels. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_plane_row_check(const vsh_lightmap *lightmap, int32_t width, vsh_error *error);

/* Makes a lightmap whose rows follow each other: the given one, or one with planes of its own in *memory,
 * which are added to run->memory_held. Free *memory with free(). Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY.
 */
vsh_result vshi_planes_tighten(const vsh_lightmap *lightmap, size_t light_count, size_t width, size_t height,
                               vsh_run *run, vsh_lightmap *tight, void **memory, vsh_error *error);

/* Copies the planes of `tight` to those of the lightmap, whose texels between rows stay. */
void vshi_planes_copy_rows(const vsh_lightmap *tight, const vsh_lightmap *lightmap, size_t light_count,
                           size_t width, size_t height);

/* --- the sky */

/* The axis of a sky, VSH_UP_…. */
void vshi_sky_up(int32_t axis, double up[3]);

/* The options that shade the sky as AO. */
vsh_shade_options vshi_sky_options(const vsh_shade_options *options, int32_t axis);

/* Weighs the free share above the horizon by the part of the hemisphere above it. */
float vshi_sky_weighed(const float normal[3], const double up[3], float open);

/* Whether a scene asks for a plane. */
static inline bool vshi_plane_wished(const vshi_plane_kind *kind, const vsh_planes *planes) {
    return kind->wish != VSHI_NO_WISH && *(const int32_t *)((const char *)planes + kind->wish) != 0;
}
