/* A scene's bake under way: its lightmaps, their outputs, parts, warnings and errors. */
#pragma once

#include "base/memory.h"
#include "io/image/image.h"
#include "lightmap/page.h"

#include <stdbool.h>
#include <string.h>
#include <vdbshade/image.h>
#include <vdbshade/scene.h>

/* One lightmap. */
typedef struct vshi_target {
    vsh_scene_lightmap *lightmap; /* for the caller */
    size_t index;                 /* among the targets */
    vsh_receiver receiver;        /* the scene's, with this lightmap's output, size and seams */
    vsh_charts *charts;           /* NULL before they are counted */
    bool unwrapped;               /* its UVs are new, or packed again */
    char *object; /* the object's name in files, unique among the lightmaps; NULL: several objects */
    char *output; /* FILE.OBJECT.exr of an object, FILE.PAGE.exr of a page, or the receiver's own */
} vshi_target;

enum { VSHI_LIT_PLANES = 4 };

/* A page of an asset, kept until the receiver's other pages are baked. */
typedef struct vshi_lit_page {
    int32_t width, height;
    const char *object;             /* its name; NULL: several objects */
    float *planes[VSHI_LIT_PLANES]; /* AO; light: R, G and B, or one; NULL: none */
} vshi_lit_page;

/* The objects that a light or the sky reaches. */
typedef struct vshi_lit_objects {
    const vsh_mesh *mesh; /* NULL: nothing yet */
    bool several;         /* more than one object */
} vshi_lit_objects;

typedef struct vshi_scene_bake {
    vsh_scene scene;
    vsh_bake_options options;
    vsh_run run; /* resolved */
    vsh_assets *assets;
    vshi_target *targets; /* [target_count] */
    size_t target_count;
    vsh_scene_lightmap *lightmaps; /* [target_count] */
    double receivers[2][3];        /* world box of all samples, min and max; min > max: none */
    vsh_occluders *occluders;      /* NULL in merges */
    bool layered_ao;               /* layers take part in AO, so texels do not share its rays */
    vshi_tracer *tracer;           /* NULL in merges */
    vsh_provenance *provenance;    /* NULL if the caller receives the rows */
    vsh_bake_error *errors;        /* [error_count]: of each light, of AO, of the sky */
    size_t error_count;
    vshi_lit_objects *lit; /* [light_count + 1]: of each light, of the sky */
    vsh_bake_report report;
    vshi_lit_page *lit_pages; /* [lit_page_count]: of the current receiver */
    size_t lit_page_count;
    struct vshi_parts *parts; /* the source of a merge's tiles; NULL: they are traced */
} vshi_scene_bake;

/* Finds the provenance of the outputs, once the occluders are known. */
vsh_result vshi_bake_find_provenance(vshi_scene_bake *bake, vsh_error *error);

/* Adds the file's name to an error of a function that knows arrays only. Returns `result`. */
vsh_result vshi_name_file(const char *path, vsh_result result, vsh_error *error);

/* --- channels (outputs.c) */

typedef struct vshi_channels {
    vsh_image image;       /* their names, in the order of lightmap/planes.c; A is the last. No planes */
    vsh_lightmap lightmap; /* the values, as the bake takes them */
    char (*names)[VSH_CHANNEL_NAME];
    const char **name_list;
    vsh_channel_kind *holds;
    float **values;     /* [value_count]: [height][width][components] of the store */
    size_t *components; /* [value_count]: 1 or 3 channels each */
    size_t value_count;
    vshi_store *store; /* NULL: there is no memory for values */
} vshi_channels;

/* Names the channels of a scene at a size, without memory for values. Errors: VSH_ERROR_ARGUMENT (more than
 * VSH_MAX_CHANNELS), VSH_ERROR_MEMORY. Free them even after a failure. */
vsh_result vshi_channels_name(const vsh_scene *scene, int32_t width, int32_t height, vshi_channels *channels,
                              vsh_error *error);

/* Takes the memory for the values, zeroed. `output` is for messages. Errors: as vshi_store_take(). */
vsh_result vshi_channels_allocate(vshi_channels *channels, const vsh_scene *scene, vshi_store *store,
                                  const char *output, vsh_error *error);

/* Returns a lightmap in which the planes that a scene's bake fills are not NULL. Nothing may be written to
 * them. */
vsh_lightmap vshi_channels_shape(const vsh_scene *scene);

void vshi_channels_free(vshi_channels *channels); /* also zeroed ones */

/* --- pages (bake_scene.c) */

/* A lightmap in memory. */
typedef struct vshi_scene_page {
    vshi_scene_bake *bake;
    const vshi_target *target;
    vshi_channels channels;
    vshi_page page;
    vsh_bake_stats baked;
} vshi_scene_page;

/* Lightmaps in a row that are in memory together. */
typedef struct vshi_page_group {
    vshi_scene_bake *bake;
    vsh_run held; /* the bake's run, with the memory used beside the pages */
    vshi_store store;
    vshi_scene_page *pages; /* [count], of which `open` are open */
    size_t count, open;
} vshi_page_group;

/* Takes memory for `count` lightmaps. Planes without room lie in files beside the first one's output. Close
 * the group even after an error. Errors: as vshi_store_take(). */
vsh_result vshi_page_group_open(vshi_scene_bake *bake, size_t first, size_t count, vshi_page_group *group,
                                vsh_error *error);
void vshi_page_group_close(vshi_page_group *group); /* also zeroed ones */

/* --- outputs */

/* Lists the lightmaps of all receivers as targets. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_list_lightmaps(vshi_scene_bake *bake, vsh_error *error);

/* A receiver's image, with its bits, packing and colours. */
vsh_image_options vshi_receiver_image(const vsh_receiver *receiver);

/* Writes a finished page: its image, its picture of invalid texels, and with a receiver's last page its
 * asset. Hands its rows to the caller instead if wanted. */
vsh_result vshi_write_page(const vshi_scene_page *page, vsh_error *error);

/* Frees the pages that wait for others. */
void vshi_lit_pages_free(vshi_scene_bake *bake);

/* --- parts: each file holds every N-th tile, as vshi_trace_tiles() left it
 *
 * A file is: vshi_part_front; texts; for each tile, in order, what it leaves; a checksum. It appears whole or
 * not at all, and holds no time and no name of a machine. A merge trusts the values of tiles whose part has
 * the right checksum and head, but reads and writes nothing out of bounds whatever they are. */

/* The format's number is in the magic, in base 36: another one is another version's. */
#define VSHI_PART_MAGIC "vdbshade part B\n"
#define VSHI_PART_MAGIC_BEGIN "vdbshade part "
#define VSHI_PART_ORDER UINT64_C(0x0102030405060708)
#define VSHI_PART_SUM UINT64_C(0xcbf29ce484222325) /* of no bytes */

enum { VSHI_MOST_SHARDS = 10000 };

/* Begins a part. Numbers have the byte order of the machine that wrote them, which `order` shows. */
typedef struct vshi_part_front {
    char magic[16];
    uint64_t order;
    uint64_t head_bytes; /* of the texts, each with its NUL: words, then names and values of attributes */
    uint64_t words;      /* their number */
    uint64_t layout;     /* a hash of the lightmaps, channels and casters */
    uint64_t active_voxels, field_bytes; /* of the casters, as in vsh_occluders_info */
    double voxel_size;
    int32_t levels, has_triangles;
    int32_t layered_ao; /* as in vshi_scene_bake */
    int32_t shard, shard_count;
    int32_t unused;
} vshi_part_front;

/* FNV-1a (Fowler, Noll and Vo, 1991). */
static inline uint64_t vshi_part_sum(uint64_t sum, const void *bytes, size_t size) {
    const unsigned char *at = bytes;
    for (size_t i = 0; i < size; ++i) {
        sum = (sum ^ at[i]) * UINT64_C(0x100000001b3);
    }
    return sum;
}

/* Numbers the tiles with texels over all lightmaps in one sequence. Shard I of N traces tiles I, I + N, I +
 * 2N … of them, and writes them into its part. Errors: as vsh_bake_scene(). */
vsh_result vshi_bake_part(vshi_scene_bake *bake, vsh_error *error);

/* The parts of a merge. */
typedef struct vshi_parts vshi_parts;
void vshi_parts_free(vshi_parts *parts); /* NULL does nothing */

/* Counts the parts of a merge, and checks that none is missing. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_parts_find(const vshi_scene_bake *bake, int32_t *count, vsh_error *error);

/* Opens the parts as bake->parts, once the charts are counted, and checks that they belong to this scene.
 * Sets the report's occluders, and the provenance. Errors: VSH_ERROR_READ (a part is missing),
 * VSH_ERROR_INPUT (a part is damaged, or of other inputs, options or another version), VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_parts_open(vshi_scene_bake *bake, int32_t count, vsh_error *error);

/* Reads the tiles of a lightmap, in place of vshi_trace_tiles(). Lightmaps come in their order. `job` counts
 * tiles. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_parts_read(vshi_parts *parts, vshi_scene_page *page, vshi_job *job, vsh_error *error);

/* --- warnings and errors */

/* Warns of faults in the target's UVs, one line for each mesh and kind. Warns of charts that lie too close
 * for the size, and of charts that cover few texels. */
void vshi_warn_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                   const vsh_run *run);

/* VSH_ERROR_INPUT if charts cover no texel's centre, or objects overlap on more than VSH_LARGEST_OVERLAP of
 * the texels. */
vsh_result vshi_refuse_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                           vsh_error *error);

/* VSH_ERROR_INPUT if a lightmap has no valid texel. */
vsh_result vshi_refuse_invalid(const vshi_target *target, const vsh_bake_stats *baked, vsh_error *error);

/* Notes invalid texels, and warns of marches that did not end or widened too far. */
void vshi_warn_baked(const vsh_scene *scene, const vshi_target *target, const vsh_bake_stats *baked,
                     const vsh_run *run);

/* Adds the objects that lights and the sky reach on a baked page to bake->lit. */
void vshi_find_lit_objects(const vshi_scene_page *page);

/* Warns of lights, and of the sky, that reach no texel, or one object of several. */
void vshi_warn_lights(const vshi_scene_bake *bake, const vsh_run *run);

/* Warns of meshes whose triangles are too large for the light on them: their errors[meshes] are above `most`.
 * Returns the largest. */
double vshi_warn_vertex_colors(const vshi_target *target, const double *errors, double most,
                               const vsh_run *run);

/* Warns of light that the file's integers cut. */
void vshi_warn_clipping(const char *output, const vsh_image_clipping *cut, const vsh_run *run);
