/* Files that hold a part of a job's lightmaps, until all of them are put together: PARTS.I-of-N.part. They
 * appear whole or not at all, hold nothing that tells of time or machine, and whoever reads one checks all of
 * it.
 *
 * A file is: magic; numbers of four and eight bytes that tell the byte order, the format, and the sizes of
 * what follows; the head, which says what the part is of; rows, from the top on, each of them its channels'
 * values, then what is known of its texels (VSHI_PART_…); the statistics of each piece; a checksum. */
#ifndef VSHI_PART_FILE_H
#define VSHI_PART_FILE_H

#include "base/error.h"

#include <stdbool.h>
#include <vdbshade/bake.h>
#include <vdbshade/image.h>
#include <vdbshade/occluders.h>

/* A lightmap of the job that a part is of. */
typedef struct vshi_part_lightmap {
    int32_t width, height;
    uint64_t mesh_count, covered, samples; /* as in vsh_job_lightmap */
} vshi_part_lightmap;

/* Rows of one of them that a part holds. */
typedef struct vshi_part_piece {
    uint64_t lightmap;
    int32_t first, rows;
} vshi_part_piece;

/* What outputs tell of where they come from (vsh_attribute). */
typedef struct vshi_part_attribute {
    char *name, *value;
} vshi_part_attribute;

/* All of it is owned. */
typedef struct vshi_part_head {
    char *version; /* of the library */
    int32_t shard, shard_count;
    char **words; /* [word_count]: as vsh_bake_job_options.words */
    uint64_t word_count;
    vshi_part_attribute *attributes; /* [attribute_count] */
    uint64_t attribute_count;
    char **channels; /* [channel_count]: names */
    uint64_t channel_count;
    uint64_t error_count; /* as in vsh_bake_report */
    double voxel_size;    /* these of what cast, as in vsh_occluders_info */
    uint64_t active_voxels, field_bytes;
    int32_t levels, has_triangles;
    vshi_part_lightmap *lightmaps; /* [lightmap_count] */
    uint64_t lightmap_count;
    vshi_part_piece *pieces; /* [piece_count], in the order of their rows in the file */
    uint64_t piece_count;
} vshi_part_head;

void vshi_part_head_free(vshi_part_head *head);

/* "PARTS.I-of-N.part", to be freed; NULL where memory is short. */
char *vshi_part_path(const char *parts, int32_t shard, int32_t count);

/* --- writing */

typedef struct vshi_part_writer vshi_part_writer;

/* Begins a part. The head is not kept. Errors: VSH_ERROR_WRITE, VSH_ERROR_MEMORY. */
vsh_result vshi_part_writer_create(const char *path, const vshi_part_head *head, vshi_part_writer **writer,
                                   vsh_error *error);

/* The next rows, of the piece that is under way: planes[channel_count][rows × width]. A write that failed is
 * told at the end. */
void vshi_part_writer_add(vshi_part_writer *writer, int32_t width, int32_t rows, const float *const *planes,
                          const uint32_t *known);

/* The piece is whole: its statistics, with errors [error_count] and invalid_by_mesh [mesh_count]. */
vsh_result vshi_part_writer_piece(vshi_part_writer *writer, const vsh_bake_stats *stats, vsh_error *error);

/* Puts the file in its place; frees the writer, after an error too. */
vsh_result vshi_part_writer_finish(vshi_part_writer *writer, vsh_error *error);
void vshi_part_writer_abandon(vshi_part_writer *writer); /* NULL does nothing */

/* --- reading */

typedef struct vshi_part {
    char *path;
    vshi_part_head head;
    uint64_t *offset;       /* [piece_count]: of each one's rows in the file, bytes */
    vsh_bake_stats *pieces; /* [piece_count]: statistics, with their arrays */
} vshi_part;

/* Reads all of a part but its rows. `whole`: looks over these, too, whether they are what was written.
 * Errors: VSH_ERROR_READ, VSH_ERROR_INPUT (no part, damaged, another version's), VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free it also after an error. */
vsh_result vshi_part_open(const char *path, bool whole, const vsh_run *run, vshi_part *part,
                          vsh_error *error);
void vshi_part_free(vshi_part *part);

/* Reads rows of a piece, from `first` of the lightmap on, into planes[channel_count] and `known` from texel
 * `at` on. Errors: VSH_ERROR_READ. */
vsh_result vshi_part_read(const vshi_part *part, size_t piece, int32_t first, int32_t rows, size_t at,
                          float *const *planes, uint32_t *known, vsh_error *error);

#endif
