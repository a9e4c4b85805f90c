/* Texels, voxels and memory of a bake, from a trial with few voxels. */
#include "bake_scene/pages.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>

enum { TRIAL_RESOLUTION = 96 }; /* voxels along the longest side */
/* Making a level set takes this many times its own memory (the cloister, 96 to 512 voxels: 6 to 4.2). */
static const double MAKING = 4.3;

/* What was measured on the trial. */
typedef struct trial {
    double finer; /* the scene's resolution over the trial's */
    double resolution;
    vsh_occluders_info made;
} trial;

/* Voxels of the scene over those of the trial, on a side; `resolution`: as vsh_scene_resolution(). */
static double finer(const vsh_scene *scene, int32_t resolution, double trial_voxel) {
    if (resolution != VSH_RESOLUTION_NAMED) {
        return (double)resolution / TRIAL_RESOLUTION;
    }
    return scene->grid.voxel_size > 0.0 ? trial_voxel / scene->grid.voxel_size
                                        : (double)scene->grid.resolution / TRIAL_RESOLUTION;
}

/* Voxels along the longest side of a field that is there; 0: there are none. */
static double resolution_of(const vsh_scene *scene, const vsh_occluders *occluders, double voxel_size) {
    vsh_occluder_parts parts;
    vsh_field_info info;
    vsh_occluders_get_parts(occluders, &parts);
    vsh_field_get_info(parts.field, &info);
    double longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        longest = fmax(longest, info.bounds_max[axis] - info.bounds_min[axis]);
    }
    const bool named = scene->grid.voxel_size == 0.0 && scene->grid.resolution > 0;
    return voxel_size == 0.0 ? 0.0 : named ? scene->grid.resolution : longest / voxel_size;
}

static vsh_result try_small(const vsh_bake_job *job, const vsh_run *run, trial *t, vsh_error *error) {
    const double points = vshi_job_points(job);
    const int32_t resolution = vsh_scene_resolution(&job->scene, job->assets, NULL, points);
    vsh_scene small = job->scene;
    const bool smaller = resolution != 0;
    if (smaller) { /* where there are none, nor are there in the trial */
        small.grid.voxel_size = 0.0;
        small.grid.resolution = TRIAL_RESOLUTION;
    }
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    options.receivers_min = job->receivers[0];
    options.receivers_max = job->receivers[1];
    options.points = points;
    options.silent_voxels = 1; /* what coarse voxels lose is not lost by the scene's */
    vsh_occluders *occluders = NULL;
    VSHI_TRY(vsh_scene_occluders(&small, job->assets, &options, run, &occluders, error));
    vsh_occluders_get_info(occluders, &t->made);
    t->finer = smaller ? finer(&job->scene, resolution, t->made.voxel_size) : 1.0;
    t->resolution =
        smaller ? TRIAL_RESOLUTION * t->finer : resolution_of(&job->scene, occluders, t->made.voxel_size);
    vsh_occluders_free(occluders);
    return VSH_OK;
}

vsh_result vsh_bake_job_forecast(vsh_bake_job *job, const vsh_run *run, vsh_bake_forecast *forecast,
                                 vsh_error *error) {
    VSHI_NEEDS(job);
    VSHI_NEEDS(forecast);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (!job->measured) {
        VSHI_TRY(vshi_job_measure(job, false, &full, error));
    }
    trial t;
    VSHI_TRY(try_small(job, &full, &t, error));
    const double more = t.finer * t.finer; /* surfaces: voxels grow with the square */
    vsh_bake_forecast f = {.voxels = (double)t.made.active_voxels * more,
                           .voxel_size = t.made.voxel_size / t.finer,
                           .resolution = t.resolution,
                           .grid_bytes = (double)t.made.grid_bytes * more,
                           .field_bytes = (double)t.made.field_bytes * more,
                           .has_triangles = t.made.has_triangles};
    for (size_t i = 0; i < job->targets.count; ++i) {
        f.texels += job->lightmaps[i].covered;
        f.samples += job->lightmaps[i].samples;
    }
    const double bake = f.field_bytes + vshi_job_bytes(job, full.threads);
    const double base =
        fmax(0.0, (double)vshi_peak_bytes() - MAKING * (double)t.made.grid_bytes); /* program and assets */
    f.peak_bytes = base + fmax(fmax(MAKING * f.grid_bytes, f.grid_bytes + f.field_bytes), bake);
    if (full.memory_limit > 0) { /* what is over it lies in files */
        f.peak_bytes = fmin(f.peak_bytes, (double)full.memory_limit);
    }
    *forecast = f;
    return VSH_OK;
}
