/* Charts grown over a surface. */
#ifndef VSHI_UNWRAP_GROW_H
#define VSHI_UNWRAP_GROW_H

#include "base/job.h"
#include "unwrap/units.h"

/* Gives each unit the number of its chart, owner[units->count], and tells how many there are. A chart hangs
 * together, and its normals are within some 60° of their mean. Advances the job by the units' triangles.
 * Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_grow_charts(const vshi_units *units, vshi_job *job, uint32_t *owner, uint32_t *chart_count,
                            vsh_error *error);

#endif
