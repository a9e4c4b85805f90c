/* Parts of a job's lightmaps, as files (base/part_file.h). The body is rows, from the top on, each of them
 * its channels' values, then what is known of its texels (VSHI_PART_…), then, where its cut keeps it, what
 * their rays came to (bake/ao_kept.h); the tail is the statistics of each piece.
 */
#ifndef VSHI_PART_ROWS_H
#define VSHI_PART_ROWS_H

#include "bake/ao_kept.h"
#include "base/part_file.h"

#include <vdbshade/bake.h>
#include <vdbshade/image.h>

/* A lightmap of the job that a part is of. */
typedef struct vshi_part_lightmap {
    int32_t width, height;
    uint64_t mesh_count, covered, samples; /* as in vsh_job_lightmap */
    int32_t left; /* spacing of texels whose shared AO is left at the ends of pieces; 1: none is */
} vshi_part_lightmap;

/* Rows of one of them that a part holds. */
typedef struct vshi_part_piece {
    uint64_t lightmap;
    int32_t first, rows;
} vshi_part_piece;

/* All of it is owned. */
typedef struct vshi_part_head {
    vshi_part_about about;
    char **channels; /* [channel_count]: names */
    uint64_t channel_count;
    uint64_t error_count; /* as in vsh_bake_report */
    double voxel_size;    /* these of what cast, as in vsh_occluders_info */
    uint64_t active_voxels, field_bytes;
    int32_t levels, has_triangles;
    int32_t kinds;                 /* VSHI_KEEPS_… of the AO that is left to merging */
    vshi_part_lightmap *lightmaps; /* [lightmap_count] */
    uint64_t lightmap_count;
    vshi_part_piece *pieces; /* [piece_count], in the order of their rows in the file */
    uint64_t piece_count;
} vshi_part_head;

void vshi_part_head_free(vshi_part_head *head);

/* Where a piece ends, whose lightmap there is. */
vshi_ao_cut vshi_part_cut(const vshi_part_head *head, const vshi_part_piece *piece);

/* Bytes of the rows of a piece before `row` of its lightmap; they cannot overflow. */
uint64_t vshi_part_rows_bytes(const vshi_part_head *head, const vshi_part_piece *piece, int32_t row);

/* --- writing */

typedef struct vshi_part_writer vshi_part_writer;

/* Begins a part. The head is not kept. Errors: VSH_ERROR_WRITE, VSH_ERROR_MEMORY. */
vsh_result vshi_part_writer_create(const char *path, const vshi_part_head *head, vshi_part_writer **writer,
                                   vsh_error *error);

/* The next rows, of the piece that is under way: planes[channel_count][rows × width], and `kept`, what is of
 * those of them that the cut keeps. A write that failed is told at the end. */
void vshi_part_writer_add(vshi_part_writer *writer, int32_t width, int32_t rows, const float *const *planes,
                          const uint32_t *known, const void *kept);

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

/* Reads all of a part but its rows, which it looks over, whether they are what was written. Errors:
 * VSH_ERROR_READ, VSH_ERROR_INPUT (no part, damaged, another version's), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. Free it also after an error. */
vsh_result vshi_part_open(const char *path, const vsh_run *run, vshi_part *part, vsh_error *error);
void vshi_part_free(vshi_part *part);

/* Reads rows of a piece, from `first` of the lightmap on, into planes[channel_count] and `known` from texel
 * `at` on. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT (a value out of its channel's range). */
vsh_result vshi_part_read(const vshi_part *part, size_t piece, int32_t first, int32_t rows, size_t at,
                          float *const *planes, uint32_t *known, vsh_error *error);

/* What is kept of rows of a piece, which is sound for such held_rays, into the memory of `rows` rows; others
 * are left as they are. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT. */
vsh_result vshi_part_read_kept(const vshi_part *part, size_t piece, int32_t first, int32_t rows,
                               int32_t held_rays, void *kept, vsh_error *error);

#endif
