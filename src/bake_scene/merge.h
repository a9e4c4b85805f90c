/* Parts of a job's lightmaps, put together. */
#ifndef VSHI_MERGE_H
#define VSHI_MERGE_H

#include "bake_scene/job.h"
#include "bake_scene/part_rows.h"

typedef struct vshi_part_place {
    size_t part, piece;
    uint64_t lightmap;
    int32_t first, end; /* rows */
} vshi_part_place;

typedef struct vshi_parts {
    vshi_part *list; /* [count] */
    size_t count;
    vshi_part_place *places; /* [place_count]: all pieces, by lightmap and row */
    size_t place_count;
} vshi_parts;

/* What parts' files are named after: the options' name, or the first lightmap's output. */
const char *vshi_parts_name(const vsh_bake_job *job);

/* What its parts' files say of themselves, of `count` shards. */
vshi_part_options vshi_job_part_options(const vsh_bake_job *job, int32_t count);

/* Reads all parts of a job whose lightmaps are measured, and checks that they are its own and complete; sets
 * what the report tells of casters, and where the output comes from. Errors: as vshi_part_open();
 * VSH_ERROR_READ (one is missing), VSH_ERROR_INPUT (one is of other inputs, options, another version). Free
 * them also after an error. */
vsh_result vshi_parts_open(vsh_bake_job *job, int32_t count, const vsh_run *run, vshi_parts *parts,
                           vsh_error *error);
void vshi_parts_free(vshi_parts *parts);

/* Reads rows of a lightmap from the job's parts into the channels. Finishes the AO that the parts left, pads
 * and fills. Adds the finished AO to the statistics. */
struct vshi_lightmap_work;
vsh_result vshi_parts_take(struct vshi_lightmap_work *work, int32_t first, int32_t rows, const vsh_run *run,
                           vsh_error *error);

/* Rows of a lightmap that are read from parts. */
typedef struct vshi_held_rows {
    int32_t width, first, end;
    float **planes; /* [channel_count], of these rows */
    float *memory;  /* NULL: they are the channels' own */
    uint32_t *known;
} vshi_held_rows;

/* Finishes the AO of those of them that parts left, and what is made of it; rows first … end - 1 are added to
 * the statistics. */
vsh_result vshi_parts_finish(const vshi_parts *parts, const vsh_scene *scene, size_t index,
                             const vshi_channels *channels, const vshi_held_rows *held, int32_t first,
                             int32_t end, const vsh_run *run, vsh_bake_stats *stats, vsh_error *error);

/* Bytes that it takes at most, of texels that share AO by `spacing` and kinds of what is kept. */
double vshi_parts_finish_bytes(int32_t width, int32_t rows, int32_t spacing, int32_t threads, uint32_t kinds);

/* Adds the statistics of a lightmap's pieces. */
void vshi_parts_add_stats(const vshi_parts *parts, size_t index, vsh_bake_stats *stats);

#endif
