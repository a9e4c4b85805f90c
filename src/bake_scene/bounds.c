#include "bake_scene/bounds.h"

#include <math.h>

/* Samples of all lightmaps, or more, where those up to `index` are counted. Fields are made where there are
 * enough points to gain by it, so that if none is for so many, none is for those that there are. */
static double most_points(const vsh_bake_job *job, size_t index, const vsh_charts *charts) {
    vsh_charts_info counted;
    vsh_charts_get_info(charts, &counted);
    double points = (double)counted.samples;
    for (size_t i = 0; i < job->targets.count; ++i) {
        const vsh_receiver *receiver = &job->targets.list[i].receiver;
        const double texels = (double)receiver->width * receiver->height;
        if (i != index) {
            points += i < index ? (double)job->lightmaps[i].samples
                                : texels * receiver->supersample * receiver->supersample;
        }
    }
    return points;
}

/* Whether a field may be made, whose reach follows from where the samples are. */
static bool may_make_field(const vsh_bake_job *job, size_t index, const vsh_charts *charts) {
    const vsh_scene *scene = &job->scene;
    const double points = most_points(job, index, charts);
    bool may = vsh_scene_resolution(scene, job->assets, NULL, points) != 0;
    for (size_t i = 0; i < scene->layer_count; ++i) {
        may = may || vsh_scene_resolution(scene, job->assets, &scene->layers[i], points) != 0;
    }
    for (size_t i = 0; i < scene->caster_count; ++i) { /* what has no triangles is no mesh to be traced */
        size_t count = 0;
        vsh_assets_caster(job->assets, i, &count);
        may = may || count == 0;
    }
    return may;
}

vsh_result vshi_job_bounds(const vsh_bake_job *job, size_t index, const vsh_run *run, double low[3],
                           double high[3], vsh_error *error) {
    const vsh_charts *charts = job->charts[index];
    if (may_make_field(job, index, charts)) {
        return vsh_charts_bounds(charts, run, low, high, error);
    }
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = INFINITY;
        high[axis] = -INFINITY;
    }
    return VSH_OK;
}
