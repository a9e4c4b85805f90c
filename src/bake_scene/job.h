/* A scene's bake under way, and the steps of it. */
#ifndef VSHI_BAKE_JOB_H
#define VSHI_BAKE_JOB_H

#include "bake_scene/target.h"

#include <vdbshade/bake_scene.h>
#include <vdbshade/provenance.h>

/* A page of a receiver that goes into an asset, until all of them are there. */
typedef struct vshi_lit_page {
    int32_t width, height;
    const char *object; /* whose it is; NULL: of several */
    float *planes[4];   /* AO; light: R, G and B, or one; NULL: none */
} vshi_lit_page;

/* The objects that a light or the sky reaches. */
typedef struct vshi_lit {
    const vsh_mesh *mesh; /* NULL: nothing yet */
    bool several;         /* more than one object */
} vshi_lit;

struct vsh_bake_job {
    vsh_scene scene;
    vsh_receiver *receivers_own; /* the scene's, where they are not those that were given; else NULL */
    vsh_bake_job_options options;
    vsh_row_sink sink; /* that of the options, where there is one */
    vsh_assets *assets;
    vshi_targets targets;
    vsh_job_lightmap *lightmaps; /* [targets.count] */
    vsh_charts **charts;         /* [targets.count]; NULL before they are counted */
    double receivers[2][3];      /* world box of all samples, min and max; min > max where there are none */
    vsh_occluders *occluders;    /* NULL: not prepared */
    bool layered_ao;             /* layers take part in AO, so that texels share no rays of it */
    struct vshi_tracer *tracer;  /* NULL: nothing is traced yet */
    vsh_provenance *provenance;  /* NULL where a caller's sink takes the rows, and nothing is kept */
    vsh_bake_error *errors;      /* [error_count], as in the report */
    vshi_lit *lit;               /* [light_count + 1]: of each light, of the sky */
    vsh_bake_report report;
    bool measured;
    vshi_lit_page *lit_pages; /* [lit_page_count]: of the receiver that is baked */
    size_t lit_page_count;
    struct vshi_parts *parts; /* that lightmaps are put together from; NULL: they are baked */
    bool merges;              /* nothing is going to be baked */
};

/* Points that the lightmaps of a measured job have. */
double vshi_job_points(const vsh_bake_job *job);

/* Sorts and counts a target's charts; warns of its UVs where asked to, and refuses those that cannot be
 * baked.
 */
vsh_result vshi_target_charts(const vsh_scene *scene, const vshi_target *target, bool allow_overlap,
                              bool warn, const vsh_run *run, vsh_charts **charts, vsh_error *error);

/* Counts all targets; for a bake warns of their UVs. */
vsh_result vshi_job_measure(vsh_bake_job *job, bool bakes, const vsh_run *run, vsh_error *error);

/* Where the outputs come from, once it is known what casts. */
vsh_result vshi_job_find_provenance(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* The report's errors and what lights reach, zeros. */
vsh_result vshi_job_make_errors(vsh_bake_job *job, vsh_error *error);

/* Adds what a lightmap came to to the report. */
void vshi_job_add(vsh_bake_job *job, const vsh_bake_stats *baked);

#endif
