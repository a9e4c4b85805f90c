/* Parts of a bake, which machines share: a file holds every so-manieth tile, as vshi_trace_tiles() left it.
 */
#ifndef VSHI_BAKE_PARTS_H
#define VSHI_BAKE_PARTS_H

#include "bake_scene/pages.h"
#include "base/part_file.h"

/* Tiles that have texels are numbered over all lightmaps, in one sequence. Shard I of N traces tiles I, I +
 * N, I + 2 N … of them, and writes them into its part. Errors: as vsh_bake_job_run(). */
vsh_result vshi_job_bake_part(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* The parts of a merge. */
typedef struct vshi_parts vshi_parts;

/* Opens all parts of a job whose lightmaps are measured, and checks that they are its own; sets what the
 * report tells of casters, and where the output comes from. Free the result with vshi_parts_free(). Errors:
 * VSH_ERROR_READ (one is missing), VSH_ERROR_INPUT (one is damaged, or of other inputs, options or another
 * version), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_parts_open(vsh_bake_job *job, int32_t count, const vsh_run *run, vshi_parts **parts,
                           vsh_error *error);
void vshi_parts_free(vshi_parts *parts); /* NULL does nothing */

/* Takes the tiles of a lightmap, in place of vshi_trace_tiles(); lightmaps come in their order. `job` counts
 * tiles. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_parts_take(vshi_parts *parts, vshi_job_page *page, vshi_job *job, vsh_error *error);

#endif
